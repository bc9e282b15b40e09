"""Results as text: JSON envelopes, CSV, and tables with aligned numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

Cell = Any
# Decimals of a table by unit; other numbers get six significant digits.
_DECIMALS = {"mm": 3, "deg": 4, "m": 6, "rad": 6}


def json_text(envelope: Mapping[str, Any]) -> str:
    """The envelope as JSON: full precision, one entry of `result` and one row per line."""
    import json

    def line(value: Any) -> str:
        return json.dumps(value, allow_nan=False, ensure_ascii=False)

    def block(value: Any, indent: str) -> str:
        if isinstance(value, dict) and value and len(indent) < 4:
            inner = ",\n".join(
                f"{indent}  {line(key)}: {block(item, indent + '  ')}"
                for key, item in value.items()
            )
            return f"{{\n{inner}\n{indent}}}"
        if isinstance(value, list) and value and isinstance(value[0], (dict, list)):
            inner = ",\n".join(f"{indent}  {line(item)}" for item in value)
            return f"[\n{inner}\n{indent}]"
        return line(value)

    return block(dict(envelope), "") + "\n"


def csv_text(rows: Sequence[Mapping[str, Cell]]) -> str:
    """Rows as CSV with a header of all their columns; full precision, missing cells empty."""
    import csv
    from io import StringIO

    columns = list(dict.fromkeys(name for row in rows for name in row))
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        cells = (row.get(name) for name in columns)
        writer.writerow(["" if cell is None else _exact(cell) for cell in cells])
    return out.getvalue()


def _exact(cell: Cell) -> str:
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


def batch_table(rows: Sequence[Mapping[str, Cell]], units: Mapping[str, str]) -> str:
    """Rows of a batch under column names with units."""
    columns = list(dict.fromkeys(name for row in rows for name in row if name != "units"))
    header = [f"{name} {units[name]}" if name in units else name for name in columns]
    cells = [[shown(row.get(name), units.get(name)) for name in columns] for row in rows]
    return "\n".join(grid(header, cells, indent="")) + "\n"
