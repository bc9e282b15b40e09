"""kr16 dynamics."""

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
    task: o.Task = False,
    christoffel: o.Christoffel = False,
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

    $ kr16 dynamics 0 -90 90 0 0 0 --payload 16 0 0 120
    $ kr16 dynamics 0 -60 90 0 30 0 --qd 20 -10 0 0 5 0 --qdd 0 50 0 0 0 0 --json

    --qdd asks for the torque, --tau for the acceleration. Results are SI whatever was typed.
    """
    from kr16cli.queries.torques import DynamicsQuestion as Ask

    code = run.ask(
        ctx,
        lambda data: Ask(
            data,
            si=si,
            payload=values.payload(payload, load_data, si=si),
            gravity=values.option(gravity, ("X", "Y", "Z"), "--gravity"),
            qd=values.six(qd, "--qd"), qdd=values.six(qdd, "--qdd"), tau=values.six(tau, "--tau"),
            drives=drives, task=task, christoffel=christoffel,
        ),
        tables.dynamics,
    )  # fmt: skip
    raise typer.Exit(code)
