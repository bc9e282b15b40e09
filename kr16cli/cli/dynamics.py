"""kr16 dynamics."""

from __future__ import annotations

from typing import Annotated

import typer

from kr16cli.cli import options as o
from kr16cli.cli import run, tables, values
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def dynamics(
    ctx: typer.Context,
    values_: o.Joints = None,
    qd: o.Qd = None,
    qdd: o.Qdd = None,
    tau: o.Tau = None,
    payload: o.Payload = None,
    load_data: o.LoadData = None,
    drives: o.Drives = False,
    gravity: o.Gravity = None,
    task: Annotated[bool, typer.Option("--task", help="Add the task-space forms.")] = False,
    christoffel: Annotated[
        bool, typer.Option("--christoffel", help="Add the matrices C_k (3.41).")
    ] = False,
    krl: o.Krl = None,
    si: o.Si = False,
    source: o.Source = None,
    strict: o.Strict = False,
    robot: o.Robot = None,
    format_: o.Format = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Mass matrix, Coriolis matrix, gravity, torques, accelerations.

    \b
    $ kr16 dynamics 0 -90 90 0 0 0 --payload 16 0 0 120
    $ kr16 dynamics 0 -60 90 0 30 0 --qd 20 -10 0 0 5 0 --qdd 0 50 0 0 0 0 --json

    --qdd asks for the torque, --tau for the acceleration. Results are SI whatever was typed.
    """
    from kr16cli.queries.torques import DynamicsQuestion

    six = ("1", "2", "3", "4", "5", "6")
    asked = {
        "qd": values.option(qd, six, "--qd"),
        "qdd": values.option(qdd, six, "--qdd"),
        "tau": values.option(tau, six, "--tau"),
        "payload": values.payload(payload, load_data, si=si),
        "gravity": values.option(gravity, "XYZ", "--gravity"),
        **{"drives": drives, "task": task, "christoffel": christoffel},
    }
    code = run.ask(ctx, lambda data: DynamicsQuestion(data, si=si, **asked), tables.dynamics)
    raise typer.Exit(code)
