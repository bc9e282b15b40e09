"""Collect the answers of a batch in the form they will be written in, little by little.

What is collected goes to a temporary file when it grows, so that memory stays small.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from itertools import repeat
from typing import IO, TYPE_CHECKING, Any, NamedTuple, Protocol

from kr16cli.cli import render

if TYPE_CHECKING:
    from kr16cli.queries.common import Answer, Question
    from kr16cli.queries.many import Many

_IN_MEMORY = 1 << 24
_MARK = "rows go here"


class Told(NamedTuple):
    """What is said of one row; no answer means the row could not be used."""

    answer: Answer | None
    status: str
    reason: str | None


class Answered(NamedTuple):
    """Answers to a block of `size` rows: `many` for the rows `sound`, and `told` for others.

    A row in both is as told.
    """

    size: int
    sound: Any
    many: Many
    told: Mapping[int, Told]


class Sink(Protocol):
    """Takes answers row by row or in blocks, writes all at the end."""

    def add(self, told: Told) -> None:
        """Take the next row."""

    def add_block(self, answered: Answered) -> None:
        """Take the next rows; of CSV and npz only, where `Question.takes_many`."""

    def write(self, out: IO[bytes], inputs: Mapping[str, Any], warnings: Sequence[str]) -> None:
        """Write all rows, with what was asked and the warnings where the format has room."""

    def close(self) -> None:
        """Let go of what was collected."""


class Spool:
    """Bytes in memory, in a temporary file when they are many."""

    def __init__(self) -> None:
        self._file: IO[bytes] = BytesIO()
        self.size = 0

    def write(self, content: bytes | memoryview) -> None:
        """Append."""
        if self.size <= _IN_MEMORY < self.size + len(content):
            from tempfile import TemporaryFile  # slow to import

            memory, self._file = self._file, TemporaryFile()  # noqa: SIM115  # closed by close()
            memory.seek(0)
            self._file.write(memory.read())
        self._file.write(content)
        self.size += len(content)

    def pour(self, out: IO[bytes]) -> None:
        """Append all to a file."""
        self._file.seek(0)
        while piece := self._file.read(1 << 20):
            out.write(piece)

    def close(self) -> None:
        """Let go of the bytes."""
        self._file.close()


class JsonSink:
    """Rows as encoded JSON objects."""

    def __init__(self, question: Question) -> None:
        self._question = question
        self._rows = Spool()
        line = next(line for line in self._around({}, []).splitlines() if _MARK in line)
        self._between = f",\n{line.partition(_MARK)[0]}".encode()

    def _around(
        self, inputs: Mapping[str, Any], warnings: Sequence[str], *, rows: bool = True
    ) -> str:
        encoded = render.Encoded([_MARK] if rows else [])
        return render.json_text(self._question.envelope(inputs, {"rows": encoded}, warnings))

    def add(self, told: Told) -> None:
        """Encode a row."""
        answer, status, reason = told
        row = {"status": status, "reason": reason, **(answer.result if answer else {})}
        if self._rows.size:
            self._rows.write(self._between)
        self._rows.write(render.json_line(row).encode())

    def add_block(self, answered: Answered) -> None:
        """Rows of JSON hold more than `Many` has."""
        raise NotImplementedError("a batch in JSON is asked row by row")

    def write(self, out: IO[bytes], inputs: Mapping[str, Any], warnings: Sequence[str]) -> None:
        """The envelope around the rows."""
        rows = bool(self._rows.size)
        before, _, after = self._around(inputs, warnings, rows=rows).partition(_MARK)
        out.write(before.encode())
        self._rows.pour(out)
        out.write(after.encode())

    def close(self) -> None:
        """Let go of what was collected."""
        self._rows.close()


class CsvSink:
    """Rows as lines of a CSV file."""

    def __init__(self, question: Question) -> None:
        self._question = question
        self._names: list[str] | None = None
        self._lines = Spool()
        self._waiting: list[Told] = []

    def _named(self, names: Sequence[str]) -> None:
        """The first answer says which columns there are."""
        if self._names is None:
            self._names = list(names)
            for told in self._waiting:
                self._lines.write(self._line(told).encode())

    def _line(self, told: Told) -> str:
        answer, status, reason = told
        names = self._names or ()
        cells = [""] * len(names)
        if answer is not None:
            row = self._question.columns(answer.result)
            cells = [render.exact(row.get(name)) for name in names]
        return render.csv_text([*cells, self._question.csv_units, status, reason or ""], ())

    def add(self, told: Told) -> None:
        """Turn a row into a line."""
        if told.answer is not None:
            self._named(list(self._question.columns(told.answer.result)))
        if self._names is None:
            self._waiting.append(told)
        else:
            self._lines.write(self._line(told).encode())

    def add_block(self, answered: Answered) -> None:
        """Turn columns into lines."""
        columns = answered.many.columns
        self._named(list(columns))
        ends = (repeat(self._question.csv_units), repeat("ok"), repeat("\n"))
        lines = list(map(",".join, zip(*map(_texts, columns.values()), *ends, strict=False)))
        if answered.told:
            every = [""] * answered.size
            for i, line in zip(answered.sound.tolist(), lines, strict=True):
                every[i] = line
            for i, told in answered.told.items():
                every[i] = self._line(told)
            lines = every
        self._lines.write("".join(lines).encode())

    def write(self, out: IO[bytes], inputs: Mapping[str, Any], warnings: Sequence[str]) -> None:
        """The whole CSV file; the warnings go elsewhere."""
        self._named(list(self._question.columns(None)))
        header = [*(self._names or ()), "units", "status", "reason"]
        out.write(render.csv_text(header, ()).encode())
        self._lines.pour(out)

    def close(self) -> None:
        """Let go of what was collected."""
        self._lines.close()


def _texts(column: Any) -> Iterator[str]:
    """Cells of a column of numbers, as `render.exact` writes them; NaN is an empty one."""
    from numpy import isnan

    texts = map(repr, column.tolist())
    if isnan(column).any():
        return ("" if text == "nan" else text for text in texts)
    return texts


class TableSink:
    """Rows as lines of a table, which must all be known to be aligned."""

    def __init__(self, question: Question) -> None:
        self._question = question
        self._names: list[str] | None = None
        self._rows: list[tuple[list[str] | None, str, str]] = []

    def add(self, told: Told) -> None:
        """Turn a row into cells; the first answer says which columns there are."""
        cells = None
        units = self._question.column_units
        if told.answer is not None:
            row = self._question.columns(told.answer.result)
            self._names = self._names or list(row)
            cells = [render.shown(row.get(name), units.get(name)) for name in self._names]
        self._rows.append((cells, told.status, told.reason or ""))

    def add_block(self, answered: Answered) -> None:
        """A table is for reading: its rows are few."""
        raise NotImplementedError("a batch in a table is asked row by row")

    def write(self, out: IO[bytes], inputs: Mapping[str, Any], warnings: Sequence[str]) -> None:
        """The whole table; the warnings go elsewhere."""
        names = self._names or list(self._question.columns(None))
        empty = [""] * len(names)
        header = [f"{n} {self._question.column_units.get(n, '')}".rstrip() for n in names]
        lines = render.grid(
            [*header, "status", "reason"],
            [[*(cells or empty), status, reason] for cells, status, reason in self._rows],
            indent="",
        )
        out.write(("\n".join(lines) + "\n").encode())

    def close(self) -> None:
        """Let go of what was collected."""
        self._rows.clear()
