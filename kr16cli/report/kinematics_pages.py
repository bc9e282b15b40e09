"""Pages on poses, inverse kinematics, Jacobians, singularities and the workspace."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli.report import figures, robot_figures
from kr16cli.report.content import Content, LackingError
from kr16cli.report.page import FULL, LEFT, Document, Page
from kr16cli.report.style import number
from kr16cli.report.suite_tables import claims, headline, sampled, worst_point
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.typeset import BOLD, MONO, PLAIN, Face, wrap


def forward(document: Document, content: Content) -> None:
    """Forward kinematics: independent formulations and published poses."""
    results = content.of("kinematics")
    title = headline(
        results,
        "Forward kinematics agrees with an independent formulation and published poses",
        "forward kinematics",
    )
    page = document.page(title)
    page.paragraph(
        "The closed form (3.3) to (3.6), corrected, is compared with the product of the transforms "
        "of Table 3.1 and with a product of exponentials that shares no code with the model."
    )
    page = claims(document, page, title, results)
    worst = max(results, key=lambda r: r.margin or 0.0, default=None)
    if worst is not None:
        page.caption(worst_point(worst))
    if "known_poses" in content.drawings:
        page = document.with_room(page, 110, title)
        page.heading("Published poses")
        columns = (Column("A1 … A6, deg", 110), Column("published X Y Z, mm; A B C, deg", 140),
                   Column("model", 120), Column("source", 100))  # fmt: skip
        rows = [
            [
                " ".join(f"{v:g}" for v in row["q_deg"]),
                " ".join(v or "-" for v in row["published"]),
                " ".join(f"{v:.4g}" for v in row["model"]),
                row["source"],
            ]
            for row in content.drawing("known_poses")["rows"]
        ]
        table(document, page, title, columns, rows)


def closure(document: Document, content: Content) -> None:
    """Inverse kinematics: closing errors in every regime, and how many solutions."""
    results = content.of("inverse")
    drawn = [r for r in results if r.id.startswith("inverse.closure.") and r.figures]
    if not drawn:
        raise LackingError("the results carry no closing errors of inverse kinematics")
    samples = sum(r.samples for r in drawn)
    title = headline(
        results,
        f"Every solution reproduces its pose: {samples:,} poses, at and around every singularity",
        "inverse kinematics",
    )
    page = document.page(title)
    columns, height, gap = 3, 56.0, 26.0
    wide = (FULL - 24 - 2 * gap) / columns
    for start in range(0, len(drawn), columns):
        for k, r in enumerate(drawn[start : start + columns]):
            left = LEFT + 22 + k * (wide + gap)
            axis = page.axes(height, left, left + wide, above=24, below=22, move=False)
            regime = r.title.partition(": ")[2] or r.regime
            figures.residual_histogram(
                axis,
                r.figures["log10_error"],
                r.figures["count"],
                r.tolerance,
                "\n".join(wrap(regime, wide, 8.0)[:2]),
            )
            if k == 0:
                axis.set_ylabel("poses", fontsize=7.5)
            if start + columns >= len(drawn):
                axis.set_xlabel("log10 of the error", fontsize=7.5, labelpad=1)
        page.y += height + 45
    page.y += 8
    page.y += 2
    page.caption(
        "Closing error of the worst branch of each pose as log10 of m and rad; dashed: tolerance. "
        f"Errors of 1e-17 and less stand at -17. n = {drawn[0].samples:,} in each regime, seed "
        f"{drawn[0].seed}. Near a singular family a distance below 1e-10 counts as on it, which "
        "moves the pose by as much."
    )
    worst = max(drawn, key=lambda r: r.margin or 0.0)
    page.caption(worst_point(worst))
    complete = next((r for r in results if r.id == "inverse.complete" and r.figures), None)
    if complete is not None:
        page = document.with_room(page, 130, title)
        axis = page.axes(78)
        figures.counts(
            axis, complete.figures["solutions"], complete.figures["poses"], "solutions of a pose"
        )
        axis.set_title("A pose has 0, 4 or 8 solutions, as an independent root finder counts")
        page.caption(f"Poses of random configurations and random poses; {sampled(complete)}.")
    page = document.page(title + ": all checks")
    claims(document, page, title, results)


def branches(document: Document, content: Content) -> None:
    """Eight solutions of one pose as stick figures."""
    drawing = content.drawing("branches")
    count = int(np.sum(drawing["found"]))
    page = document.page(f"One pose, {count} configurations: arm, elbow, wrist each either way")
    pose = " ".join(f"{v:.3f}" for v in drawing["pose_mm_deg"])
    page.paragraph(f"kr16 ik {pose}", face=Face(MONO), size=8)
    points = np.asarray(drawing["points"])[np.asarray(drawing["found"])]
    arrows = np.asarray(drawing["a5_ends"])[np.asarray(drawing["found"])]
    ends = np.concatenate(
        [points.reshape(-1, 2), arrows.reshape(-1, 2), np.asarray(drawing["floor"])]
    )
    low, high = ends.min(axis=0) - 0.08, ends.max(axis=0) + 0.08
    wide = FULL / 4 - 6
    height = min(wide * (high[1] - low[1]) / (high[0] - low[0]), 240.0)
    for k in range(8):
        left = LEFT + (k % 4) * (FULL / 4 + 2)
        axis = page.axes(height, left, left + wide, above=0, move=False)
        robot_figures.branch(axis, drawing, k, ((low[0], high[0]), (low[1], high[1])))
        _describe(page, drawing, k, left, page.y + height + 2)
        if k == 3:
            page.y += height + 62
    page.y += height + 58
    page.caption(
        "Oblique view. Square: flange, the same in all; arrow: the A5 axis, which a wrist flip "
        "turns round. Order: index = 4 arm + 2 elbow + wrist. S and T are computed by rule."
    )


def _describe(page: Page, drawing: Any, k: int, left: float, y: float) -> None:
    if not drawing["found"][k]:
        page.write(left, y, f"{k}: no solution", size=7.5)
        return
    outside = drawing["outside"][k]
    q = [f"{v:.1f}" for v in drawing["q_deg"][k]]
    lines = (
        f"{k}: S {drawing['status'][k]}, T {drawing['turn'][k]}",
        f"OUTSIDE LIMITS: {', '.join(outside)}" if outside else "within limits",
        f"A1 … A3  {' '.join(q[:3])}",
        f"A4 … A6  {' '.join(q[3:])}",
    )
    for i, line in enumerate(lines):
        page.write(left, y + 10 * i, line, size=7.5, face=BOLD if outside and i == 1 else PLAIN)


def jacobian(document: Document, content: Content) -> None:
    """Velocity kinematics: the V of central differences, and the checks."""
    results = content.of("velocity")
    r = content.result("velocity.difference")
    title = headline(
        results, "The Jacobian is the derivative of the pose, to rounding", "velocity kinematics"
    )
    page = document.page(title)
    axis = page.axes(230, LEFT + 48)
    figures.difference_curve(axis, r.figures["step"], r.figures["error"], r.tolerance)
    axis.set_title("Central differences approach it with h², until rounding takes over as 1/h")
    page.caption(f"Differences of the model's own fk; {sampled(r)}. {worst_point(r)}")
    claims(document, page, title, results)


_MAPS = (
    ("smallest", "smallest singular value, m or 1", False, None),
    ("condition", "condition number (cut at 1e4)", True, (1.0, 1e4)),
    ("determinant", "manipulability |det J|, m³", False, None),
)


def singularities(document: Document, content: Content) -> None:
    """Maps of manipulability, condition and smallest singular value."""
    drawing = content.drawing("singularity_maps")
    page = document.page("Three families of singularities, and nothing else, make J lose rank")
    wide = (FULL - 62) / 2
    for name, words, log, cut in _MAPS:
        for k, s in enumerate(drawing["slices"]):
            left = LEFT + 34 + k * (wide + 34)
            axis = page.axes(148, left, left + wide - 32, above=18, below=30, move=False)
            labels = (f"{s['x']}, deg", f"{s['y']}, deg")
            figures.heat_map(axis, s["x_deg"], s["y_deg"], s[name], labels, words, log=log, cut=cut)
            families = {key: s[key] for key in ("shoulder", "elbow", "wrist")}
            figures.zero_lines(axis, s["x_deg"], s["y_deg"], families)
        page.y += 148 + 54
    held = [
        ", ".join(f"A{i + 1} = {v:g}" for i, v in enumerate(s["held_deg"])
                  if f"A{i + 1}" not in (s["x"], s["y"]))
        for s in drawing["slices"]
    ]  # fmt: skip
    page.caption(
        "Red lines: shoulder (solid: wrist centre on the A1 axis), elbow (dashed: arm stretched or "
        "folded), wrist (dotted: A5 = 0), where a factor of (3.37) vanishes. Singular values set "
        f"1 m against 1 rad. Left: {held[0]} deg; right: {held[1]} deg; n = "
        f"{drawing['samples']:,} each, ranges of the joints."
    )


def workspace(document: Document, content: Content) -> None:
    """Section of the workspace with published figures."""
    drawing = content.drawing("workspace")
    rows = drawing["figures"]
    off = [r for r in rows if abs(r["computed"] - r["value"]) > r["tolerance"]]
    if off:
        title = f"FAILED: {len(off)} of {len(rows)} published figures of the envelope differ"
    elif rows:
        title = "The working envelope has the published figures"
    else:
        title = "The working envelope at A1 = 0"
    page = document.page(title)
    axis = page.axes(330 if rows else 450, below=78)
    robot_figures.section(axis, drawing)
    by_name = {r["figure"]: r for r in rows}
    if by_name:
        for name, sign in (("reach", 1.0), ("rear_reach", -1.0)):
            axis.axvline(sign * by_name[name]["value"] / 1e3, color="#555555", lw=0.8, ls=":")
            axis.annotate(
                f"{name.replace('_', ' ')} {by_name[name]['value']:g}",
                (sign * by_name[name]["value"] / 1e3, -0.42), (-3 * sign, 2),
                textcoords="offset points", fontsize=8, rotation=90,
                ha="right" if sign > 0 else "left", va="bottom",
            )  # fmt: skip
        top = by_name["wrist_height"]["value"] / 1e3
        axis.axhline(top, color="#555555", lw=0.8, ls=":")
        axis.annotate(f"wrist height {by_name['wrist_height']['value']:g}", (-0.95, top), (0, 3),
                      textcoords="offset points", fontsize=8)  # fmt: skip
    axis.set_ylim(-0.45, 2.2)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, handlelength=3.2)
    page.caption(
        "Wrist centre at A1 = 0; shaded: reached by some A2, A3 within limits; lines: where a "
        "limit or the stretched arm holds; dotted: published figures, mm. Grey: the arm at home."
    )
    if rows:
        _figures(document, page, title, rows)
    results = content.of("datasheet")
    if results:
        page = document.with_room(document.pages[-1], 80, title)
        page.heading("All checks against published numbers")
        claims(document, page, title, results)


def _figures(document: Document, page: Page, title: str, rows: Any) -> None:
    columns = (Column("figure", 144), Column("published", 50, "right"),
               Column("computed", 50, "right"), Column("difference", 50, "right"),
               Column("tolerance", 44, "right"), Column("unit", 22), Column("status", 52),
               Column("source", 32))  # fmt: skip
    cells = []
    for r in rows:
        difference = r["computed"] - r["value"]
        bad = abs(difference) > r["tolerance"]
        word = Cell(f"{difference:+.2f}" + (" FAILED" if bad else ""), BOLD if bad else PLAIN)
        cells.append(
            [r["means"], f"{r['value']:g}", f"{r['computed']:.2f}", word, number(r["tolerance"]),
             r["unit"], r["status"], r["source"]]
        )  # fmt: skip
    table(document, page, title, columns, cells, size=7)
