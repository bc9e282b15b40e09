"""kr16 export urdf, kr16 export mjcf."""

from __future__ import annotations

import typer

from kr16cli.cli import batch, run, values
from kr16cli.cli import options as o
from kr16cli.cli import output as out
from kr16cli.cli.command import Command, LeanGroup, new_app
from kr16cli.export import mjcf as mj
from kr16cli.export import urdf as ur

app = new_app(cls=LeanGroup)


@app.callback()
def export() -> None:
    """Write the robot as URDF (ROS, Pinocchio, ...) or MJCF (MuJoCo).

    $ kr16 export urdf -o kr16.urdf
    $ kr16 export mjcf -o kr16.xml
    """


@app.command(cls=Command)
def urdf(
    ctx: typer.Context, payload: o.Payload = None, load_data: o.LoadData = None,
    drives: o.Drives = False, si: o.Si = False, robot: o.Robot = None, output: o.Output = None,
) -> None:  # fmt: skip
    """URDF. What it cannot say is told on stderr.

    $ kr16 export urdf -o kr16.urdf
    $ kr16 export urdf --payload 16 0 0 120
    """
    with out.Target(output) as target:
        data, load = run.load(ctx), values.payload(payload, load_data, si=si)
        target.write(ur.urdf(data, load, drives))
        batch.warn(ur.notes(data, drives))


@app.command(cls=Command)
def mjcf(
    ctx: typer.Context, payload: o.Payload = None, load_data: o.LoadData = None,
    drives: o.Drives = False, gravity: o.Gravity = None, si: o.Si = False,
    robot: o.Robot = None, output: o.Output = None,
) -> None:  # fmt: skip
    """MJCF, with the gravity of the parameter file or another.

    $ kr16 export mjcf -o kr16.xml
    $ kr16 export mjcf --drives --gravity 0 0 0
    """
    with out.Target(output) as target:
        data, load = run.load(ctx), values.payload(payload, load_data, si=si)
        target.write(mj.mjcf(data, load, drives, values.option(gravity, "XYZ", "--gravity")))
        batch.warn(mj.notes(data, drives))
