"""`kr16 sweep`: tables, summaries, pictures and complaints."""

from __future__ import annotations

import csv

import pytest

from command_line import complains, kr16

_SHORT = ("sweep", "free_swing", "--workers", 1)


def test_a_sweep_is_told_and_written(tmp_path):
    file = tmp_path / "s.csv"
    done = kr16(*_SHORT, "--vary", "duration_s=0.05:0.1:2", "--vary", "payload.mass=0,8",
                "-o", file)  # fmt: skip
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines()[0] == ("Free swing: KUKA KR 16-2, 4 runs, factorial, 0 failed")
    with file.open(newline="") as source:
        rows = list(csv.DictReader(source))
    assert [row["payload.mass [kg]"] for row in rows] == ["0.0", "8.0", "0.0", "8.0"]
    assert {row["status"] for row in rows} == {"ok"}
    assert [p.name for p in tmp_path.iterdir()] == ["s.csv"]


def test_random_runs_are_those_of_the_seed():
    words = (*_SHORT, "--vary", "duration_s=0.02:0.04", "--monte-carlo", 3, "--json")
    first, again, other = kr16(*words), kr16(*words), kr16(*words, "--seed", 2)
    assert first.out == again.out != other.out
    assert first.result()["runs"] == 3
    latin = kr16(*_SHORT, "--vary", "duration_s=0.02:0.04", "--latin", 2, "--json").result()
    assert latin["vary"]["duration_s"]["least"] < 0.03 < latin["vary"]["duration_s"]["largest"]


def test_failed_runs_are_marked_and_end_with_1(tmp_path):
    file = tmp_path / "s.csv"
    done = kr16(*_SHORT, "--vary", "duration_s=0.02,-1", "-o", file)
    assert done.code == 1
    assert "1 of 2 runs failed, the first of them run 2" in done.err
    rows = file.read_text().splitlines()
    assert rows[1].endswith(",ok")
    assert "must be > 0" in rows[2]


def test_a_picture_is_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    for words in (("--vary", "payload.mass=0:8:3"), ("--vary", "solver.rtol=1e-8")):
        file = tmp_path / "s.pdf"
        done = kr16(*_SHORT, "--vary", "duration_s=0.05", *words, "--plot", file)
        assert done.code in (0, 2), done.err
    assert file.read_bytes()[:4] == b"%PDF"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("sweep nothing --vary a=1", ("nothing", "no such file")),
        ("sweep free_swing", ("--vary",)),
        ("sweep free_swing --vary payload.mas=1,2", ("payload.mas", "near: payload.mass")),
        ("sweep free_swing --vary payload.mass=5:1:3", ("the range is empty",)),
        ("sweep free_swing --vary payload.mass=0:9", ("has no count",)),
        ("sweep free_swing --vary payload.mass=1 --latin 0", ("--latin", "1")),
        ("sweep free_swing --vary payload.mass=1 --latin 2 --monte-carlo 2", ("exclude",)),
        ("sweep free_swing --vary payload.mass=1 -o s.xls", ("-o s.xls", ".parquet")),
    ],
)
def test_bad_input_is_one_line(words, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    complains(kr16(words), *told)
    assert not list(tmp_path.iterdir())


def test_without_a_scenario_the_help_is_shown():
    done = kr16("sweep")
    assert (done.code, done.out) == (2, "")
    assert "--vary payload.mass" in done.err


def test_levels_without_end_are_refused_before_they_fill_the_memory() -> None:
    done = kr16("sweep", "free_swing", "--vary", "payload.mass=0:16:1000000000")
    assert done.code == 2
    assert "COUNT is 1000000000; at most 1000000 are possible" in done.err


def test_robot_without_inertia_is_refused_before_any_run() -> None:
    done = kr16("sweep", "free_swing", "--vary", "payload.mass=0:16:3", "--robot", "kr16_l6")
    assert done.code == 2
    assert "no inertial data" in done.err
