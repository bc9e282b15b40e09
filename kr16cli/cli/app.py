"""The root of `kr16`: its commands by name; each module is imported only when asked for."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Annotated, Any

import typer

from kr16cli.cli.command import LeanGroup, new_app, unknown

COMMANDS = {
    "info": "The robot, where its numbers come from, and which engine runs.",
    "fk": "Forward kinematics: joint angles to the pose of the flange.",
    "ik": "Inverse kinematics: a pose to all joint configurations.",
    "jacobian": "The Jacobian, its rate, and how near singularities are.",
    "dynamics": "Mass matrix, Coriolis matrix, gravity, torques, accelerations.",
    "simulate": "Simulate a motion.",
    "verify": "Verify the model and report each case.",
    "report": "Write a report.",
    "fmu": "Build, check and run FMUs.",
    "bench": "Time the kernels on this machine.",
    "export": "Write the robot as URDF or MJCF.",
    "robot": "Check a parameter file, or write a commented one.",
    "map": "Maps over the workspace.",
    "sweep": "Vary parameters of a scenario.",
    "uncertainty": "How far results can be trusted.",
}


def available() -> list[str]:
    """The commands this installation has."""
    return [name for name in COMMANDS if find_spec(f"kr16cli.cli.{name}") is not None]


class _LazyGroup(LeanGroup):
    """Finds a command by importing its module."""

    def list_commands(self, ctx: Any) -> list[str]:
        return available()

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in COMMANDS or find_spec(f"kr16cli.cli.{cmd_name}") is None:
            return None
        command = typer.main.get_command(import_module(f"kr16cli.cli.{cmd_name}").app)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, COMMANDS[name]) for name in available()])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        command = self.get_command(ctx, args[0])
        if command is None and not ctx.resilient_parsing:
            raise unknown("command", args[0], available())
        return args[0] if command else None, command, args[1:]


app = new_app(cls=_LazyGroup, invoke_without_command=True, add_completion=True)


def _version(wanted: bool) -> None:
    if wanted:
        from kr16cli.queries.info import version_line

        print(version_line())
        raise typer.Exit


@app.callback()
def root(
    ctx: typer.Context,
    robot: Annotated[
        str | None,
        typer.Option("--robot", metavar="FILE", help="Parameter file, or a shipped name: kr16_l6."),
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Version and model.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show tracebacks.")] = False,
) -> None:
    """Kinematics, dynamics and simulation of the KUKA KR 16-2.

    $ kr16 fk 0 -90 90 0 0 0
    $ kr16 ik 1088 0 1320 0 90 0 --json

    Angles are in degrees and lengths in mm (X Y Z A B C), unless --si. kr16 COMMAND --help
    tells more. Not affiliated with KUKA; not for safety functions.
    """
    ctx.obj = {"robot": robot}
    if ctx.invoked_subcommand is None:
        typer.echo(ctx.get_help(), err=True)
        raise typer.Exit(2)
