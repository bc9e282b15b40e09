"""What `kr16 uncertainty` takes and gives: its options, files, and the summary as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.cli import batch, render, studies, values
from kr16cli.errors import InputError

if TYPE_CHECKING:
    from kr16cli.robot import RobotData
    from kr16cli.study.uncertainty import UncertaintyWork

_HOME_DEG = (0.0, -90.0, 90.0, 0.0, 0.0, 0.0)

Samples = Annotated[
    str, typer.Option("--samples", metavar="N", help="Robots drawn from the tolerances.")
]
Seed = Annotated[str, typer.Option("--seed", metavar="S", help="Of the random numbers.")]
Distribution = Annotated[
    str,
    typer.Option(
        "--distribution",
        metavar="KIND",
        help="normal: 95 % within the tolerance; or uniform over it.",
    ),
]
Poses = Annotated[
    list[str] | None,
    typer.Option(
        "--q",
        metavar="A1 A2 A3 A4 A5 A6",
        help="Where gravity torque and M are asked, deg (rad); may be repeated; default: home.",
    ),
]
Scene = Annotated[
    str | None,
    typer.Argument(metavar="[SCENARIO]", help="Bands along its motion, too: a file or a name."),
]


def work(p: Mapping[str, Any], data: RobotData) -> UncertaintyWork:
    """The study that options ask for."""
    import numpy as np

    from kr16cli import units
    from kr16cli.simulate.scenario import load_scenario
    from kr16cli.study.uncertainty import work_for

    si, kind = p["si"], p["distribution"]
    if kind not in ("normal", "uniform"):
        raise InputError(f"--distribution is {kind}; it must be normal or uniform")
    given = [values.joints(text, "--q", si=si) or [] for text in p["q"] or ()]
    poses = [q if si else [units.rad(v) for v in q] for q in given]
    load = values.payload(p["payload"], p["load_data"], si=si)
    if p["scene"] is not None and (load is not None or p["drives"]):
        raise InputError("a scenario says payload and drives itself; leave out the options")
    return work_for(
        data,
        np.array(poses or [[units.rad(v) for v in _HOME_DEG]]),
        values.whole(p["samples"], "--samples", 2, 10**9) or 2,
        seed=values.whole(p["seed"], "--seed", 0, 2**63) or 0,
        distribution=kind,
        scenario=None if p["scene"] is None else load_scenario(p["scene"]),
        payload=load,
        drives=p["drives"],
    )


def make(p: Mapping[str, Any], data: RobotData) -> None:
    """Draw the robots, compare both ways, write, and tell the summary."""
    asked = work(p, data)
    file = studies.data_file(p, (".npz",))
    with studies.picture(p, p["output"]) as draw, studies.carried_out(p, asked, file) as store:
        from kr16cli.study import trust

        answer = trust.answer(asked, store)
        if file is not None:
            trust.write(file, asked, store, answer)
        if draw is not None:
            from kr16cli.report.study_figures import trust_drawn

            draw(trust_drawn(answer, str(p["plot"])))
    studies.tell(p, file, answer, table)
    batch.warn(answer["warnings"])


def table(answer: Mapping[str, Any]) -> str:
    """The summary as text."""
    result, joints = answer["result"], answer["result"]["joints"]
    lines = [
        f"{answer['robot']}: {result['samples']} robots drawn, "
        f"{answer['input']['distribution']}; bands hold 95 %"
    ]
    gravity = result["gravity"]
    for i, pose in enumerate(result["poses_deg"]):
        at = " ".join(f"{v:g}" for v in pose)
        lines.append(f"gravity torque, N m, at {at} deg")
        lines += render.grid(
            ["", "nominal", "low", "high", "sigma", "first order"],
            [[name, *_cells(gravity, (i, j))] for j, name in enumerate(joints)],
        )
    lines.append("mass matrix, kg m2, at the first pose")
    lines += render.grid(
        ["", "nominal", "low", "high", "sigma", "first order"],
        [[f"M{j + 1}{j + 1}", *_cells(result["mass_matrix"], (j, j))] for j in range(6)],
    )
    if "torque" in result:
        lines.append("largest half width of the band along the motion")
        heads = ["", "torque, N m", *(["path, rad"] if "motion" in result else [])]
        lines += render.grid(heads, _widths(result, joints))
    lines.append(
        "sigma of the samples and first order differ by "
        + ", ".join(
            f"{100 * result[n]['disagreement']:.2g} % ({n.replace('_', ' ')})"
            for n in ("gravity", "mass_matrix", "torque")
            if n in result
        )
    )
    if result.get("agree_until"):
        lines.append(f"  and for the path by less than 10 % until {result['agree_until']:.4g} s")
    return "\n".join([*lines, *_parameters(result), ""])


def _cells(column: Mapping[str, Any], at: Sequence[int]) -> list[str]:
    def entry(name: str) -> float:
        value = column[name]
        for i in at:
            value = value[i]
        return float(value)

    names = ("nominal", "low", "high", "sigma", "sigma_first_order")
    return [f"{round(entry(name), 4) + 0.0:.5g}" for name in names]


def _widths(result: Mapping[str, Any], joints: Sequence[str]) -> list[list[str]]:
    rows = []
    for j, name in enumerate(joints):
        row = [name]
        for column in ("torque", "motion"):
            if column in result:
                low, high = result[column]["low"], result[column]["high"]
                width = max(0.5 * (h[j] - w[j]) for w, h in zip(low, high, strict=True))
                row.append(f"{round(width, 6) + 0.0:.4g}")
        rows.append(row)
    return rows


def _parameters(result: Mapping[str, Any]) -> list[str]:
    """Which parameter matters most: shares of the variance of the leading joint's torque."""
    joint = result["joints"].index(result["leading_joint"])
    along = "torque_first_order" in result["parameters"][0]
    heads = ["", "tolerance", "", "first order", "Sobol", "Sobol total"]
    rows = []
    for row in result["parameters"]:
        numbers = [
            row[f"gravity_{k}"][joint] for k in ("first_order", "sobol_first", "sobol_total")
        ] + ([row["torque_first_order"][joint]] if along else [])
        if max(numbers) >= 0.0005:
            shares = [f"{100 * max(v, 0.0):.1f}" for v in numbers]
            relative = row["unit"] == "relative"
            half = f"{100 * row['half']:g}" if relative else f"{row['half']:g}"
            rows.append([row["name"], half, "%" if relative else row["unit"], *shares])
    title = f"share of the variance of the gravity torque of {result['leading_joint']}, %"
    if along:
        heads.append("along motion")
    return [f"what matters most: {title}", *render.grid(heads, rows)]
