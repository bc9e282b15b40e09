"""The rules of a robot parameter file, schema kr16.robot/1.

`problems_in` walks a parsed table and lists every broken rule, each as one ParameterError with
the key, the value and the rule. It never raises, whatever the table holds.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from numbers import Real
from typing import Any, TypeGuard, cast, get_args

from kr16cli.errors import ParameterError
from kr16cli.robot import Inertia6, Status
from kr16cli.robot_rules import (
    GEOMETRY,
    GRAVITY,
    INERTIA,
    JOINT,
    LENGTH,
    LIMITS,
    LINK,
    NOTE,
    RATINGS,
    Quantity,
    inertia_problem,
    look_up,
)

SCHEMA = "kr16.robot/1"
AXES = 6
STATUSES: tuple[str, ...] = get_args(Status)
FRAMES = ("zero-pose", "dh")

# All six ranges within 2 pi, or all six speeds below 15, are radians: no arm of this kind is so.
_RADIAN_LIMIT = 2.0 * math.pi
_RADIAN_SPEED = 15.0
_CONFLICT_KEYS = ("key", "values", "chosen", "reason", "source")
_NOTE_KEYS = ("status", "source", "text", *NOTE)
# Longest text of a value, and most keys, in one message.
_SHOWN = 80
_LISTED = 8


def problems_in(table: Mapping[str, Any], path: str) -> list[ParameterError]:
    """Every broken rule of a parsed parameter file, in the order of the format.

    Args:
        table: what tomllib returns, or a mapping of the same shape.
        path: what messages call the file.
    """
    checker = Checker(path)
    checker.robot(table)
    return checker.found


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, Real) and not isinstance(value, bool)


def _is_list(value: object) -> TypeGuard[list[Any] | tuple[Any, ...]]:
    return isinstance(value, list | tuple)


def _kind(value: object) -> str:
    """TOML's word for the type of a value."""
    names = {bool: "true/false", str: "text", list: "a list", tuple: "a list", dict: "a table"}
    return names.get(type(value), type(value).__name__)


def _float(value: float) -> float:
    """The float of a number; a whole number beyond the floats becomes infinite."""
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _is_finite(value: object) -> bool:
    return _is_number(value) and math.isfinite(_float(value))


def _nearest(word: str, known: Collection[str]) -> str:
    """What to write instead of an unknown key: the nearest known one, or a few of them."""
    import difflib  # only a wrong key pays for it

    close = difflib.get_close_matches(word, known, n=1, cutoff=0.5)
    if close:
        return f"; did you mean {close[0]}?"
    return f"; known: {', '.join(known)}" if 0 < len(known) <= _LISTED else "; leave it out"


