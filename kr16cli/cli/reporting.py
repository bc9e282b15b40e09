"""What `kr16 report` does with its options: gather, build, write."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from kr16cli.cli import output as out
from kr16cli.cli import run
from kr16cli.errors import InputError

if TYPE_CHECKING:
    import typer

    from kr16cli.verify.records import Setting


def write(ctx: typer.Context) -> int:
    """Write the report asked for; 1 if a check in it failed."""
    from kr16cli.report import build
    from kr16cli.report.content import outline

    p = ctx.params
    outline(p["kind"])
    target = _file(p.get("output"))
    build.require_matplotlib()
    bar = sys.stderr is not None and sys.stderr.isatty()
    with out.Target(target) as file:
        try:
            content = build.gather(
                p["kind"], _setting(ctx), p.get("sources") or (), _show if bar else None
            )
        finally:
            if bar:
                print("\r\x1b[K", end="", file=sys.stderr, flush=True)
        file.write(build.build(content))
    for name, reason in content.left_out.items():
        if name not in ("run", "speed"):  # there only when asked for
            print(f"kr16: no page on {name}: {reason}", file=sys.stderr)
    return 1 if content.count("failed") else 0


def _file(output: str | None) -> str:
    if output is None or output == "-":
        raise InputError("a report is a PDF file; give its name: -o FILE.pdf")
    if Path(output).suffix.lower() != ".pdf":
        raise InputError(f"-o {output}: the suffix must be .pdf")
    return output


def _setting(ctx: typer.Context) -> Setting:
    from kr16cli.api import Robot
    from kr16cli.verify.records import Setting

    text = ctx.params.get("seed")
    robot, quick = Robot(run.load(ctx)), bool(ctx.params.get("quick"))
    if text is None:
        return Setting(robot, quick=quick)
    try:
        seed = int(text)
    except ValueError:
        seed = -1
    if seed < 0:
        raise InputError(f"--seed is {text}; it must be a whole number, 0 or more")
    return Setting(robot, seed, quick)


def _show(done: int, total: int, last: str) -> None:
    """A bar on the terminal."""
    filled = "#" * round(30 * done / total)
    text = f"{filled:-<30} {done} of {total} {last}"
    print(f"\r\x1b[K{text[:78]}", end="", file=sys.stderr, flush=True)
