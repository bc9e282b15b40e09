"""`kr16 fmu table`: FMUs beside the simulator, each interface, host and platform a row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import typer

from kr16cli.cli import batch, render
from kr16cli.cli import output as out
from kr16cli.cli import run as runs
from kr16cli.cli.options import Json, Output, Robot
from kr16cli.cli.progress import Bar
from kr16cli.errors import CheckFailedError


def table(ctx: typer.Context, output: Output = None, robot: Robot = None,
          json: Json = False) -> None:  # fmt: skip
    """Build all FMUs, run them wherever this machine can, compare; exit code 1 if one fails.

    Windows needs wine, ARM qemu-user and libc6-arm64-cross, other platforms than this ziglang.

    $ kr16 fmu table -o fmus.json
    $ kr16 report verification --from fmus.json -o verification.pdf
    """
    from kr16cli.fmi import evidence

    kind = out.choose_format(None, json, output, ("table", "json"))
    with out.Target(output) as target, Bar() as bar:
        found = evidence.table(runs.load(ctx), bar.say)
        bar.clear()
        rows = found["result"]["rows"]
        cells = [
            [r["file"], r["fmi_version"], r["interface"], f"{r['host']}, {r['platform']}",
             _worst(r), "passed" if r["passed"] else f"FAILED: {r['problems'][0]}"]
            for r in rows
        ]  # fmt: skip
        header = ["FMU", "FMI", "interface", "host", "relative deviation", "status"]
        text = render.json_text(found) if kind == "json" else "\n".join(render.grid(header, cells))
        target.write(text if text.endswith("\n") else text + "\n")
    batch.warn(found["warnings"])
    failed = [r for r in rows if not r["passed"]]
    if failed:
        raise CheckFailedError(
            f"{len(failed)} of {len(rows)} FMUs fail, the first {failed[0]['file']}"
        )


def _worst(row: Mapping[str, Any]) -> str:
    found = [d["relative"] for d in row["deviations"]]
    return "not finite" if None in found else f"{max(found, default=0.0):.1e}"
