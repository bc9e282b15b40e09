"""What `kr16 simulate` takes and gives: its options, the scenario they make, the run's files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.cli import output as out
from kr16cli.cli import render, values
from kr16cli.errors import CheckFailedError, InputError

if TYPE_CHECKING:
    from kr16cli.robot import RobotData
    from kr16cli.simulate.run import Run
    from kr16cli.simulate.scenario import Scenario

_SIX = ("1", "2", "3", "4", "5", "6")

Scene = Annotated[
    str | None,
    typer.Argument(metavar="[SCENARIO]", help="A scenario file, or a shipped one: free_swing."),
]
Q = Annotated[
    str | None,
    typer.Option("--q", metavar="A1 A2 A3 A4 A5 A6", help="Joint angles at the start, deg (rad)."),
]
Duration = Annotated[
    str | None, typer.Option("--duration", metavar="S", help="Length, s; 1 without a scenario.")
]
Torque = Annotated[
    str | None,
    typer.Option("--torque", metavar="KIND", help="zero, constant (--tau), gravity or csv."),
]
TorqueCsv = Annotated[
    str | None,
    typer.Option("--torque-csv", metavar="FILE", help="Columns time (s), tau1 to tau6 (N m)."),
]
OutputStep = Annotated[
    str | None, typer.Option("--output-step", metavar="S", help="Time between samples, 0.01 s.")
]
Method = Annotated[
    str | None, typer.Option("--method", metavar="NAME", help="DOP853, RK45, Radau or LSODA.")
]
Rtol = Annotated[
    str | None, typer.Option("--rtol", metavar="X", help="Relative tolerance of a step, 1e-9.")
]
Atol = Annotated[
    str | None, typer.Option("--atol", metavar="X", help="Absolute tolerance, 1e-10 rad, rad/s.")
]


def scenario(p: Mapping[str, Any]) -> Scenario | None:
    """The scenario of a command's parameters, options before the file; None without either."""
    from kr16cli.simulate.scenario import load_scenario, scenario_table, with_options

    si = p["si"]
    q, qd = values.joints(p["q"], "--q", si=si), values.option(p["qd"], _SIX, "--qd")
    if p["scene"] is None and q is None:
        return None
    options = {
        "duration_s": _number(p, "duration"),
        "output_step_s": _number(p, "output_step"),
        "drives": p["drives"] or None,
        "gravity": values.option(p["gravity"], "XYZ", "--gravity"),
        "initial": {"q" if si else "q_deg": q, "qd" if si else "qd_deg_s": qd},
        "torque": _torque(p),
        "solver": {"method": p["method"], "rtol": _number(p, "rtol"), "atol": _number(p, "atol")},
    }
    load = values.payload(p["payload"], p["load_data"], si=si)
    return with_options(p["scene"], options, load)
