"""The pages a reader sees first: verdict, identity, poses, margins."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kr16cli import __version__
from kr16cli.report import figures, robot_figures
from kr16cli.report.content import Content
from kr16cli.report.page import HEIGHT, LEFT, RIGHT, WIDTH, Document, Page
from kr16cli.report.style import GREEN, INK, MUTED, RED, number
from kr16cli.report.suite_tables import measured, status_cell, worst_point
from kr16cli.report.table import Cell, Column, Row, pairs, table
from kr16cli.report.typeset import BOLD
from kr16cli.units import mm


def verdict(document: Document, content: Content) -> None:
    """One page that is enough for who reads no other."""
    page = document.page()
    page.write(LEFT, page.y, content.outline.title, size=20, face=BOLD)
    page.y += 30
    page.write(LEFT, page.y, content.data.name, size=14)
    page.y += 26
    _answer(page, content)
    _worst(document, page, content)
    _grades(page, content)
    page.heading("What is not shown")
    page.bullets([*content.words["not_shown"], *_left_undone(content)], size=8.5)
    page.paragraph(content.words["statement"], face=BOLD, size=8.5)
    page.heading("Identity")
    pairs(
        page,
        [
            ("robot", content.data.name),
            ("model, SHA-256", content.data.sha256),
            ("kr16cli", __version__),
            ("results", content.evidence.source),
            ("samples", _extent(content)),
            ("seed", "not stated" if content.evidence.seed is None else str(content.evidence.seed)),
            ("report of", f"{content.created:%Y-%m-%d}"),
        ],
    )


def _extent(content: Content) -> str:
    quick = content.evidence.quick
    drawn = sum(r.samples for r in content.results)
    kind = "" if quick is None else "quick run, " if quick else "full run, "
    return f"{kind}{drawn:,} samples in all" if drawn else "none"


def _answer(page: Page, content: Content) -> None:
    """The verdict in a word, with counts."""
    passed, failed, skipped = map(content.count, ("passed", "failed", "skipped"))
    ran = passed + failed
    page.panel(64, "#fbe9ec" if failed else "#eaf5ef" if ran else "#eeeeee")
    page.y += 9
    if failed:
        word, color = f"FAILED: {failed} of {ran} checks do not hold", RED
    elif ran:
        word, color = f"PASSED: all {ran} checks that ran hold", GREEN
    else:
        word, color = "NO CHECKS: this report only draws a recorded motion", INK
    page.write(LEFT, page.y, word, size=15, face=BOLD, color=color)
    page.y += 27
    page.write(
        LEFT,
        page.y,
        f"{passed} passed · {failed} failed · {skipped} skipped",
        size=10,
    )
    page.y += 38


def _left_undone(content: Content) -> list[str]:
    """What this very report lacks: skipped checks, samples a quick run saves."""
    skipped = [r for r in content.results if r.status == "skipped"]
    reasons = list(dict.fromkeys(r.evidence for r in skipped))
    said = []
    if skipped:
        more = "; others in the list of cases" if len(reasons) > 2 else ""
        said.append(f"Skipped, {len(skipped)}: {'; '.join(reasons[:2])}{more}.")
    if content.evidence.quick:
        said.append("A quick run: fewer samples and shorter motions than a full one.")
    return said


def _worst(document: Document, page: Page, content: Content) -> None:
    worst = [r for r in content.by_margin() if r.margin != 0][:3]
    if not worst:
        return
    page.heading(("Failed, or n" if content.count("failed") else "N") + "earest to failing")
    columns = (
        Column("check", 236), Column("error / tolerance", 110, "right"),
        Column("tolerance used", 76, "right"), Column("status", 52),
    )  # fmt: skip
    rows: list[list[str | Cell]] = [
        [
            r.title,
            measured(r),
            "not measured" if r.margin is None else f"{100 * r.margin:.0f} %",
            status_cell(r),
        ]
        for r in worst
    ]
    table(document, page, content.outline.title, columns, rows, size=8.5, pad=3)


def _grades(page: Page, content: Content) -> None:
    ran = [r for r in content.results if r.status != "skipped"]
    if not ran:
        return
    page.heading("How independent the evidence is")
    for letter, words in content.words["grades"]:
        count = sum(r.grade == letter for r in ran)
        page.write(LEFT, page.y, letter, size=9, face=BOLD)
        page.write(LEFT + 46, page.y, str(count), size=9, align="right")
        page.write(LEFT + 56, page.y, words, size=9)
        page.y += 12.5
    misprints = _misprints(content)
    if misprints:
        page.y += 3
        page.paragraph(misprints)


def _misprints(content: Content) -> str:
    rows = [e for r in content.of("chapter") for e in r.figures.get("equations", ())]
    if not rows:
        return ""
    wrong = sum(e["verdict"] == "misprint" for e in rows)
    unproved = sum(not e["proved"] for e in rows)
    proved = "Every verdict is proved, and the model agrees with each corrected form."
    if unproved:
        proved = f"{unproved} verdicts are NOT PROVED; see the pages on the chapter."
    return (
        f"The chapter this tool implements was audited statement by statement: {len(rows)} "
        f"statements, {wrong} of them misprints. {proved}"
    )


def identity(document: Document, content: Content) -> None:
    """Where every number comes from."""
    title = "Where the robot's numbers come from, and how far they can be trusted"
    page = document.page(title)
    about = content.identity()
    page.paragraph(
        f"{about['name']}, file {content.data.path.rsplit('/', 1)[-1]}. Source keys S1, S2, … are "
        "those of data/SOURCES.md. Status: datasheet (manufacturer's document), agreed (several "
        "public sources agree), sibling (of a near relative), derived (computed from others), "
        "estimated (an engineering guess), recalled (from memory of the data sheet). Units: as the "
        "key says, else m, kg, kg m2; rotor inertia kg m2 before the gear."
    )
    page.heading("Conflicts between sources")
    page.bullets(about["conflicts"] or ["None: the sources that were read agree."], size=8.5)
    page.heading("Groups of numbers")
    _data_table(document, page, title, about)


def _data_table(document: Document, page: Page, title: str, about: Mapping[str, Any]) -> None:
    columns = (
        Column("group", 42), Column("values", 196), Column("status", 46), Column("sources", 50),
        Column("other status of single numbers", 133),
    )  # fmt: skip
    rows = [
        [
            Cell(g["group"], BOLD),
            ", ".join(f"{k} {_value(v)}" for k, v in g["values"].items()),
            g["status"],
            " ".join(g["source"]),
            _others(g["overrides"]),
        ]
        for g in about["groups"]
    ]
    table(document, page, title, columns, rows, size=7, pad=1.6)


def _others(overrides: Mapping[str, Any]) -> str:
    """Keys of a group that differ from it, by status."""
    by_status: dict[str, list[str]] = {}
    for key, own in overrides.items():
        by_status.setdefault(own["status"], []).append(key)
    return "; ".join(f"{status}: {', '.join(keys)}" for status, keys in by_status.items()) or "-"


def _value(value: Any) -> str:
    if isinstance(value, list):
        return "[" + " ".join(_value(v) for v in value) + "]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def poses(document: Document, content: Content) -> None:
    """Frames, axes and lengths, drawn."""
    drawing = content.drawing("poses")
    page = document.page("Frames, positive senses and lengths: the zero pose and home")
    for k, height in ((1, 258.0), (0, 178.0)):
        axis = page.axes(height)
        points = drawing["points"][k]
        robot_figures.side_view(axis, points[:, [0, 2]])
        names = [f"A{i}" for i in range(1, 7)]
        robot_figures.joint_axes(
            axis, drawing["axis_points"][k], drawing["axis_directions"][k], names
        )
        robot_figures.triad(axis, (-0.68, 0.0), ("x", "z"), 0.2)
        if k == 1:
            _home_lengths(axis, points, drawing["lengths"])
        axis.set_xlim(-0.75, 1.95)
        axis.set_ylim(-0.12, 1.62 if k == 1 else 1.08)
        axis.set_xlabel("x of robroot, m")
        axis.set_ylabel("z of robroot, m")
        q = ", ".join(f"{v:g}" for v in drawing["q_deg"][k])
        pose = " ".join(
            f"{n} {v:g}" for n, v in zip("XYZABC", drawing["pose_mm_deg"][k], strict=True)
        )
        axis.set_title(f"{drawing['names'][k]}, A = ({q}) deg: flange {pose}", fontsize=8.5)
    page.caption(
        "Side view, y away from the reader; lengths in mm. Arrows: joint axes, turning positive by "
        "the right hand. Rings: axes across the plane, a cross points away from the reader (along "
        "+y). Square: flange. At the zero pose the upper arm lies level; home raises it."
    )
    _frames(document, page, drawing)


def _home_lengths(axis: Any, points: Any, lengths: Mapping[str, float]) -> None:
    at = {name: (p[0], p[2]) for name, p in zip("ocsebwf", points, strict=True)}
    text = {k: f"{k} {mm(v):g}" for k, v in lengths.items()}
    draw = robot_figures.dimension
    draw(axis, at["o"], at["c"], text["d1"], (-0.28, 0.0), "left")
    draw(axis, (0.0, at["s"][1]), at["s"], text["a1"], (0.0, -0.16))
    draw(axis, at["s"], (at["s"][0], at["e"][1]), text["a2"], (-0.2, 0.0), "left")
    draw(axis, (at["e"][0], at["w"][1]), at["w"], text["d4"], (0.0, -0.14))
    draw(axis, at["w"], at["f"], text["d6"], (0.0, -0.26), "after")
    draw(axis, (at["f"][0], at["w"][1]), (at["f"][0], at["e"][1]), text["a3"], (0.22, 0.0), "right")


def _frames(document: Document, page: Page, drawing: Mapping[str, Any]) -> None:
    columns = (Column("frame of Table 3.1, at home", 126), Column("origin x y z, mm", 112),
               Column("x axis", 76), Column("y axis", 76), Column("z axis", 76))  # fmt: skip
    rows = []
    for i, (origin, axes) in enumerate(
        zip(drawing["frame_origins"][1], drawing["frame_axes"][1], strict=True)
    ):
        cells = [" ".join(f"{round(v):+d}" if round(v) else "0" for v in a) for a in axes]
        rows.append([f"frame {i}", " ".join(f"{mm(v) + 0.0:.0f}" for v in origin + 0.0), *cells])
    table(document, page, "Frames", columns, rows, size=7.5, pad=1.2)


_MARGINS = (
    Column("case", 128), Column("grade", 26, "center"), Column("n", 38, "right"),
    Column("error", 44, "right"), Column("tolerance", 44, "right"), Column("unit", 62),
    Column("status", 36),
)  # fmt: skip
_BARS = LEFT + 426.0


def margins(document: Document, content: Content) -> None:
    """Every case that ran, worst margin first, with the margin as a bar."""
    ran = content.by_margin()
    if not ran:
        return
    failed = content.count("failed")
    worst = ran[0]
    if failed:
        title = f"FAILED: {failed} of {len(ran)} errors exceed their tolerance"
    else:
        share = 100 * (worst.margin or 0.0)
        title = f"Every error stays within its tolerance; the largest uses {share:.0f} % of it"
    page = document.page(title)
    page.paragraph(
        "Sorted by margin, error over tolerance. Bars on a log scale from 1e-9; the line marks "
        "the tolerance; hatched bars FAILED. Error 0: exact, or a count of wrong results that "
        "found none. Two units, as in m, 1: the larger of both parts, lengths and rotations."
    )
    rows: list[list[str | Cell]] = [
        [r.id, r.grade, f"{r.samples:,}", number(r.error), number(r.tolerance), r.unit,
         status_cell(r)]
        for r in ran
    ]  # fmt: skip
    _, landed = table(document, page, title, _MARGINS, rows, size=7, pad=1.3, keep=30)
    for sheet in dict.fromkeys(row.page for row in landed):
        here = [(row, r) for row, r in zip(landed, ran, strict=True) if row.page is sheet]
        _bars(sheet, here)
    last = landed[-1].page
    last = document.with_room(last, 40, title)
    last.y += 24
    last.caption(worst_point(worst))


def _bars(page: Page, here: list[tuple[Row, Any]]) -> None:
    top, bottom = here[0][0].middle - 8, here[-1][0].middle + 8
    axis = page.figure.add_axes(
        (_BARS / WIDTH, 1 - bottom / HEIGHT, (RIGHT - _BARS) / WIDTH,
         (bottom - top) / HEIGHT)
    )  # fmt: skip
    axis.set_ylim(bottom, top)
    figures.margin_bars(
        axis, [row.middle for row, _ in here], [r.margin for _, r in here],
        [r.status == "failed" for _, r in here],
    )  # fmt: skip
    axis.set_xlabel("error / tolerance", fontsize=7, color=MUTED)
