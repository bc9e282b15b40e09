"""The registered cases by suite, and how they are run."""

from __future__ import annotations

import importlib
import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from kr16cli.errors import InputError
from kr16cli.verify.records import Case, Finding, Grade, Result, Setting, SkipCase

SUITES = (
    "kinematics",
    "inverse",
    "velocity",
    "dynamics",
    "simulation",
    "datasheet",
    "engines",
    "chapter",
)
"""In the order of a full run; `kr16cli.verify.suites.<name>` registers the cases of each."""

_CASES: dict[str, Case] = {}


def case(
    id: str,  # the field's name in the contract
    *,
    title: str,
    statement: str,
    regime: str,
    method: str,
    grade: Grade,
    tolerance: float,
    unit: str,
    reason: str,
    equations: Sequence[str] = (),
    functions: Sequence[str] = (),
    engine: str | None = None,
) -> Callable[[Callable[[Setting], Finding]], Callable[[Setting], Finding]]:
    """Register a function as a case of the suite whose module or package it stands in."""

    def register(run: Callable[[Setting], Finding]) -> Callable[[Setting], Finding]:
        suite = run.__module__.partition(".suites.")[2].partition(".")[0]
        if id in _CASES:
            raise ValueError(f"case {id} is registered twice")
        _CASES[id] = Case(
            id, suite, title, statement, regime, method, grade, tolerance, unit, reason, run,
            tuple(equations), tuple(functions), engine,
        )  # fmt: skip
        return run

    return register


def cases(suites: Sequence[str]) -> list[Case]:
    """The cases of the suites, in the order of SUITES and of their definition.

    Raises:
        InputError: an unknown suite.
    """
    for name in suites:
        if name not in SUITES:
            raise InputError(f"suite {name!r} is unknown; choose from {', '.join(SUITES)} or all")
    chosen = [name for name in SUITES if name in suites]
    for name in chosen:
        importlib.import_module(f"kr16cli.verify.suites.{name}")
    return [c for name in chosen for c in _CASES.values() if c.suite == name]


def run(chosen: Sequence[Case], setting: Setting) -> Iterator[Result]:
    """Results one by one. A case that raises fails with the reason; the others still run."""
    for c in chosen:
        yield _run_one(c, setting)


@contextmanager
def model_source() -> Iterator[None]:
    """Robots made inside run the model's own source: the NumPy engine.

    What is verified is the source that reads like the chapter; the compiled kernels are
    compared with it by cases of their own. KR16_ENGINE, where set, is left as it is.
    """
    with using_engine(os.environ.get("KR16_ENGINE") or "numpy"):
        yield


@contextmanager
def using_engine(name: str) -> Iterator[None]:
    """Robots made inside run on this engine."""
    before = os.environ.get("KR16_ENGINE")
    os.environ["KR16_ENGINE"] = name
    try:
        yield
    finally:
        if before is None:
            del os.environ["KR16_ENGINE"]
        else:
            os.environ["KR16_ENGINE"] = before


def _run_one(c: Case, setting: Setting) -> Result:
    try:
        with model_source():
            r = setting.robot
            robot = type(r)(r.data, payload=r.payload, drives=r.drives, tool=r.tool)
            found = c.run(replace(setting, robot=robot))
    except SkipCase as reason:
        return _result(c, setting, None, "skipped", str(reason))
    except Exception as error:  # whatever a case meets is its verdict
        return _result(c, setting, None, "failed", f"{type(error).__name__}: {error}")
    passed = math.isfinite(found.error) and found.error <= c.tolerance
    return _result(c, setting, found, "passed" if passed else "failed", found.evidence)


def _result(c: Case, setting: Setting, found: Finding | None, status: str, evidence: str) -> Result:
    return Result(
        id=c.id,
        group=c.suite,
        title=c.title,
        statement=c.statement,
        regime=c.regime,
        method=c.method,
        grade=c.grade,
        error=found.error if found and math.isfinite(found.error) else None,
        tolerance=c.tolerance,
        unit=c.unit,
        reason=c.reason,
        status=status,  # type: ignore[arg-type]  # one of Outcome's
        samples=found.samples if found else 0,
        seed=setting.seed,
        worst=found.worst if found else {},
        evidence=evidence,
        equations=c.equations,
        functions=c.functions,
        figures=found.figures if found else {},
    )
