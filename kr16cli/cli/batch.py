"""Ask a question for every row of a file: order kept, bad rows told and set apart."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from kr16cli.cli import output, rows, sinks
from kr16cli.errors import InputError, Kr16Error

if TYPE_CHECKING:
    from kr16cli.queries.common import Answer, Question
    from kr16cli.robot import RobotData

_SHOWN = 5


class Common(NamedTuple):
    """What every query command takes, as typed."""

    robot: str | None
    si: bool
    source: str | None
    track: bool
    strict: bool
    kind: str
    output: str | None


def answer_rows(
    question: Question, data: RobotData, common: Common, source: str, target: output.Target
) -> int:
    """Answer each row of `source` and write all answers at once; the exit code.

    Nothing is written before the last row is done, so an interrupted batch leaves no half.
    """
    batch = rows.read(source, question.reads, question.optional, si=common.si)
    sink = _sink(question, data, common.kind)
    warnings = _Gathered()
    problems: list[str] = []
    bad = count = 0
    for row in batch.rows:
        count += 1
        answer, problem = _answer(question, row, track=common.track)
        sink.add(answer, "bad" if answer is None else answer.status, problem)
        warnings.add(count, answer.warnings if answer else ())
        if problem is not None:
            bad += 1
            if len(problems) < _SHOWN:
                problems.append(f"row {count}: {problem}")
        _tick(count, batch.expected)
    _tick(0, batch.expected)
    if bad and common.strict:
        more = f" ({bad} such rows)" if bad > 1 else ""
        raise InputError(f"{batch.name}, {problems[0]}{more}; --strict: nothing is written")
    texts = [*batch.warnings, *warnings.texts()]
    if common.kind in ("csv", "table"):
        texts += unlisted(question, common.kind)
    inputs = {"source": batch.name, "rows": count, **question.options}
    target.write(sink.content(inputs, texts))
    if common.kind != "json":
        warn(texts)
    warn(problems, "")
    if bad:
        more = f" ({bad - _SHOWN} more than shown)" if bad > _SHOWN else ""
        warn([f"{bad} of {count} rows of {batch.name} have no answer{more}"], "")
    return 1 if bad else 0


def one_row(question: Question, data: RobotData, kind: str, answer: Answer) -> str | bytes:
    """A single answer as a CSV or npz file of one row."""
    sink = _sink(question, data, kind)
    sink.add(answer, answer.status, answer.problem)
    return sink.content({}, [])


def unlisted(question: Question, kind: str) -> list[str]:
    """A warning for each thing asked for that has no columns."""
    return [
        f"{kind} has no columns for {what}; {where}"
        for what, where in question.beyond_columns.items()
    ]


def warn(texts: Sequence[str], kind: str = "warning: ") -> None:
    """A line on stderr for each text."""
    for text in texts:
        print(f"kr16: {kind}{' '.join(text.split())}", file=sys.stderr)


def _sink(question: Question, data: RobotData, kind: str) -> sinks.Sink:
    if kind == "npz":
        from kr16cli.cli.archive import NpzSink

        return NpzSink(question, data)
    if kind == "json":
        return sinks.JsonSink(question)
    return sinks.TextSink(question, table=kind == "table")


def _answer(question: Question, row: rows.Row, *, track: bool) -> tuple[Answer | None, str | None]:
    """The answer to one row, or None, and what is wrong with the row."""
    if row.problem is not None:
        return None, row.problem
    try:
        answer = question.finite_answer(row.values)
    except Kr16Error as error:
        return None, str(error)
    if track:
        question.follow(answer)
    return answer, answer.problem


class _Gathered:
    """Each warning once, with the rows it is about; many kinds of warnings only counted."""

    def __init__(self) -> None:
        self._about: dict[str, tuple[list[int], list[int]]] = {}
        self._rows = 0

    def add(self, row: int, texts: Sequence[str]) -> None:
        """Note the warnings of a row."""
        self._rows += bool(texts)
        for text in texts:
            if text in self._about or len(self._about) <= _SHOWN:
                first, count = self._about.setdefault(text, ([], [0]))
                count[0] += 1
                if len(first) < 3:
                    first.append(row)

    def texts(self) -> list[str]:
        """A sentence for each warning."""
        if len(self._about) > _SHOWN:
            text, (first, _) = next(iter(self._about.items()))
            return [f"{self._rows} rows have warnings; the first: row {first[0]}: {text}"]
        return [
            f"row{'s' if count[0] > 1 else ''} {', '.join(map(str, first))}"
            f"{f' and {count[0] - 3} more' if count[0] > 3 else ''}: {text}"
            for text, (first, count) in self._about.items()
        ]


def _tick(done: int, total: int) -> None:
    """Count rows on stderr of a long batch, on a terminal only; 0 wipes the line."""
    if total < 2000 or done % 500 or sys.stderr is None or not sys.stderr.isatty():
        return
    text = f"\r{done} of {total} rows" if done else "\r\x1b[K"
    print(text, end="", file=sys.stderr, flush=True)
