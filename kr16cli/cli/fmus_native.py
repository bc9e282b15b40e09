"""`kr16 fmu build --native` and `kr16 fmu ssp`: their options, and what they do with them."""

from __future__ import annotations

from typing import Annotated

import typer

from kr16cli.cli import batch
from kr16cli.cli import output as out
from kr16cli.cli import run as runs
from kr16cli.cli.fmus import file_only
from kr16cli.cli.options import Robot
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


System = Annotated[str, typer.Option("--output", "-o", metavar="FILE", help="The SSP to write.")]
Motion = Annotated[
    str,
    typer.Option(
        "--scenario", metavar="SCENARIO",
        help="A file or shipped scenario with a reference and a controller that follows it.",
    ),
]  # fmt: skip
Targets = Annotated[
    str,
    typer.Option(
        "--platforms", metavar="WHICH", help="host, all (needs ziglang), or names with commas."
    ),
]


def build(ctx: typer.Context) -> None:
    """Write the native FMU and say what it is."""
    from kr16cli.fmi import choices
    from kr16cli.fmi.native import build as builder
    from kr16cli.fmi.native.library import platforms
    from kr16cli.fmi.variables import Part
    from kr16cli.simulate.scenario import load_scenario

    p = ctx.params
    if p["no_shim"]:
        raise InputError("--no-shim is for FMUs in Python; a native FMU has no shim, leave it out")
    if p["fmi"] not in ("2", "3"):
        raise InputError(f"--fmi is {p['fmi']}; it must be 2 or 3")
    version = int(p["fmi"])
    if p["arrays"] and version == 2:
        raise InputError("--arrays needs --fmi 3; FMI 2 has no arrays")
    names = platforms(p["platforms"], version)
    file_only(p["output"], "an FMU", "KR16.fmu")
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
    print(
        f"{p['output']}: {part} of {data.name}, FMI {version}.0, native for "
        f"{', '.join(names)}, {len(content)} bytes"
    )


def ssp(ctx: typer.Context, output: System = "cell.ssp", scenario: Motion = "ptp_16kg",
        platforms: Targets = "host", robot: Robot = None) -> None:  # fmt: skip
    """Build a system of native FMUs: trajectory source, controller and robot, connected (SSP 1.0).

    $ kr16 fmu ssp -o cell.ssp
    $ kr16 fmu ssp --scenario circle_task_space -o circle.ssp
    """
    from kr16cli.fmi.native import ssp as builder
    from kr16cli.fmi.native.library import platforms as named
    from kr16cli.simulate.scenario import load_scenario

    names = named(platforms, 2)
    file_only(output, "an SSP", "cell.ssp")
    with out.Target(output) as target:
        cell = builder.cell(runs.load(ctx), load_scenario(scenario))
        content = builder.package(cell, names)
        target.write(content)
    batch.warn(cell.notes)
    print(
        f"{output}: {cell.scenario.name} by trajectory, controller and robot of "
        f"{cell.data.name}, SSP 1.0, native for {', '.join(names)}, {len(content)} bytes; "
        f"run it for {cell.scenario.duration:g} s in steps of {cell.step:g} s"
    )
