"""kr16 jacobian."""

from __future__ import annotations

from typing import Annotated

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
    link: Annotated[
        str | None, typer.Option("--link", metavar="N", help="Link of the point, 1 to 6.")
    ] = None,
    point: Annotated[
        str | None,
        typer.Option(
            "--point", metavar="PX PY PZ", help="In the link's frame; or flange, wrist, tool, com."
        ),
    ] = None,
    axes: Annotated[
        str, typer.Option("--axes", metavar="AXES", help="robroot, flange or chapter.")
    ] = "robroot",
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

    \b
    $ kr16 jacobian 0 -90 90 0 30 0
    $ kr16 jacobian 0 -90 90 0 30 0 --qd 10 0 0 0 -5 0 --point wrist --json

    Linear rows first. Results are in m and rad whatever was typed.
    """
    from kr16cli.queries.velocity import JacobianQuestion

    asked = {
        "qd": values.joints(qd, "--qd", si=si),
        "link": values.whole(link, "--link", 1, 6) or 6,
        "point": values.point(point),
        "axes": axes,
        "tool": values.pose(tool, "--tool", si=si),
    }
    code = run.ask(ctx, lambda data: JacobianQuestion(data, si=si, **asked), tables.jacobian)
    raise typer.Exit(code)
