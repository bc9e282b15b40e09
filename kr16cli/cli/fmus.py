"""What `kr16 fmu` takes and gives: its options, and what each command does with them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from kr16cli.cli import batch, render, values
from kr16cli.cli import output as out
from kr16cli.cli import run as runs
from kr16cli.cli.options import Json
from kr16cli.errors import CheckFailedError, InputError

File = Annotated[str, typer.Argument(metavar="FILE", help="An FMU.")]
Built = Annotated[str, typer.Option("--output", "-o", metavar="FILE", help="The FMU to write.")]
Scene = Annotated[
    str | None,
    typer.Option(
        "--scenario", metavar="SCENARIO", help="Start values of a file, or of a shipped one."
    ),
]
Controller = Annotated[
    bool, typer.Option("--controller", help="Only the controller: q, qd, references to tau.")
]
NoShim = Annotated[
    bool,
    typer.Option("--no-shim", help="Without the parts in C: shim for Linux, quicker functions."),
]
Tolerance = Annotated[
    str | None,
    typer.Option(
        "--tolerance", metavar="X", help="Largest relative deviation: 1e-9, others' FMUs 1e-5."
    ),
]
Signals = Annotated[
    str | None,
    typer.Option("--input", metavar="FILE", help="Columns time (s) and inputs by name."),
]
Step = Annotated[
    str | None, typer.Option("--step", metavar="S", help="Communication step, s; the FMU's own.")
]
Stop = Annotated[
    str | None, typer.Option("--stop", metavar="S", help="End, s; that of --input, or the FMU's.")
]
Values = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="A parameter's start value; repeatable."),
]


def group() -> None:
    """Build, look into, check and run FMUs of the robot, and a system of them (SSP).

    $ kr16 fmu build
    $ kr16 fmu check KR16.fmu
    """


def build(ctx: typer.Context) -> None:
    """Write the FMU and say what it is."""
    from kr16cli.fmi import build as builder
    from kr16cli.fmi import choices, compiling, quick
    from kr16cli.fmi.variables import Part
    from kr16cli.simulate.scenario import load_scenario

    p = ctx.params
    for name, usual in (("fmi", "2"), ("arrays", False), ("platforms", "host")):
        if p[name] != usual:
            raise InputError(f"--{name} is for native FMUs; give --native, too")
    file_only(p["output"], "an FMU", "KR16.fmu")
    with out.Target(p["output"]) as target:
        data = runs.load(ctx)
        scenario = load_scenario(p["scenario"]) if p["scenario"] else None
        compiler = None if p["no_shim"] else compiling.find_compiler()
        part = Part.CONTROLLER if p["controller"] else Part.ROBOT
        options, notes = choices.options(data, scenario, part, compiler)
        content = builder.build(data, options)
        target.write(content)
    if not compiler and not p["no_shim"]:
        notes.append(
            "no C compiler: on Linux, programs that are not Python need LD_PRELOAD; see README"
        )
    if compiler and not quick.headers():
        notes.append(
            "no Python.h (Debian: python3-dev): the FMU computes in Python alone, "
            "several times slower"
        )
    batch.warn(notes)
    print(f"{p['output']}: {part} of {data.name}, FMI 2.0, {len(content)} bytes")


def file_only(output: str, what: str, example: str) -> None:
    """Refuse standard output for what is no text."""
    if output == "-":
        raise InputError(f"{what} is binary and needs a file; give -o {example}")


def info(file: File, json: Json = False) -> None:
    """What an FMU is, and its variables.

    $ kr16 fmu build
    $ kr16 fmu info KR16.fmu
    """
    from kr16cli.fmi import reading

    answer = reading.envelope(reading.read(file))
    target = out.Target(None)
    target.write(render.json_text(answer) if json else _described(answer["result"]))
    batch.warn([] if json else answer["warnings"])


def _described(result: Mapping[str, Any]) -> str:
    experiment = ", ".join(
        f"{key} {value:g} s" for key, value in result["experiment"].items() if value is not None
    )
    facts = [
        ["name", f"{result['name']}: {result['description'] or ''}"],
        ["FMI", f"{result['fmi_version']}, {', '.join(result['kinds'])}"],
        ["made by", f"{result['tool'] or 'unknown'}, {result['date'] or 'no date'}"],
        ["identity", str(result["guid"])],
        ["platforms", ", ".join(result["platforms"]) + (", with shim" if result["shim"] else "")],
        ["experiment", experiment or "none"],
    ]
    rows = [
        [v["name"], v["causality"], v["unit"] or v["base"], v["start"] or "", v["description"]]
        for v in result["variables"]
    ]
    lines = [f"{name:<11}{text}" for name, text in facts]
    return "\n".join(
        [*lines, *render.grid(["variable", "is", "unit", "start", "description"], rows), ""]
    )


def check(ctx: typer.Context, *, json: bool) -> None:
    """Check an FMU and print the largest deviations; CheckFailedError if it fails."""
    from kr16cli.fmi import check as checks
    from kr16cli.fmi import reading

    p = ctx.params
    tolerance = values.number(p["tolerance"], "--tolerance") if p["tolerance"] else None
    if tolerance is not None and tolerance <= 0.0:
        raise InputError(f"--tolerance is {tolerance:g}; it must be positive")
    fmu = reading.read(p["file"])
    chosen = p["robot"] or (ctx.obj or {}).get("robot")
    report = checks.check(fmu, runs.load(ctx) if chosen else None, tolerance)
    rows = [
        [d.group, f"{d.largest:.3e}", d.unit, f"{d.time:.4g}", f"{d.relative:.1e}"]
        for d in report.deviations
    ]
    header = ["largest deviation", "", "unit", "at s", "relative"]
    text = "\n".join([*(render.grid(header, rows) if rows else []), *_verdict(report), ""])
    answer = checks.envelope(fmu, report)
    out.Target(None).write(render.json_text(answer) if json else text)
    if report.problems:
        more = f" (and {len(report.problems) - 1} more)" if len(report.problems) > 1 else ""
        raise CheckFailedError(f"{p['file']}: {report.problems[0]}{more}")


def _verdict(report: Any) -> list[str]:
    if report.problems:
        return [f"problem: {problem}" for problem in report.problems]
    return [
        f"passed: valid; {report.steps} steps agree with the direct simulator within "
        f"{report.tolerance:g}"
    ]


def run(ctx: typer.Context) -> None:
    """Run an FMU and write its outputs as CSV."""
    from kr16cli.fmi import play, reading, tables

    p = ctx.params
    with out.Target(p["output"]) as target:
        if p["output"] not in (None, "-") and Path(p["output"]).suffix.lower() != ".csv":
            raise InputError(f"-o {p['output']}: the suffix must be .csv")
        fmu = reading.read(p["file"])
        inputs = [v.name for v in fmu.scalars if v.causality == "input"]
        signals = tables.read_signals(p["source"], inputs) if p["source"] else play.Signals()
        last = signals.times[-1] if signals.times else 0.0
        stop = _seconds(p, "stop") or last or fmu.number("stopTime") or 1.0
        step = _seconds(p, "step") or fmu.number("stepSize") or 0.01
        columns, messages = play.play(fmu, signals, stop, step, _starts(p["values_"]))
        units = {"time": "s", **{v.name: v.unit or "" for v in fmu.scalars}}
        target.write(tables.to_csv(columns, units))
    batch.warn(messages)


def _seconds(p: Mapping[str, Any], name: str) -> float | None:
    if p[name] is None:
        return None
    value = values.number(p[name], f"--{name}")
    if value <= 0.0:
        raise InputError(f"--{name} is {value:g}; it must be positive")
    return value


def _starts(texts: list[str] | None) -> dict[str, float]:
    found = {}
    for text in texts or ():
        name, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--set {text}: write NAME=VALUE")
        words = {"true": 1.0, "false": 0.0}
        found[name.strip()] = words.get(value.lower()) or (
            0.0 if value.lower() == "false" else values.number(value, f"--set {name}")
        )
    return found
