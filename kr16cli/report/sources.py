"""Where results come from: a run of the suites, or files that other commands wrote."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from kr16cli.errors import FileError, InputError
from kr16cli.report import fmus, times
from kr16cli.report.content import Evidence, sha256
from kr16cli.robot import RobotData
from kr16cli.simulate.run import load_run
from kr16cli.verify import registry
from kr16cli.verify.records import Result, Setting

_SCHEMA = "kr16.verify/1"
_NEEDED = ("id", "group", "title", "method", "grade", "tolerance", "status", "evidence")
_PLAIN: dict[str, Any] = {
    "statement": "", "regime": "", "unit": "", "reason": "", "error": None, "samples": 0,
    "seed": 0, "worst": {}, "equations": (), "functions": (), "figures": {},
}  # fmt: skip


def run_suites(
    suites: Sequence[str],
    setting: Setting,
    progress: Callable[[int, int, str], None] | None = None,
    given: Evidence | None = None,
) -> Evidence:
    """Run the suites, beside what files gave.

    Args:
        suites: by name.
        setting: what they are run with.
        progress: told how many cases are done, of how many, and the last.
        given: what files gave, kept.
    """
    cases = registry.cases(suites)
    results = []
    for result in registry.run(cases, setting):
        results.append(result)
        if progress:
            progress(len(results), len(cases), result.id)
    words = "quick run: fewer samples" if setting.quick else "full run"
    evidence = given or Evidence((), None, None, "")
    return replace(
        evidence,
        results=tuple(results),
        seed=setting.seed,
        quick=setting.quick,
        source=f"run for this report ({words})",
    )


def read(paths: Sequence[str | Path], suites: Sequence[str], data: RobotData) -> Evidence:
    """What files hold: results of `kr16 verify --json`, a run's npz, FMU checks, times.

    Args:
        paths: the files, in any order; later results of a case replace earlier ones.
        suites: only their cases are kept.
        data: the robot; results of another model are refused.

    Raises:
        FileError: a file that cannot be read or holds something else.
        InputError: results of another model.
    """
    found = Evidence((), None, None, "read from " + ", ".join(Path(p).name for p in paths))
    lacking: str | Path | None = None
    for path in paths:
        content = _bytes(path)
        found = replace(found, files=(*found.files, (Path(path).name, sha256(content))))
        if content[:2] == b"PK":
            run = load_run(path)
            _same_model(path, run.model_sha256, run.robot, data)
            found = replace(found, run=run)
            continue
        table = _table(path, content)
        found = _joined(found, path, table, suites, data)
        if table["schema"] == _SCHEMA and not found.results:
            lacking = path
    if lacking and not (found.results or found.run):
        raise FileError(lacking, f"holds no case of the suites {', '.join(suites)}")
    return replace(found, fmus=tuple(fmus.numbered(found.fmus)))


def _joined(
    found: Evidence, path: str | Path, table: Mapping[str, Any], suites: Sequence[str],
    data: RobotData,
) -> Evidence:  # fmt: skip
    """The evidence with a JSON file added."""
    schema = table.get("schema")
    if schema not in (_SCHEMA, times.SCHEMA, fmus.ONE, fmus.TABLE):
        raise FileError(
            path,
            "is neither a result of kr16 verify, kr16 fmu check or kr16 bench (--json) nor a run",
        )
    if schema == _SCHEMA or table.get("model_sha256") is not None:  # FMUs of others name none
        _same_model(path, str(table.get("model_sha256")), str(table.get("robot")), data)
    try:
        if schema == times.SCHEMA:
            return replace(found, bench=times.read(table))
        if schema != _SCHEMA:
            return replace(found, fmus=(*found.fmus, *fmus.cases(table)))
        cases = [_result(entry) for entry in table["result"]["cases"]]
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise FileError(path, f"holds a result that is not whole: {error}") from None
    asked = table.get("input") or {}
    kept = {r.id: r for r in (*found.results, *cases) if r.group in suites}
    return replace(
        found, results=tuple(kept.values()), seed=asked.get("seed"), quick=asked.get("quick")
    )


def _result(entry: Mapping[str, Any]) -> Result:
    for key in _NEEDED:
        if key not in entry:
            raise KeyError(f"{entry.get('id', 'a case')} lacks {key}")
    known = {f.name for f in fields(Result)}
    values = _PLAIN | {k: v for k, v in entry.items() if k in known}
    if values["status"] not in ("passed", "failed", "skipped"):
        raise ValueError(f"status of {values['id']} is {values['status']!r}")
    for key in ("error", "tolerance"):
        if values[key] is not None:
            values[key] = float(values[key])
    for key in ("equations", "functions"):
        values[key] = tuple(values[key])
    return Result(**values)


def _bytes(path: str | Path) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None


def _table(path: str | Path, content: bytes) -> Mapping[str, Any]:
    try:
        table = json.loads(content)
    except ValueError as error:
        raise FileError(path, f"is no JSON: {error}") from None
    if not isinstance(table, dict):
        raise FileError(path, "is no JSON object; give what kr16 verify --json wrote")
    return table


def _same_model(path: str | Path, sha: str, name: str, data: RobotData) -> None:
    if sha != data.sha256:
        raise InputError(
            f"{path} is of {name}, model {sha[:12]}; the robot is {data.name}, model "
            f"{data.sha256[:12]}; give its parameter file with --robot"
        )
