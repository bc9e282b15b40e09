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

_FEWEST = 3
"""Fewer rows of a table than this look lost on a page."""

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
    ready = [[_set(cell, c, size) for cell, c in zip(row, columns, strict=True)] for row in rows]
    heights = [max(len(lines) for _, lines in row) * LEADING * size + 2 * pad for row in ready]
    head = _header_height(columns, size)
    fresh = False
    while len(landed) < len(rows):
        first = len(landed)
        count = _rows_that_fit(heights[first:], page.room - keep - head)
        if not fresh and count < min(_FEWEST, len(rows) - first):
            page, fresh = document.page(f"{title} (continued)" if first else title), True
            continue
        _header(page, columns, size, left)
        if on_page:
            on_page(page, page.y)
        for i in range(first, first + max(1, count)):
            _row(page, columns, ready[i], size, left, pad)
            landed.append(Row(page, page.y + heights[i] / 2))
            page.y += heights[i]
            page.rule(page.y, left=left, right=_right(columns, left))
        if len(landed) < len(rows):
            page, fresh = document.page(f"{title} (continued)"), True
    page.y += 8.0
    return page, landed


def _rows_that_fit(heights: Sequence[float], room: float) -> int:
    """How many rows to set here, so that neither this page nor the next is left with a few."""
    count, used = 0, 0.0
    while count < len(heights) and used + heights[count] <= room:
        used += heights[count]
        count += 1
    over = len(heights) - count
    short = _FEWEST - over
    return count - short if 0 < over < _FEWEST <= count - short else count


def _right(columns: Sequence[Column], left: float) -> float:
    return left + sum(c.width + _GAP for c in columns) - _GAP


def _set(cell: str | Cell, column: Column, size: float) -> tuple[Cell, _Wrapped]:
    own = cell if isinstance(cell, Cell) else Cell(cell)
    if own.math:
        return own, formula(own.text, column.width, size)
    return own, wrap(own.text, column.width, size, own.face)


def _header_height(columns: Sequence[Column], size: float) -> float:
    return max(len(wrap(c.header, c.width, size, BOLD)) for c in columns) * LEADING * size + 4.0


def _header(page: Page, columns: Sequence[Column], size: float, left: float) -> None:
    """Headers on a tinted strip; a header may take two lines."""
    wrapped = [wrap(c.header, c.width, size, BOLD) for c in columns]
    height = _header_height(columns, size)
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
