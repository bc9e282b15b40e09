"""Read batches: CSV (comma, semicolon or tab, decimal comma too) and npz, from file or stdin."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from kr16cli.cli.values import number
from kr16cli.errors import FileError, InputError, Kr16Error

if TYPE_CHECKING:
    from kr16cli.cli.blocks import Block

FEW = 200
"""Rows up to which a batch is read and answered row by row: NumPy is slower to import."""

NOT_FINITE = "a number is not finite; every number must be finite"

_HEAD = 1 << 20
_NPZ_MAGIC = b"PK\x03\x04"

GROUPS: Mapping[str, tuple[str, ...]] = {
    "q": ("a1", "a2", "a3", "a4", "a5", "a6"),
    "pose": ("x", "y", "z", "a", "b", "c"),
    **{name: tuple(f"{name}{i}" for i in range(1, 7)) for name in ("qd", "qdd", "tau")},
}
"""Columns of each group of numbers in a CSV file; in npz `q qd qdd tau` and, for poses, `T`."""

# Columns that this program writes itself are passed over in silence.
_OWN = {"status", "reason", "units", "s", "t", "solutions", "residual", *sum(GROUPS.values(), ())}
_OWN |= {"time", *(f"energy_{kind}" for kind in ("kinetic", "potential"))}
_OWN |= {f"work_{what}" for what in ("torque", "friction", "wrench", "contact")}

# Words that say in which units a group's numbers are; torques are N m in any case.
_SI_WORDS, _EDGE_WORDS = {"rad", "m"}, {"deg", "mm"}


class Row(NamedTuple):
    """One row: its groups of numbers as read, or the reason why it cannot be used."""

    values: Mapping[str, Any]
    problem: str | None = None


class Batch(NamedTuple):
    """The rows of a file, to be taken once, and what the file is called in messages.

    `expected` is about how many rows there are; `warnings` are about the file as a whole. A long
    batch has `blocks` too, to be taken in place of `rows`.
    """

    name: str
    rows: Iterator[Row]
    expected: int
    warnings: list[str]
    blocks: Iterator[Block] | None = None


class Form(NamedTuple):
    """How the lines of a CSV file are read, as its header says.

    `taken` says where each group's columns stand, `units_at` where the units of a row.
    """

    name: str
    delimiter: str
    width: int
    taken: Mapping[str, list[int]]
    units_at: int | None
    needed: str
    si: bool

    @property
    def decimal_comma(self) -> bool:
        """Whether a number may have a comma."""
        return self.delimiter != ","

    def lines(self, text: str, before: int = 0) -> Iterator[list[str]]:
        """Cells of the lines of a text; `before` lines came before it."""
        import csv

        source = StringIO(text, newline="")
        reader = csv.reader(source, delimiter=self.delimiter, skipinitialspace=True)
        return _lines(reader, self.name, before)

    def rows(self, lines: Iterator[list[str]]) -> Iterator[Row]:
        """A row for each line."""
        if self.units_at is not None:
            lines = _in_units(lines, self.units_at, self.name, self.needed, si=self.si)
        return (
            _csv_row(cells, self.width, self.taken, decimal_comma=self.decimal_comma)
            for cells in lines
        )


def read(source: str, needed: str, optional: Sequence[str] = (), *, si: bool = False) -> Batch:
    """Read a batch.

    Args:
        source: path of a CSV or npz file; "-" for stdin.
        needed: group every row must have, "q" or "pose".
        optional: groups taken where the file has them.
        si: numbers are taken as rad and m, else as degrees and mm.

    Raises:
        FileError: the file cannot be read, has no usable header, or says that its numbers are
            in other units; of a row's units only when the row is taken.
    """
    name = "stdin" if source == "-" else source
    with reading(name):
        # Open beyond this function: a long file is read as its rows are taken.
        stream: BinaryIO = sys.stdin.buffer if source == "-" else Path(source).open("rb")  # noqa: SIM115
    try:
        with reading(name):
            head = stream.read(_HEAD)
            if head.startswith(_NPZ_MAGIC):
                head += stream.read()
        if head.startswith(_NPZ_MAGIC):
            batch = _npz_batch(head, name, needed, optional, si=si)
        else:
            batch = _csv_batch(head, stream, name, needed, optional, si=si)
    except BaseException:
        close(stream)
        raise
    if len(head) != _HEAD:
        close(stream)
    return batch


def close(stream: BinaryIO) -> None:
    """Close a file; stdin is the caller's."""
    if stream is not getattr(sys.stdin, "buffer", None):
        stream.close()


