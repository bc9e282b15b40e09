"""kr16 report."""

from __future__ import annotations

from typing import Annotated

import typer

from kr16cli.cli import checks, reporting
from kr16cli.cli import options as o
from kr16cli.cli.command import Command, new_app

app = new_app()

Kind = Annotated[
    str, typer.Argument(metavar="[REPORT]", help="verification, kinematics, dynamics, simulation.")
]
Pdf = Annotated[str | None, typer.Option("--output", "-o", metavar="FILE.pdf", help="Write here.")]
Sources = Annotated[
    list[str] | None,
    typer.Option(
        "--from",
        metavar="FILE",
        help="Draw these and run no suite: results of kr16 verify --json --figures, a run of kr16 "
        "simulate (npz). Pages more: kr16 fmu check --json, kr16 bench --json. May be repeated.",
    ),
]


@app.command(cls=Command)
def report(
    ctx: typer.Context, kind: Kind = "verification", output: Pdf = None, sources: Sources = None,
    quick: checks.Quick = False, seed: checks.Seed = None, robot: o.Robot = None,
) -> None:  # fmt: skip
    """Write a report as PDF: verification, kinematics, dynamics or simulation.

    $ kr16 report simulation --quick -o simulation.pdf

    The suites it shows are run, unless --from gives results. Equal input gives equal bytes where
    SOURCE_DATE_EPOCH is set. Exit code 1 when a check failed; the report says which and why.
    """
    raise typer.Exit(reporting.write(ctx))
