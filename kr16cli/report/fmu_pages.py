"""The page of FMUs beside the simulator."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.report import figures
from kr16cli.report.content import Content, LackingError
from kr16cli.report.fmus import GROUP
from kr16cli.report.page import FULL, LEFT, Document
from kr16cli.report.style import RED, number
from kr16cli.report.suite_tables import headline, status_cell
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.typeset import BOLD, PLAIN
from kr16cli.verify.records import Result

_GAP = 7.0


def fmu(document: Document, content: Content) -> None:
    """Largest deviations of every FMU by group of outputs, and their share of the tolerance."""
    results = content.of(GROUP)
    ran = [r for r in results if r.status != "skipped"]
    if not results:
        raise LackingError("no FMU was checked; kr16 fmu check --json makes the record")
    if not ran:
        raise LackingError(results[0].evidence)
    title = headline(ran, "The FMU moves as the simulator does", "FMUs against the simulator")
    page = document.page(title)
    page.paragraph(
        "Each FMU runs in a process that cannot import kr16cli, with slow, small waves on every "
        "input; the direct simulator gets the same inputs at the same steps. 0: equal to the last "
        "bit. This shows that packing, interface and compiled code keep the model; that the model "
        "is right is for the other pages to show (grade D)."
    )
    if any(r.figures["host"] == "C host" for r in ran):
        page.paragraph(
            "CS is co-simulation. ME is model exchange, where the host steps: FMPy as its "
            "tolerance wants, the C host as the simulator does. The C host is a small program that "
            "loads the library as other tools do. It also serializes the state half-way, and "
            "passes only if another process goes on from there to the last bit."
        )
    groups = list(dict.fromkeys(d["group"] for r in ran for d in r.figures["deviations"]))
    if groups:
        axis = page.axes(18.0 * len(ran) + 36.0, LEFT + 146, below=52)
        figures.deviation_dots(
            axis,
            [_label(r) for r in ran],
            [{d["group"]: d["relative"] for d in r.figures["deviations"]} for r in ran],
            [r.tolerance for r in ran],
            groups,
        )
        axis.set_title("Largest deviation over the size of the output, with the tolerance")
    page.heading("Largest deviation of any output of a group")
    columns, rows = _table(ran, groups)
    page, _ = table(document, page, title, columns, rows, size=7, pad=2)
    units = {d["group"]: d["unit"] for r in ran for d in r.figures["deviations"]}
    page.caption(
        "Units: " + ", ".join(f"{g} {u}" for g, u in units.items()) + " (pose: m or rad). "
        "Tolerance: relative, of the size of the quantity. Steps: "
        + ", ".join(sorted({f"{r.samples:,}" for r in ran}))
        + "."
    )
    for r in ran:
        if r.status == "failed":
            page = document.with_room(page, 60, title)
            page.paragraph(f"FAILED {r.id}: {r.evidence}", size=8, color=RED, face=BOLD)


def _label(r: Result) -> str:
    f = r.figures
    return f"{f['file']}, {f['interface']}\n{f['host']}, {f['platform']}"


def _table(
    ran: Sequence[Result], groups: Sequence[str]
) -> tuple[list[Column], list[list[str | Cell]]]:
    """One row an FMU, host and interface; one column a group of outputs."""
    fixed = [Column("FMU", 62), Column("host, platform", 62)]
    ends = [Column("tolerance", 41, "right"), Column("status", 32)]
    used = sum(c.width + _GAP for c in (*fixed, *ends))
    wide = (FULL - used) / max(1, len(groups)) - _GAP if groups else 0.0
    columns = [*fixed, *(Column(g.replace("_", " "), wide, "right") for g in groups), *ends]
    rows: list[list[str | Cell]] = []
    for r in ran:
        f = r.figures
        found = {d["group"]: d for d in f["deviations"]}
        cells: list[str | Cell] = [
            f"{f['file']}, FMI {f['fmi_version']} {f['interface']}",
            f"{f['host']}, {f['platform']}",
        ]
        for g in groups:
            d = found.get(g)
            if d is None:
                cells.append("-")
                continue
            size = d["relative"]
            bad = size is None or size > r.tolerance
            value = "not finite" if d["largest"] is None else number(d["largest"])
            cells.append(Cell(value, BOLD if bad else PLAIN, RED) if bad else value)
        rows.append([*cells, number(r.tolerance), status_cell(r)])
    return columns, rows
