"""Results as text: JSON envelopes, CSV, and tables with aligned numbers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Cell = Any
# Decimals of a table by unit; other numbers get six significant digits.
_DECIMALS = {"mm": 3, "deg": 4, "m": 6, "rad": 6}
_LARGE = 1e12  # from here on decimals mean nothing: what is left of a failed run


class Encoded(list[str]):
    """A list whose items are JSON already."""


def json_line(value: Any) -> str:
    """A value as JSON on one line; full precision, NaN refused."""
    import json

    return json.dumps(value, allow_nan=False)


def json_text(envelope: Mapping[str, Any]) -> str:
    """The envelope as JSON, one entry of `result` and one row per line."""

    def block(value: Any, indent: str) -> str:
        if isinstance(value, dict) and value and len(indent) < 4:
            inner = (f"{json_line(key)}: {block(v, indent + '  ')}" for key, v in value.items())
            return _enclosed("{}", inner, indent)
        if isinstance(value, Encoded):
            return _enclosed("[]", value, indent)
        if isinstance(value, list) and value and isinstance(value[0], (dict, list)):
            return _enclosed("[]", map(json_line, value), indent)
        return json_line(value)

    return block(dict(envelope), "") + "\n"


def _enclosed(brackets: str, items: Iterable[str], indent: str) -> str:
    inner = ",\n".join(f"{indent}  {item}" for item in items)
    return f"{brackets[0]}\n{inner}\n{indent}{brackets[1]}" if inner else brackets


def csv_text(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A CSV file of cells that are text already."""
    import csv
    from io import StringIO

    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()


def exact(cell: Cell) -> str:
    """A cell of a CSV file: full precision, never -0, empty where there is nothing."""
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    return repr(cell + 0.0) if isinstance(cell, float) else str(cell)


def shown(cell: Cell, unit: str | None = None) -> str:
    """A cell of a table: rounded by its unit, never -0, empty where there is nothing."""
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if not isinstance(cell, float):
        return str(cell)
    decimals = _DECIMALS.get(unit or "")
    if decimals is None:
        return f"{cell + 0.0:.6g}"
    if abs(cell) >= _LARGE:
        return f"{cell:.6e}"
    text = f"{cell:.{decimals}f}"
    return text[1:] if text.startswith("-") and float(text) == 0.0 else text


def grid(header: Sequence[str], rows: Sequence[Sequence[str]], indent: str = "  ") -> list[str]:
    """Rows under a header, columns aligned: numbers right, words left."""
    table = [list(header), *map(list, rows)] if any(header) else [list(row) for row in rows]
    if not table:
        return []
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    right = [
        all(_numeric(row[i]) for row in rows) and any(row[i] for row in rows)
        for i in range(len(widths))
    ]
    lines = []
    for row in table:
        cells = (
            cell.rjust(width) if flush else cell.ljust(width)
            for cell, width, flush in zip(row, widths, right, strict=True)
        )
        lines.append((indent + "  ".join(cells)).rstrip())
    return lines


def _numeric(text: str) -> bool:
    return not text or text.lstrip("-")[:1].isdigit()


def matrix(values: Sequence[Sequence[Any]], unit: str | None = None) -> list[str]:
    """Lines of a matrix with aligned columns; rounding noise shows as 0."""
    largest = max((abs(v) for row in values for v in row if v is not None), default=0.0)
    return grid([], [[shown(_quiet(v, largest), unit) for v in row] for row in values])


def vector(values: Sequence[Any], unit: str | None = None) -> str:
    """One line of numbers; rounding noise shows as 0."""
    largest = max((abs(v) for v in values if v is not None), default=0.0)
    return "  ".join(shown(_quiet(v, largest), unit) for v in values)


def _quiet(value: float | None, largest: float) -> float | None:
    """Zero for what is rounding beside the largest entry, as tables are for reading."""
    if value is None or abs(value) < 1e-14 * largest:
        return None if value is None else 0.0
    return float(value)
