"""`kr16 uncertainty`: bands, the table of what matters, pictures and complaints."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from command_line import complains, kr16


def test_the_bands_and_what_matters_most_are_told():
    done = kr16("uncertainty --q 0 0 0 0 0 0 --samples 200 --workers 1")
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0] == "KUKA KR 16-2: 200 robots drawn, normal; bands hold 95 %"
    assert any(line.split()[:2] == ["A2", "-543.73"] for line in lines)
    at = lines.index("what matters most: share of the variance of the gravity torque of A2, %")
    assert lines[at + 2].split()[0] == "link[3].mass"


def test_json_is_the_seed_s_whatever_the_workers():
    words = "uncertainty --samples 600 --seed 4 --json --workers "
    one, three, other = kr16(words + "1"), kr16(words + "3"), kr16(words.replace("4", "5") + "1")
    assert one.out == three.out != other.out
    gravity = one.result()["gravity"]
    assert np.array(gravity["low"]).shape == (1, 6)
    assert gravity["sigma"][0][1] == pytest.approx(gravity["sigma_first_order"][0][1], rel=0.1)


def test_a_scenario_gets_bands_along_its_motion(tmp_path):
    scene = tmp_path / "short.toml"
    scene.write_text(
        'schema = "kr16.scenario/1"\nname = "short"\nduration_s = 0.1\n'
        "[initial]\nq_deg = [0, -60, 60, 0, 30, 0]\n"
    )
    file, plot = tmp_path / "u.npz", tmp_path / "u.pdf"
    pytest.importorskip("matplotlib")
    done = kr16("uncertainty", scene, "--samples", 50, "-o", file, "--plot", plot)
    assert done.code == 0, done.err
    assert "largest half width of the band along the motion" in done.out
    assert plot.read_bytes()[:4] == b"%PDF"
    with np.load(file) as archive:
        told = json.loads(str(archive["metadata"]))["result"]
        assert archive["motion"].shape == (50, len(archive["motion_time"]), 6)
        assert archive["torque"].shape[0] == 50
    assert told["agree_until"] > 0.05


@pytest.mark.skipif(os.name == "nt", reason="a closed pipe is POSIX")
def test_a_reader_that_leaves_early_loses_no_file(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}
    process = subprocess.Popen(
        [sys.executable, "-m", "kr16cli", "uncertainty", "--samples", "20", "-o", "u.npz"],
        cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.close()
    process.wait(60)
    assert process.stderr is not None
    assert b"Traceback" not in process.stderr.read()
    process.stderr.close()
    assert [p.name for p in tmp_path.iterdir()] == ["u.npz"]


def test_drives_and_payload_count():
    plain = kr16("uncertainty --samples 20 --json").result()
    loaded = kr16("uncertainty --samples 20 --payload 16 0 0 120 --json").result()
    nominal = [r["gravity"]["nominal"][0][1] for r in (plain, loaded)]
    assert nominal == pytest.approx([-73.921, -222.719], abs=0.01)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("uncertainty --samples 1", ("--samples", "2")),
        ("uncertainty --seed -1", ("--seed",)),
        ("uncertainty --distribution flat", ("--distribution", "normal or uniform")),
        ("uncertainty nothing", ("nothing", "no such file")),
        ("uncertainty free_swing --drives", ("scenario says",)),
        ("uncertainty --robot chapter3", ("tolerance",)),
        ("uncertainty -o u.csv", ("-o u.csv", ".npz")),
    ],
)
def test_bad_input_is_one_line(words, told):
    complains(kr16(words), *told)


def test_few_samples_are_told() -> None:
    few = kr16("uncertainty", "--q", "0", "-90", "90", "0", "0", "0", "--samples", "20")
    enough = kr16("uncertainty", "--q", "0", "-90", "90", "0", "0", "0", "--samples", "100")
    assert few.code == enough.code == 0
    assert "20 robots drawn are few" in few.err and "are few" not in enough.err
