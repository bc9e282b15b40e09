"""A4 pages filled from the top: headings, paragraphs, axes, footers; then one PDF.

Places are in points from the top left corner.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from kr16cli.report.style import INK, MUTED, RULE, TINT
from kr16cli.report.typeset import (
    BOLD,
    PLAIN,
    Face,
    Formula,
    printable,
    width,
    wrap,
)
from kr16cli.report.words import Piece, Words

WIDTH, HEIGHT = 595.276, 841.89
LEFT, RIGHT, TOP, BOTTOM = 50.0, WIDTH - 50.0, 48.0, HEIGHT - 52.0
FULL = RIGHT - LEFT
LEADING = 1.32
"""Line distance over size."""


class Page:
    """One sheet with a cursor `y`, the top of the free space."""

    def __init__(self, figure: Figure | None = None) -> None:
        self.figure = figure or Figure(figsize=(WIDTH / 72, HEIGHT / 72), dpi=72)
        self.y = TOP
        self.words = Words(HEIGHT)
        self.figure.add_artist(self.words)
        self._rules: list[list[tuple[float, float]]] = []

    def write(
        self,
        x: float,
        y: float,
        line: str,
        *,
        size: float = 9.0,
        face: Face = PLAIN,
        color: str = INK,
        align: str = "left",
    ) -> None:
        """One line with its top at y."""
        text = printable(line)
        share = {"left": 0.0, "center": 0.5, "right": 1.0}[align]
        left = x - share * width(text, size, face)
        self.words.pieces.append(Piece(left, y + 0.95 * size, text, face, size, color))

    def write_formula(self, x: float, y: float, line: Formula, size: float, color: str) -> None:
        """A line of a formula with its top at y."""
        base = y + 0.95 * size
        self.words.pieces += [
            Piece(x + r.right * size, base - r.up * size, r.text, r.face, r.scale * size, color)
            for r in line.runs
            if not r.text.isspace()
        ]

    def lines(self, x: float, lines: Sequence[str], size: float, **look: Any) -> None:
        """Lines from the cursor down; moves the cursor."""
        for line in lines:
            if line:
                self.write(x, self.y, line, size=size, **look)
            self.y += LEADING * size

    def title(self, text: str) -> None:
        """The page's claim."""
        self.lines(LEFT, wrap(text, FULL, 13.5, BOLD), 13.5, face=BOLD)
        self.y += 3.0
        self.rule(self.y, INK)
        self.y += 9.0

    def heading(self, text: str) -> None:
        """A heading within a page."""
        self.y += 5.0
        self.lines(LEFT, [text], 10.5, face=BOLD)
        self.y += 2.0

    def paragraph(
        self,
        text: str,
        *,
        size: float = 9.0,
        x: float = LEFT,
        to: float = RIGHT,
        face: Face = PLAIN,
        color: str = INK,
    ) -> None:
        """Wrapped text from the cursor down."""
        self.lines(x, wrap(text, to - x, size, face), size, face=face, color=color)
        self.y += 0.45 * size

    def bullets(self, items: Sequence[str], size: float = 9.0) -> None:
        """A list."""
        for item in items:
            self.write(LEFT + 3, self.y, "•", size=size)
            self.paragraph(item, size=size, x=LEFT + 14)

    def caption(self, text: str) -> None:
        """Words under a figure."""
        self.paragraph(text, size=8.0, color=MUTED)
        self.y += 4.0

    def rule(self, y: float, color: str = RULE, left: float = LEFT, right: float = RIGHT) -> None:
        """A horizontal line."""
        ends = [(left / WIDTH, 1 - y / HEIGHT), (right / WIDTH, 1 - y / HEIGHT)]
        if color == RULE:
            self._rules.append(ends)
        else:
            self.figure.add_artist(LineCollection([ends], colors=[color], linewidths=[0.9]))

    def panel(self, height: float, color: str = TINT) -> None:
        """A tinted field from the cursor down, behind what is written next."""
        self.strip(self.y, height, color, LEFT - 8, RIGHT + 8)

    def strip(self, y: float, height: float, color: str, left: float, right: float) -> None:
        """A filled rectangle behind everything."""
        self.figure.add_artist(
            Rectangle(
                (left / WIDTH, 1 - (y + height) / HEIGHT),
                (right - left) / WIDTH,
                height / HEIGHT,
                facecolor=color,
                edgecolor="none",
                zorder=-1,
            )
        )

    def axes(
        self,
        height: float,
        left: float = LEFT + 42,
        right: float = RIGHT - 6,
        *,
        above: float = 16.0,
        below: float = 32.0,
        move: bool = True,
    ) -> Axes:
        """Axes at the cursor: `height` of the frame, with room above and below for words."""
        top = self.y + above
        if move:
            self.y = top + height + below
        box = (left / WIDTH, 1 - (top + height) / HEIGHT, (right - left) / WIDTH, height / HEIGHT)
        return self.figure.add_axes(box)

    @property
    def room(self) -> float:
        """Free points above the footer."""
        return BOTTOM - self.y

    def finish(self, left: str, right: str) -> None:
        """Rules and the footer."""
        if self._rules:
            self.figure.add_artist(LineCollection(self._rules, colors=[RULE], linewidths=[0.5]))
            self._rules = []
        self.write(LEFT, HEIGHT - 36, left, size=7.5, color=MUTED)
        self.write(RIGHT, HEIGHT - 36, right, size=7.5, color=MUTED, align="right")


class Document:
    """The pages of a report in order, with footers and metadata."""

    def __init__(self, footer: str, title: str) -> None:
        self._footer, self.title = footer, title
        self.pages: list[Page] = []

    def page(self, title: str | None = None) -> Page:
        """A new page."""
        self.pages.append(Page())
        if title:
            self.pages[-1].title(title)
        return self.pages[-1]

    def with_room(self, page: Page, points: float, title: str) -> Page:
        """The page if it has room for so many points, else a new one."""
        return page if page.room >= points else self.page(f"{title} (continued)")

    def adopt(self, figure: Figure, title: str) -> None:
        """Take a figure made elsewhere as a page; it leaves room for title and footer."""
        self.pages.append(Page(figure))
        self.pages[-1].title(title)

    def finish(self) -> list[Figure]:
        """Write the footers; the figures in order."""
        for n, page in enumerate(self.pages, 1):
            page.finish(self._footer, f"{self.title} · page {n} of {len(self.pages)}")
        return [page.figure for page in self.pages]


def to_pdf(figures: Sequence[Figure], metadata: Mapping[str, str], created: dt.datetime) -> bytes:
    """The figures as the content of a PDF file, fonts embedded."""
    out = BytesIO()
    about: dict[str, Any] = {**metadata, "CreationDate": created, "ModDate": created}
    with PdfPages(out, metadata=about) as pdf:
        for figure in figures:
            pdf.savefig(figure)
    return out.getvalue()
