"""The page of measured times, where a bench file was given."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.report import figures
from kr16cli.report.content import Content, LackingError
from kr16cli.report.page import FULL, LEFT, RIGHT, Document, Page
from kr16cli.report.style import number
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.times import Bench, Timing


def speed(document: Document, content: Content) -> None:
    """Times of every quantity beside other engines, and their ratios as bars."""
    bench = content.evidence.bench
    if bench is None:
        raise LackingError("no times were given; kr16 bench --peers --json measures them")
    title = _title(bench)
    page = document.page(title)
    page.paragraph(
        "Wall time per configuration. Batch: one thread, into an array of the caller's; threads: "
        f"the same on {bench.threads}; one call: a single configuration from Python. Ratio: the "
        "fastest peer's time over the batch's; call: a call of Pinocchio over a call. Peers run "
        "in the way their column names."
    )
    page.paragraph(f"Measured with: {bench.machine}.", size=8)
    if len(bench.limits) == 3:
        arithmetic, read, written = (f"{v:.0f}" for v in bench.limits)
        page.paragraph(
            f"Measured limits of one core: {arithmetic}e9 operations/s, {read} GB/s read, "
            f"{written} GB/s written. Of limit: the time the one that binds leaves none below, "
            "over the time taken.",
            size=8,
        )
    _bars(page, bench.rows)
    page, _ = table(document, page, title, *_own(bench), size=7)
    others = sorted({name for t in bench.rows for name in t.peers})
    if len(others) > 1:
        page = document.with_room(page, 120, title)
        page.heading("All peers, ns")
        wide = (FULL - 84 - 7 * len(others)) / len(others)
        heads = [Column("quantity", 84), *(Column(name, wide, "right") for name in others)]
        rows: list[list[str | Cell]] = [
            [t.name, *(f"{t.peers[n]:,.1f}" if n in t.peers else "-" for n in others)]
            for t in bench.rows
        ]
        page, _ = table(document, page, title, heads, rows, size=7)
    page.bullets(list(bench.warnings), size=8)


def _bars(page: Page, rows: Sequence[Timing]) -> None:
    """Ratios to the fastest peer, and beside them the shares of what the core allows."""
    compared = [t for t in rows if t.ratio is not None]
    if not compared:
        return
    height, left, middle = 19.0 * len(compared), LEFT + 112, LEFT + 318
    shares = [t.share for t in compared if t.share is not None]
    both = len(shares) == len(compared)
    axis = page.axes(height, left, middle if both else RIGHT - 6, move=not both)
    names = [f"{t.name}: {t.fastest or ''}".replace(", ", ",\n") for t in compared]
    ratios = [t.ratio or 0.0 for t in compared]
    figures.ratio_bars(axis, names, ratios, "ratio (dashed: equal)", least=1.0)
    axis.set_title("Times faster than the fastest peer")
    if both:
        axis = page.axes(height, middle + 24, RIGHT - 6)
        figures.ratio_bars(axis, [""] * len(compared), shares, "share (dashed: limit)")
        axis.set_title("Share of the limit of one core")


def _own(bench: Bench) -> tuple[list[Column], list[list[str | Cell]]]:
    """The table of this library's times."""
    columns = [
        Column("quantity", 76), Column("batch, ns", 36, "right"),
        Column(f"{bench.threads} threads, ns", 40, "right"), Column("one call, ns", 40, "right"),
        Column("1e9 op/s", 30, "right"), Column("GB/s", 28, "right"),
        Column("of limit", 30, "right"), Column("fastest peer", 84), Column("ratio", 30, "right"),
        Column("ratio, call", 34, "right"),
    ]  # fmt: skip
    rows: list[list[str | Cell]] = [
        [t.name, *(f"{ns:,.1f}" for ns in (t.batch_ns, t.threads_ns, t.call_ns)), number(t.rate),
         number(t.moved), "-" if t.share is None else f"{100 * t.share:.0f} %", t.fastest or "-",
         number(t.ratio), number(t.call_ratio)]
        for t in bench.rows
    ]  # fmt: skip
    return columns, rows


def _title(bench: Bench) -> str:
    ratios = [t.ratio for t in bench.rows if t.ratio is not None]
    if not ratios:
        return "Measured times, as the bench file gives them"
    slow = sum(r < 1 for r in ratios)
    if slow:
        return f"Batches are slower than a peer in {slow} of {len(ratios)} quantities"
    return f"Batches are {min(ratios):.0f} to {max(ratios):.0f} times faster than any peer measured"
