"""Progress on a terminal's stderr; nothing elsewhere."""

from __future__ import annotations

import sys


class Bar:
    """How many of some things are done, on one line that vanishes at the end."""

    def __init__(self) -> None:
        self.shown = sys.stderr is not None and sys.stderr.isatty()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *details: object) -> None:
        self.clear()

    def clear(self) -> None:
        """Take the line away."""
        if self.shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def show(self, done: int, total: int, after: str) -> None:
        """So many are done of the total; `after` goes on from there."""
        if self.shown:
            text = f"{'#' * round(30 * done / total):-<30} {done} of {total}{after}"
            print(f"\r\x1b[K{text[:78]}", end="", file=sys.stderr, flush=True)

    def say(self, text: str) -> None:
        """What is being done, where nobody knows how much there is."""
        if self.shown:
            print(f"\r\x1b[K{text[:78]}", end="", file=sys.stderr, flush=True)
