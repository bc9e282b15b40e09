"""KRL aggregates as text: `{X 1088.0,Y 0.0,...}`, `{A1 0,...}` and LOAD_DATA.

Accepted around the braces: `DECL E6POS XP1=`, `E6POS XP1=`, `XP1=`, and inside a type prefix
`{E6POS: ...}`; any spacing and case; binary `'B010'` and hexadecimal `'H2'` whole numbers.
Lengths stay in mm and angles in degrees here, as KUKA writes them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple, NoReturn

from kr16cli.errors import InputError

AXIS_FIELDS = ("A1", "A2", "A3", "A4", "A5", "A6")
POSE_FIELDS = ("X", "Y", "Z", "A", "B", "C")
_EXTERNAL_FIELDS = ("E1", "E2", "E3", "E4", "E5", "E6")
_WHOLE_FIELDS = ("S", "T")

_FIELDS_OF_TYPE: Mapping[str, tuple[str, ...]] = {
    "FRAME": POSE_FIELDS,
    "POS": POSE_FIELDS + _WHOLE_FIELDS,
    "E6POS": POSE_FIELDS + _WHOLE_FIELDS + _EXTERNAL_FIELDS,
    "AXIS": AXIS_FIELDS,
    "E6AXIS": AXIS_FIELDS + _EXTERNAL_FIELDS,
    "LOAD": ("M", "CM", "J"),
}
# What the type is called when the text does not say: the widest type of each family.
_TYPE_OF_FIELD: Mapping[str, str] = {
    **dict.fromkeys(AXIS_FIELDS, "E6AXIS"),
    **dict.fromkeys(POSE_FIELDS + _WHOLE_FIELDS, "E6POS"),
    **dict.fromkeys(_FIELDS_OF_TYPE["LOAD"], "LOAD"),
}
_FIELDS_INSIDE: Mapping[str, tuple[str, ...]] = {"CM": POSE_FIELDS, "J": ("X", "Y", "Z")}

# Patterns are compiled on first use: a query without KRL text pays nothing for them.
_HEAD = (
    r"\s*(?:(?:GLOBAL|DECL)\s+)*(?:(?P<type>[A-Z]\w*)\s+)?"
    r"(?:[$A-Z_][$\w]*(?:\[\s*\d+\s*\])?\s*=\s*)?\{"
)
_PREFIX = r"\s*(?P<type>[A-Z]\w*)\s*:"
_NAME = r"\s*(?P<name>[A-Z]\w*)"
_NUMBER = r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?)(?![\w.])"
_BITS = r"\s*'\s*(?:B(?P<binary>[01]+)|H(?P<hex>[0-9A-F]+))\s*'"
_REST = r"\s*(?:;[^\n]*)?\s*$"


class KrlRecord(NamedTuple):
    """One aggregate: its KRL `type` and its numbers by field name (mm, degrees).

    LOAD_DATA's inner aggregates are flattened: `CM.X`, `J.X` and so on.
    """

    type: str
    fields: Mapping[str, float]

    def numbers(self, names: Sequence[str]) -> list[float]:
        """The named fields, all of which must be there; InputError names those missing."""
        missing = [name for name in names if name not in self.fields]
        if missing:
            raise InputError(
                f"KRL text lacks {', '.join(missing)}; it must give {', '.join(names)}"
            )
        return [self.fields[name] for name in names]

    def whole(self, name: str) -> int | None:
        """A whole number such as S or T, or None where the text leaves it out."""
        value = self.fields.get(name)
        return None if value is None else int(value)


class _Reader:
    """A position in the text; every complaint points at it."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0

    def fail(self, why: str) -> NoReturn:
        shown = self.text if len(self.text) <= 120 else self.text[:117] + "..."
        raise InputError(f"KRL text, character {self.at + 1}: {why}, in {' '.join(shown.split())}")

    def take(self, pattern: str) -> re.Match[str] | None:
        match = re.compile(pattern, re.IGNORECASE).match(self.text, self.at)
        if match:
            self.at = match.end()
        return match

    def skip_space(self) -> None:
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1

    def found(self) -> str:
        """What stands here, for messages."""
        self.skip_space()
        rest = self.text[self.at :].split(",")[0].split("}")[0].strip()
        if rest:
            return f"found '{rest[:20]}'"
        return f"found '{self.text[self.at]}'" if self.at < len(self.text) else "the text ends"

    def symbol(self, symbol: str) -> bool:
        self.skip_space()
        if self.text.startswith(symbol, self.at):
            self.at += 1
            return True
        return False


