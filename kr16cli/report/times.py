"""Wall times of `kr16 bench --json` as a record: only in a report that was given them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

SCHEMA = "kr16.bench/1"


_MORE = {"rate": "gflop_s", "moved": "gb_s", "share": "share", "ratio": "ratio",
         "call_ratio": "call_ratio"}  # fmt: skip

_LIMITS = ("gflop_s", "read_gb_s", "write_gb_s")


class Timing(NamedTuple):
    """Times of one quantity, ns: in a batch, in threads, one call alone, and of other engines.

    In the batch: `rate`, 1e9 operations/s; `moved`, 1e9 bytes/s; `share` of the limit of one core
    that binds. `ratio` is the fastest peer's time over the batch's, `call_ratio` that of a call of
    Pinocchio over the own call. None where it was not measured.
    """

    name: str
    batch_ns: float
    threads_ns: float
    call_ns: float
    peers: Mapping[str, float]
    rate: float | None = None
    moved: float | None = None
    share: float | None = None
    ratio: float | None = None
    call_ratio: float | None = None

    @property
    def fastest(self) -> str | None:
        """The peer with the least time."""
        return min(self.peers, key=lambda name: self.peers[name], default=None)


class Bench(NamedTuple):
    """A measurement: its rows, what it was made with, and what to beware of.

    `limits` are one core's: 1e9 operations/s, 1e9 bytes/s read and written.
    """

    rows: tuple[Timing, ...]
    machine: str
    threads: int
    limits: tuple[float, ...]
    warnings: tuple[str, ...]


def read(table: Mapping[str, Any]) -> Bench:
    """The record of a file of `kr16 bench --json`.

    Raises:
        KeyError, TypeError, ValueError: a row that is not whole.
    """
    result, given = table["result"], table.get("input") or {}
    limits = result.get("limits") or {}
    about = {"engine": result.get("engine"), **(result.get("machine") or {}), **given}
    return Bench(
        tuple(_timing(row) for row in result["rows"]),
        ", ".join(f"{key} {value}" for key, value in about.items()),
        int(given.get("threads", 1)),
        tuple(float(limits[key]) for key in _LIMITS if key in limits),
        tuple(map(str, table.get("warnings") or ())),
    )


def _timing(row: Mapping[str, Any]) -> Timing:
    return Timing(
        str(row["quantity"]),
        float(row["batch_ns"]),
        float(row["threads_ns"]),
        float(row["call_ns"]),
        {str(name): float(ns) for name, ns in (row.get("peers") or {}).items()},
        **{field: _optional(row.get(key)) for field, key in _MORE.items()},
    )


def _optional(value: Any) -> float | None:
    return None if value is None else float(value)
