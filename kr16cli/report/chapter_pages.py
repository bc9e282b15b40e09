"""The chapter's audit: verdicts in numbers, misprints in full, and every statement."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from kr16cli.report.content import Content
from kr16cli.report.page import LEADING, LEFT, RIGHT, Document, Page
from kr16cli.report.style import INK, MUTED, RED, number
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.typeset import BOLD, PLAIN, formula, wrap

Equation = Mapping[str, Any]

_WORDS = {
    "holds": "holds as printed",
    "holds-under-convention": "holds under a stated convention",
    "misprint": "misprint, with a proved correction",
    "definition": "names something; nothing to prove",
    "missing": "promised or needed, not printed",
}
_SHORT = {"holds-under-convention": "convention"}


def chapter(document: Document, content: Content) -> None:
    """All pages of the audit."""
    rows = content.equations
    proved = sum(bool(e["proved"]) for e in rows)
    wrong = [e for e in rows if e["verdict"] == "misprint"]
    if proved == len(rows):
        title = f"The chapter judged: {len(rows)} statements, {len(wrong)} misprints, all proved"
    else:
        title = f"FAILED: {len(rows) - proved} of {len(rows)} verdicts are not proved"
    page = document.page(title)
    page.paragraph(
        "Every numbered equation, printed matrix element, displayed equation and checkable claim "
        "of chapter 3 was executed as printed and compared with Table 3.1. Proof: exact: at "
        "random rational points of the unit circle with fractions; 50 digits: where roots or "
        "angles occur; counted: a claim about a number or a set. Residual: the largest difference "
        "in float64; error: what a misprint is off by."
    )
    counts = Counter(e["verdict"] for e in rows)
    columns = (Column("verdict", 130), Column("means", 220), Column("statements", 60, "right"))
    page, _ = table(
        document, page, title, columns,
        [[v, words, str(counts.get(v, 0))] for v, words in _WORDS.items()], size=8.5,
    )  # fmt: skip
    page.heading("Misprints, as printed and corrected")
    for e in wrong:
        page = _in_full(document, page, "Misprints", e)
    noted = [e for e in rows if e["verdict"] in ("holds-under-convention", "missing")]
    if noted:
        page = document.with_room(page, 90, "Conventions and missing statements")
        page.heading("What holds under a convention, and what is missing")
        for e in noted:
            page = _in_full(document, page, "Conventions and missing statements", e)
    _all(document, rows)


def label(equation: Equation) -> str:
    """`(3.4) [3]`, or the words that name a statement without number."""
    id, part = str(equation["id"]), equation["part"]
    name = f"({id})" if id[0].isdigit() else id
    return name if part is None else f"{name} [{', '.join(map(str, part))}]"


def _in_full(document: Document, page: Page, title: str, e: Equation) -> Page:
    """One statement with printed form, accepted form and evidence."""
    second = {
        "misprint": ("corrected", e["correction"]),
        "missing": ("supplied", e["correction"]),
        "holds-under-convention": ("convention", e["convention"]),
    }[e["verdict"]]
    parts = [("printed", e["says"]), second]
    x, size = LEFT + 66, 8.5
    lines = [(name, formula(text, RIGHT - x, size)) for name, text in parts if text is not None]
    evidence = wrap(_evidence(e), RIGHT - x, 7.5)
    height = sum(len(block) for _, block in lines) * LEADING * (size + 1.2) + 28
    page = document.with_room(page, height + len(evidence) * LEADING * 7.5, title)
    proved = "" if e["proved"] else "  NOT PROVED"
    page.write(LEFT, page.y, label(e) + proved, size=8.5, face=BOLD,
               color=INK if e["proved"] else RED)  # fmt: skip
    page.y += 13
    for name, block in lines:
        page.write(LEFT + 8, page.y, name, size=7.5, color=MUTED)
        for line in block:
            page.write_formula(x, page.y, line, size, INK)
            page.y += LEADING * (size + 1.2)
    page.lines(x, evidence, 7.5, color=MUTED)
    page.y += 2
    page.rule(page.y)
    page.y += 5
    return page


def _evidence(e: Equation) -> str:
    unit = "" if e["unit"] == "1" else f" {e['unit']}"
    off = "" if e["error"] is None else f"Printed form off by {number(e['error'])}{unit}. "
    notes = [s for s in str(e["evidence"]).split(". ") if not s.startswith(_SAID)]
    rest = ". ".join(notes).strip()
    rest = f"{rest} " if not rest or rest.endswith(".") else f"{rest}. "
    return f"{off}{rest}Proof: {str(e['proof']).partition(';')[0].partition(' (seed')[0]}."


_SAID = ("Printed form", "Convention:", "Supplied form")
"""What the evidence repeats of the other fields."""


def _all(document: Document, rows: Sequence[Equation]) -> None:
    """Every statement in a line or two."""
    title = "Every statement of the chapter, with verdict and proof"
    page = document.page(title)
    columns = (Column("statement", 92), Column("as printed", 236), Column("verdict", 54),
               Column("proof", 40), Column("residual", 45, "right"))  # fmt: skip
    cells = []
    for e in rows:
        plain = e["verdict"] in ("holds", "definition")
        verdict = _SHORT.get(e["verdict"], str(e["verdict"]))
        if not e["proved"]:
            verdict = "NOT PROVED"
        cells.append(
            [
                Cell(label(e), PLAIN if plain else BOLD, math=plain),
                Cell(e["says"], math=True),
                Cell(verdict, PLAIN if plain else BOLD, INK if e["proved"] else RED),
                "-" if e["kind"] == "none" else e["kind"],
                "-" if e["kind"] == "none" else number(e["residual"]),
            ]
        )
    table(document, page, title, columns, cells, size=7, pad=1.1)
