"""Read long batches in blocks of rows: numbers as arrays, by NumPy's parser where it can.

A block that NumPy refuses, or that holds quotes, is read cell by cell like a short file, so that
what is wrong with a row is told in the same words.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli.cli import rows

if TYPE_CHECKING:
    from kr16cli.cli.rows import Form

# Small enough for the columns of a block to stay in the cache of a core.
_BYTES = 1 << 18
_ROWS = 4096


Array = npt.NDArray[np.float64]


class Block(NamedTuple):
    """Some rows of a batch.

    `size` counts them; `values` are the numbers of the sound ones by group, (k, 6) or (k, 4, 4);
    `sound` says which rows these are, (k,); `problems` tells of the others.
    """

    size: int
    values: Mapping[str, Array]
    sound: npt.NDArray[np.intp]
    problems: Mapping[int, str]

    def rows(self) -> Iterator[rows.Row]:
        """The rows one by one."""
        values = {name: array.tolist() for name, array in self.values.items()}
        at = iter(range(len(self.sound)))
        for i in range(self.size):
            if i in self.problems:
                yield rows.Row({}, self.problems[i])
            else:
                k = next(at)
                yield rows.Row({name: numbers[k] for name, numbers in values.items()})


def csv_blocks(form: Form, body: bytes, rest: BinaryIO, read: tuple[int, int]) -> Iterator[Block]:
    """Blocks of the rows of a CSV file.

    Args:
        form: what its header says.
        body: the bytes after the header that are in hand.
        rest: where more come from.
        read: bytes and lines before `body`.
    """
    done, lines = read
    for text in _texts(form.name, body, rest, done):
        values = _parsed(form, text)
        if values is None:
            yield _careful(form, text, lines)
        else:
            count = len(next(iter(values.values())))
            yield Block(count, values, np.arange(count), {})
        lines += text.count("\n")


def array_blocks(values: Mapping[str, Array]) -> Iterator[Block]:
    """Blocks of arrays (n, 6) or (n, 4, 4); a row with a number that is not finite is bad."""
    n = len(next(iter(values.values())))
    for start in range(0, n, _ROWS):
        part = {name: array[start : start + _ROWS] for name, array in values.items()}
        count = min(_ROWS, n - start)
        finite = np.ones(count, dtype=bool)
        for array in part.values():
            finite &= np.isfinite(array).reshape(count, -1).all(axis=1)
        if finite.all():
            yield Block(count, part, np.arange(count), {})
            continue
        sound = np.flatnonzero(finite)
        told = dict.fromkeys(np.flatnonzero(~finite).tolist(), rows.NOT_FINITE)
        yield Block(count, {name: array[sound] for name, array in part.items()}, sound, told)


def _texts(name: str, pending: bytes, rest: BinaryIO, done: int) -> Iterator[str]:
    """The text in blocks of whole lines; a line end in quotes does not end a block."""
    more = True
    try:
        while more:
            with rows.reading(name):
                read = rest.read(_BYTES)
            more = bool(read)
            cut = pending.rfind(b"\n") + 1 if more else len(pending)
            block = pending[:cut]
            if block and not (more and block.count(b'"') % 2):
                yield rows.decoded(block, name, done)
                done, pending = done + cut, pending[cut:]
            pending += read
    finally:
        rows.close(rest)


def _parsed(form: Form, text: str) -> dict[str, Array] | None:
    """The numbers of a block by group, or None where it needs care."""
    if '"' in text:
        return None
    lines = text.replace("\r\n", "\n").split("\n")
    if not lines[-1]:
        lines.pop()
    mark, width = form.delimiter, form.width
    if {line.count(mark) for line in lines} != {width - 1}:
        return None
    if form.units_at is not None:
        at = form.units_at
        for unit in {line.split(mark, at + 1)[at].lstrip(" ") for line in lines} - {""}:
            rows.check_units(form.name, unit, form.needed, si=form.si)
    if form.decimal_comma:
        lines = [line.replace(",", ".") for line in lines]
    columns = sorted(set().union(*form.taken.values()))
    try:
        table = np.loadtxt(lines, delimiter=mark, comments=None, usecols=columns, ndmin=2)
    except ValueError:
        return None
    if not np.isfinite(table).all():
        return None
    table += 0.0  # a typed -0 is 0
    return {
        group: np.ascontiguousarray(table[:, [columns.index(c) for c in taken]])
        for group, taken in form.taken.items()
    }


def _careful(form: Form, text: str, lines_before: int) -> Block:
    """A block read cell by cell."""
    found = list(form.rows(form.lines(text, lines_before)))
    sound = [i for i, row in enumerate(found) if row.problem is None]
    values = {group: [found[i].values[group] for i in sound] for group in form.taken}
    return Block(
        len(found),
        {group: np.array(numbers).reshape(-1, 6) for group, numbers in values.items()},
        np.array(sound, dtype=np.intp),
        {i: row.problem for i, row in enumerate(found) if row.problem is not None},
    )
