"""What `kr16 map` takes and gives: its options, the grid they make, the summary as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.cli import batch, render, studies, values
from kr16cli.errors import InputError

if TYPE_CHECKING:
    from kr16cli.robot import RobotData
    from kr16cli.study.maps import MapWork

QUANTITIES = ("reach", "manipulability", "condition", "torque", "payload")

Quantity = Annotated[
    str | None, typer.Argument(metavar="QUANTITY", help=f"One of {', '.join(QUANTITIES)}.")
]
Grid = Annotated[
    str, typer.Option("--grid", metavar="STEP", help="Spacing: 20mm, 0.02m, or a number in mm.")
]
X = Annotated[
    str | None, typer.Option("--x", metavar="LOW:HIGH", help="Range in mm; one number: a plane.")
]
Y = Annotated[str | None, typer.Option("--y", metavar="LOW:HIGH", help="As --x.")]
Z = Annotated[str | None, typer.Option("--z", metavar="LOW:HIGH", help="As --x.")]
Orientation = Annotated[
    str,
    typer.Option(
        "--orientation",
        metavar="KIND",
        help="fixed: --abc; list: several --abc, a layer each; free: best and worst of many.",
    ),
]
Abc = Annotated[
    list[str] | None,
    typer.Option(
        "--abc", metavar="A B C", help="Orientation in degrees; default 0 180 0, flange down."
    ),
]
Directions = Annotated[
    str, typer.Option("--directions", metavar="N", help="Directions of flange z tried if free.")
]
Rolls = Annotated[
    str, typer.Option("--rolls", metavar="N", help="Turns about each direction tried if free.")
]
Point = Annotated[
    str | None,
    typer.Option("--point", metavar="POINT", help="On the grid: flange, tool (--tool) or wrist."),
]
Length = Annotated[
    str,
    typer.Option("--length", metavar="L", help="Characteristic length of condition, mm: 1000."),
]


def work(p: Mapping[str, Any], data: RobotData) -> MapWork:
    """The map that options ask for."""
    from kr16cli import kuka
    from kr16cli.study import grid, maps

    quantity = p["quantity"]
    if quantity not in QUANTITIES:
        raise InputError(f"map of {quantity}: it must be one of {', '.join(QUANTITIES)}")
    kind, si = p["orientation"], p["si"]
    if kind not in ("fixed", "list", "free"):
        raise InputError(f"--orientation is {kind}; it must be fixed, list or free")
    tool = values.pose(p["tool"], "--tool", si=si)
    matrix = None if tool is None else kuka.matrix_from_pose(tool, si=si)
    point: Any = p["point"] or ("flange" if tool is None else "tool")
    if point not in ("flange", "tool", "wrist"):
        raise InputError(f"--point is {point}; it must be flange, tool or wrist")
    return maps.MapWork(
        data,
        quantity,
        grid.make_grid(
            data,
            _length(p["grid"], "--grid", si=si),
            ranges={axis: _range(p[axis], f"--{axis}", si=si) for axis in "xyz"},
            rotations=_rotations(p, kind, si=si),
            kind=kind,
            longer=0.0 if matrix is None else sum(row[3] ** 2 for row in matrix[:3]) ** 0.5,
        ),
        point=point,
        tool=None if matrix is None or point != "tool" else tuple(map(tuple, matrix)),
        payload=values.payload(p["payload"], p["load_data"], si=si),
        length=_length(p["length"], "--length", si=si),
    )


def _length(text: str, what: str, *, si: bool) -> float:
    """A length in m; without a unit in mm, or in m with --si."""
    from kr16cli import units

    number = text.strip()
    unit = next((unit for unit in ("cm", "mm", "km", "m") if number.endswith(unit)), "")
    if unit in ("cm", "km"):
        raise InputError(f"{what} is {text}; give it in mm or m, such as 20mm or 0.02m")
    value = values.number(number.removesuffix(unit), what)
    metres = unit == "m" or (si and not unit)
    return value if metres else units.metres(value)


def _range(text: str | None, what: str, *, si: bool) -> Sequence[float] | None:
    if text is None:
        return None
    parts = text.split(":")
    if len(parts) > 2:
        raise InputError(f"{what} is {text}; it must be LOW:HIGH or one number")
    return [_length(part, what, si=si) for part in parts]


def _rotations(p: Mapping[str, Any], kind: str, *, si: bool) -> Any:
    from kr16cli.study import grid

    if kind == "free":
        if p["abc"]:
            raise InputError("--abc and --orientation free exclude each other; give one")
        count = (values.whole(p[n], f"--{n}", 1, 10**6) or 1 for n in ("directions", "rolls"))
        return grid.all_around(*count)
    if kind == "fixed" and len(p["abc"] or ()) > 1:
        raise InputError("--orientation fixed takes one --abc; give --orientation list for more")
    angles = [values.numbers([t], "ABC", "--abc", of_option=True) for t in p["abc"] or ()]
    return grid.from_abc(angles, si=si) if angles else grid.from_abc([(0.0, 180.0, 0.0)])


def make(p: Mapping[str, Any], data: RobotData) -> None:
    """Compute the map, write it, draw it, and tell its summary."""
    asked = work(p, data)
    file = studies.data_file(p, (".npz",))
    with studies.picture(p, p["output"]) as draw, studies.carried_out(p, asked, file) as store:
        from kr16cli.study import map_facts, map_file

        answer = map_facts.answer(asked, store)
        if file is not None:
            map_file.write(file, asked, store, answer)
        if draw is not None:
            from kr16cli.report.map_figures import drawn

            draw(drawn(asked, store, answer["result"], str(p["plot"])))
    studies.tell(p, file, answer, lambda a: table(a, si=p["si"]))
    batch.warn(answer["warnings"])


def table(answer: Mapping[str, Any], *, si: bool = False) -> str:
    """The summary as text."""
    from kr16cli import units

    asked, result = answer["input"], answer["result"]
    unit, scale = ("m", 1.0) if si else ("mm", units.mm(1.0))

    def place(at: Mapping[str, Any]) -> str:
        where = " ".join(f"{scale * at[axis]:g}" for axis in "xyz")
        return where + (f", orientation {at['orientation'] + 1}" if "orientation" in at else "")

    lines = [
        f"{asked['quantity']} of {answer['robot']}: {result['rows']} points, {result['poses']} "
        f"poses, {asked['point']} on a grid of {scale * asked['step']:g} {unit}, orientation "
        f"{asked['orientation']}",
        f"reached within the limits: {result['reached']} ({100 * result['share']:.2f} %)",
        "branches within limits: "
        + ", ".join(f"{count} with {n}" for n, count in result["branches"].items()),
    ]
    if result["volume"] is not None:
        lines.append(f"volume of the cells reached: {result['volume']:.4g} m3")
    rows = [
        [
            name.replace("_", " "),
            *(f"{m[k]:.5g}" for k in ("least", "mean", "largest")),
            answer["units"][name],
            place(m["least_at"]),
            place(m["largest_at"]),
        ]
        for name, m in result["measures"].items()
        if m is not None
    ]
    if rows:
        header = ["", "least", "mean", "largest", "", f"least at {unit}", f"largest at {unit}"]
        lines += render.grid(header, rows)
    if asked["quantity"] == "payload":
        lines.append(
            "held at rest by the torques of the drives alone; the rating in motion is far less: "
            "kr16 info"
        )
    for row in result["envelope"]:
        verdict = "within" if row["within"] else "BEYOND"
        lines.append(
            f"{row['figure'].replace('_', ' ')}: {row['map']:.5g} {row['unit']}, {verdict} the "
            f"published {row['published']:g} ({row['status']}, {row['source']})"
        )
    return "\n".join([*lines, ""])
