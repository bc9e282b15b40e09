"""kr16 bench: it measures what it names, and compares like with like."""

from __future__ import annotations

import json

import pytest

import kr16cli
from command_line import kr16
from kr16cli.bench import own, peers, report
from kr16cli.bench.timing import nanoseconds


def test_time_of_a_call_is_of_its_size() -> None:
    works = {str(n): (lambda n=n: sum(range(n)), n // 1000) for n in (1000, 100_000)}
    each = nanoseconds(works, 3)
    assert 0.2 < each["100000"] / each["1000"] < 5


@pytest.mark.filterwarnings("ignore")
def test_every_quantity_has_its_figures_and_peers() -> None:
    robot = kr16cli.load_robot()
    answer = report.bench(robot, n=256, threads=2, rounds=1, with_peers=True)
    rows = {row["quantity"]: row for row in answer["result"]["rows"]}
    assert set(rows) == set(own.MEASURED)
    for row in rows.values():
        assert all(row[key] > 0 for key in ("batch_ns", "threads_ns", "call_ns"))
    assert "Pinocchio, a loop" in rows["forward_dynamics"]["peers"]
    figures = {f["what"]: f for f in answer["result"]["motions"]}
    assert all(f["seconds"] > 0 for f in figures.values())
    swings = [f for what, f in figures.items() if "SciPy" in what]
    assert len(swings) == 2 and all("Pinocchio's ABA" in f["peers"] for f in swings)
    assert any("doStep of 1 ms" in what for what in figures)
    shown = report.table(answer)
    assert all(what in shown for what in figures)
    assert rows["fk"]["ratio"] == min(rows["fk"]["peers"].values()) / rows["fk"]["batch_ns"]


def test_missing_peers_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(*_: object) -> peers.Works:
        raise ImportError
        yield

    for name in ("_pinocchio", "_mujoco", "_toolbox", "_eaik", "_opw"):
        monkeypatch.setattr(peers, name, absent)
    robot = kr16cli.load_robot()
    assert peers.works(robot, own.inputs(robot, 10)) == {}


def test_command_prints_a_table_and_json() -> None:
    done = kr16("bench", "--quick", "--json")
    assert done.code == 0
    answer = json.loads(done.out)
    assert answer["schema"] == "kr16.bench/1"
    assert len(answer["result"]["rows"]) == len(own.MEASURED)
    assert kr16("bench", "--threads", "0").code == 2
