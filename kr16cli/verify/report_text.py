"""Results as JSON entries, as a table, and as JUnit XML; nothing is computed here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from kr16cli.verify.records import Case, Result


def counts(results: Sequence[Result]) -> dict[str, int]:
    """How many passed, failed and were skipped."""
    return {
        status: sum(r.status == status for r in results)
        for status in ("passed", "failed", "skipped")
    }


def entry(result: Result, *, figures: bool = False) -> dict[str, Any]:
    """One of `result.cases`; with `figures`, the numbers that a report draws too."""
    drawn = {"figures": plain(result.figures)} if figures else {}
    return drawn | {
        "id": result.id,
        "group": result.group,
        "title": result.title,
        "statement": result.statement,
        "regime": result.regime,
        "method": result.method,
        "grade": result.grade,
        "error": result.error,
        "tolerance": result.tolerance,
        "unit": result.unit,
        "reason": result.reason,
        "status": result.status,
        "samples": result.samples,
        "seed": result.seed,
        "worst": plain(result.worst),
        "evidence": result.evidence,
        "equations": list(result.equations),
        "functions": list(result.functions),
    }


def plain(value: Any) -> Any:
    """Mappings, tuples and NumPy numbers as JSON has them; what is not finite is null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def table(results: Sequence[Result]) -> str:
    """Cases by suite with error, tolerance, grade and status; failures in full at the end."""
    lines: list[str] = []
    width = max((len(r.id) for r in results), default=0)
    for i, r in enumerate(results):
        if i == 0 or r.group != results[i - 1].group:
            lines += ["", r.group]
        lines.append(f"  {r.id:<{width}}  {r.grade}  {_measured(r)}  {r.status}")
    for r in results:
        if r.status == "failed":
            lines += ["", *_failure(r)]
    lines += ["", summary(results)]
    reasons = sorted({r.evidence for r in results if r.status == "skipped"})
    lines += [f"skipped: {reason}" for reason in reasons]
    return "\n".join(lines).lstrip("\n") + "\n"


def summary(results: Sequence[Result]) -> str:
    """The verdict in a line."""
    n = counts(results)
    grades = ", ".join(
        f"{grade} {sum(r.grade == grade and r.status != 'skipped' for r in results)}"
        for grade in "ABCD"
    )
    return f"{n['passed']} passed, {n['failed']} failed, {n['skipped']} skipped; grades: {grades}"


def _measured(r: Result) -> str:
    error = "        " if r.error is None else f"{r.error:8.1e}"
    return f"{error} of {r.tolerance:7.1e} {r.unit:<22.22}"


def _failure(r: Result) -> list[str]:
    found = "nothing was measured" if r.error is None else f"{r.error:.6g} {r.unit}"
    lines = [
        f"FAILED {r.id}: {r.title}",
        f"  claim     {r.statement}",
        f"  found     {found}, tolerance {r.tolerance:g}: {r.evidence}",
    ]
    for key, value in r.worst.items():
        shown = ", ".join(map(repr, value)) if isinstance(value, list) else value
        lines.append(f"  {key:<9} {shown}")
    return lines


def listing(cases: Sequence[Case]) -> str:
    """The cases without running them."""
    width = max((len(c.id) for c in cases), default=0)
    return "".join(f"{c.id:<{width}}  {c.grade}  {c.title}\n" for c in cases)


def junit(results: Sequence[Result], name: str) -> str:
    """JUnit XML, one testsuite per group; times are left out, so that equal runs are equal."""
    root = ET.Element("testsuites", name=name)
    groups = list(dict.fromkeys(r.group for r in results))
    for group in groups:
        own = [r for r in results if r.group == group]
        n = counts(own)
        suite = ET.SubElement(
            root,
            "testsuite",
            name=group,
            tests=str(len(own)),
            failures=str(n["failed"]),
            skipped=str(n["skipped"]),
            errors="0",
        )
        for r in own:
            test = ET.SubElement(suite, "testcase", classname=f"kr16.{group}", name=r.id)
            if r.status == "failed":
                failure = ET.SubElement(test, "failure", message=f"{r.title}: {r.evidence}")
                failure.text = "\n".join(_failure(r))
            elif r.status == "skipped":
                ET.SubElement(test, "skipped", message=r.evidence)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
