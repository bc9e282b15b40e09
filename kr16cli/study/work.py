"""What a study is to those who run it: a table of rows that can be computed in any order."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from kr16cli.errors import Kr16Error

Chunk = dict[str, npt.NDArray[Any]]
"""Columns of consecutive rows; the first axis counts them."""


class Column(NamedTuple):
    """One column of the table: NumPy's dtype, shape of one entry, and unit."""

    dtype: str
    shape: tuple[int, ...] = ()
    unit: str = ""


class Work(Protocol):
    """A study. It can be pickled, and a row depends on its index alone.

    Attributes:
        rows: how many rows there are.
        chunk_rows: how many of them are computed and kept together.
        prefers: "threads" where the work is done by NumPy or the kernels, which let other
            threads run meanwhile; "processes" where it is done by Python.
    """

    @property
    def rows(self) -> int:
        """How many rows."""

    @property
    def chunk_rows(self) -> int:
        """Rows of a chunk."""

    @property
    def prefers(self) -> Literal["threads", "processes"]:
        """What runs it best on one machine."""

    def columns(self) -> Mapping[str, Column]:
        """The columns by name."""

    def describe(self) -> dict[str, Any]:
        """All that the rows depend on, JSON-ready: equal descriptions have equal rows."""

    def compute(self, start: int, stop: int) -> Chunk:
        """Rows `start` to `stop` (exclusive)."""


class ForeignWorkerError(Kr16Error):
    """A worker that would compute other numbers than this process."""

    exit_code = 2


def chunks(work: Work) -> int:
    """How many chunks the rows make."""
    return -(-work.rows // work.chunk_rows)


def bounds(work: Work, index: int) -> tuple[int, int]:
    """First row of a chunk, and the one after its last."""
    start = index * work.chunk_rows
    return start, min(start + work.chunk_rows, work.rows)


def row_bytes(work: Work) -> int:
    """Bytes of one row."""
    return sum(
        np.dtype(c.dtype).itemsize * int(np.prod(c.shape, dtype=int))
        for c in work.columns().values()
    )


def stamp() -> str:
    """What decides the last bits of a number beside the description: version and engine."""
    from kr16cli import __version__
    from kr16cli.kernels import engine_name

    return f"kr16cli {__version__}, engine {engine_name()}"


def fingerprint(work: Work) -> str:
    """SHA-256 of all that the rows and their cutting depend on."""
    content = [work.describe(), stamp(), work.rows, work.chunk_rows]
    text = json.dumps(content, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def compute_chunk(work: Work, index: int, asker: str) -> tuple[int, Chunk]:
    """A chunk with its index; what every worker runs.

    Args:
        work: the study.
        index: which chunk, from 0.
        asker: the `stamp` of the process that asks.

    Raises:
        ForeignWorkerError: this process has another version or engine.
    """
    mine = stamp()
    if mine != asker:
        raise ForeignWorkerError(
            f"a worker has {mine}, this process {asker}; install the same kr16cli on both"
        )
    start, stop = bounds(work, index)
    return index, checked_chunk(work, index, work.compute(start, stop))


def checked_chunk(work: Work, index: int, chunk: Chunk) -> Chunk:
    """The chunk with its columns in order, dtype and shape as promised; RuntimeError if not."""
    start, stop = bounds(work, index)
    made: Chunk = {}
    for name, column in work.columns().items():
        array = np.ascontiguousarray(chunk[name], dtype=column.dtype)
        if array.shape != (stop - start, *column.shape):
            raise RuntimeError(f"column {name} of chunk {index} has shape {array.shape}")
        made[name] = array
    return made


def in_memory(work: Work) -> Iterator[Chunk]:
    """All chunks in order, computed here and kept by nobody."""
    for index in range(chunks(work)):
        yield compute_chunk(work, index, stamp())[1]
