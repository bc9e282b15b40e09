"""Seeding faults: which mutants are made, how they are run, and what the command says."""

from __future__ import annotations

import ast
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from command_line import complains, kr16
from kr16cli.assets import asset
from kr16cli.errors import CheckFailedError
from kr16cli.verify import misprints, mutants, selftest
from kr16cli.verify.mutants import Mutant

_SOURCE = '''
"""A text: 1 + 1."""
from a import b

Rows = Sequence[Sequence[int]]

def f(x: tuple[int, ...], y: float = 2) -> int | None:
    """Leave 3 - 3 alone."""
    if x is None:
        raise ValueError(f"{x} - 1")
    return atan2(x[1], -y) if y < 0.5 else zip(x, strict=True)
'''


def _text(file: str) -> str:
    return (Path(mutants.__file__).parents[1] / file).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def everything() -> list[Mutant]:
    return mutants.all_mutants()


@pytest.fixture
def worker() -> Iterator[selftest._Worker]:
    with selftest._Worker() as made:
        yield made


def test_every_operator_sign_index_and_constant_is_changed_and_nothing_else(
    tmp_path: Path,
) -> None:
    path = tmp_path / "toy.py"
    path.write_text(_SOURCE, encoding="utf-8")
    made = mutants.source_mutants(path)
    lines = [line.strip() for line in _SOURCE.splitlines() if line.strip()]
    signature, test, result = lines[3], lines[5], lines[7]
    assert {m.change for m in made} == {
        f"{before} -> {after}"
        for before, after in (
            (signature, signature.replace("= 2", "= 3")),
            (signature, signature.replace("= 2", "= 1")),
            (test, "if x is not None:"),
            (result, result.replace("x[1]", "x[0]")),
            (result, result.replace("x[1]", "x[2]")),
            (result, result.replace("x[1]", "-x[1]")),
            (result, result.replace("-y", "y")),
            (result, result.replace("x[1], -y", "-y, x[1]")),
            (result, result.replace("return atan2", "return -atan2")),
            (result, result.replace("<", ">=")),
            (result, result.replace("<", "<=")),
            (result, result.replace("0.5", "1.5")),
            (result, result.replace("0.5", "-0.5")),
        )
    }
    assert {m.where for m in made} == {"f"}


def test_every_mutant_is_one_of_a_kind_and_compiles(everything: list[Mutant]) -> None:
    assert len(everything) >= 2000
    assert len({m.id for m in everything}) == len(everything)
    sources = {m.file: _text(m.file) for m in everything if m.source}
    for m in everything:
        if m.source:
            assert m.source != sources[m.file], m.id
            ast.parse(m.source)
    counted = Counter(m.kind for m in everything)
    assert min(counted[kind] for kind in ("operator", "sign", "index", "constant")) >= 200
    assert counted["misprint"] == len(misprints.MISPRINTS)


def test_each_number_of_the_parameter_file_is_changed_alone(everything: list[Mutant]) -> None:
    made = {m.where: m for m in everything if m.kind == "parameter"}
    tables = [m.table for m in made.values()]
    assert all(table is not None for table in tables)
    assert made["geometry.d4"].table["geometry"]["d4"] == pytest.approx(0.6701, abs=1e-12)  # type: ignore[index]
    assert made["link.2.mass"].table["link"][1]["mass"] == pytest.approx(42.042)  # type: ignore[index]
    assert made["link.2.com.3"].table["link"][1]["com"] == [0.272, -0.14, 1e-4]  # type: ignore[index]
    assert len({json.dumps(table) for table in tables}) == len(tables) >= 100


def test_a_misprint_that_no_longer_fits_the_model_is_an_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    gone = misprints.Misprint("(3.99)", "chain.py", "no such line", "x")
    monkeypatch.setattr(mutants, "MISPRINTS", (gone,))
    with pytest.raises(ValueError, match=r"3\.99.*no such line"):
        mutants.misprint_mutants()


def test_every_listed_survivor_is_a_mutant_and_has_a_reason(everything: list[Mutant]) -> None:
    known = {(m.file, m.where, m.change) for m in everything}
    listed = selftest.survivors()
    assert set(listed) <= known
    for reason in listed.values():
        verdict, _, words = reason.partition(": ")
        assert verdict in ("equivalent", "cannot be seen")
        assert len(words.split()) >= 4


def test_a_quick_run_draws_from_every_file_and_kind_and_depends_on_the_seed(
    everything: list[Mutant],
) -> None:
    drawn = selftest.chosen(1, quick=True)
    assert 200 <= len(drawn) <= 400
    assert {(m.file, m.kind) for m in drawn} == {(m.file, m.kind) for m in everything}
    assert drawn == selftest.chosen(1, quick=True)
    assert drawn != selftest.chosen(2, quick=True)
    assert selftest.chosen(1, quick=False) == everything


