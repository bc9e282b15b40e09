"""Joint torques as functions of time and state, and the CSV files that tabulate them."""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from collections.abc import Sequence
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Protocol

from kr16cli.errors import FileError
from kr16cli.simulate.scenario import TorqueSpec
from kr16cli.simulate.scenario_check import TORQUE
from kr16cli.single import Arm

_COLUMNS = ("time", *(f"tau{i}" for i in range(1, 7)))


class Torque(Protocol):
    """What drives the joints.

    `breaks` are the times (s, rising) at which the torque is not smooth; the solver starts
    afresh there, so that no step of it spans a kink.
    """

    @property
    def breaks(self) -> Sequence[float]:
        """Times of kinks, s."""

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """Six joint torques (N m) at time t (s) in state q (rad), qd (rad/s)."""


class Constant:
    """The same torques all the time."""

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

    The header names time (s) and tau1 to tau6 (N m); units in brackets and other columns may
    stand beside them, so a run's own CSV can be read. Comma, tab, or semicolon with decimal
    comma.

    Raises:
        FileError: the file cannot be read, or the line and column that cannot be used.
    """
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(path, f"not UTF-8 text at byte {error.start}") from None
    except IsADirectoryError:
        raise FileError(path, "is a directory; name a CSV file in it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read: {reason}") from None
    head = text.split("\n", 1)[0]
    delimiter = next((mark for mark in (";", "\t") if mark in head), ",")
    reader = csv.reader(StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True)
    header: list[str] | None = None
    times: list[float] = []
    rows: list[list[float]] = []
    try:
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = [cell.split("[")[0].strip().lower() for cell in cells]
                _check_header(path, header)
                continue
            where = f"line {reader.line_num}"
            values = _row(path, where, cells, header, decimal_comma=delimiter == ";")
            if times and values[0] <= times[-1]:
                raise FileError(path, f"{where}: time {values[0]:g} s does not exceed the one "
                                f"before, {times[-1]:g} s; times must rise")  # fmt: skip
            times.append(values[0])
            rows.append(values[1:])
    except csv.Error as error:
        raise FileError(path, f"line {reader.line_num}: no CSV: {error}") from None
    if not rows:
        found = "is empty" if header is None else "has a header and no row"
        raise FileError(path, f"{found}; it needs rows of {','.join(_COLUMNS)}")
    return Table(times, rows)


def _check_header(path: str | Path, header: list[str]) -> None:
    missing = [name for name in _COLUMNS if name not in header]
    if missing:
        raise FileError(
            path,
            f"the header lacks {', '.join(missing)}; it must name {','.join(_COLUMNS)}, "
            f"found: {', '.join(header)[:80]}",
        )
    double = next((name for name in _COLUMNS if header.count(name) > 1), None)
    if double:
        raise FileError(path, f"the header names {double} twice")


def _row(
    path: str | Path, where: str, cells: list[str], header: list[str], *, decimal_comma: bool
) -> list[float]:
    """Time and torques of one row."""
    if len(cells) != len(header):
        reason = f"{len(cells)} cells where the header has {len(header)}"
        raise FileError(path, f"{where}: {reason}")
    values = []
    for name in _COLUMNS:
        cell = cells[header.index(name)].strip()
        try:
            value = float(cell.replace(",", ".") if decimal_comma else cell)
        except ValueError:
            shown = f"'{cell}'" if cell else "empty"
            raise FileError(path, f"{where}: {name} is {shown}; it must be a number") from None
        if not math.isfinite(value):
            raise FileError(path, f"{where}: {name} is {cell}; every number must be finite")
        problem = None if name == "time" else TORQUE.problem(value)
        if problem:
            raise FileError(path, f"{where}: {name} is {cell}: {problem}")
        values.append(value)
    return values
