"""The commands under `kr16 verify`: chapter, model, poses."""

from __future__ import annotations

import typer

from kr16cli.cli import checks
from kr16cli.cli import options as o


def chapter(
    ctx: typer.Context, quick: checks.Quick = False, seed: checks.Seed = None,
    format_: o.Told = None, json: o.Json = False, output: o.Output = None,
) -> None:  # fmt: skip
    """Judge every printed equation of chapter 3; 0 when every verdict is proved.

    $ kr16 verify chapter --quick
    $ kr16 verify chapter --quick --json
    """
    raise typer.Exit(checks.chapter(ctx))


def model(
    ctx: typer.Context, file: checks.UrdfFile, robot: o.Robot = None, format_: o.Told = None,
    json: o.Json = False, junit: checks.Junit = None, output: o.Output = None,
) -> None:  # fmt: skip
    """Judge somebody's URDF of this arm: what differs, and by how much.

    $ kr16 export urdf -o kr16.urdf
    $ kr16 verify model kr16.urdf
    """
    raise typer.Exit(checks.model(ctx, file))


def poses(
    ctx: typer.Context, file: checks.PoseFile, si: o.Si = False, robot: o.Robot = None,
    format_: o.Told = None, json: o.Json = False, junit: checks.Junit = None,
    output: o.Output = None,
) -> None:  # fmt: skip
    """Judge recorded joint angles and poses: residuals, best-fit base and tool, outliers.

    $ kr16 verify poses example_poses
    $ kr16 verify poses example_poses --json
    """
    raise typer.Exit(checks.poses(ctx, file))
