"""kr16 jacobian."""

import typer

from kr16cli.cli import options as o
from kr16cli.cli import run, tables, values
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def jacobian(
    ctx: typer.Context,
    values_: o.Joints = None,
    qd: o.Qd = None,
    link: o.Link = None,
    point: o.Point = None,
    axes: o.Axes = "robroot",
    tool: o.Tool = None,
    krl: o.Krl = None,
    si: o.Si = False,
    source: o.Source = None,
    strict: o.Strict = False,
    robot: o.Robot = None,
    format_: o.Format = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """The Jacobian, its rate, and how near singularities are.

    $ kr16 jacobian 0 -90 90 0 30 0
    $ kr16 jacobian 0 -90 90 0 30 0 --qd 10 0 0 0 -5 0 --point wrist --json

    Linear rows first. Results are in m and rad whatever was typed.
    """
    from kr16cli.queries.velocity import JacobianQuestion

    raise typer.Exit(
        run.ask(
            ctx,
            lambda data: JacobianQuestion(
                data,
                si=si,
                link=values.whole(link, "--link", 1, 6) or 6,
                point=values.point(point),
                tool=values.pose(tool, "--tool", si=si),
                axes=axes,
                qd=values.six(qd, "--qd"),
            ),
            tables.jacobian,
        )
    )
