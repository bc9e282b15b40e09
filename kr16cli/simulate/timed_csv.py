"""CSV files that tabulate six numbers over time: torques, waypoints.

The header names time (s) and the six columns; units in brackets and other columns may stand
beside them. Comma, tab, or semicolon with decimal comma.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import NamedTuple

from kr16cli.errors import FileError
from kr16cli.robot_rules import Quantity

Names = tuple[str, ...]


class TimedTable(NamedTuple):
    """Rising `times` (s), a row of six numbers for each, and the `names` of their columns."""

    times: list[float]
    rows: list[list[float]]
    names: Names


def read_timed_csv(path: str | Path, choices: Mapping[Names, Quantity]) -> TimedTable:
    """Read a table over time.

    Args:
        path: the file.
        choices: the sets of columns it may have, each with what its numbers are.

    Raises:
        FileError: the file cannot be read, or the line and column that cannot be used.
    """
    text = _text(path)
    head = text.split("\n", 1)[0]
    delimiter = next((mark for mark in (";", "\t") if mark in head), ",")
    reader = csv.reader(StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True)
    header: list[str] | None = None
    names = next(iter(choices))
    times: list[float] = []
    rows: list[list[float]] = []
    try:
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = [cell.split("[")[0].strip().lower() for cell in cells]
                names = _chosen(path, header, list(choices))
                continue
            where = f"line {reader.line_num}"
            values = _row(path, where, cells, header, names, choices[names], delimiter)
            if times and values[0] <= times[-1]:
                raise FileError(path, f"{where}: time {values[0]:g} s does not exceed the one "
                                f"before, {times[-1]:g} s; times must rise")  # fmt: skip
            times.append(values[0])
            rows.append(values[1:])
    except csv.Error as error:
        raise FileError(path, f"line {reader.line_num}: no CSV: {error}") from None
    if not rows:
        found = "is empty" if header is None else "has a header and no row"
        raise FileError(path, f"{found}; it needs rows of {','.join(('time', *names))}")
    return TimedTable(times, rows, names)


def _text(path: str | Path) -> str:
    try:
        return Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(path, f"not UTF-8 text at byte {error.start}") from None
    except IsADirectoryError:
        raise FileError(path, "is a directory; name a file in it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(path, f"cannot be read: {reason}") from None


def _chosen(path: str | Path, header: list[str], choices: Sequence[Names]) -> Names:
    """The columns a header names: the set of which it names most."""
    names = max(choices, key=lambda names: sum(name in header for name in names))
    needed = ("time", *names)
    missing = [name for name in needed if name not in header]
    if missing:
        known = " or ".join(",".join(("time", *names)) for names in choices)
        found = ", ".join(header)[:80]
        raise FileError(
            path, f"the header lacks {', '.join(missing)}; it must name {known}, found: {found}"
        )
    double = next((name for name in needed if header.count(name) > 1), None)
    if double:
        raise FileError(path, f"the header names {double} twice")
    return names


def _row(
    path: str | Path,
    where: str,
    cells: list[str],
    header: list[str],
    names: Names,
    quantity: Quantity,
    delimiter: str,
) -> list[float]:
    """Time and numbers of one row."""
    if len(cells) != len(header):
        reason = f"{len(cells)} cells where the header has {len(header)}"
        raise FileError(path, f"{where}: {reason}")
    values = []
    for name in ("time", *names):
        cell = cells[header.index(name)].strip()
        try:
            value = float(cell.replace(",", ".") if delimiter == ";" else cell)
        except ValueError:
            shown = f"'{cell}'" if cell else "empty"
            raise FileError(path, f"{where}: {name} is {shown}; it must be a number") from None
        if not math.isfinite(value):
            raise FileError(path, f"{where}: {name} is {cell}; every number must be finite")
        problem = None if name == "time" else quantity.problem(value)
        if problem:
            raise FileError(path, f"{where}: {name} is {cell}: {problem}")
        values.append(value)
    return values
