"""kr16 simulate."""

from __future__ import annotations

import sys

import typer

from kr16cli.cli import motion as m
from kr16cli.cli import options as o
from kr16cli.cli import run
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def simulate(
    ctx: typer.Context,
    scene: m.Scene = None,
    q: m.Q = None,
    qd: o.Qd = None,
    duration: m.Duration = None,
    torque: m.Torque = None,
    tau: o.Tau = None,
    torque_csv: m.TorqueCsv = None,
    payload: o.Payload = None,
    load_data: o.LoadData = None,
    drives: o.Drives = False,
    gravity: o.Gravity = None,
    output_step: m.OutputStep = None,
    method: m.Method = None,
    rtol: m.Rtol = None,
    atol: m.Atol = None,
    step: m.Step = None,
    plot: m.Plot = None,
    si: o.Si = False,
    robot: o.Robot = None,
    format_: o.Format = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Simulate a motion: a scenario file, a shipped scenario, or options.

    $ kr16 simulate free_swing -o swing.npz
    $ kr16 simulate step_disturbance --duration 0.6 -o push.csv --plot push.pdf
    $ kr16 simulate --q 0 -60 60 0 30 0 --duration 0.5 --torque gravity --json

    An option replaces the scenario's value. CSV and npz hold every sample, in SI units; the
    summary goes to stdout. A scenario says what joint limits do; by default they are reported. If
    the solver fails, the run so far is written and marked, and the exit code is 1.
    """
    asked = m.scenario(ctx.params)
    if asked is None:
        print(ctx.get_help(), file=sys.stderr)
        raise typer.Exit(2)
    m.simulate(ctx.params, run.load(ctx), asked)
