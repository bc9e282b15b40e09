"""`kr16 fmu` as typed: what it writes, prints and refuses."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
import zipfile
from pathlib import Path

import jsonschema
import pytest

import fmus
from command_line import complains, kr16
from kr16cli.assets import asset
from kr16cli.fmi import child, play
from kr16cli.fmi.variables import Part, Start

_SLOW = pytest.mark.slow
_SCHEMA = json.loads(asset("data/schemas/fmu.json").read_text(encoding="utf-8"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _changed(content: bytes, name: str, old: str, new: str) -> bytes:
    """An FMU with a text of some members replaced; `name` ends their names."""
    out = io.BytesIO()
    found = False
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(out, "w") as target:
        for member in source.namelist():
            text = source.read(member)
            if member.endswith(name):
                found = found or old.encode() in text
                text = text.replace(old.encode(), new.encode())
            target.writestr(member, text)
    assert found
    return out.getvalue()


def test_build_writes_the_fmu_and_says_what_it_is(folder: Path) -> None:
    done = kr16("fmu build --no-shim")
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("KR16.fmu: robot of KUKA KR 16-2, FMI 2.0, ")
    assert [p.name for p in folder.iterdir()] == ["KR16.fmu"]


def test_scenario_and_controller_say_what_they_leave_out(folder: Path) -> None:
    done = kr16("fmu build --no-shim --scenario ptp_16kg --controller -o c.fmu")
    assert done.code == 0
    assert "reference" in done.err
    found = kr16("fmu info c.fmu --json").result()
    assert found["part"] == "controller"
    starts = {v["name"]: v["start"] for v in found["variables"]}
    assert float(starts["payload.mass"]) == 16.0


def test_info_fits_its_schema_and_the_table_shows_the_variables(folder: Path) -> None:
    done = kr16("fmu", "info", fmus.file(), "--json")
    jsonschema.validate(done.json(), _SCHEMA)
    assert len(done.result()["variables"]) == 137
    assert any("LD_PRELOAD" in text for text in done.json()["warnings"])
    table = kr16("fmu", "info", fmus.file())
    for word in ("co-simulation", "linux64, win64", "tau[1]", "N.m", "payload.mass"):
        assert word in table.out


@pytest.mark.parametrize("part", list(Part))
def test_check_passes_what_was_built(part: Part) -> None:
    path = fmus.file(Start(q=fmus.BENT, mode=4, drives=True), part)
    done = kr16("fmu", "check", path, "--json")
    assert done.code == 0, done.err
    jsonschema.validate(done.json(), _SCHEMA)
    result = done.result()
    assert result["passed"] and result["problems"] == []
    groups = {d["group"]: d["relative"] for d in result["deviations"]}
    assert set(groups) >= ({"tau"} if part is Part.CONTROLLER else {"q", "qd", "qdd", "pose"})
    assert max(groups.values()) <= 1e-12


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("cargo.json", '"d4": 0.67', '"d4": 0.66', "pose deviates"),
        pytest.param(
            "/model/energy.py", "return", "return 1.001 *", "energy deviates", marks=_SLOW
        ),
        pytest.param(
            "fmi/machine.py", 'list(saved["state"])', "[0.0] * 12", "a state set back", marks=_SLOW
        ),
        pytest.param(
            "fmi/outputs.py", "s.plant.acceleration(", "[0.0] * 6 or (", "qdd deviates", marks=_SLOW
        ),
        pytest.param("modelDescription.xml", 'unit="N.m"', 'unit="lbf"', "lbf", marks=_SLOW),
        ("fmi/machine.py", "from __future__ import annotations", "import kr16cli", "kr16cli"),
    ],
)
def test_check_finds_what_is_wrong(name: str, old: str, new: str, words: str, folder: Path) -> None:
    Path("bad.fmu").write_bytes(_changed(fmus.content(), name, old, new))
    robot = ("--robot", "kr16_2") if name == "cargo.json" else ()
    done = kr16("fmu", "check", "bad.fmu", *robot)
    assert done.code == 1
    assert words in done.out
    assert done.err.startswith("kr16: error: bad.fmu: ")
    assert "passed" not in done.out


def test_check_takes_fmus_of_others_with_our_names(folder: Path) -> None:
    """One without our cargo is compared with the robot asked for, and its own steps allowed."""
    out = io.BytesIO()
    with zipfile.ZipFile(fmus.file()) as source, zipfile.ZipFile(out, "w") as target:
        for member in source.namelist():
            text = source.read(member)
            if member == "modelDescription.xml":
                text = text.replace(b'generationTool="kr16cli ', b'generationTool="other ')
            if member.endswith("fmi/cargo.py"):
                text = text.replace(b'NAME = "cargo.json"', b'NAME = "other.json"')
            target.writestr(member.replace("cargo.json", "other.json"), text)
    Path("theirs.fmu").write_bytes(out.getvalue())
    assert kr16("fmu info theirs.fmu --json").result()["part"] is None
    done = kr16("fmu check theirs.fmu --json")
    assert done.code == 0, done.err
    assert done.result()["tolerance"] == 1e-5


def test_run_reads_inputs_and_writes_outputs(folder: Path) -> None:
    Path("in.csv").write_text("time (s);tau1;tau[2] [N.m]\n0;0;0\n0,5;10;-20,5\n1;0;0\n")
    done = kr16("fmu", "run", fmus.file(), "--input", "in.csv", "-o", "out.csv", "--step", 0.1,
                "--set", "control.mode=2", "--set", "drives=true")  # fmt: skip
    assert (done.code, done.out) == (0, ""), done.err
    rows = list(csv.reader(io.StringIO(Path("out.csv").read_text())))
    header, last = rows[0], dict(zip(rows[0], rows[-1], strict=True))
    assert header[0] == "time [s]" and "q[1] [rad]" in header
    assert len(rows) == 12 and float(last["time [s]"]) == 1.0
    assert float(last["q[2] [rad]"]) != pytest.approx(fmus.BENT[1], abs=1e-5)


def test_run_takes_times_from_the_fmu_without_input() -> None:
    done = kr16("fmu", "run", fmus.file(), "--set", "control.mode=2", "--set", "solver.step=0.01")
    rows = list(csv.reader(io.StringIO(done.out)))
    assert len(rows) == 202 and float(rows[-1][0]) == 2.0


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("fmu info nowhere.fmu", ("nowhere.fmu", "cannot be read")),
        ("fmu info .", ("directory",)),
        ("fmu info text.fmu", ("text.fmu", "is no FMU")),
        ("fmu info empty.fmu", ("no modelDescription.xml",)),
        ("fmu info bad.fmu", ("is no XML",)),
        ("fmu info old.fmu", ("FMI 1.0",)),
        ("fmu info bomb.fmu", ("entities",)),
        ("fmu check text.fmu", ("is no FMU",)),
        ("fmu check KR16.fmu --tolerance 0", ("--tolerance is 0",)),
        ("fmu run KR16.fmu --input in.csv", ("column speed", "tau[1]")),
        ("fmu run KR16.fmu --input nan.csv", ("tau[1]", "finite")),
        ("fmu run KR16.fmu --input back.csv", ("row 2", "time 0 s")),
        ("fmu run KR16.fmu --input short.csv", ("row 1", "cells")),
        ("fmu run KR16.fmu --input text.fmu", ("header",)),
        ("fmu run KR16.fmu --set mass=3", ("no parameter mass",)),
        ("fmu run KR16.fmu --set payload.mass", ("NAME=VALUE",)),
        ("fmu run KR16.fmu --set payload.mass=x", ("payload.mass", "number")),
        ("fmu run KR16.fmu --step 0", ("--step is 0",)),
        ("fmu run KR16.fmu --step 9", ("step of 9 s",)),
        ("fmu run KR16.fmu --step 1e-9", ("steps",)),
        ("fmu run KR16.fmu -o out.npz", (".csv",)),
        ("fmu run KR16.fmu --set control.mode=2.5", ("control.mode is 2.5", "whole number")),
        ("fmu run KR16.fmu --set drives=2", ("drives is 2", "true or false")),
        ("fmu build --fmi 3", ("--fmi", "--native")),
        ("fmu build --arrays", ("--arrays", "--native")),
        ("fmu build --platforms all", ("--platforms", "--native")),
        ("fmu build --native --no-shim", ("--no-shim", "leave it out")),
        ("fmu build --scenario nowhere", ("nowhere", "shipped")),
        ("fmu build --robot kr16_l6", ("inertial",)),
        ("fmu build -o nowhere/x.fmu", ("nowhere", "cannot be written")),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    words: str, expected: tuple[str, ...], folder: Path
) -> None:
    Path("KR16.fmu").write_bytes(fmus.content())
    Path("text.fmu").write_text("no archive")
    bomb = '<!DOCTYPE x [<!ENTITY a "b">]><fmiModelDescription fmiVersion="2.0"/>'
    for name, text in (
        ("empty", None), ("bad", "<a"), ("old", '<fmiModelDescription fmiVersion="1.0"/>'),
        ("bomb", bomb),
    ):  # fmt: skip
        with zipfile.ZipFile(f"{name}.fmu", "w") as archive:
            if text:
                archive.writestr("modelDescription.xml", text)
    Path("in.csv").write_text("time,speed\n0,1\n")
    Path("nan.csv").write_text("time,tau1\n0,nan\n")
    Path("back.csv").write_text("time,tau1\n0,1\n0,2\n")
    Path("short.csv").write_text("time,tau1\n0\n")
    before = sorted(p.name for p in folder.iterdir())
    complains(kr16(words), *expected)
    assert sorted(p.name for p in folder.iterdir()) == before


def test_failed_run_gives_the_fmus_reason() -> None:
    done = kr16("fmu", "run", fmus.file(), "--set", "payload.inertia.xx=5")
    complains(done, "the run failed", "inertia has principal moments", code=1)


def test_missing_fmpy_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.util.find_spec
    monkeypatch.setattr(play, "find_spec", lambda n: None if n == "fmpy" else real(n))
    for command in ("check", "run"):
        complains(kr16("fmu", command, fmus.file()), "kr16cli[fmu]", code=4)


def test_process_under_test_cannot_import_kr16cli() -> None:
    with pytest.raises(ImportError, match=r"closed"):
        child._Closed().find_spec("kr16cli.fmi")
    child._Closed().find_spec("kr16")


def test_crash_of_an_fmu_ends_only_its_process(folder: Path) -> None:
    Path("bad.fmu").write_bytes(
        _changed(fmus.content(), "slave.py", "import sys\n", "import os\nos.abort()\n")
    )
    done = kr16("fmu run bad.fmu")
    complains(done, "the FMU ended its process", code=1)