def _number(reader: _Reader, name: str) -> float:
    reader.skip_space()
    start = reader.at
    if match := reader.take(_BITS):
        binary, hexa = match.group("binary"), match.group("hex")
        value = float(int(binary, 2) if binary else int(hexa, 16))
    elif match := reader.take(_NUMBER):
        value = float(match.group("number"))
    else:
        reader.fail(f"{name} needs a number, {reader.found()}")
    if not math.isfinite(value):
        reader.at = start
        reader.fail(f"{name} is too large")
    if name in _WHOLE_FIELDS and (value != int(value) or value < 0):
        reader.at = start
        reader.fail(f"{name} is {value:g}, it must be a whole number of 0 or more")
    return value


def _fields(reader: _Reader, allowed: Sequence[str] | None, prefix: str = "") -> dict[str, float]:
    """Fields up to the closing brace; `allowed` None means: decide by the first field."""
    values: dict[str, float] = {}
    seen: set[str] = set()
    while True:
        reader.skip_space()
        start = reader.at
        match = reader.take(_NAME)
        if match is None:
            reader.fail(f"expected a field name, {reader.found()}")
        name = match.group("name").upper()
        if allowed is None:
            kind = _TYPE_OF_FIELD.get(name)
            allowed = _FIELDS_OF_TYPE[kind] if kind else ()
        if name not in allowed:
            reader.at = start
            known = f"; known here: {', '.join(allowed)}" if allowed else ""
            reader.fail(f"unknown field {name}{known}")
        if name in seen:
            reader.at = start
            reader.fail(f"field {name} is given twice")
        seen.add(name)
        if not prefix and name in _FIELDS_INSIDE:
            if not reader.symbol("{"):
                reader.fail(f"{name} needs an inner aggregate, {reader.found()}")
            values |= _fields(reader, _FIELDS_INSIDE[name], f"{name}.")
        else:
            values[prefix + name] = _number(reader, name)
        if reader.symbol("}"):
            return values
        if not reader.symbol(","):
            reader.fail(f"expected ',' or '}}' after {name}, {reader.found()}")


def parse_krl(text: str) -> KrlRecord:
    """Read one KRL aggregate.

    Args:
        text: such as `{X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2}`.

    Returns:
        Its type and its fields; the type is guessed from the fields where it is not written.

    Raises:
        InputError: malformed text; the message points at the character.
    """
    reader = _Reader(text)
    head = reader.take(_HEAD)
    if head is None:
        reader.skip_space()
        reader.fail("expected an aggregate such as {X 0,Y 0,Z 0,A 0,B 0,C 0}")
    prefix = reader.take(_PREFIX)
    kind = (prefix or head).group("type")
    kind = "" if kind is None or kind.upper() in ("DECL", "GLOBAL") else kind.upper()
    if kind and kind not in _FIELDS_OF_TYPE:
        reader.at = (prefix or head).start("type")
        reader.fail(f"unknown type {kind}; known: {', '.join(_FIELDS_OF_TYPE)}")
    values = _fields(reader, _FIELDS_OF_TYPE.get(kind))
    if reader.take(_REST) is None:
        reader.fail(f"nothing may follow the closing brace, {reader.found()}")
    if not kind:
        first = next(iter(values)).split(".")[0]
        kind = _TYPE_OF_FIELD[first]
    return KrlRecord(kind, values)


def _real(value: float) -> str:
    """A KRL REAL: shortest form, rounding noise below 1e-9 removed, never -0.0."""
    return repr(round(value, 9) + 0.0)


def format_e6pos(pose: Sequence[float], status: int, turn: int) -> str:
    """`{X ..,Y ..,Z ..,A ..,B ..,C ..,S ..,T ..}` of a pose in mm and degrees."""
    numbers = ",".join(f"{n} {_real(v)}" for n, v in zip(POSE_FIELDS, pose, strict=True))
    return f"{{{numbers},S {status},T {turn}}}"


def format_e6axis(q_deg: Sequence[float]) -> str:
    """`{A1 ..,A2 ..,...,A6 ..}` of six joint angles in degrees."""
    numbers = ",".join(f"{n} {_real(v)}" for n, v in zip(AXIS_FIELDS, q_deg, strict=True))
    return f"{{{numbers}}}"
