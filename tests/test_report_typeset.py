"""How reports set numbers, lines, formulas and tables."""

from __future__ import annotations

import itertools

import pytest

from kr16cli.report import typeset
from kr16cli.report.page import Document
from kr16cli.report.style import number, styled
from kr16cli.report.table import Column, Row, table


@pytest.mark.parametrize(
    ("value", "shown"),
    [(None, "-"), (0.0, "0"), (1e-9, "1e-9"), (1.23e-14, "1.2e-14"), (0.4133, "0.413"),
     (5000.0, "5e+03"), (2e5, "2e5")],
)  # fmt: skip
def test_numbers_are_short(value: float | None, shown: str) -> None:
    assert number(value) == shown


def test_wrapped_lines_fit_and_lose_no_letter() -> None:
    text = "A line of words, then inverse.closure.near-wrist-pi.and.so.on.without.any.blank ends."
    lines = typeset.wrap(text, 90.0, 9.0)
    assert len(lines) > 4
    assert all(typeset.width(line, 9.0) <= 90.0 for line in lines)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


@pytest.mark.parametrize(
    ("plain", "runs"),
    [
        ("c23*c6", [("c", 0), ("23", -1), ("\u2009", 0), ("c", 0), ("6", -1)]),
        ("T_b^0", [("T", 0), ("b", -1), ("0", 1)]),
        ("Atan2(r32,", [("Atan2", 0), ("(", 0), ("r", 0), ("32", -1), (",", 0)]),
        ("omega_i", [("\u03c9", 0), ("i", -1)]),
        ("dq6", [("q\u0307", 0), ("6", -1)]),
        ("p x q", [("p", 0), ("\u00d7", 0), ("q", 0)]),
        ("for x >= 0", [("for", 0), ("x", 0), ("\u2265", 0), ("0", 0)]),
        ("u for x < 0", [("u", 0), ("for", 0), ("x", 0), ("<", 0), ("0", 0)]),
        ("of roll-pitch-yaw", [("of", 0), ("roll-pitch-yaw", 0)]),
        ("q_{1,i}", [("q", 0), ("1", -1), (",", -1), ("i", -1)]),
    ],
)
def test_formulas_get_their_indices(plain: str, runs: list[tuple[str, int]]) -> None:
    (line,) = typeset.formula(plain, 500.0, 9.0)
    assert [(r.text, (r.up > 0) - (r.up < 0)) for r in line.runs] == runs


def test_an_index_above_stands_over_the_one_below() -> None:
    (line,) = typeset.formula("T_b^0", 500.0, 9.0)
    below, above = line.runs[1:]
    assert below.right == above.right and below.up < 0 < above.up


def test_a_letter_no_font_has_is_replaced() -> None:
    assert typeset.printable("arm \U0001f9be") == "arm ?"


def _table(rows: int, room: float, lines: int = 1) -> list[Row]:
    """A table of so many rows, begun with so much room left on its page."""
    with styled():
        document = Document("footer", "title")
        page = document.page("A table")
        page.y += page.room - room
        text = "\n".join(["word"] * lines)
        _, landed = table(document, page, "A table", [Column("head", 100.0)], [[text]] * rows)
        document.finish()
    return landed


def _by_page(landed: list[Row]) -> list[int]:
    pages = list(dict.fromkeys(id(row.page) for row in landed))
    return [sum(id(row.page) == page for row in landed) for page in pages]


@pytest.mark.parametrize("room", [20.0, 50.0, 100.0, 150.0])
@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 7, 8, 60, 61, 62, 63, 64, 65, 66, 130])
def test_no_page_of_a_table_has_one_or_two_rows(rows: int, room: float) -> None:
    landed = _table(rows, room)
    counts = _by_page(landed)
    assert sum(counts) == rows
    assert min(counts) >= min(3, rows)
    for above, below in itertools.pairwise(landed):
        assert above.page is not below.page or above.middle < below.middle


def test_rows_move_to_keep_the_last_one_company() -> None:
    whole = next(n for n in range(1, 99) if len(_by_page(_table(n, 700.0))) == 2)
    assert _by_page(_table(whole - 1, 700.0)) == [whole - 1]
    assert _by_page(_table(whole, 700.0)) == [whole - 3, 3]
    assert _by_page(_table(whole + 1, 700.0)) == [whole - 2, 3]
    assert _by_page(_table(whole + 2, 700.0)) == [whole - 1, 3]


def test_rows_too_tall_for_three_on_a_page_are_set_all_the_same() -> None:
    assert _by_page(_table(5, 100.0, lines=30)) == [2, 2, 1]
