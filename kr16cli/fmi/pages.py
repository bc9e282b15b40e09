"""The page about an FMU that lies inside it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import NamedTuple

from kr16cli.fmi.variables import TYPES, Variable


class Row(NamedTuple):
    """One variable as the page shows it."""

    name: str
    causality: str
    variability: str
    unit: str
    start: str
    description: str


def row(variable: Variable) -> Row:
    """The row of a variable: its unit, or its type where it has none."""
    v, kind = variable, TYPES[variable.type]
    return Row(v.name, v.causality, v.variability, kind.unit or kind.base, start(v), v.description)


def start(variable: Variable) -> str:
    """The start value as the page shows it; empty for outputs."""
    value = variable.start
    if value is None:
        return ""
    return str(value).lower() if variable.base != "Real" else f"{value:.6g}"


def filled(template: str, texts: Mapping[str, object], rows: Iterable[Row]) -> bytes:
    """The page of a template, whose `{{words}}` are replaced; `{{variables}}` by the rows."""
    text = template
    for key, value in texts.items():
        text = text.replace(f"{{{{{key}}}}}", escape(str(value)))
    return text.replace("{{variables}}", "\n".join(map(_html, rows))).encode()


def _html(cells: Row) -> str:
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
