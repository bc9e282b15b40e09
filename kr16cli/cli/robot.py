"""kr16 robot check, kr16 robot template."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from kr16cli.cli import options as o
from kr16cli.cli import output as out
from kr16cli.cli.command import Command, LeanGroup, new_app

app = new_app(cls=LeanGroup)


@app.callback()
def robot() -> None:
    """Check a parameter file, or write a commented one.

    $ kr16 robot template -o arm.toml
    $ kr16 robot check arm.toml
    """


@app.command(cls=Command)
def check(
    file: Annotated[str, typer.Argument(metavar="FILE", help="Parameter file to check.")],
) -> None:
    """Check a parameter file: a line for every broken rule, then their number; exit code 2.

    $ kr16 robot check kr16_2
    $ kr16 robot check kr16_l6
    """
    from kr16cli.robot_file import load_data, problems

    found = problems(file)
    for problem in found:
        print(f"kr16: error: {problem}", file=sys.stderr)
    if len(found) > 1:
        print(f"kr16: error: {found[0].path}: {len(found)} problems", file=sys.stderr)
    if found:
        raise typer.Exit(2)
    data = load_data(file)
    print(f"{data.path}: {data.name}: sound; model {data.sha256}")


@app.command(cls=Command)
def template(output: o.Output = None) -> None:
    """Write a commented parameter file to start from.

    $ kr16 robot template
    $ kr16 robot template -o mine.toml
    """
    from kr16cli.robot_file import template as text

    with out.Target(output) as target:
        target.write(text())