def test_cases_that_call_the_changed_function_come_quick_ones_first() -> None:
    def case(id: str, seconds: float, *calls: str, status: str = "passed") -> dict[str, Any]:
        return {"suite": "s", "id": id, "seconds": seconds, "status": status, "calls": calls}

    cases = [
        case("slow", 2.0, "a.py:f"),
        case("other", 0.1, "a.py:g"),
        case("quick", 1.0, "a.py:f", "a.py:g"),
        case("skipped", 0.5, "a.py:f", status="skipped"),
    ]
    in_f = Mutant("", "model/a.py", "f", "sign", "", "m", "text")
    at_top = Mutant("", "model/a.py", "", "sign", "", "m", "text")
    assert [id for _, id in selftest.order(in_f, cases)] == ["quick", "slow"]
    assert [id for _, id in selftest.order(at_top, cases)] == ["other", "quick", "slow"]


def _job(source: str, **changes: Any) -> dict[str, Any]:
    job = {
        "kind": "mutant", "module": "kr16cli.model.scalars", "source": source, "table": None,
        "cases": [("kinematics", "kinematics.vectors")], "seed": 1, "limit": 60.0,
    }  # fmt: skip
    return job | changes


def test_a_worker_sees_a_fault_and_keeps_nothing_of_it(worker: selftest._Worker) -> None:
    text = _text("model/scalars.py")
    broken = text.replace("return -a[0], -a[1], -a[2]", "return -a[0], a[1], -a[2]")
    assert worker.ask(_job(broken))["by"] == "kinematics.vectors"
    assert worker.ask(_job(text)) == {"by": None, "says": ""}
    answer = worker.ask(_job("import nothing_of_that_name"))
    assert answer["by"] == "error"
    assert "nothing_of_that_name" in answer["says"]


def test_a_mutant_that_hangs_or_kills_its_process_is_detected(worker: selftest._Worker) -> None:
    assert worker.ask(_job("while True: pass", limit=1.0))["by"] == "timeout"
    assert worker.ask(_job("import os\nos._exit(3)"))["by"] == "error"
    assert worker.ask(_job("print('noise')\nraise SystemExit"))["by"] == "error"


def test_a_suite_that_fails_on_the_sound_model_stops_the_self_test(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = {
        "cases": [{"suite": "s", "id": "s.a", "seconds": 1.0, "status": "failed", "calls": []}]
    }
    monkeypatch.setattr(selftest._Worker, "ask", lambda self, job: found)
    with pytest.raises(CheckFailedError, match=r"s\.a"):
        list(selftest.run([Mutant("", "model/a.py", "f", "sign", "", "m", "text")], 1, 1))


@pytest.fixture
def few(everything: list[Mutant], monkeypatch: pytest.MonkeyPatch) -> list[Mutant]:
    """A few mutants and one that changes nothing, against three quick suites."""
    monkeypatch.setattr(selftest, "OWN_SUITES", ("kinematics", "inverse", "datasheet"))
    by_kind = {m.kind: m for m in everything if "forward.py" in m.file and m.where == "r36"}
    picked = [by_kind["sign"], by_kind["operator"]]
    picked += [m for m in everything if m.where in ("geometry.d4", "link.6.mass")]
    picked += [m for m in everything if m.kind == "misprint" and "(3.24)" in m.change]
    text = _text("model/scalars.py")
    picked.append(Mutant("nothing", "model/scalars.py", "cross", "sign", "a -> a",
                         "kr16cli.model.scalars", text))  # fmt: skip
    monkeypatch.setattr(selftest, "chosen", lambda seed, quick: picked)
    return picked


def test_command_reports_each_fault_and_fails_on_a_survivor_without_a_reason(
    few: list[Mutant], monkeypatch: pytest.MonkeyPatch
) -> None:
    done = kr16("verify", "--self-test", "--json")
    assert done.code == 1, done.err
    found = done.json()
    schema = json.loads(asset("data/schemas/verify.json").read_text(encoding="utf-8"))
    jsonschema.validate(found, schema)
    result = found["result"]
    assert [fault["id"] for fault in result["faults"]] == [m.id for m in few]
    *detected, survivor = result["faults"]
    assert all(fault["detected"] and fault["by"] for fault in detected)
    assert survivor | {"file": "", "kind": ""} == {
        "id": "nothing", "file": "", "kind": "", "change": "a -> a",
        "detected": False, "by": None, "reason": None,
    }  # fmt: skip
    counted = [result[key] for key in ("seeded", "detected", "survived", "unexplained")]
    assert counted == [6, 5, 1, 1]

    monkeypatch.setattr(selftest, "reason_for", lambda mutant: "equivalent: it changes nothing")
    done = kr16("verify", "--self-test")
    assert done.code == 0, done.err
    assert done.out.endswith("6 faults seeded, 5 detected (0 of them broke the model before a case "
                             "ran), 1 survived, all explained\n")  # fmt: skip


def test_self_test_takes_no_suite_and_no_other_robot() -> None:
    complains(kr16("verify", "--self-test", "--suite", "velocity"), "--suite")
    complains(kr16("verify", "--self-test", "--robot", "kr16_l6"), "--robot")
