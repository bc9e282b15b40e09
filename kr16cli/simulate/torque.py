"""Joint torques as functions of time and state."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from kr16cli.simulate.core import Torque
from kr16cli.simulate.scenario import TorqueSpec
from kr16cli.simulate.scenario_check import TORQUE
from kr16cli.simulate.timed_csv import read_timed_csv
from kr16cli.single import Arm

__all__ = ["Constant", "GravityCompensation", "Table", "Torque", "make_torque", "read_torque_csv"]

_COLUMNS = tuple(f"tau{i}" for i in range(1, 7))


class Constant:
    """The same torques all the time."""

    steady = True
    breaks: Sequence[float] = ()

    def __init__(self, tau: Sequence[float] = (0.0,) * 6) -> None:
        self.tau = tuple(tau)

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """The torques, whatever time and state."""
        return self.tau


class GravityCompensation:
    """tau = G(q) of the arm with its payload: without friction, it floats."""

    breaks: Sequence[float] = ()

    def __init__(self, arm: Arm) -> None:
        self._gravity = arm.gravity

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """G(q)."""
        return self._gravity(q)


class Table:
    """Torques tabulated over time: straight lines between rows, the end rows held beyond them.

    Args:
        times: rising, s.
        rows: six torques (N m) for each time.
    """

    def __init__(self, times: Sequence[float], rows: Sequence[Sequence[float]]) -> None:
        self.times, self.rows = list(times), [tuple(row) for row in rows]
        self._slopes = [
            tuple((b - a) / (t1 - t0) for a, b in zip(low, high, strict=True))
            for (t0, t1), (low, high) in zip(pairwise(self.times), pairwise(self.rows), strict=True)
        ]
        flat = (0.0,) * 6
        slopes = [flat, *self._slopes, flat]
        self.breaks: Sequence[float] = [
            t
            for t, (before, after) in zip(self.times, pairwise(slopes), strict=True)
            if not all(math.isclose(a, b, rel_tol=1e-9) for a, b in zip(before, after, strict=True))
        ]

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """The row at time t."""
        i = bisect_right(self.times, t) - 1
        if i < 0 or i >= len(self._slopes):
            return self.rows[0 if i < 0 else -1]
        after = t - self.times[i]
        return [v + s * after for v, s in zip(self.rows[i], self._slopes[i], strict=True)]


def make_torque(spec: TorqueSpec, arm: Arm, folder: Path) -> Torque:
    """The torque of a scenario; a CSV file's name is relative to `folder`."""
    if spec.kind == "gravity":
        return GravityCompensation(arm)
    if spec.kind == "csv":
        return read_torque_csv(folder / str(spec.file))
    return Constant(spec.tau or (0.0,) * 6)


def read_torque_csv(path: str | Path) -> Table:
    """Read torques over time from a CSV file.

    The header names time (s) and tau1 to tau6 (N m), see `timed_csv`, so a run's own CSV can
    be read.

    Raises:
        FileError: the file cannot be read, or the line and column that cannot be used.
    """
    table = read_timed_csv(path, {_COLUMNS: TORQUE})
    return Table(table.times, table.rows)
