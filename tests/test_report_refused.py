"""What `kr16 report` cannot do is said in a line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import kr16cli
from command_line import complains, kr16
from kr16cli.report import build
from report_content import recorded_run, saved_results


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "no/such/folder/r.pdf"], ["no/such/folder/", "cannot be written"]),
        ([], ["give its name", "-o FILE.pdf"]),
        (["-o", "r.txt"], ["r.txt", ".pdf"]),
        (["weather", "-o", "r.pdf"], ["weather", "kinematics"]),
        (["-o", "r.pdf", "--seed", "-3"], ["--seed", "-3"]),
        (["-o", "r.pdf", "--seed", "x"], ["--seed", "x"]),
        (["-o", "r.pdf", "--from", "missing.json"], ["missing.json", "cannot be read"]),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    arguments: list[str], said: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    complains(kr16("report", *arguments), *said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "no JSON"),
        ("[1]", "no JSON object"),
        ('{"schema": "kr16.fk/1"}', "neither"),
        (json.dumps({"schema": "kr16.bench/1", "result": {"rows": [{}]}}), "not whole"),
        (json.dumps({"schema": "kr16.fmu_table/1", "result": {"rows": [{}]}}), "not whole"),
        (json.dumps({"schema": "kr16.fmu_check/1", "result": []}), "not whole"),
    ],
)
def test_a_file_that_holds_no_results_is_refused(content: str, said: str, tmp_path: Path) -> None:
    source = tmp_path / "results.json"
    source.write_text(content, encoding="utf-8")
    target = tmp_path / "r.pdf"
    complains(kr16("report", "-o", target, "--from", source), "results.json", said)
    assert not target.exists()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"model_sha256": "0" * 64}, "model 000000000000"),
        ({"result": {"cases": []}}, "no case"),
        ({"result": {"cases": [{"id": "kinematics.rpy"}]}}, "lacks group"),
        ({"result": {}}, "not whole"),
    ],
)
def test_results_that_do_not_fit_are_refused(
    changes: dict[str, Any], said: str, tmp_path: Path
) -> None:
    source = tmp_path / "results.json"
    source.write_text(json.dumps(saved_results("kinematics", **changes)), encoding="utf-8")
    complains(kr16("report", "-o", tmp_path / "r.pdf", "--from", source), said)


def test_a_run_goes_with_the_simulation_report_only(tmp_path: Path) -> None:
    source = tmp_path / "run.npz"
    source.write_bytes(recorded_run().to_npz())
    complains(kr16("report", "dynamics", "-o", tmp_path / "r.pdf", "--from", source), "simulation")


def test_a_creation_time_that_is_none_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    complains(kr16("report", "-o", tmp_path / "r.pdf"), "SOURCE_DATE_EPOCH", "yesterday")


def test_without_matplotlib_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(kr16cli.Kr16Error, match=r"kr16cli\[report\]") as raised:
        build.require_matplotlib()
    assert raised.value.exit_code == 4