@contextmanager
def reading(name: str) -> Iterator[None]:
    """Turns an error of the operating system into a FileError about what is read."""
    try:
        yield
    except IsADirectoryError:
        raise FileError(name, "is a directory; name a CSV or npz file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(name, f"cannot be read: {reason}") from None


def check_units(name: str, unit: str, group: str, *, si: bool) -> None:
    """FileError where a file says that a group's numbers are in other units than are read."""
    said = set(re.findall("[a-z]+", unit.lower()))
    if group != "pose":
        said &= {"rad", "deg"}
    if group == "tau" or not said & (_EDGE_WORDS if si else _SI_WORDS):
        return
    mixed = said & (_SI_WORDS if si else _EDGE_WORDS)
    do = "convert it" if mixed else "leave out --si" if si else "give --si"
    reads = "rad and m" if si else "degrees and mm"
    raise FileError(name, f"its numbers are in {unit}, but {reads} are read; {do}")


def decoded(content: bytes, name: str, before: int = 0) -> str:
    """The text of bytes, `before` bytes from the start; FileError where it is none."""
    try:
        return content.decode("utf-8" if before else "utf-8-sig")
    except UnicodeDecodeError as error:
        at = before + error.start
        raise FileError(name, f"not UTF-8 text at byte {at}, and no npz") from None


def _csv_batch(
    head: bytes, rest: BinaryIO, name: str, needed: str, optional: Sequence[str], *, si: bool
) -> Batch:
    open_end = len(head) == _HEAD
    long = open_end or head.count(b"\n") > FEW
    if long and _needs_care(head):
        long = open_end = False
        with reading(name):
            head += rest.read()
        close(rest)
    text = decoded(head[: head.rfind(b"\n") + 1] if open_end else head, name)
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise FileError(name, f"is empty; it needs a header {','.join(GROUPS[needed])}")
    delimiter = next((mark for mark in (";", "\t") if mark in first), ",")
    form = Form(name, delimiter, 0, {}, None, needed, si)
    lines = form.lines(text)
    header, column_units = _header(next(lines))
    taken = _columns(header, name, needed, optional)
    for group, columns in taken.items():
        for column in columns:
            check_units(name, column_units[column], group, si=si)
    units_at = header.index("units") if "units" in header else None
    form = form._replace(width=len(header), taken=taken, units_at=units_at)
    extra = [cell for cell in header if cell and cell not in _OWN]
    warnings = [f"{name}: columns not used: {', '.join(extra)}"] if extra else []
    if not long:
        return Batch(name, form.rows(lines), text.count("\n"), warnings)
    from kr16cli.cli import blocks

    before = next(i for i, line in enumerate(text.split("\n"), 1) if line.strip())
    start = sum(len(line) + 1 for line in head.split(b"\n", before)[:before])
    more = rest if open_end else BytesIO()
    found = blocks.csv_blocks(form, head[start:], more, (start, before))
    expected = text.count("\n")
    with suppress(OSError):  # not of a pipe
        if open_end:
            expected = expected * os.fstat(rest.fileno()).st_size // len(head)
    return _in_blocks(name, found, expected, warnings)


def _needs_care(head: bytes) -> bool:
    """Whether lines end in CR alone, or the header may go over several lines."""
    first = head.lstrip().partition(b"\n")[0]
    return b"\r" in head.replace(b"\r\n", b"").rstrip(b"\r") or first.count(b'"') % 2 == 1


def _in_blocks(name: str, found: Iterator[Block], expected: int, warnings: list[str]) -> Batch:
    return Batch(name, (row for one in found for row in one.rows()), expected, warnings, found)


def _lines(reader: Any, name: str, before: int = 0) -> Iterator[list[str]]:
    """Lines of a CSV file that hold more than blanks; FileError where it is none."""
    import csv

    try:
        for line in reader:
            blank = len(line) < 2 or reader.dialect.delimiter == "\t"
            if not blank or "".join(line).strip():
                yield line
    except csv.Error as error:
        at = before + reader.line_num
        raise FileError(name, f"line {at}: no CSV: {error}") from None


def _header(cells: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names and units of the columns, `q1 [rad]`; a simulation calls the joint angles q1 to q6."""
    parts = [cell.strip().lower().partition("[") for cell in cells]
    names = [name.strip() for name, _, _ in parts]
    if not set(GROUPS["q"]) & set(names):
        names = [re.sub("^q([1-6])$", r"a\1", name) for name in names]
    return names, [unit.rstrip("] ") for _, _, unit in parts]


def _in_units(
    lines: Iterator[list[str]], at: int, name: str, needed: str, *, si: bool
) -> Iterator[list[str]]:
    """The lines, once what each says in its column `units` is found to be what is read."""
    sound = {""}
    for cells in lines:
        unit = cells[at] if at < len(cells) else ""
        if unit not in sound:
            check_units(name, unit, needed, si=si)
            sound.add(unit)
        yield cells


def _columns(
    header: list[str], name: str, needed: str, optional: Sequence[str]
) -> dict[str, list[int]]:
    """Where each group's columns stand; FileError where the needed ones are not all there."""
    taken: dict[str, list[int]] = {}
    for group in (needed, *optional):
        present = [column for column in GROUPS[group] if column in header]
        if not present and group != needed:
            continue
        missing = [column for column in GROUPS[group] if column not in header]
        if missing:
            raise FileError(
                name,
                f"the header lacks {', '.join(missing)}; it must name {','.join(GROUPS[group])} "
                f"in any order, found: {', '.join(header)[:80]}",
            )
        double = next((column for column in present if header.count(column) > 1), None)
        if double:
            raise FileError(name, f"the header names {double} twice")
        taken[group] = [header.index(column) for column in GROUPS[group]]
    return taken


def _csv_row(
    cells: list[str], width: int, taken: Mapping[str, list[int]], *, decimal_comma: bool
) -> Row:
    if len(cells) > width:
        return Row({}, f"{len(cells)} cells where the header has {width}")
    cells = cells + [""] * (width - len(cells))
    if decimal_comma:
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        return Row(
            {
                group: [
                    number(cells[at], column)
                    for column, at in zip(GROUPS[group], columns, strict=True)
                ]
                for group, columns in taken.items()
            }
        )
    except Kr16Error as error:
        return Row({}, str(error))


def _npz_batch(
    content: bytes, name: str, needed: str, optional: Sequence[str], *, si: bool
) -> Batch:
    import numpy as np

    keys = {"q": "q", "pose": "T"}
    shapes: dict[str, tuple[int, ...]] = {"pose": (4, 4)}
    try:
        with np.load(BytesIO(content), allow_pickle=False) as archive:
            arrays = {
                group: np.asarray(archive[keys.get(group, group)])
                for group in (needed, *optional)
                if keys.get(group, group) in archive
            }
            found = ", ".join(archive.files)
            units = _npz_units(archive)
    except Exception as error:
        raise FileError(name, f"no readable npz: {' '.join(str(error).split())}") from None
    if needed not in arrays:
        raise FileError(name, f"lacks the array {keys[needed]}; found: {found}")
    for group in arrays:
        if group != "pose":  # the 4x4 transforms are in m, whatever is typed
            check_units(name, units.get(group, ""), group, si=si)
    for group, array in arrays.items():
        if array.dtype.kind not in "fiu":
            key = keys.get(group, group)
            raise FileError(name, f"{key} has dtype {array.dtype}; expected real numbers")
        shape = shapes.get(group, (6,))
        if array.shape[-len(shape) :] != shape:
            wanted = ", ".join(map(str, shape))
            raise FileError(
                name, f"{keys.get(group, group)} has shape {array.shape}; expected (n, {wanted})"
            )
        arrays[group] = array.astype(float, copy=False).reshape(-1, *shape)
    count = len(arrays[needed])
    for group, array in arrays.items():
        if len(array) != count:
            raise FileError(name, f"{group} has {len(array)} rows, {needed} has {count}")
    names = {"pose": "T"} if needed == "pose" else {}
    arrays = {names.get(group, group): array for group, array in arrays.items()}
    from kr16cli.cli import blocks

    batch = _in_blocks(name, blocks.array_blocks(arrays), count, [])
    return batch if count > FEW else batch._replace(blocks=None)


def _npz_units(archive: Mapping[str, Any]) -> dict[str, str]:
    """The units that this program writes into its npz files, by array; empty without."""
    found: dict[str, str] = {}
    for key in ("units", "metadata"):
        if key not in archive or archive[key].dtype.kind != "U":
            continue
        with suppress(ValueError, AttributeError):  # no JSON, or no object: somebody else's
            about = json.loads(str(archive[key]))
            about = about["units"] if key == "metadata" and "units" in about else about
            found |= {name: str(unit) for name, unit in about.items()}
    return found


def stdin_is_terminal() -> bool:
    """Whether reading stdin would wait for someone to type."""
    return sys.stdin is None or sys.stdin.isatty()


def only_one(*given: tuple[str, object]) -> None:
    """InputError if more than one of several (name, value) inputs was given."""
    names = [name for name, value in given if value]
    if len(names) > 1:
        raise InputError(f"{' and '.join(names)} exclude each other; give one")
