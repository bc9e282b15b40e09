"""kr16 fk."""

import typer

from kr16cli.cli import options as o
from kr16cli.cli import run, tables, values
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def fk(
    ctx: typer.Context,
    values_: o.Joints = None,
    tool: o.Tool = None,
    base: o.Base = None,
    frames: o.Frames = None,
    mass_centres: o.MassCentres = False,
    krl: o.Krl = None,
    si: o.Si = False,
    source: o.Source = None,
    strict: o.Strict = False,
    robot: o.Robot = None,
    format_: o.Format = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Forward kinematics: joint angles to the pose of the flange.

    $ kr16 fk 0 -90 90 0 0 0
    $ kr16 fk 10 -80 95 0 -45 30 --tool 0 0 120 0 0 0 --json

    A, B, C turn about Z, Y', X''; at B = +-90 A is 0 by choice. Status and Turn are computed by
    rule. An angle outside its limits is answered with a warning.
    """
    from kr16cli.queries.forward import ForwardQuestion

    raise typer.Exit(
        run.ask(
            ctx,
            lambda data: ForwardQuestion(
                data,
                si=si,
                tool=values.pose(tool, "--tool", si=si),
                base=values.pose(base, "--base", si=si),
                frames=frames,
                mass_centres=mass_centres,
            ),
            tables.fk,
        )
    )
