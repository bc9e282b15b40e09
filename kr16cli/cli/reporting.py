"""What `kr16 report` does with its options: gather, build, write."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from kr16cli.cli import checks
from kr16cli.cli import output as out
from kr16cli.cli.progress import Bar
from kr16cli.errors import InputError

if TYPE_CHECKING:
    import typer


def write(ctx: typer.Context) -> int:
    """Write the report asked for; 1 if a check in it failed."""
    from kr16cli.report import build
    from kr16cli.report.content import outline

    p = ctx.params
    outline(p["kind"])
    target = _file(p.get("output"))
    build.require_matplotlib()
    with out.Target(target) as file:
        setting, sources = checks.make_setting(ctx), p.get("sources") or ()
        with Bar() as bar:
            content = build.gather(p["kind"], setting, sources, bar.show)
        file.write(build.build(content))
    for name, reason in content.left_out.items():
        if name not in ("run", "speed", "fmu"):  # a file brings them
            print(f"kr16: no page on {name}: {reason}", file=sys.stderr)
    return 1 if content.count("failed") else 0


def _file(output: str | None) -> str:
    if output is None or output == "-":
        raise InputError("a report is a PDF file; give its name: -o FILE.pdf")
    if Path(output).suffix.lower() != ".pdf":
        raise InputError(f"-o {output}: the suffix must be .pdf")
    return output
