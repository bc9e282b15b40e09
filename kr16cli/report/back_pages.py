"""The pages to look things up in: credibility, traceability, cases, reproduction, references."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kr16cli.report.content import Content, LackingError, asset_hashes, commands, environment
from kr16cli.report.page import FULL, LEADING, LEFT, RIGHT, Document, Page
from kr16cli.report.style import INK, MUTED, RED, STATUS_COLOUR, STATUS_WORD, number
from kr16cli.report.suite_tables import measured, sampled
from kr16cli.report.table import Cell, Column, table
from kr16cli.report.typeset import BOLD, MONO, PLAIN, Face, wrap
from kr16cli.verify.records import Result


def credibility(document: Document, content: Content) -> None:
    """Levels by factor, and the sentence that justifies each."""
    failed = content.count("failed") > 0
    page = document.page("How far the results can be trusted, factor by factor")
    page.paragraph(
        "After the factors of NASA-STD-7009B, levels 0 (nothing shown) to 4. A self-assessment by "
        "the developers, not a review by that standard's process; factors recalled by name."
    )
    columns = (Column("factor", 128), Column("level", 34, "center"), Column("why", 319))
    rows = []
    for row in content.words["credibility"]:
        lowered = failed and "failed" in row
        level = row["failed"] if lowered else row["level"]
        why = f"LOWERED, a check FAILED; else: {row['why']}" if lowered else row["why"]
        rows.append([row["factor"], Cell(str(level), BOLD, RED if lowered else INK), why])
    table(document, page, "Credibility", columns, rows, size=8.5, pad=4)


def traceability(document: Document, content: Content) -> None:
    """Equation or function, what exercises it, and the result."""
    title = "What was tested by what: from equation to function to case"
    page = document.page(title)
    page.paragraph(
        "Left: the chapter's numbered equations in order. Cases of the audit execute what is "
        "printed; the others are properties of the model. Bold: no property case bears on it."
    )
    ids = _numbered(content.results)
    rows: list[list[str | Cell]] = [
        _equation_row(id, [r for r in content.results if id in r.equations]) for id in ids
    ]
    columns = [Column("equation", 42), Column("functions", 178), Column("cases", 194),
               Column("result", 57)]  # fmt: skip
    if rows:
        page, _ = table(document, page, title, columns, rows, size=7, pad=1.6)
    functions = sorted({f for r in content.results for f in r.functions})
    if functions:
        page = document.with_room(page, 120, title)
        page.heading("Functions and the cases that exercise them")
        columns = [Column("function", 200), Column("cases", 224), Column("result", 57)]
        rows = []
        for name in functions:
            found = [r for r in content.results if name in r.functions]
            rows.append([name.removeprefix("kr16cli."), _ids(found), _verdict(found)])
        table(document, page, title, columns, rows, size=7, pad=1.6)


def _numbered(results: Sequence[Result]) -> list[str]:
    """Numbers 3.k that any case names, in order."""
    found = {id for r in results for id in r.equations if id[0].isdigit()}
    return sorted(found, key=lambda id: [int(v) for v in id.split(".")])


def _equation_row(id: str, found: Sequence[Result]) -> list[str | Cell]:
    own = [r for r in found if r.group != "chapter"]
    face = PLAIN if own else BOLD
    functions = dict.fromkeys(f for r in own for f in r.functions)
    shown = _functions(functions) or "audit only"
    return [Cell(f"({id})", face), Cell(shown, face), Cell(_ids(found), face),
            _verdict(found)]  # fmt: skip


def _functions(names: Iterable[str]) -> str:
    """Dotted names, those of one class or package together: Robot: fk, frames; Arm: fk."""
    owners: dict[str, list[str]] = {}
    for name in names:
        owner, _, rest = name.removeprefix("kr16cli.").partition(".")
        owners.setdefault(owner, []).append(rest)
    return "; ".join(f"{owner}: {', '.join(rest)}" for owner, rest in owners.items())


def _ids(results: Sequence[Result]) -> str:
    """Case ids; three or more of a family as one: inverse.closure.* (12)."""
    families: dict[str, list[str]] = {}
    for r in results:
        families.setdefault(r.id.rpartition(".")[0], []).append(r.id)
    shown = []
    for family, ids in families.items():
        several = len(ids) > 2 and "." in family
        shown += [f"{family}.* ({len(ids)})"] if several else ids
    return ", ".join(shown)


def _verdict(results: Sequence[Result]) -> Cell:
    counts = {s: sum(r.status == s for r in results) for s in ("failed", "passed", "skipped")}
    there = [status for status, count in counts.items() if count]
    if not there:
        return Cell("none", BOLD)
    words = ", ".join(f"{counts[status]} {STATUS_WORD[status]}" for status in there)
    return Cell(words, BOLD if counts["failed"] else PLAIN, STATUS_COLOUR[there[0]])


def cases(document: Document, content: Content) -> None:
    """Every case in full.

    Raises:
        LackingError: the report holds no cases, such as one of a run alone.
    """
    if not content.results:
        raise LackingError("no cases were run for this report")
    title = "Every case in full"
    page = document.page(title)
    page.paragraph(
        "Grade: " + "; ".join(f"{k} {words}" for k, words in content.words["grades"]) + ".", size=8
    )
    for group in dict.fromkeys(r.group for r in content.results):
        page = document.with_room(page, 90, title)
        page.heading(f"Suite {group}")
        for r in content.of(group):
            page = _case(document, page, title, r)


def _case(document: Document, page: Page, title: str, r: Result) -> Page:
    """One case: name, grade and status, then all that was stated and found."""
    size = 7.0
    found = f"{measured(r)}; {sampled(r)}. {r.evidence}"
    worst = r.worst.get("command") or ", ".join(f"{k} {v}" for k, v in r.worst.items())
    parts = [
        f"{r.title}. {r.statement}.",
        f"Sampled: {r.regime}. Method: {r.method}.",
        f"Tolerance {number(r.tolerance)} {r.unit}: {r.reason}.",
    ]
    failed = r.status == "failed"
    last = r.evidence if r.status == "skipped" else found
    ends = [("Found: " if r.status != "skipped" else "Skipped: ") + last]
    if worst:
        ends[0] = ends[0].rstrip(".") + "."
        ends.append(f"Worst: {worst}")
    words, result = (wrap(" ".join(p), FULL - 10, size) for p in (parts, ends))
    page = document.with_room(page, 18 + LEADING * size * (len(words) + len(result)), title)
    page.write(LEFT, page.y, r.id, size=7.5, face=BOLD)
    page.write(RIGHT, page.y, f"grade {r.grade} · {STATUS_WORD[r.status]}", size=7.5,
               align="right", face=BOLD if failed else PLAIN,
               color=STATUS_COLOUR[r.status])  # fmt: skip
    page.y += 10.5
    page.lines(LEFT + 10, words, size)
    page.lines(LEFT + 10, result, size, color=RED if failed else MUTED)
    page.y += 4
    return page


def reproduction(document: Document, content: Content) -> None:
    """Commands, seeds, environment, hashes."""
    title = "How to get the same report"
    page = document.page(title)
    page.heading("Commands")
    for line in commands(content):
        page.paragraph(line, size=8, face=Face(MONO), x=LEFT + 8, to=RIGHT - 60)
    page.paragraph(
        f"Results: {content.evidence.source}. Equal input gives equal bytes where "
        "SOURCE_DATE_EPOCH is set and the versions below are the same."
    )
    if content.left_out:
        page.heading("Pages left out")
        page.bullets([f"{name}: {why}" for name, why in content.left_out.items()], size=8)
    page.heading("Environment of this report")
    columns = (Column("part", 130), Column("version", 200))
    page, _ = table(
        document, page, title, columns, [list(row) for row in environment()], size=8, pad=1.2
    )
    page.heading("Files, SHA-256")
    hashes = [
        ("model (numbers of the parameter file)", content.data.sha256),
        *asset_hashes(content.data),
        *content.evidence.files,
    ]
    columns = (Column("file", 160), Column("SHA-256", 320))
    table(document, page, title, columns, [list(row) for row in hashes], size=7, pad=1.2)


def references(document: Document, content: Content) -> None:
    """What the report leans on."""
    page = document.pages[-1]
    if page.room < 250:
        page = document.page("References")
    else:
        page.heading("References")
    for row in content.words["reference"]:
        page.write(LEFT, page.y, row["key"], size=8.5, face=BOLD)
        page.paragraph(row["text"], size=8.5, x=LEFT + 96)
    page.y += 10
    page.paragraph(content.words["statement"], face=BOLD, size=8.5)
