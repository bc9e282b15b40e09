"""`kr16 map`: what it tells, writes and draws, and how it is interrupted and goes on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from command_line import complains, kr16

_COARSE = ("--grid", "400mm", "--workers", "2")


def test_the_summary_is_told_and_the_map_written(tmp_path):
    file = tmp_path / "reach.npz"
    done = kr16("map", "reach", *_COARSE, "-o", file)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("reach of KUKA KR 16-2: ")
    assert "within the published 1611" in done.out
    with np.load(file) as archive:
        told = json.loads(str(archive["metadata"]))
        branches = archive["branches"]
    assert told["schema"] == "kr16.map/1"
    assert told["result"]["reached"] == (branches > 0).sum()
    assert [p.name for p in tmp_path.iterdir()] == ["reach.npz"]


def test_json_is_whole_and_the_same_whatever_the_workers(tmp_path):
    words = ("map", "payload", "--grid", "0.4m", "--y", 0, "--payload", "1 0 0 120", "--json")
    one, two = kr16(*words, "--workers", 1), kr16(*words, "--workers", 3)
    assert one.out == two.out
    answer = one.json()
    assert answer["input"]["payload"]["com"] == [0.0, 0.0, 0.12]
    measures = answer["result"]["measures"]
    assert 50 < measures["mass_best"]["least"] < measures["mass_best"]["largest"] < 1000
    kept = tmp_path / "a.json"
    assert kr16(*words[:-1], "-o", kept).out == ""
    assert json.loads(kept.read_text()) == answer


def test_payload_says_that_the_drives_hold_it_at_rest():
    done = kr16("map payload --y 0 --x 1000 --z 900")
    assert done.code == 0
    assert "held at rest by the torques of the drives alone" in done.out


@pytest.mark.parametrize("quantity", ["manipulability", "condition", "torque"])
def test_every_quantity_has_a_table(quantity):
    done = kr16("map", quantity, "--grid", "500", "--z", "0:1500", "--abc", "0 90 0")
    assert done.code == 0
    assert done.out.startswith(f"{quantity} of KUKA KR 16-2")


def test_units_follow_si():
    mm = kr16("map reach --grid 400 --x -800:800 --json").json()
    si = kr16("map reach --si --grid 0.4 --x -0.8:0.8 --json").json()
    assert mm == si


def test_free_and_listed_orientations():
    free = kr16("map reach --grid 400 --orientation free --directions 4 --rolls 2 --json").json()
    assert free["result"]["poses"] == 8 * free["result"]["rows"]
    listed = kr16("map", "reach", *_COARSE, "--orientation", "list", "--abc", "0 180 0",
                  "--abc", "0 90 0", "--json").json()  # fmt: skip
    assert listed["result"]["rows"] == 2 * free["result"]["rows"]


@pytest.mark.parametrize("suffix", ["pdf", "png"])
def test_a_picture_is_drawn_and_depends_on_the_map_alone(tmp_path, suffix):
    pytest.importorskip("matplotlib")
    files = [tmp_path / f"{i}.{suffix}" for i in (1, 2)]
    for file in files:
        assert kr16("map", "reach", *_COARSE, "--plot", file).code == 0
    first, second = (file.read_bytes() for file in files)
    assert first == second
    assert first[:4] in (b"%PDF", b"\x89PNG")


def test_pictures_of_little_are_drawn_too(tmp_path):
    pytest.importorskip("matplotlib")
    for words in (("--y", "0", "--z", "500"), ("--y", "3000"), ("--y", "0")):
        done = kr16("map", "payload", "--grid", "300", *words, "--plot", tmp_path / "p.pdf")
        assert done.code == 0, done.err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("map everything", ("everything", "reach, manipulability")),
        ("map reach --grid 0", ("--grid", "more than 0")),
        ("map reach --grid 1e-9", ("--grid", "points along x")),
        ("map reach --grid fine", ("--grid", "number")),
        ("map reach --grid 10cm", ("--grid is 10cm", "mm or m")),
        ("map reach --x 500:100", ("--x", "empty")),
        ("map reach --x 1:2:3", ("--x", "LOW:HIGH")),
        ("map reach --orientation up", ("--orientation", "fixed, list or free")),
        ("map reach --orientation free --directions 0", ("--directions", "1")),
        ("map reach --abc 0", ("--abc", "3 numbers")),
        ("map reach --point elbow", ("--point", "flange, tool or wrist")),
        ("map reach --point tool", ("--tool",)),
        ("map condition --length 0", ("--length", "more than 0")),
        ("map reach --workers 0", ("--workers", "1")),
        ("map reach --scheduler there", ("scheduler", "tcp://host:port")),
        ("map reach -o map.csv", ("-o map.csv", ".npz")),
        ("map reach --plot map.jpg", ("--plot", ".pdf")),
        ("map reach -o a.npz --format csv", ("csv", "suffix")),
        ("map torque --robot chapter3", ("torque",)),
    ],
)
def test_bad_input_is_one_line(words, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    complains(kr16(words), *told)
    assert not list(tmp_path.iterdir())


def test_a_map_of_nothing_says_so():
    done = kr16("map reach --grid 500 --y 9000 --json")
    assert done.code == 0
    (warning,) = done.json()["warnings"]
    assert "nothing is reached within the joint limits" in warning
    assert warning in done.err


def test_without_a_quantity_the_help_is_shown():
    done = kr16("map")
    assert (done.code, done.out) == (2, "")
    assert "kr16 map reach" in done.err


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_map_goes_on_where_it_was(tmp_path, number):
    words = ["map", "condition", "--grid", "40", "--workers", "2", "-o", "m.npz"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}
    process = subprocess.Popen(
        [sys.executable, "-m", "kr16cli", *words], cwd=tmp_path, env=environment,
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    folder, deadline = tmp_path / "m.npz.partial", time.monotonic() + 60
    while len(list(folder.glob("0*.npz"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(number)
    out, err = process.communicate()
    assert process.returncode == 128 + number, err
    assert out == ""
    kept = len(list(folder.glob("0*.npz")))
    assert kept >= 2
    assert f"{kept} of 10 chunks are kept in m.npz.partial; the same command goes on" in err
    assert not (tmp_path / "m.npz").exists()
    done = subprocess.run(
        [sys.executable, "-m", "kr16cli", *words], cwd=tmp_path, env=environment, text=True,
        capture_output=True, check=True,
    )  # fmt: skip
    assert done.stderr == f"kr16: going on: {kept} of 10 chunks are there\n"
    assert [p.name for p in tmp_path.iterdir()] == ["m.npz"]
