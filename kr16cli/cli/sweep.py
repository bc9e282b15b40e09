"""kr16 sweep."""

from __future__ import annotations

import sys

import typer

from kr16cli.cli import options as o
from kr16cli.cli import run, studies
from kr16cli.cli import varying as v
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def sweep(
    ctx: typer.Context,
    scene: v.Scene = None,
    vary: v.Vary = None,
    monte_carlo: v.MonteCarlo = None,
    latin: v.Latin = None,
    seed: v.Seed = "1",
    simulator: v.Simulator = False,
    workers: studies.Workers = None,
    scheduler: studies.Scheduler = None,
    fresh: studies.Fresh = False,
    plot: studies.Plot = None,
    robot: o.Robot = None,
    format_: o.Told = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Run a scenario with other numbers: every combination, a Latin hypercube, or at random.

    $ kr16 sweep payload_16kg --vary payload.mass=0:16:5 -o falls.csv
    $ kr16 sweep free_swing --vary link[2].mass=x0.8:x1.2 --monte-carlo 20 --seed 7 --json

    One row for each run with its numbers and figures, as npz, CSV or Parquet. A run that fails is
    marked and does not stop the others. Motions that nothing answers (no controller, wrench or
    acting limit) run on the compiled solvers, all others in the simulator; each row says which.
    """
    if scene is None:
        print(ctx.get_help(), file=sys.stderr)
        raise typer.Exit(2)
    v.make(ctx.params, run.load(ctx))
