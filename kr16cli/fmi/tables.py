"""CSV files of signals: the inputs of an FMU, and what came out of it."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Mapping, Sequence
from io import StringIO
from pathlib import Path

from kr16cli.errors import FileError
from kr16cli.fmi.play import Signals

_UNIT = re.compile(r"\s+(\[[^\]]*\]|\([^)]*\))$")
_NUMBERED = re.compile(r"(.*[A-Za-z_])([1-9]\d*)")


def read_signals(path: str | Path, known: Collection[str]) -> Signals:
    """Read inputs over time.

    The header names time (s) and inputs, in any order: `tau[1]` or `tau1`, a unit in brackets
    after a blank is left aside. Comma, tab, or semicolon with decimal comma.

    Args:
        path: the file.
        known: names of the inputs; other columns are refused.

    Raises:
        FileError: the file cannot be read, or the line and column that cannot be used.
    """
    lines = [line for line in _text(path).splitlines() if line.strip()]
    if len(lines) < 2:
        raise FileError(path, "needs a header (time and inputs) and at least one row")
    mark = next((m for m in (";", "\t") if m in lines[0]), ",")
    reader = csv.reader(StringIO("\n".join(lines)), delimiter=mark, skipinitialspace=True)
    header = [_name(cell, known) for cell in next(reader)]
    _check_header(path, header, known)
    rows: list[list[float]] = []
    for cells in reader:
        where = f"row {reader.line_num - 1}"
        if len(cells) != len(header):
            raise FileError(path, f"{where}: {len(cells)} cells where the header has {len(header)}")
        row = [
            _number(path, f"{where}: {name}", cell.replace(",", ".") if mark == ";" else cell)
            for name, cell in zip(header, cells, strict=True)
        ]
        time = row[header.index("time")]
        if rows and time <= rows[-1][header.index("time")]:
            raise FileError(path, f"{where}: time {time:g} s does not exceed the one before")
        rows.append(row)
    columns = dict(zip(header, map(list, zip(*rows, strict=True)), strict=True))
    return Signals(columns.pop("time"), columns)


def _text(path: str | Path) -> str:
    try:
        return Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(path, f"not UTF-8 text at byte {error.start}") from None
    except IsADirectoryError:
        raise FileError(path, "is a directory; name a CSV file in it") from None
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None


def _name(cell: str, known: Collection[str]) -> str:
    """The variable a column's head means."""
    name = _UNIT.sub("", cell.strip())
    if name.lower() == "time":
        return "time"
    numbered = _NUMBERED.fullmatch(name)
    if name not in known and numbered and f"{numbered[1]}[{numbered[2]}]" in known:
        return f"{numbered[1]}[{numbered[2]}]"
    return name


def _check_header(path: str | Path, header: Sequence[str], known: Collection[str]) -> None:
    if "time" not in header:
        raise FileError(path, f"the header lacks time; found: {', '.join(header)[:80]}")
    for name in header:
        if name != "time" and name not in known:
            shown = ", ".join(list(known)[:6])
            raise FileError(path, f"column {name} is no input of the FMU; it has {shown}, ...")
        if header.count(name) > 1:
            raise FileError(path, f"the header names {name} twice")


def _number(path: str | Path, where: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        raise FileError(path, f"{where} is {cell.strip()!r}; it must be a number") from None
    if not math.isfinite(value):
        raise FileError(path, f"{where} is {cell.strip()}; every number must be finite")
    return value


def to_csv(columns: Mapping[str, Sequence[float]], units: Mapping[str, str]) -> str:
    """Columns as CSV, units in the header after a blank: `q[1] [rad]`."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([f"{name} [{units[name]}]" if units.get(name) else name for name in columns])
    for row in zip(*columns.values(), strict=True):
        writer.writerow([repr(v + 0.0) for v in row])
    return out.getvalue()
