"""The command line `kr16`: one short file per command, no maths; `main` is the entry point.

A command's module is imported when the command is asked for, and holds `app`, a
`typer.Typer` made by `kr16cli.cli.command.new_app`. `app` of this package lists them.
"""

from __future__ import annotations

from kr16cli.cli.entry import main

__all__ = ["main"]
