"""kr16 fmu build, ssp, info, check, run, table."""

from __future__ import annotations

from typer import Context

from kr16cli.cli import fmus as f
from kr16cli.cli import fmus_native as n
from kr16cli.cli import fmus_table as t
from kr16cli.cli.command import Command, LeanGroup, new_app
from kr16cli.cli.options import Json, Output, Robot

app = new_app(cls=LeanGroup)
app.callback()(f.group)


@app.command(cls=Command)
def build(ctx: Context, output: f.Built = "KR16.fmu", scenario: f.Scene = None,
          controller: f.Controller = False, no_shim: f.NoShim = False, native: n.Native = False,
          fmi: n.Version = "2", arrays: n.Arrays = False, platforms: n.Platforms = "host",
          robot: Robot = None) -> None:  # fmt: skip
    """Build an FMU of the robot, or of its controller; needs pythonfmu, or --native a compiler.

    $ kr16 fmu build --native --fmi 3
    $ kr16 fmu build --scenario ptp_16kg -o ptp.fmu
    """
    (n if native else f).build(ctx)


app.command(cls=Command)(n.ssp)
app.command(cls=Command)(f.info)


@app.command(cls=Command)
def check(ctx: Context, file: f.File, tolerance: f.Tolerance = None, robot: Robot = None,
          json: Json = False) -> None:  # fmt: skip
    """Validate an FMU, compare it with the direct simulator; exit code 1 if it fails.

    $ kr16 fmu build
    $ kr16 fmu check KR16.fmu
    """
    f.check(ctx, json=json)


@app.command(cls=Command)
def run(ctx: Context, file: f.File, source: f.Signals = None, output: Output = None,
        step: f.Step = None, stop: f.Stop = None, values_: f.Values = None) -> None:  # fmt: skip
    """Run an FMU with inputs from a CSV file (--input in.csv).

    $ kr16 fmu build
    $ kr16 fmu run KR16.fmu --set control.mode=2 --stop 0.5 -o out.csv
    """
    f.run(ctx)


app.command(cls=Command)(t.table)
