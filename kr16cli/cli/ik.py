"""kr16 ik."""

import typer

from kr16cli.cli import options as o
from kr16cli.cli import run, tables, values
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def ik(
    ctx: typer.Context,
    values_: o.Pose = None,
    near: o.Near = None,
    turns: o.Turns = False,
    status: o.Status = None,
    turn: o.Turn = None,
    tool: o.Tool = None,
    base: o.Base = None,
    krl: o.Krl = None,
    si: o.Si = False,
    source: o.Source = None,
    track: o.Track = False,
    strict: o.Strict = False,
    robot: o.Robot = None,
    format_: o.Format = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Inverse kinematics: a pose to all joint configurations.

    $ kr16 ik 1088 0 1320 0 90 0 --near 0 -90 90 0 0 0
    $ kr16 ik --krl '{X 1200,Y 100,Z 900,A 0,B 120,C 0,S 2}' --json

    Solutions come nearest to --near first; the largest joint move decides. All branches are
    listed, those outside the limits marked; exit code 3 if none is within.
    """
    from kr16cli.queries.inverse import InverseQuestion

    raise typer.Exit(
        run.ask(
            ctx,
            lambda data: InverseQuestion(
                data,
                si=si,
                near=values.joints(near, "--near", si=si),
                turns=turns,
                status=values.whole(status, "--status", 0, 7),
                turn=values.whole(turn, "--turn", 0, 63),
                tool=values.pose(tool, "--tool", si=si),
                base=values.pose(base, "--base", si=si),
            ),
            tables.ik,
        )
    )
