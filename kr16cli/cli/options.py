"""Options that several commands share, so that each is written and explained once.

All are text or flags: `values` turns text into numbers, which keeps pydantic out of start-up.
A metavar of several words says how many numbers an option takes (see `command`).
"""

from __future__ import annotations

from typing import Annotated

import typer

from kr16cli.tolerances import TOLERANCES

_SIX_MM = "Six numbers, mm and degrees, or KRL text {X ..,Y ..,Z ..,A ..,B ..,C ..}."

Joints = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="A1 A2 A3 A4 A5 A6", help="Joint angles in degrees; - reads rows from stdin."
    ),
]
Pose = Annotated[
    list[str] | None,
    typer.Argument(metavar="X Y Z A B C", help="Pose in mm and degrees; - reads rows from stdin."),
]
Robot = Annotated[
    str | None,
    typer.Option("--robot", metavar="FILE", help="Parameter file, or a shipped name: kr16_l6."),
]
Si = Annotated[bool, typer.Option("--si", help="Angles in rad and lengths in m, in and out.")]
Source = Annotated[
    str | None,
    typer.Option("--input", metavar="FILE", help="Rows from a CSV or npz file; - is stdin."),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Any bad row: exit code 2 and nothing is written.")
]
Format = Annotated[
    str | None, typer.Option("--format", metavar="FORMAT", help="table, json, csv or npz.")
]
Told = Annotated[str | None, typer.Option("--format", metavar="FORMAT", help="table or json.")]
Json = Annotated[bool, typer.Option("--json", help="Short for --format json.")]
Output = Annotated[
    str | None,
    typer.Option("--output", "-o", metavar="FILE", help="Write here; the suffix sets the format."),
]
Krl = Annotated[
    str | None, typer.Option("--krl", metavar="TEXT", help="The input as KRL text in braces.")
]
Tool = Annotated[
    str | None,
    typer.Option("--tool", metavar="X Y Z A B C", help=f"Tool seen from the flange. {_SIX_MM}"),
]
Base = Annotated[
    str | None,
    typer.Option("--base", metavar="X Y Z A B C", help=f"Base seen from robroot. {_SIX_MM}"),
]
Near = Annotated[
    str | None,
    typer.Option(
        "--near",
        metavar="A1 A2 A3 A4 A5 A6",
        help="The configuration to stay near; it also supplies free angles. Default: zeros.",
    ),
]
Qd = Annotated[
    str | None,
    typer.Option("--qd", metavar="Q1 Q2 Q3 Q4 Q5 Q6", help="Joint speeds, deg/s (rad/s)."),
]
Qdd = Annotated[
    str | None,
    typer.Option(
        "--qdd", metavar="Q1 Q2 Q3 Q4 Q5 Q6", help="Joint accelerations, deg/s2 (rad/s2)."
    ),
]
Tau = Annotated[
    str | None,
    typer.Option("--tau", metavar="T1 T2 T3 T4 T5 T6", help="Joint torques, N m."),
]
Payload = Annotated[
    str | None,
    typer.Option(
        "--payload",
        metavar="M X Y Z [IX IY IZ]",
        help="Load at the flange: kg, mm (m), kg m2; or LOAD_DATA text {M ..,CM {..},J {..}}.",
    ),
]
LoadData = Annotated[
    str | None,
    typer.Option("--load-data", metavar="TEXT", help="The payload as KUKA LOAD_DATA text."),
]
Drives = Annotated[
    bool,
    typer.Option(
        "--drives",
        help="Count rotor inertia and friction of the data file. Coulomb friction is regularised "
        f"as qd/sqrt(qd^2 + {TOLERANCES.coulomb_speed:g}^2), qd in rad/s: within 0.04 % of its "
        "value at 20 deg/s.",
    ),
]
Frames = Annotated[
    str | None,
    typer.Option("--frames", metavar="WHICH", help="all: in robroot; chapter: the chapter's."),
]
MassCentres = Annotated[
    bool, typer.Option("--mass-centres", help="Add the mass centres of the links.")
]
Turns = Annotated[bool, typer.Option("--turns", help="List full turns of A1, A4 and A6 too.")]
Status = Annotated[
    str | None, typer.Option("--status", metavar="S", help="Only this Status, 0 to 7.")
]
Turn = Annotated[str | None, typer.Option("--turn", metavar="T", help="Only this Turn, 0 to 63.")]
Track = Annotated[
    bool, typer.Option("--track", help="Each row of --input stays near the solution before.")
]
Link = Annotated[
    str | None, typer.Option("--link", metavar="N", help="Link of the point, 1 to 6; default 6.")
]
Point = Annotated[
    str | None,
    typer.Option(
        "--point",
        metavar="PX PY PZ",
        help="Point in the link's frame, mm (m); or flange, wrist, tool, com.",
    ),
]
Axes = Annotated[
    str, typer.Option("--axes", metavar="AXES", help="Of the rows: robroot, flange or chapter.")
]
Task = Annotated[bool, typer.Option("--task", help="Add the task-space forms of section 3.6.")]
Christoffel = Annotated[bool, typer.Option("--christoffel", help="Add the matrices C_k of (3.41).")]
Gravity = Annotated[
    str | None,
    typer.Option("--gravity", metavar="GX GY GZ", help="Gravity in robroot, m/s2."),
]
