"""kr16 uncertainty."""

from __future__ import annotations

import typer

from kr16cli.cli import options as o
from kr16cli.cli import run, studies
from kr16cli.cli import trusting as t
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def uncertainty(
    ctx: typer.Context,
    scene: t.Scene = None,
    q: t.Poses = None,
    samples: t.Samples = "1000",
    seed: t.Seed = "1",
    distribution: t.Distribution = "normal",
    payload: o.Payload = None,
    load_data: o.LoadData = None,
    drives: o.Drives = False,
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
    """How far torques and motions can be trusted, given the tolerances of the robot's numbers.

    $ kr16 uncertainty --q 0 0 0 0 0 0
    $ kr16 uncertainty free_swing --samples 2000 --plot bands.pdf -o bands.npz

    Robots are drawn from the tolerances of the parameter file and compared with first order by
    exact derivatives. A table says which number matters most.
    """
    t.make(ctx.params, run.load(ctx))
