"""How reports look: the shipped style sheet, colours, marks, and numbers as text."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from kr16cli.assets import asset

INK, MUTED, RULE = "#1a1a1a", "#5c5c5c", "#bdbdbd"
BLUE, ORANGE, GREEN, PINK = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
RED = "#B00020"
TINT, SHADE = "#eef3f8", "#d5e4f3"

STATUS_WORD = {"passed": "passed", "failed": "FAILED", "skipped": "skipped"}
STATUS_COLOUR = {"passed": INK, "failed": RED, "skipped": MUTED}

LINES = ("-", (0, (6, 2)), (0, (1, 1.2)), "-.", (0, (3, 1, 1, 1, 1, 1)), (0, (9, 2, 2, 2)))
"""Dashes told apart without colour."""


@contextmanager
def styled() -> Iterator[None]:
    """matplotlib's defaults and the report's style sheet, whatever the user has set."""
    from matplotlib import style

    with style.context(["default", str(asset("reports/kr16.mplstyle"))]):
        yield


def number(value: float | None, digits: int = 2) -> str:
    """A measured number in short: 1.2e-14, 1e-9, 0.413, 0; a dash where there is none."""
    if value is None:
        return "-"
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.{digits + 1}g}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa.removesuffix('.0')}e{int(exponent)}"
