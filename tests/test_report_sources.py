"""Where a report's results come from: suites, saved results, runs, times and FMUs."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

import kr16cli
from command_line import complains, kr16
from kr16cli.report import build, fmus, times
from kr16cli.report.content import outline
from kr16cli.report.sources import read
from kr16cli.verify import registry
from kr16cli.verify.records import Setting
from report_content import (
    bench_answer,
    content_of,
    drawn_words,
    fmu_row,
    fmu_table,
    left_out,
    made_result,
    made_results,
    recorded_run,
    said_by,
    saved_results,
)


def test_saved_results_are_read_back_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(json.dumps(saved_results("verification")), encoding="utf-8")
    found = read([path], outline("verification").suites, kr16cli.load_data())
    assert (found.seed, found.quick) == (20161, True)
    assert found.results == tuple(
        dataclasses.replace(r, worst=json.loads(json.dumps(r.worst))) for r in made_results()
    )


def test_results_without_figures_still_give_a_report_that_says_so(tmp_path: Path) -> None:
    saved = saved_results("simulation")
    for case in saved["result"]["cases"]:
        del case["figures"]
    source, target = tmp_path / "results.json", tmp_path / "report.pdf"
    source.write_text(json.dumps(saved), encoding="utf-8")
    done = kr16("report", "simulation", "--from", source, "-o", target)
    assert done.code == 0
    assert "no page on orders: case simulation.order: no figure data in the file" in done.err
    assert "no page on energy" in done.err and "run" not in done.err.split()
    assert target.read_bytes().startswith(b"%PDF")


def test_a_failed_case_makes_the_exit_code_1(tmp_path: Path) -> None:
    saved = saved_results("simulation")
    saved["result"]["cases"][0] |= {"status": "failed", "error": 1.0}
    source, target = tmp_path / "results.json", tmp_path / "report.pdf"
    source.write_text(json.dumps(saved), encoding="utf-8")
    done = kr16("report", "simulation", "--from", source, "-o", target)
    assert (done.code, done.err) == (1, "")
    assert target.exists()


def test_a_recorded_run_is_drawn_and_nothing_is_run(tmp_path: Path) -> None:
    source, target = tmp_path / "run.npz", tmp_path / "run.pdf"
    source.write_bytes(recorded_run().to_npz())
    done = kr16("report", "simulation", "--from", source, "-o", target)
    assert (done.code, done.out) == (0, "")
    assert target.read_bytes().startswith(b"%PDF")
    content = build.gather("simulation", Setting(kr16cli.load_robot()), [source])
    assert content.results == ()
    words = said_by(content)
    assert any("NO CHECKS" in word for word in words)
    assert "Recorded motion rest" in words
    assert "angle, deg" in [word for page in drawn_words("simulation") for word, *_ in page]


def test_measured_times_are_shown_only_where_given(tmp_path: Path) -> None:
    results, measured = tmp_path / "results.json", tmp_path / "bench.json"
    results.write_text(json.dumps(saved_results("dynamics")), encoding="utf-8")
    measured.write_text(json.dumps(bench_answer()), encoding="utf-8")
    content = build.gather("dynamics", Setting(kr16cli.load_robot()), [results, measured])
    words = said_by(content)
    assert {"41.2", "Pinocchio", "310.0", "7.5", "2.5", "62 %", "2.25", "times drift"} <= set(words)
    assert "speed" in left_out("dynamics")


def test_slower_than_a_peer_is_said_in_the_title() -> None:
    slow = bench_answer()
    slow["result"]["rows"][0]["ratio"] = 0.5
    words = said_by(content_of(bench=times.read(slow)))
    assert "Batches are slower than a peer in 1 of 1 quantities" in words
    alone = bench_answer()
    del alone["result"]["rows"][0]
    words = said_by(content_of(bench=times.read(alone)))
    assert "Measured times, as the bench file gives them" in words


def test_times_alone_add_their_page_to_suites_that_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "bench.json"
    file.write_text(json.dumps(bench_answer()), encoding="utf-8")
    cases = [c for c in registry.cases(["dynamics"]) if c.id == "dynamics.power"]
    monkeypatch.setattr(registry, "cases", lambda names: cases)
    content = build.gather("dynamics", Setting(kr16cli.load_robot(), quick=True), [file])
    assert [r.id for r in content.results] == ["dynamics.power"]
    assert content.evidence.source.startswith("run for this report")
    assert "41.2" in said_by(content)


# FMUs ----------------------------------------------------------------------------------------


def test_an_fmu_built_from_the_robot_moves_as_the_simulator() -> None:
    pytest.importorskip("pythonfmu")
    pytest.importorskip("fmpy")
    (result,) = fmus.own(kr16cli.load_data(), quick=True)
    assert (result.status, result.group, result.grade) == ("passed", "fmu", "D")
    assert result.error is not None and result.error <= result.tolerance
    assert {d["group"] for d in result.figures["deviations"]} >= {"q", "qd", "pose", "energy"}


def test_an_arm_that_can_be_no_fmu_is_skipped_with_the_reason() -> None:
    (result,) = fmus.own(kr16cli.load_data("kr16_l6"), quick=False)
    assert result.status == "skipped"
    content = content_of(fmus=(result,))
    words = "\n".join(said_by(content))
    assert "no inertial data" in content.left_out["fmu"]
    assert "fmu: KUKA KR 16 L6" in words
    assert "no inertial data" in " ".join(words.partition("Identity")[0].split())


def test_checks_of_fmus_are_read_one_or_many_and_judged(tmp_path: Path) -> None:
    one, many = tmp_path / "one.json", tmp_path / "many.json"
    row = fmu_row()
    check = fmu_table() | {"schema": "kr16.fmu_check/1", "input": {"file": row.pop("file")}}
    one.write_text(json.dumps(check | {"result": row}), encoding="utf-8")
    many.write_text(json.dumps(fmu_table()), encoding="utf-8")
    found = read([one, many], outline("verification").suites, kr16cli.load_data())
    assert [r.id for r in found.fmus] == [
        "fmu.KR16-CS-FMPy-Linux-x86_64",
        "fmu.KR16-CS-FMPy-Linux-x86_64-2",
        "fmu.KR16-CS-Ecos-Linux-x86_64",
        "fmu.KR16_controller-CS-FMPy-Linux-x86_64",
        "fmu.KR16-ME-FMPy-Windows-x86_64-wine",
    ]
    assert {r.status for r in found.fmus} == {"passed"}
    assert found.fmus[0].error == 3e-11
    assert found.fmus[0].worst == {"output": "tau_applied", "at": "0.3 s"}


def test_an_fmu_that_deviates_fails_the_report(tmp_path: Path) -> None:
    far = [
        {"group": "q", "largest": None, "unit": "rad", "time": 0.2, "relative": None},
        {"group": "qd", "largest": 3e-4, "unit": "rad/s", "time": 0.1, "relative": 3e-4},
    ]
    bad = fmu_row(passed=False, deviations=far, problems=["q runs away"], host="Other 1.0")
    results, checks = tmp_path / "results.json", tmp_path / "fmus.json"
    results.write_text(json.dumps(saved_results("verification")), encoding="utf-8")
    checks.write_text(json.dumps(fmu_table(fmu_row(), bad)), encoding="utf-8")
    content = build.gather("verification", Setting(kr16cli.load_robot()), [results, checks])
    words = said_by(content)
    assert any(w.startswith("FAILED: 1 of 2 checks of FMUs") for w in words)
    assert "FAILED fmu.KR16-CS-Other-Linux-x86_64: q runs away" in words
    assert {"not finite", "3e-4"} <= set(words)
    assert content.by_margin()[0].id == "fmu.KR16-CS-Other-Linux-x86_64"
    assert content.count("failed") == 1


def test_checks_of_fmus_go_with_the_verification_report_only(tmp_path: Path) -> None:
    source = tmp_path / "fmus.json"
    source.write_text(json.dumps(fmu_table()), encoding="utf-8")
    complains(
        kr16("report", "dynamics", "-o", tmp_path / "r.pdf", "--from", source), "verification"
    )


def test_compiled_kernels_are_not_called_another_engine() -> None:
    native = made_result("engines.native.fk", title="Compiled kernels: fk", grade="D")
    words = said_by(content_of(results=(*made_results(), native)))
    assert "Pinocchio agree: same numbers, other code" in words
    assert words.index("The compiled kernels") < words.index("Compiled kernels: fk")
