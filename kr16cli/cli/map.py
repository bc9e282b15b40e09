"""kr16 map."""

from __future__ import annotations

import sys

import typer

from kr16cli.cli import mapping as m
from kr16cli.cli import options as o
from kr16cli.cli import run, studies
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command("map", cls=Command)
def map_(
    ctx: typer.Context,
    quantity: m.Quantity = None,
    grid: m.Grid = "20mm",
    x: m.X = None,
    y: m.Y = None,
    z: m.Z = None,
    orientation: m.Orientation = "fixed",
    abc: m.Abc = None,
    directions: m.Directions = "50",
    rolls: m.Rolls = "1",
    point: m.Point = None,
    tool: o.Tool = None,
    payload: o.Payload = None,
    load_data: o.LoadData = None,
    length: m.Length = "1000mm",
    workers: studies.Workers = None,
    scheduler: studies.Scheduler = None,
    fresh: studies.Fresh = False,
    plot: studies.Plot = None,
    si: o.Si = False,
    robot: o.Robot = None,
    format_: o.Told = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Map the workspace: where the arm reaches, how well, and what it can hold there.

    $ kr16 map reach --grid 50mm -o reach.npz --plot reach.pdf
    $ kr16 map payload --y 0 --grid 20mm --plot payload.pdf

    Every pose is solved in closed form; branches within the joint limits count. An interrupted
    run keeps its finished chunks beside -o, and the same command goes on.
    """
    if quantity is None:
        print(ctx.get_help(), file=sys.stderr)
        raise typer.Exit(2)
    m.make(ctx.params, run.load(ctx))
