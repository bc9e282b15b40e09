"""What the robot's numbers are worth: gravity torques with bands, and what moves them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kr16cli.report import study_figures
from kr16cli.report.content import Content
from kr16cli.report.page import LEFT, RIGHT, Document
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.typeset import BOLD

_MOVES = 0.0005
"""A parameter with less of every variance is counted, not listed."""


def trust(document: Document, content: Content) -> None:
    """Bands of the gravity torques, and which parameter matters most."""
    answer = content.drawing("trust")
    result = answer["result"]
    gravity, joints = result["gravity"], result["joints"]
    lead = joints.index(result["leading_joint"])
    nominal, sigma = (gravity[k][0][lead] for k in ("nominal", "sigma_first_order"))
    title = (
        f"What the numbers are worth: the stretched arm's {joints[lead]} holds {abs(nominal):.0f} "
        f"± {2.0 * sigma:.0f} N m"
    )
    page = document.page(title)
    page.paragraph(
        f"{len(result['parameters'])} numbers of the parameter file carry a tolerance, read as a "
        f"95 % interval. {result['samples']:,} robots were drawn from them (normal, seed "
        f"{answer['input']['seed']}) and the whole model run for each; apart from that, exact "
        "derivatives give the spread to first order. These are bands of the model's estimates; no "
        "robot was measured."
    )
    middle = LEFT + 190.0
    left = page.axes(126, LEFT + 40, middle, move=False)
    study_figures.gravity_bands(left, result)
    left.legend(loc="upper left", bbox_to_anchor=(-0.15, -0.12), ncols=2)
    study_figures.importance_bars(page.axes(126, middle + 138, RIGHT - 6, below=40), result)
    poses = "; ".join(_pose(q) for q in result["poses_deg"])
    page.caption(
        f"Left: a mark each for A = {poses} deg, in this order. Right: at the first of them; "
        "Sobol's total index counts what a parameter does together with others, too. Samples and "
        f"first order differ by at most {100 * gravity['disagreement']:.2g} % of the largest "
        f"standard deviation. {_notes(answer['warnings'])}"
    )
    page.heading("Gravity torques, N m, where a tolerance moves them")
    columns = (Column("at A, deg", 120), Column("joint", 30), *(
        Column(head, 52, "right") for head in ("nominal", "2.5 %", "97.5 %", "sigma", "first order")
    ))  # fmt: skip
    page, _ = table(document, page, title, columns, _torques(result), size=8, pad=1.0)
    page.heading("Which number matters most: share of the variance, %")
    shown = [j for j in range(len(joints)) if any(_total(r, j) > _MOVES for r in _listed(result))]
    columns = (
        Column("number", 82), Column("tolerance", 60, "right"),
        Column(f"{joints[lead]}, first order", 52, "right"),
        Column(f"{joints[lead]}, Sobol", 40, "right"),
        *(Column(f"{joints[j]}, total", 28, "right") for j in shown),
    )  # fmt: skip
    rows = [_share_row(r, lead, shown) for r in _listed(result)]
    page, _ = table(document, page, title, columns, rows, size=8, pad=1.0)
    still = len(result["parameters"]) - len(rows)
    page.y += 6
    page.caption(
        f"At the first pose; {still} further numbers have less than {100 * _MOVES:g} % of any "
        "joint's variance: "
        "inertias move no gravity torque, only motions. The same from the command line: "
        f"{_command(answer)}."
    )


def _pose(q: Sequence[float]) -> str:
    return "(" + ", ".join(f"{v:g}" for v in q) + ")"


def _notes(warnings: Sequence[str]) -> str:
    return " ".join(f"{w[0].upper()}{w[1:]}." for w in warnings)


def _torques(result: Mapping[str, Any]) -> list[list[str | Cell]]:
    """A row for each pose and joint whose torque varies."""
    gravity, rows = result["gravity"], list[list[str | Cell]]()
    for i, pose in enumerate(result["poses_deg"]):
        for j, name in enumerate(result["joints"]):
            if gravity["sigma_first_order"][i][j] > 1e-9:
                cells = [f"{gravity[k][i][j]:.1f}" for k in ("nominal", "low", "high")]
                cells += [f"{gravity[k][i][j]:.2f}" for k in ("sigma", "sigma_first_order")]
                rows.append([_pose(pose), Cell(name, BOLD), *cells])
    return rows


def _total(row: Mapping[str, Any], joint: int) -> float:
    return max(float(row[f"gravity_{k}"][joint]) for k in ("sobol_total", "first_order"))


def _listed(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The numbers that move some joint's torque, in the record's order: most important first."""
    count = range(len(result["joints"]))
    return [r for r in result["parameters"] if max(_total(r, j) for j in count) >= _MOVES]


def _share_row(row: Mapping[str, Any], lead: int, shown: Sequence[int]) -> list[str | Cell]:
    unit = row["unit"]
    half = f"± {100 * row['half']:g} %" if unit == "relative" else f"± {row['half']:g} {unit}"
    one = (row[f"gravity_{k}"][lead] for k in ("first_order", "sobol_first"))
    shares = [*one, *(row["gravity_sobol_total"][j] for j in shown)]
    return [Cell(row["name"], BOLD), half, *(f"{100 * max(v, 0.0):.1f}" for v in shares)]


def _command(answer: Mapping[str, Any]) -> str:
    poses = " ".join(
        "--q '" + " ".join(f"{v:g}" for v in q) + "'" for q in answer["result"]["poses_deg"]
    )
    asked = answer["input"]
    return f"kr16 uncertainty {poses} --samples {asked['samples']} --seed {asked['seed']}"
