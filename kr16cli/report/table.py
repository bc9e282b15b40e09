"""Tables that flow over pages: wrapped cells, a repeated header, rules between rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from kr16cli.report.page import LEADING, LEFT, Document, Page
from kr16cli.report.style import INK, MUTED, TINT
from kr16cli.report.typeset import BOLD, PLAIN, Face, Formula, formula, wrap

_GAP = 7.0
"""Between columns."""

_Wrapped = Sequence[str | Formula]


class Cell(NamedTuple):
    """Text with a look of its own; `math` asks for a plain formula to be set as one."""

    text: str
    face: Face = PLAIN
    color: str = INK
    math: bool = False


class Column(NamedTuple):
    """A column: header, width in points (without the gap after it), alignment."""

    header: str
    width: float
    align: str = "left"


@dataclass(frozen=True)
class Row:
    """Where a row landed: its page and the middle of its height, for bars beside it."""

    page: Page
    middle: float


def table(
    document: Document,
    page: Page,
    title: str,
    columns: Sequence[Column],
    rows: Sequence[Sequence[str | Cell]],
    *,
    size: float = 7.5,
    pad: float = 2.0,
    left: float = LEFT,
    keep: float = 0.0,
    on_page: Callable[[Page, float], None] | None = None,
) -> tuple[Page, list[Row]]:
    """Set a table from the cursor on, over as many pages as it takes.

    Args:
        document: takes the pages.
        page: where to begin.
        title: of the pages that follow.
        columns: their widths with gaps of 7 points must fit the page.
        rows: cells by column; text alone is a plain cell.
        size: of the text, points.
        pad: above and below a row's text.
        left: left edge.
        keep: free points to leave at the bottom of each page.
        on_page: called with each page the table reaches and the top of its rows.

    Returns:
        The last page, its cursor below the table, and where each row landed.
    """
    landed: list[Row] = []
    begun = False
    for cells in rows:
        set_cells = [_set(cell, c, size) for cell, c in zip(cells, columns, strict=True)]
        height = max(len(lines) for _, lines in set_cells) * LEADING * size + 2 * pad
        if not begun or page.room - keep < height:
            if page.room - keep < height + 3 * size:
                page = document.page(f"{title} (continued)" if begun else title)
            _header(page, columns, size, left)
            begun = True
            if on_page:
                on_page(page, page.y)
        _row(page, columns, set_cells, size, left, pad)
        landed.append(Row(page, page.y + height / 2))
        page.y += height
        page.rule(page.y, left=left, right=_right(columns, left))
    page.y += 8.0
    return page, landed


def _right(columns: Sequence[Column], left: float) -> float:
    return left + sum(c.width + _GAP for c in columns) - _GAP


def _set(cell: str | Cell, column: Column, size: float) -> tuple[Cell, _Wrapped]:
    own = cell if isinstance(cell, Cell) else Cell(cell)
    if own.math:
        return own, formula(own.text, column.width, size)
    return own, wrap(own.text, column.width, size, own.face)


def _header(page: Page, columns: Sequence[Column], size: float, left: float) -> None:
    """Headers on a tinted strip; a header may take two lines."""
    wrapped = [wrap(c.header, c.width, size, BOLD) for c in columns]
    height = max(map(len, wrapped)) * LEADING * size + 4.0
    page.strip(page.y, height, TINT, left - 3, _right(columns, left) + 3)
    for (x, column), lines in zip(_places(columns, left), wrapped, strict=True):
        for i, line in enumerate(lines):
            y = page.y + 2.0 + i * LEADING * size
            page.write(x, y, line, size=size, face=BOLD, align=column.align)
    page.y += height


def _row(
    page: Page,
    columns: Sequence[Column],
    cells: Sequence[tuple[Cell, _Wrapped]],
    size: float,
    left: float,
    pad: float,
) -> None:
    for (x, column), (cell, lines) in zip(_places(columns, left), cells, strict=True):
        for i, line in enumerate(lines):
            y = page.y + pad + i * LEADING * size
            if isinstance(line, Formula):
                page.write_formula(x, y, line, size, cell.color)
            elif isinstance(line, str) and line:
                page.write(
                    x, y, line, size=size, face=cell.face, color=cell.color, align=column.align
                )


def _places(columns: Sequence[Column], left: float) -> list[tuple[float, Column]]:
    """Anchor of each column: its left edge, middle or right edge."""
    places, x = [], left
    for c in columns:
        shift = {"left": 0.0, "center": c.width / 2, "right": c.width}[c.align]
        places.append((x + shift, c))
        x += c.width + _GAP
    return places


def pairs(page: Page, items: Sequence[tuple[str, str]], label: float = 118.0) -> None:
    """Labels and values in two columns."""
    size = 8.5
    for name, value in items:
        page.write(LEFT, page.y, name, size=size, color=MUTED)
        page.paragraph(value, size=size, x=LEFT + label)
        page.y -= 0.2 * size
