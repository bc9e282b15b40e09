"""`kr16 simulate` as typed: answers, files, exit codes, and nothing half-written."""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from kr16cli.assets import asset
from kr16cli.cli import main
from kr16cli.simulate import experiment

_ROOT = Path(__file__).resolve().parent.parent
_ENVELOPE = json.loads(asset("data/schemas/simulate.json").read_text(encoding="utf-8"))
_SHORT = "--q 0 -60 60 0 30 0 --qd 20 -10 0 0 0 0 --duration 0.05"

_SLOW = """schema = "kr16.scenario/1"
name = "slow"
duration_s = 80000.0
output_step_s = 1.0
[initial]
q_deg = [0, -60, 60, 0, 30, 0]
"""


def kr16(command: str) -> int:
    """Run a command line in this process."""
    return main(command.split())


def files(folder: Path) -> list[str]:
    """Names of everything in a folder, hidden files too."""
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_table_shows_state_energy_and_solver(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16(f"simulate {_SHORT}") == 0
    shown, errors = capsys.readouterr()
    assert errors == ""
    first, *lines = shown.splitlines()
    assert first == "options: KUKA KR 16-2, 0.05 s, 6 samples"
    assert [line.split()[0] for line in lines[1:7]] == ["A1", "A2", "A3", "A4", "A5", "A6"]
    assert "q deg" in lines[0] and "qd deg/s" in lines[0] and "tau N m" in lines[0]
    assert any(line.startswith("energy J") and "kinetic" in line for line in lines)
    assert "solver DOP853, rtol 1e-09, atol 1e-10" in lines[-1]
    assert "nan" not in shown


def test_json_holds_the_summary(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16(f"simulate {_SHORT} --torque gravity --payload 16 0 0 120 --json") == 0
    answer = json.loads(capsys.readouterr().out)
    jsonschema.validate(answer, _ENVELOPE)
    assert answer["schema"] == "kr16.simulate/1"
    assert answer["input"]["payload"]["com"] == [0.0, 0.0, 0.12]
    assert answer["input"]["torque"] == {"kind": "gravity"}
    result = answer["result"]
    assert result["duration"] == 0.05
    assert result["complete"] is True
    assert abs(result["energy"]["drift_max"]) < 1e-6
    assert len(result["final"]["pose"]) == 6
    assert answer["units"]["q"] == "rad"


def test_si_takes_radians(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16("simulate --si --q 0.1 -1 1 0 0.5 0 --qd 1 0 0 0 0 0 --duration 0.01 --json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["input"]["q"] == [0.1, -1.0, 1.0, 0.0, 0.5, 0.0]
    assert answer["input"]["qd"] == [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    assert kr16("simulate --si --q 0.1 -1 1 0 0.5 0 --duration 0.01") == 0
    assert "pose m rad:" in capsys.readouterr().out


def test_run_goes_to_the_file_and_summary_to_stdout(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert kr16(f"simulate {_SHORT} -o run.csv") == 0
    assert "6 samples" in capsys.readouterr().out
    assert kr16(f"simulate {_SHORT} -o run.npz --json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert kr16(f"simulate {_SHORT} -o run.json") == 0
    assert capsys.readouterr().out == ""
    assert files(folder) == ["run.csv", "run.json", "run.npz"]
    assert json.loads((folder / "run.json").read_text()) == answer
    with (folder / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    with np.load(folder / "run.npz") as archive:
        assert archive["q"][-1].tolist() == answer["result"]["final"]["q"]
        assert float(rows[-1]["q1 [rad]"]) == archive["q"][-1, 0]
        assert len(rows) == len(archive["time"]) == 6


def test_plot_is_a_pdf_of_two_pages_and_the_same_each_time(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    command = "simulate ptp_16kg --duration 0.3 --rtol 1e-4 -o run.npz --plot run.pdf"
    assert kr16(command) == 0
    shown, errors = capsys.readouterr()
    assert "flange from its reference: largest" in shown
    assert "the end of the reference is not reached" in errors
    first = (folder / "run.pdf").read_bytes()
    assert first.startswith(b"%PDF") and b"/Count 2" in first
    assert b"CreationDate" not in first
    assert kr16(command) == 0
    assert (folder / "run.pdf").read_bytes() == first
    assert files(folder) == ["run.npz", "run.pdf"]


def test_plot_without_matplotlib_ends_with_code_4(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "matplotlib" else find(name)
    )
    assert kr16(f"simulate {_SHORT} -o run.npz --plot run.pdf") == 4
    shown, errors = capsys.readouterr()
    assert shown == "" and "pip install 'kr16cli[report]'" in errors
    assert files(folder) == []


def test_controlled_run_is_told_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16("simulate circle_task_space --duration 0.1 --json") == 0
    answer = json.loads(capsys.readouterr().out)
    jsonschema.validate(answer, _ENVELOPE)
    assert answer["result"]["tracking"]["position_largest"] < 1e-3
    assert answer["result"]["solver"]["step"] == 0.004
    assert answer["input"]["controller"]["sampling"]["period"] == 0.004
    assert kr16("simulate circle_task_space --duration 0.1 --step 0.002 --method RK4") == 0
    assert "solver RK4, step 0.002 s" in capsys.readouterr().out


def test_reference_out_of_reach_ends_with_code_3(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    toml = (
        'schema = "kr16.scenario/1"\nname = "far"\nduration_s = 1\n'
        '[initial]\nq_deg = [0, -80, 95, 0, 60, 0]\n[controller]\nkind = "pd"\n'
        '[reference]\nkind = "line"\noffset_mm = [3000, 0, 0]\n'
    )
    (folder / "far.toml").write_text(toml)
    assert kr16("simulate far.toml -o run.npz --plot run.pdf") == 3
    shown, errors = capsys.readouterr()
    assert shown == "" and errors.count("\n") == 1
    assert "leaves the workspace at" in errors and "mm)" in errors
    assert files(folder) == ["far.toml"]


def test_csv_on_stdout_is_the_run_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16(f"simulate {_SHORT} --format csv") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("time [s],q1 [rad],")
    assert len(lines) == 7


def test_options_replace_what_a_shipped_scenario_says(capsys: pytest.CaptureFixture[str]) -> None:
    options = "--duration 0.02 --output-step 0.005 --method RK45 --rtol 1e-7 --atol 1e-8"
    assert kr16(f"simulate free_swing {options} --gravity 0 0 0 --drives --json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["result"]["scenario"] == "Free swing"
    assert answer["result"]["samples"] == 5
    solver = answer["result"]["solver"]
    assert (solver["method"], solver["rtol"], solver["atol"]) == ("RK45", 1e-7, 1e-8)
    assert answer["input"]["gravity"] == [0.0, 0.0, 0.0]
    assert answer["input"]["drives"] is True


def test_torque_file_is_found_from_here(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "t.csv").write_text("time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,3,4,5,0.1\n")
    assert kr16(f"simulate {_SHORT} --torque-csv t.csv --json") == 0
    by_file = json.loads(capsys.readouterr().out)["result"]["final"]["q"]
    assert kr16(f"simulate {_SHORT} --tau 1 2 3 4 5 0.1 --json") == 0
    assert json.loads(capsys.readouterr().out)["result"]["final"]["q"] == by_file


def test_other_robot_is_simulated(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16(f"simulate {_SHORT} --robot chapter3 --json") == 0
    assert json.loads(capsys.readouterr().out)["robot"] == "Chapter 3 test arm"


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("simulate free_swin", "shipped: circle_task_space, constant_torque"),
        ("simulate --q 0 -90 90 0 0", "--q takes 6 numbers"),
        ("simulate --q 0 -90 nan 0 0 0", "--q A3 is nan; every number must be finite"),
        ("simulate --q 0 -90 900 0 0 0", "initial.q_deg[3] = 900.0: angles are in deg"),
        (f"simulate {_SHORT} --duration 0", "duration_s = 0.0: must be > 0 s"),
        (f"simulate {_SHORT} --duration x", "--duration is 'x'; it must be a number"),
        (f"simulate {_SHORT} --output-step 1", "must not exceed duration_s"),
        (f"simulate {_SHORT} --method euler", "must be one of auto, DOP853"),
        (f"simulate {_SHORT} --rtol 0", "solver.rtol = 0.0"),
        (f"simulate {_SHORT} --torque none", "torque.kind = 'none': must be one of zero"),
        (f"simulate {_SHORT} --torque constant", "torque.tau_nm missing"),
        (f"simulate {_SHORT} --torque zero --tau 1 2 3 4 5 6", 'not to "zero"'),
        (f"simulate {_SHORT} --torque-csv none.csv", "none.csv: cannot be read"),
        (f"simulate {_SHORT} --payload -1 0 0 0", "payload mass is -1 kg"),
        (f"simulate {_SHORT} --robot kr16_l6", "no inertial data"),
        (f"simulate {_SHORT} --durration 1", "did you mean --duration?"),
        (f"simulate {_SHORT} -o none/run.npz", "cannot be written"),
        (f"simulate {_SHORT} -o run.xyz", "the suffix must be one of"),
        (f"simulate {_SHORT} --plot run.png", "the suffix must be .pdf"),
        (f"simulate {_SHORT} --plot none/run.pdf", "cannot be written"),
        (f"simulate {_SHORT} --step 0.01", "belongs to RK4 or SemiImplicitEuler"),
        (f"simulate {_SHORT} --method RK4 --step -1", "solver.step_s = -1.0: must be > 0 s"),
    ],
)
def test_bad_input_ends_with_one_line_and_code_2(
    folder: Path, capsys: pytest.CaptureFixture[str], command: str, reason: str
) -> None:
    assert kr16(command) == 2
    shown, errors = capsys.readouterr()
    assert shown == ""
    assert errors.startswith("kr16: error: ") and errors.count("\n") == 1
    assert reason in errors
    assert files(folder) == []


def test_without_input_the_help_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16("simulate") == 2
    assert "Usage: kr16 simulate" in capsys.readouterr().err


def test_unwritable_output_is_found_before_the_run(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*args: object, **options: object) -> None:
        raise AssertionError("the simulation was started")

    monkeypatch.setattr(experiment, "simulate", never)
    (folder / "taken.csv").mkdir()
    for output in ("none/run.csv", "taken.csv"):
        assert kr16(f"simulate {_SHORT} -o {output}") == 2
        assert output.split("/")[0] in capsys.readouterr().err


def test_failed_run_is_saved_marked_and_told(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    toml = _SLOW.replace("80000.0", "2.0").replace("1.0", "0.01") + "[solver]\nmax_steps = 20\n"
    (folder / "few.toml").write_text(toml)
    assert kr16("simulate few.toml -o run.npz") == 1
    shown, errors = capsys.readouterr()
    assert "INCOMPLETE" in shown
    (line,) = [line for line in errors.splitlines() if "error" in line]
    assert "ended at 0." in line and "20 steps are used up" in line and "q = " in line
    with np.load(folder / "run.npz") as archive:
        about = json.loads(str(archive["metadata"]))
        assert about["complete"] is False
        assert "20 steps" in about["failure"]
        assert 0.0 < archive["time"][-1] < 2.0
    assert kr16("simulate few.toml --json") == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["result"]["complete"] is False
    jsonschema.validate(answer, _ENVELOPE)


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child on Windows")
def test_table_of_a_run_that_went_astray_stays_narrow(capsys: pytest.CaptureFixture[str]) -> None:
    fast = "--qd 500 500 500 500 500 500 --method RK4 --step 0.1 --duration 2"
    assert kr16(f"simulate free_swing {fast}") == 1
    shown, errors = capsys.readouterr()
    assert "INCOMPLETE" in shown and "e+" in shown
    assert max(map(len, shown.splitlines())) < 120
    assert "the simulation ended at" in errors


def test_interrupt_leaves_what_was_there(folder: Path) -> None:
    (folder / "slow.toml").write_text(_SLOW)
    (folder / "run.csv").write_text("before")
    process = subprocess.Popen(
        [sys.executable, "-m", "kr16cli", "simulate", "slow.toml", "-o", "run.csv"],
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A parent in the background ignores SIGINT, and its children would inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60.0
    while len(files(folder)) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)
    assert len(files(folder)) == 3, "the output was not opened before the run"
    time.sleep(1.0)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    shown, errors = process.communicate(timeout=60)
    # An interrupt that meets an import may end Python by the signal; a shell shows 130 for both.
    assert process.returncode in (130, -signal.SIGINT), errors
    assert (shown, errors.strip()) == ("", "kr16: interrupted; nothing more was written")
    assert files(folder) == ["run.csv", "slow.toml"]
    assert (folder / "run.csv").read_text() == "before"


# kr16 export --------------------------------------------------------------------------------


def test_export_writes_to_stdout_or_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for form, tag in (("urdf", "<robot name="), ("mjcf", "<mujoco model=")):
        assert kr16(f"export {form} --payload 16 0 0 120") == 0
        text, errors = capsys.readouterr()
        assert tag in text and errors == ""
        assert kr16(f"export {form} --payload 16 0 0 120 -o {form}.xml --format x") == 2
        capsys.readouterr()
        assert kr16(f"export {form} --payload 16 0 0 120 -o {form}.xml") == 0
        assert capsys.readouterr().out == ""
        assert (folder / f"{form}.xml").read_text() == text
    assert files(folder) == ["mjcf.xml", "urdf.xml"]


def test_export_says_what_the_file_cannot(capsys: pytest.CaptureFixture[str]) -> None:
    assert kr16("export urdf --robot kr16_l6") == 0
    text, errors = capsys.readouterr()
    assert "<inertial>" not in text
    assert "kr16: warning: " in errors and "no inertial data" in errors
    assert kr16("export urdf --drives") == 0
    assert "rotor inertia" in capsys.readouterr().err
    assert kr16("export mjcf --robot kr16_l6") == 2
    text, errors = capsys.readouterr()
    assert text == "" and "0 of 6 links" in errors
    assert kr16("export mjcf --gravity 0 0 -1.62") == 0
    assert 'gravity="0.0 0.0 -1.62"' in capsys.readouterr().out
