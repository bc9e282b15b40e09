"""Tables and sentences about cases that several pages share."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.report.page import Document, Page
from kr16cli.report.style import RED, STATUS_COLOUR, STATUS_WORD, number
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.typeset import BOLD, PLAIN
from kr16cli.verify.records import Result

_CLAIMS = (
    Column("claim", 148), Column("sampled", 122), Column("grade", 28, "center"),
    Column("n", 32, "right"), Column("worst / tolerance", 92, "right"), Column("status", 38),
)  # fmt: skip


def status_cell(result: Result) -> Cell:
    """The status in a word; a failure is also red and bold."""
    face = BOLD if result.status == "failed" else PLAIN
    return Cell(STATUS_WORD[result.status], face, STATUS_COLOUR[result.status])


def measured(result: Result) -> str:
    """Error over tolerance with unit."""
    return f"{number(result.error)} / {number(result.tolerance)} {result.unit}"


def headline(results: Sequence[Result], holds: str, subject: str) -> str:
    """A title that says the claim, or how many of its checks failed."""
    failed = sum(r.status == "failed" for r in results)
    ran = sum(r.status != "skipped" for r in results)
    if failed:
        return f"FAILED: {failed} of {ran} checks of {subject} do not hold"
    return holds if ran else f"Nothing was checked of {subject}"


def claims(document: Document, page: Page, title: str, results: Sequence[Result]) -> Page:
    """What each case claims, and how well it holds; failures explained below."""
    rows: list[list[str | Cell]] = []
    before = ""
    for r in results:
        claim = r.title.removesuffix(f": {r.regime}")  # the next column says it
        regime = "as above" if r.regime == before and len(before) > 24 else r.regime
        before = r.regime
        count = f"{r.samples:,}" if r.samples else "-"
        rows.append([claim, regime, r.grade, count, measured(r), status_cell(r)])
    page, _ = table(document, page, title, _CLAIMS, rows, size=7.2)
    for r in results:
        if r.status == "failed":
            page = document.with_room(page, 60, title)
            page.paragraph(f"FAILED {r.id}: {r.evidence}", size=8, color=RED, face=BOLD)
    return page


def sampled(result: Result) -> str:
    """Number of samples and seed, for a caption."""
    drawn = result.group != "fmu"  # its inputs are the same waves every time
    return f"n = {result.samples:,}" + (f", seed {result.seed}" if drawn else "")


def worst_point(result: Result) -> str:
    """The worst sample as a command to paste, or what else names it."""
    command = result.worst.get("command")
    if command:
        return f"Worst sample: {command}"
    named = ", ".join(f"{k} {v}" for k, v in result.worst.items())
    return f"Worst: {named}" if named else ""
