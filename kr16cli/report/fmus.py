"""Checks of FMUs as cases: one made here, or those that files hold.

A file is what `kr16 fmu check --json` wrote, one FMU on one host, or a table of many: schema
`kr16.fmu_table/1`, whose `result.rows` are such results, each with its `file`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from kr16cli.errors import CheckFailedError, InputError, MissingPartError
from kr16cli.robot import RobotData
from kr16cli.verify.records import Result

GROUP = "fmu"
ONE, TABLE = "kr16.fmu_check/1", "kr16.fmu_table/1"
_SHORT = {"co-simulation": "CS", "model-exchange": "ME", "scheduled-execution": "SE"}
_UNNAMED = {"fmi_version": "?", "interface": "", "host": "unnamed host", "platform": ""}


def own(data: RobotData, *, quick: bool) -> tuple[Result, ...]:
    """The checks of FMUs built from the robot for this report; skipped where it cannot be.

    Args:
        data: the robot.
        quick: the pythonfmu FMU alone; else native ones as well, by every interface.
    """
    from kr16cli.fmi import check, evidence

    try:
        table = evidence.table(data, everywhere=False, native=not quick)
        return tuple(numbered(cases(table)))
    except (MissingPartError, InputError) as reason:
        return (_skipped("KR16.fmu", str(reason)),)
    except CheckFailedError as reason:
        failed = {"file": "KR16.fmu", "passed": False, "problems": [str(reason)], "deviations": [],
                  "steps": 0, "tolerance": check.EQUAL_STEPS}  # fmt: skip
        return (case(failed),)


def cases(table: Mapping[str, Any]) -> list[Result]:
    """The rows of a file as cases.

    Raises:
        KeyError, TypeError, ValueError: a row that is not whole.
    """
    result = table["result"]
    rows = result["rows"] if table["schema"] == TABLE else [{**table["input"], **result}]
    return [case(row) for row in rows]


def numbered(found: Sequence[Result]) -> list[Result]:
    """The cases with ids of their own: x, x-2, x-3."""
    seen: dict[str, int] = {}
    unique = []
    for r in found:
        seen[r.id] = seen.get(r.id, 0) + 1
        unique.append(r if seen[r.id] == 1 else replace(r, id=f"{r.id}-{seen[r.id]}"))
    return unique


def case(row: Mapping[str, Any]) -> Result:
    """One FMU on one host by one interface as a case."""
    name = Path(str(row["file"])).name
    about = {key: str(row.get(key) or word) for key, word in _UNNAMED.items()}
    deviations = [dict(d) for d in row["deviations"]]
    relative = [None if d["relative"] is None else float(d["relative"]) for d in deviations]
    finite = [r for r in relative if r is not None]
    whole = bool(finite) and len(finite) == len(relative)
    worst = max(deviations, key=lambda d: _size(d["relative"]), default=None)
    problems = [str(p) for p in row["problems"]]
    interface = _SHORT.get(about["interface"], about["interface"])
    where = f"{about['host']} on {about['platform']}" if about["platform"] else about["host"]
    words = [Path(name).stem, interface, about["host"].split()[0], about["platform"]]
    return Result(
        id=f"{GROUP}." + re.sub(r"[^A-Za-z0-9_]+", "-", "-".join(filter(None, words))).strip("-"),
        group=GROUP,
        title=f"{name}, FMI {about['fmi_version']} {interface}, in {where}",
        statement="the outputs of the FMU are those of the direct simulator",
        regime="slow, small waves on every input",
        method="the FMU in a process of its own beside the simulator, with equal inputs and steps",
        grade="D",
        error=max(finite) if whole else None,
        tolerance=float(row["tolerance"]),
        unit="relative",
        reason="over the size of the output: round-off where both step alike, else the solver's",
        status="passed" if row["passed"] and not problems else "failed",
        samples=int(row["steps"]),
        seed=0,
        worst={"output": worst["group"], "at": f"{worst['time']:g} s"} if worst else {},
        evidence="; ".join(problems) or "valid, and no output deviates further",
        functions=("kr16cli.fmi.machine.Machine",),
        figures={"file": name, "interface": interface, **_shown(about), "deviations": deviations},
    )


def _size(relative: float | None) -> float:
    return float("inf") if relative is None else float(relative)


def _shown(about: Mapping[str, str]) -> dict[str, str]:
    return {key: about[key] for key in ("fmi_version", "host", "platform")}


def _skipped(name: str, reason: str) -> Result:
    return Result(
        id=f"{GROUP}.{Path(name).stem}", group=GROUP, title=f"{name}, built from the robot",
        statement="the outputs of the FMU are those of the direct simulator", regime="", method="",
        grade="D", error=None, tolerance=1e-9, unit="relative", reason="round-off",
        status="skipped", samples=0, seed=0, worst={}, evidence=reason,
    )  # fmt: skip
