"""Read batches: CSV (comma, semicolon or tab, decimal comma too) and npz, from file or stdin."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, NamedTuple

from kr16cli.cli.values import number
from kr16cli.errors import FileError, InputError, Kr16Error

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

    `expected` is about how many rows there are; `warnings` are about the file as a whole.
    """

    name: str
    rows: Iterator[Row]
    expected: int
    warnings: list[str]


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
    try:
        content = sys.stdin.buffer.read() if source == "-" else Path(source).read_bytes()
    except IsADirectoryError:
        raise FileError(name, "is a directory; name a CSV or npz file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(name, f"cannot be read: {reason}") from None
    if content.startswith(_NPZ_MAGIC):
        return _npz_batch(content, name, needed, optional, si=si)
    return _csv_batch(content, name, needed, optional, si=si)


def _check_units(name: str, unit: str, group: str, *, si: bool) -> None:
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


def _csv_batch(
    content: bytes, name: str, needed: str, optional: Sequence[str], *, si: bool
) -> Batch:
    import csv

    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(name, f"not UTF-8 text at byte {error.start}, and no npz") from None
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise FileError(name, f"is empty; it needs a header {','.join(GROUPS[needed])}")
    delimiter = next((mark for mark in (";", "\t") if mark in first), ",")
    lines = _lines(
        csv.reader(StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True), name
    )
    header, column_units = _header(next(lines))
    taken = _columns(header, name, needed, optional)
    for group, columns in taken.items():
        for column in columns:
            _check_units(name, column_units[column], group, si=si)
    if "units" in header:
        lines = _in_units(lines, header.index("units"), name, needed, si=si)
    extra = [cell for cell in header if cell and cell not in _OWN]
    warnings = [f"{name}: columns not used: {', '.join(extra)}"] if extra else []
    comma = delimiter != ","
    rows = (_csv_row(cells, len(header), taken, decimal_comma=comma) for cells in lines)
    return Batch(name, rows, text.count("\n"), warnings)


def _lines(reader: Any, name: str) -> Iterator[list[str]]:
    """Lines of a CSV file that hold more than blanks; FileError where it is none."""
    import csv

    try:
        for line in reader:
            blank = len(line) < 2 or reader.dialect.delimiter == "\t"
            if not blank or "".join(line).strip():
                yield line
    except csv.Error as error:
        raise FileError(name, f"line {reader.line_num}: no CSV: {error}") from None


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
            _check_units(name, unit, needed, si=si)
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
            _check_units(name, units.get(group, ""), group, si=si)
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
        arrays[group] = array.astype(float).reshape(-1, *shape)
    count = len(arrays[needed])
    for group, array in arrays.items():
        if len(array) != count:
            raise FileError(name, f"{group} has {len(array)} rows, {needed} has {count}")
    return Batch(name, _array_rows(arrays, count, needed), count, [])


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


def _array_rows(arrays: Mapping[str, Any], count: int, needed: str) -> Iterator[Row]:
    import numpy as np

    finite = np.ones(count, dtype=bool)
    for array in arrays.values():
        finite &= np.isfinite(array).reshape(count, -1).all(axis=1)
    names = {"pose": "T"} if needed == "pose" else {}
    for i in range(count):
        if finite[i]:
            yield Row({names.get(key, key): array[i].tolist() for key, array in arrays.items()})
        else:
            yield Row({}, "a number is not finite; every number must be finite")


def stdin_is_terminal() -> bool:
    """Whether reading stdin would wait for someone to type."""
    return sys.stdin is None or sys.stdin.isatty()


def only_one(*given: tuple[str, object]) -> None:
    """InputError if more than one of several (name, value) inputs was given."""
    names = [name for name, value in given if value]
    if len(names) > 1:
        raise InputError(f"{' and '.join(names)} exclude each other; give one")
