"""kr16 info."""

from __future__ import annotations

import typer

from kr16cli.cli import options as o
from kr16cli.cli import output as out
from kr16cli.cli import render, run, tables
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def info(
    ctx: typer.Context,
    robot: o.Robot = None,
    format_: o.Told = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """The robot, where its numbers come from, and which engine runs.

    $ kr16 info
    $ kr16 info --robot kr16_l6 --json
    """
    from kr16cli.queries import info as query

    kind = out.choose_format(format_, json, output, ("table", "json"))
    with out.Target(output) as target:
        data = run.load(ctx)
        result = query.info(data)
        if kind == "json":
            target.write(render.json_text(query.envelope(data, result)))
        else:
            target.write(tables.info(result, {}))
