"""Collect the answers of a batch in the form they will be written in, little by little."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from kr16cli.cli import render

if TYPE_CHECKING:
    from kr16cli.queries.common import Answer, Question


class Sink(Protocol):
    """Takes answers row by row, gives the content of the file at the end."""

    def add(self, answer: Answer | None, status: str, reason: str | None) -> None:
        """Take the next row; no answer means the row could not be used."""

    def content(self, inputs: Mapping[str, Any], warnings: Sequence[str]) -> str | bytes:
        """All rows, with what was asked and the warnings where the format has room for them."""


class JsonSink:
    """Rows as encoded JSON objects."""

    def __init__(self, question: Question) -> None:
        self._question = question
        self._rows = render.Encoded()

    def add(self, answer: Answer | None, status: str, reason: str | None) -> None:
        """Encode a row."""
        row = {"status": status, "reason": reason, **(answer.result if answer else {})}
        self._rows.append(render.json_line(row))

    def content(self, inputs: Mapping[str, Any], warnings: Sequence[str]) -> str:
        """The envelope around the rows."""
        return render.json_text(self._question.envelope(inputs, {"rows": self._rows}, warnings))


class TextSink:
    """Rows as cells of a CSV file or a table."""

    def __init__(self, question: Question, *, table: bool) -> None:
        self._question, self._table = question, table
        self._names: list[str] | None = None
        self._rows: list[tuple[list[str] | None, str, str]] = []

    def add(self, answer: Answer | None, status: str, reason: str | None) -> None:
        """Turn a row into cells; the first answer says which columns there are."""
        cells = None
        if answer is not None:
            row = self._question.columns(answer.result)
            self._names = self._names or list(row)
            cells = [self._cell(row.get(name), name) for name in self._names]
        self._rows.append((cells, status, reason or ""))

    def _cell(self, value: Any, name: str) -> str:
        if self._table:
            return render.shown(value, self._question.column_units.get(name))
        return render.exact(value)

    def content(self, inputs: Mapping[str, Any], warnings: Sequence[str]) -> str:
        """The whole CSV file or table; the warnings go elsewhere."""
        names = self._names or list(self._question.columns(None))
        empty = [""] * len(names)
        units = self._question.csv_units
        if self._table:
            header = [f"{n} {self._question.column_units.get(n, '')}".rstrip() for n in names]
            lines = render.grid(
                [*header, "status", "reason"],
                [[*(cells or empty), status, reason] for cells, status, reason in self._rows],
                indent="",
            )
            return "\n".join(lines) + "\n"
        return render.csv_text(
            [*names, "units", "status", "reason"],
            ([*(cells or empty), units, status, reason] for cells, status, reason in self._rows),
        )
