"""Ask a question for every row of a file: order kept, bad rows told and set apart."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from io import BytesIO
from typing import TYPE_CHECKING, NamedTuple

from kr16cli.cli import output, rows, sinks
from kr16cli.errors import InputError, Kr16Error

if TYPE_CHECKING:
    from kr16cli.cli import blocks
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
    with closing(_sink(question, data, common.kind)) as sink:
        return _answered(question, common, batch, sink, target)


def _answered(
    question: Question, common: Common, batch: rows.Batch, sink: sinks.Sink, target: output.Target
) -> int:
    work = _Work(question, sink, batch.expected)
    if batch.blocks is not None:
        question.quicken()
    if batch.blocks is not None and question.takes_many(common.kind) and not common.track:
        for block in batch.blocks:
            work.block(block)
    else:
        for row in batch.rows:
            work.row(row, track=common.track)
    _tick(0, batch.expected)
    count, bad, problems = work.count, work.bad, work.problems
    if bad and common.strict:
        more = f" ({bad} such rows)" if bad > 1 else ""
        raise InputError(f"{batch.name}, {problems[0]}{more}; --strict: nothing is written")
    texts = [*batch.warnings, *work.warnings.texts()]
    if common.kind in ("csv", "table"):
        texts += unlisted(question, common.kind)
    inputs = {"source": batch.name, "rows": count, **question.options}
    target.write_with(lambda out: sink.write(out, inputs, texts))
    if common.kind != "json":
        warn(texts)
    warn(problems, "")
    if bad:
        more = f" ({bad - _SHOWN} more than shown)" if bad > _SHOWN else ""
        warn([f"{bad} of {count} rows of {batch.name} have no answer{more}"], "")
    return 1 if bad else 0


def one_row(question: Question, data: RobotData, kind: str, answer: Answer) -> bytes:
    """A single answer as a CSV or npz file of one row."""
    out = BytesIO()
    with closing(_sink(question, data, kind)) as sink:
        sink.add(sinks.Told(answer, answer.status, answer.problem))
        sink.write(out, {}, [])
    return out.getvalue()


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
    return sinks.TableSink(question) if kind == "table" else sinks.CsvSink(question)


class _Work:
    """Rows answered so far, and what went wrong with them."""

    def __init__(self, question: Question, sink: sinks.Sink, expected: int) -> None:
        self._question, self._sink, self._expected = question, sink, expected
        self.count = self.bad = 0
        self.problems: list[str] = []
        self.warnings = _Gathered()

    def row(self, row: rows.Row, *, track: bool = False) -> None:
        """Answer the next row."""
        told = self._told(row)
        if track and told.answer is not None:
            self._question.follow(told.answer)
        self._sink.add(told)
        self.count += 1
        self._note(self.count, told)
        _tick(self.count, self._expected)

    def block(self, block: blocks.Block) -> None:
        """Answer the next rows at once, and those that need care one by one."""
        if not len(block.sound):
            for row in block.rows():
                self.row(row)
            return
        told = {i: sinks.Told(None, "bad", problem) for i, problem in block.problems.items()}
        many = self._question.many(block.values)
        for k in many.care.nonzero()[0].tolist():
            row = rows.Row({name: array[k].tolist() for name, array in block.values.items()})
            told[int(block.sound[k])] = self._told(row)
        self._sink.add_block(sinks.Answered(block.size, block.sound, many, told))
        warned = {int(block.sound[k]): k for k in many.warned.nonzero()[0].tolist()}
        for i in sorted(told.keys() | warned.keys()):
            number = self.count + i + 1
            if i in told:
                self._note(number, told[i])
            else:
                self.warnings.add_from(number, many.warnings, warned[i])
        self.count += block.size
        _tick(self.count, self._expected, every=1)

    def _told(self, row: rows.Row) -> sinks.Told:
        """The answer to one row, or what is wrong with the row."""
        if row.problem is not None:
            return sinks.Told(None, "bad", row.problem)
        try:
            answer = self._question.finite_answer(row.values)
        except Kr16Error as error:
            return sinks.Told(None, "bad", str(error))
        return sinks.Told(answer, answer.status, answer.problem)

    def _note(self, number: int, told: sinks.Told) -> None:
        """Count a row's problem and warnings."""
        self.warnings.add(number, told.answer.warnings if told.answer else ())
        if told.reason is not None:
            self.bad += 1
            if len(self.problems) < _SHOWN:
                self.problems.append(f"row {number}: {told.reason}")


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

    def add_from(self, row: int, texts_of: Callable[[int], Sequence[str]], index: int) -> None:
        """Note the warnings of a row that has some, without asking for them where it can."""
        if len(self._about) > _SHOWN:
            self._rows += 1
        else:
            self.add(row, texts_of(index))

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


def _tick(done: int, total: int, *, every: int = 500) -> None:
    """Count rows on stderr of a long batch, on a terminal only; 0 wipes the line."""
    if total < 2000 or done % every or sys.stderr is None or not sys.stderr.isatty():
        return
    text = f"\r{done} of about {max(done, total)} rows" if done else "\r\x1b[K"
    print(text, end="", file=sys.stderr, flush=True)
