"""kr16 bench."""

from typing import Annotated

import typer

from kr16cli.cli import options as o
from kr16cli.cli import output as out
from kr16cli.cli import render, run, values
from kr16cli.cli.command import Command, new_app

app = new_app()


@app.command(cls=Command)
def bench(
    ctx: typer.Context,
    peers: Annotated[bool, typer.Option("--peers", help="Other engines too, if there.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer configurations.")] = False,
    threads: Annotated[
        str, typer.Option("--threads", metavar="N", help="Of the second column.")
    ] = "2",
    robot: o.Robot = None,
    format_: o.Told = None,
    json: o.Json = False,
    output: o.Output = None,
) -> None:
    """Time the kernels on this machine, beside other engines with --peers.

    $ kr16 bench --quick
    $ kr16 bench --quick --json

    Batches go into an array of the caller's; ratio is the fastest peer's time over the batch's.
    """
    from kr16cli.api import Robot
    from kr16cli.bench import report

    count = values.whole(threads, "--threads", 1, 64) or 1
    kind = out.choose_format(format_, json, output, ("table", "json"))
    with out.Target(output) as target:
        answer = report.bench(
            Robot(run.load(ctx)),
            n=4096 if quick else 100_000,
            threads=count,
            rounds=1 if quick else 10,
            with_peers=peers,
        )
        target.write(render.json_text(answer) if kind == "json" else report.table(answer))
