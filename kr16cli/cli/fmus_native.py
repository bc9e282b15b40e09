"""`kr16 fmu build --native`: its options, and what it does with them."""

from __future__ import annotations

from typing import Annotated

import typer

from kr16cli.cli import batch
from kr16cli.cli import output as out
from kr16cli.cli import run as runs
from kr16cli.errors import InputError

Native = Annotated[
    bool, typer.Option("--native", help="Compiled C: any tool loads it, no Python on the target.")
]
Version = Annotated[
    str, typer.Option("--fmi", metavar="2|3", help="Version of FMI, with --native.")
]
Arrays = Annotated[
    bool, typer.Option("--arrays", help="Rows of six as arrays, with --native --fmi 3.")
]
Platforms = Annotated[
    str,
    typer.Option(
        "--platforms", metavar="WHICH",
        help="With --native: host, all (needs ziglang), or names with commas.",
    ),
]  # fmt: skip


def build(ctx: typer.Context) -> None:
    """Write the native FMU and say what it is."""
    from kr16cli.fmi import choices
    from kr16cli.fmi.native import build as builder
    from kr16cli.fmi.native.library import platforms
    from kr16cli.fmi.variables import Part
    from kr16cli.simulate.scenario import load_scenario

    p = ctx.params
    if p["fmi"] not in ("2", "3"):
        raise InputError(f"--fmi is {p['fmi']}; it must be 2 or 3")
    version = int(p["fmi"])
    if p["arrays"] and version == 2:
        raise InputError("--arrays needs --fmi 3; FMI 2 has no arrays")
    names = platforms(p["platforms"], version)
    with out.Target(p["output"]) as target:
        data = runs.load(ctx)
        scenario = load_scenario(p["scenario"]) if p["scenario"] else None
        part = Part.CONTROLLER if p["controller"] else Part.ROBOT
        chosen, notes = choices.options(data, scenario, part, None)
        own = builder.Options(
            chosen.start, part, chosen.stop, chosen.step, chosen.scenario, version, names,
            p["arrays"],
        )  # fmt: skip
        content = builder.build(data, own)
        target.write(content)
    batch.warn(notes)
    if p["output"] != "-":
        print(
            f"{p['output']}: {part} of {data.name}, FMI {version}.0, native for "
            f"{', '.join(names)}, {len(content)} bytes"
        )
