"""A small study for tests of those who run studies: rows that tell of themselves."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from kr16cli.study.streams import uniforms
from kr16cli.study.work import Chunk, Column


@dataclass(frozen=True)
class Toy:
    """Row i holds i, its square and three random numbers; each computation leaves a mark.

    `fatal` names a file: the process that finds it removes it and dies in the middle of a chunk.
    `deadly`: no process survives a chunk that starts at this row or later.
    """

    rows: int = 23
    chunk_rows: int = 5
    seed: int = 3
    seconds: float = 0.0
    marks: str | None = None
    fatal: str | None = None
    deadly: int | None = None
    prefers: Literal["threads", "processes"] = "threads"

    def columns(self) -> dict[str, Column]:
        return {
            "index": Column("i8"),
            "square": Column("f4", unit="1"),
            "random": Column("f8", (3,)),
        }

    def describe(self) -> dict[str, Any]:
        return {"study": "toy", "rows": self.rows, "seed": self.seed}

    def compute(self, start: int, stop: int) -> Chunk:
        if self.marks is not None:
            Path(self.marks, f"{start}-{os.getpid()}-{time.monotonic_ns()}").touch()
        if self.fatal is not None:
            try:
                Path(self.fatal).unlink()
            except FileNotFoundError:
                pass
            else:
                os._exit(1)
        if self.deadly is not None and start >= self.deadly:
            os._exit(1)
        time.sleep(self.seconds)
        index = np.arange(start, stop)
        return {
            "index": index,
            "square": index**2,
            "random": uniforms(self.seed, 0, start, stop, 3),
        }


def computed(marks: Path) -> list[int]:
    """First rows of the chunks that were computed, in order, a chunk as often as it was."""
    return sorted(int(mark.name.split("-")[0]) for mark in marks.iterdir())