class _Brief(str):
    """A value cut short for a message: shown without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


def _short(value: object) -> object:
    """The value, or where its text is long, the beginning of it."""
    try:
        shown = repr(value)
    except (ValueError, RecursionError):  # thousands of digits, or nested without end
        return _Brief("(too long to show)")
    if len(shown) <= _SHOWN and shown.isprintable():
        return value
    printable = "".join(character for character in shown if character.isprintable())
    return _Brief(f"{printable[:_SHOWN]}...")


def _join(at: str, key: str) -> str:
    return f"{at}.{key}" if at else key


class Checker:
    """Collects problems; every method takes the dotted key of what it looks at."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.found: list[ParameterError] = []

    def fail(self, key: str, value: object, rule: str) -> None:
        """Note a broken rule."""
        self.found.append(ParameterError(self.path, key, _short(value), rule))

    def robot(self, table: Mapping[str, Any]) -> None:
        """Check a whole parameter file."""
        if not self.is_table(table, "parameters"):
            return
        optional = ("gravity", "link", "ratings", "conflict")
        self.keys(table, "", ("schema", "name", "geometry", "joint"), optional)
        self.choice(table, "", "schema", (SCHEMA,))
        self.text(table, "", "name")
        self.numbers(table, "", "gravity", [GRAVITY] * 3)
        self.group(table, "geometry", GEOMETRY, tuple(GEOMETRY))
        for key, joint in self.sequence(table, "joint", optional=False):
            self.joint(joint, key)
        self.radians(table)
        for key, link in self.sequence(table, "link", optional=True):
            self.link(link, key)
        self.group(table, "ratings", RATINGS, ())
        conflicts = table.get("conflict", [])
        if not _is_list(conflicts):
            self.fail("conflict", conflicts, "must be [[conflict]] tables")
            return
        for i, conflict in enumerate(conflicts, 1):
            if self.is_table(conflict, f"conflict[{i}]"):
                self.conflict(table, conflict, f"conflict[{i}]")

    def keys(
        self, table: Mapping[str, Any], at: str, needed: Collection[str], optional: Collection[str]
    ) -> None:
        """No key is unknown, no needed key is missing."""
        known = (*needed, *optional)
        for key, value in table.items():
            if key not in known:
                shown = str(key) if str(key).isidentifier() else repr(key)
                self.fail(_join(at, shown), value, f"unknown key{_nearest(str(key), known)}")
        for key in needed:
            if key not in table:
                self.fail(_join(at, key), None, "this key is needed")

    def is_table(self, value: object, key: str) -> TypeGuard[Mapping[str, Any]]:
        """Whether a value is a table; notes it if not."""
        if isinstance(value, Mapping):
            return True
        self.fail(key, value, f"must be a table, is {_kind(value)}")
        return False

    def sequence(
        self, table: Mapping[str, Any], name: str, *, optional: bool
    ) -> list[tuple[str, Mapping[str, Any]]]:
        """The six tables of [[joint]] or [[link]], with their keys; links may be left out."""
        if name not in table:
            return []
        value = table[name]
        rule = f"must be six [[{name}]] tables, in order A1 to A6"
        if not _is_list(value):
            self.fail(name, value, rule)
            return []
        if len(value) != AXES and not (optional and not value):
            self.fail(name, len(value), f"{rule}; this many were given")
        named = [(f"{name}[{i}]", entry) for i, entry in enumerate(value, 1)]
        return [(key, entry) for key, entry in named if self.is_table(entry, key)]

    def joint(self, joint: Mapping[str, Any], at: str) -> None:
        """Check one joint."""
        self.keys(joint, at, ("name", "limits_deg", "status", "source"), (*JOINT, "note"))
        expected = f"A{at.removeprefix('joint[').removesuffix(']')}"
        self.choice(joint, at, "name", (expected,))
        limits = self.numbers(joint, at, "limits_deg", [LIMITS] * 2)
        if limits and not limits[0] < limits[1]:
            self.fail(f"{at}.limits_deg", joint["limits_deg"], "the lower limit must come first")
        for key, quantity in JOINT.items():
            self.number(joint, at, key, quantity)
        if "rotor_inertia" in joint and "gear_ratio" not in joint:
            self.fail(f"{at}.gear_ratio", None, "rotor_inertia needs it to act on the joint")
        self.provenance(joint, at, ("limits_deg", *JOINT))

    def radians(self, table: Mapping[str, Any]) -> None:
        """All six ranges or speeds so small that they must be in radians."""
        joints = table.get("joint")
        if not _is_list(joints) or not all(isinstance(joint, Mapping) for joint in joints):
            return
        ranges = [joint.get("limits_deg") for joint in joints]
        ends = [end for pair in ranges if _is_list(pair) for end in pair if _is_number(end)]
        if len(ends) == 2 * AXES and all(abs(end) <= _RADIAN_LIMIT for end in ends):
            self.fail("joint[1].limits_deg", ranges[0], "limits are in deg; all six look like rad")
        speeds = [joint.get("speed_deg_s") for joint in joints]
        numbers = [speed for speed in speeds if _is_number(speed) and speed > 0]
        if len(numbers) == AXES and max(numbers) < _RADIAN_SPEED:
            rule = "speeds are in deg/s; all six look like rad/s"
            self.fail("joint[1].speed_deg_s", speeds[0], rule)

    def link(self, link: Mapping[str, Any], at: str) -> None:
        """Check one link."""
        needed = ("mass", "com", "inertia", "frame", "status", "source")
        self.keys(link, at, needed, ("tolerance", "note"))
        for key, quantity in LINK.items():
            self.number(link, at, key, quantity)
        self.numbers(link, at, "com", [LENGTH] * 3)
        inertia = self.numbers(link, at, "inertia", [INERTIA] * 6)
        rule = inertia_problem(cast("Inertia6", tuple(inertia))) if inertia else None
        if rule:
            self.fail(f"{at}.inertia", link["inertia"], rule)
        self.choice(link, at, "frame", FRAMES)
        self.provenance(link, at, ("mass", "com", "inertia", "tolerance"))

    def group(
        self,
        table: Mapping[str, Any],
        name: str,
        quantities: Mapping[str, Quantity],
        needed: tuple[str, ...],
    ) -> None:
        """[geometry] or [ratings]: numbers with one provenance."""
        if name not in table or not self.is_table(table[name], name):
            return
        group = table[name]
        self.keys(group, name, (*needed, "status", "source"), (*quantities, "note"))
        for key, quantity in quantities.items():
            self.number(group, name, key, quantity)
        self.provenance(group, name, tuple(quantities))

    def provenance(self, group: Mapping[str, Any], at: str, data_keys: tuple[str, ...]) -> None:
        """Status, source and the notes on single keys."""
        self.choice(group, at, "status", STATUSES)
        self.sources(group, at)
        notes = group.get("note", {})
        if not self.is_table(notes, f"{at}.note"):
            return
        self.keys(notes, f"{at}.note", (), data_keys)
        for key in data_keys:
            where = f"{at}.note.{key}"
            if key not in notes or not self.is_table(notes[key], where):
                continue
            note = notes[key]
            self.keys(note, where, (), _NOTE_KEYS)
            if not note:
                self.fail(where, note, "a note must hold a status, a source, a text or a tolerance")
            self.choice(note, where, "status", STATUSES)
            self.sources(note, where)
            self.text(note, where, "text")
            for quantity_key, quantity in NOTE.items():
                self.number(note, where, quantity_key, quantity)
            if all(kind in note for kind in NOTE):
                self.fail(where, note["plus_minus"], "stands beside tolerance; give one")

    def conflict(self, table: Mapping[str, Any], conflict: Mapping[str, Any], at: str) -> None:
        """Check one conflict between sources."""
        self.keys(conflict, at, _CONFLICT_KEYS, ())
        self.text(conflict, at, "reason")
        self.sources(conflict, at)
        if any(key not in conflict for key in ("key", "values", "chosen")):
            return
        key, values, chosen = conflict["key"], conflict["values"], conflict["chosen"]
        if not _is_list(values) or not all(map(_is_finite, values)) or len(set(values)) < 2:
            self.fail(f"{at}.values", values, "must be a list of two or more different numbers")
            return
        if not _is_number(chosen) or chosen not in values:
            self.fail(f"{at}.chosen", chosen, "must be one of the values")
            return
        stands, _ = look_up(table, key)
        if not _is_number(stands):
            rule = "must be the dotted key of one number of this file, such as geometry.d6"
            self.fail(f"{at}.key", key, rule)
        elif chosen != stands:
            self.fail(f"{at}.chosen", chosen, f"must be what {key} says, {_short(stands)!r}")

    def number(self, table: Mapping[str, Any], at: str, key: str, quantity: Quantity) -> None:
        """Check a number of a table, where it is given."""
        if key in table:
            self.one_number(table[key], _join(at, key), quantity)

    def one_number(self, value: object, key: str, quantity: Quantity) -> float | None:
        """The float, or None after a failure."""
        if not _is_number(value):
            rule = f"must be a number{' in ' * bool(quantity.unit)}{quantity.unit}"
            self.fail(key, value, f"{rule}, is {_kind(value)}")
            return None
        number = _float(value)
        problem = quantity.problem(number)
        if problem:
            self.fail(key, value, problem)
        return None if problem else number

    def numbers(
        self, table: Mapping[str, Any], at: str, key: str, quantities: list[Quantity]
    ) -> list[float] | None:
        """The floats of a list, or None after a failure or where the key is missing."""
        if key not in table:
            return None
        value, where = table[key], _join(at, key)
        if not _is_list(value) or len(value) != len(quantities):
            found = f"has {len(value)}" if _is_list(value) else f"is {_kind(value)}"
            self.fail(where, value, f"must be a list of {len(quantities)} numbers, {found}")
            return None
        checked = [
            self.one_number(number, f"{where}[{i}]", quantity)
            for i, (number, quantity) in enumerate(zip(value, quantities, strict=True), 1)
        ]
        good = [number for number in checked if number is not None]
        return good if len(good) == len(checked) else None

    def text(self, table: Mapping[str, Any], at: str, key: str) -> None:
        """Check a printable text, where it is given."""
        if key not in table:
            return
        value = table[key]
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            self.fail(_join(at, key), value, "must be one line of text, not empty")

    def choice(self, table: Mapping[str, Any], at: str, key: str, known: Collection[str]) -> None:
        """Check a word against the known ones, where it is given."""
        if key not in table:
            return
        value = table[key]
        if not isinstance(value, str) or value not in known:
            one_of = "one of " * (len(known) > 1)
            self.fail(_join(at, key), value, f"must be {one_of}{', '.join(known)}")

    def sources(self, table: Mapping[str, Any], at: str) -> None:
        """Check a list of source keys, where it is given."""
        if "source" not in table:
            return
        value = table["source"]
        if not _is_list(value) or not value:
            self.fail(_join(at, "source"), value, "must be a list of keys of SOURCES.md")
            return
        for i, source in enumerate(value, 1):
            if not isinstance(source, str) or not source.strip() or not source.isprintable():
                rule = "must be a key of SOURCES.md, not empty"
                self.fail(f"{_join(at, 'source')}[{i}]", source, rule)
