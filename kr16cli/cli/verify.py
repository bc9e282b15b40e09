"""kr16 verify, with chapter, model and poses."""

from __future__ import annotations

import typer

from kr16cli.cli import checks, judge
from kr16cli.cli import options as o
from kr16cli.cli.command import Command, LeanGroup, new_app

app = new_app(cls=LeanGroup, invoke_without_command=True)


@app.callback()
def verify(
    ctx: typer.Context, suite: checks.Suite = None, quick: checks.Quick = False,
    seed: checks.Seed = None, robot: o.Robot = None, format_: o.Told = None,
    json: o.Json = False, junit: checks.Junit = None, list_: checks.List = False,
    output: o.Output = None, figures: checks.Figures = False,
    self_test: checks.SelfTest = False,
) -> None:  # fmt: skip
    """Verify the model: every case with its tolerance, worst case and grade of independence.

    $ kr16 verify --suite kinematics --quick
    $ kr16 verify --suite inverse --quick --json

    Grades: A an outside number or another engine, B independent code, C an identity, D a round
    trip. Exit code 1 when a case fails. Numbers are verified, not validated on a robot.
    """
    if robot:
        ctx.obj = {**(ctx.obj or {}), "robot": robot}
    if ctx.invoked_subcommand is None:
        raise typer.Exit(checks.suites(ctx))


for command in (judge.chapter, judge.model, judge.poses):
    app.command(cls=Command)(command)
