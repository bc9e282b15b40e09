"""The numbers of one robot as the library holds them: as C to compile, or as bytes to put in.

The layout is that of `kr16_robot_table` in fmu/native/kr16_fmu.h, the same on every platform.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.fmi.native import slots
from kr16cli.fmi.native.table import Item
from kr16cli.fmi.variables import Part, Variable
from kr16cli.model.inertia import link_body
from kr16cli.robot import RobotData

MARK = b"kr16 robot table"
ENTRIES = 192
_CAUSALITIES = ("input", "parameter", "output", "local", "independent")
_VARIABILITIES = ("fixed", "tunable", "discrete", "continuous")
_PARTS = (Part.ROBOT, Part.CONTROLLER)


class Entry(NamedTuple):
    """What a value reference leads to: its variables and their first slot."""

    item: Item
    slot: int


class Table(NamedTuple):
    """The content of `kr16_robot_table`."""

    sources: str
    numbers: tuple[tuple[str, tuple[float, ...]], ...]
    token: str
    joints: tuple[str, ...]
    part: int
    entries: tuple[Entry, ...]


def entries(listed: Sequence[Item], part: Part) -> tuple[Entry, ...]:
    """The first slot of each item, in their order; those of value references 1, 2, ..."""
    places = slots.places()

    def place(variable: Variable) -> int:
        wanted = part is Part.CONTROLLER and variable.causality == "output"
        name = variable.name.replace("tau[", "tau_wanted[") if wanted else variable.name
        return places[name]

    return tuple(Entry(item, place(item.first)) for item in listed)


def table(data: RobotData, known: Sequence[Entry], part: Part, token: str, sources: str) -> Table:
    """The numbers of a robot and the start values of its variables.

    Args:
        data: the robot, with inertial data.
        known: one entry for each value reference.
        part: the robot or its controller.
        token: GUID or instantiation token.
        sources: SHA-256 of the C that goes with it.
    """
    start = [float(_start(v)) for v in slots.slots()]
    for item, slot in known:
        for place, variable in enumerate(item.members, slot):
            if variable.start is not None:
                start[place] = float(variable.start)
    places = slots.places()
    if part is Part.ROBOT:
        for state, first in (("q[1]", "q_start[1]"), ("qd[1]", "qd_start[1]")):
            own = places[first]
            start[places[state] : places[state] + 6] = start[own : own + 6]
    bodies = [link_body(link, i, data.geometry) for i, link in enumerate(data.links, 1)]
    numbers = (
        ("geometry", tuple(map(float, data.geometry))),
        ("links", tuple(float(v) for b in bodies for v in (b.m, *b.h, *b[2:]))),
        ("lower", tuple(j.lower for j in data.joints)),
        ("upper", tuple(j.upper for j in data.joints)),
        ("speed", tuple(math.inf if j.speed is None else j.speed for j in data.joints)),
        ("torque", tuple(math.inf if j.torque is None else j.torque for j in data.joints)),
        ("start", tuple(start)),
    )
    names = tuple(j.name.encode("ascii", "replace").decode()[:15] for j in data.joints)
    return Table(sources, numbers, token, names, _PARTS.index(part), tuple(known))


def _start(variable: Variable) -> float:
    """The value of a slot that no variable leads to: choices at their first, nothing acts."""
    if variable.name == "solver.step":
        return 1e-3
    return 1.0 if variable.base == "Integer" else 0.0


def _codes(entry: Entry) -> tuple[int, int, int, int]:
    v = entry.item.first
    return (
        entry.slot,
        len(entry.item.members),
        _CAUSALITIES.index(v.causality),
        _VARIABILITIES.index(v.variability),
    )


def as_c(content: Table) -> str:
    """The table as a definition in C."""
    lines = [
        "/* Written by kr16cli: the numbers of one robot. */",
        "const kr16_robot_table kr16_robot = {",
        f"    .mark = {{{', '.join(repr(chr(b)) for b in MARK)}}},",
        f'    .sources = "{content.sources}",',
    ]
    for name, values in content.numbers:
        rows = [values[k : k + 6] for k in range(0, len(values), 6)]
        lines += [f"    .{name} = {{"]
        lines += ["        " + ", ".join(map(_literal, row)) + "," for row in rows] + ["    },"]
    names = ", ".join(f'"{name}"' for name in content.joints)
    lines += [
        f'    .token = "{content.token}",',
        f"    .joints = {{{names}}},",
        f"    .part = {content.part},",
        f"    .entries = {len(content.entries)},",
        "    .entry = {",
    ]
    for entry in content.entries:
        codes = ", ".join(map(str, _codes(entry)))
        lines.append(f"        {{{codes}}}, /* {entry.item.name} */")
    return "\n".join([*lines, "    },", "};", ""])


def _literal(value: float) -> str:
    return repr(value) if math.isfinite(value) else "HUGE_VAL"


def as_bytes(content: Table) -> bytes:
    """The table as it lies in a library: little-endian, no padding."""
    values = [v for _, row in content.numbers for v in row]
    parts = [MARK, content.sources.encode().ljust(80, b"\0")]
    parts.append(struct.pack(f"<{len(values)}d", *values))
    parts.append(content.token.encode().ljust(64, b"\0"))
    parts += [name.encode().ljust(16, b"\0") for name in content.joints]
    parts.append(struct.pack("<2i", content.part, len(content.entries)))
    parts += [bytes(_codes(entry)) for entry in content.entries]
    parts.append(bytes(4 * (ENTRIES - len(content.entries))))
    return b"".join(parts)


def put_in(library: bytes, content: Table | bytes) -> bytes | None:
    """A compiled library with the table in place of its own; None if its C is another.

    A table of bytes is any that begins with a mark of 16 bytes and the hash of its C.
    """
    own = content if isinstance(content, bytes) else as_bytes(content)
    at = library.find(own[: len(MARK) + 64])
    return None if at < 0 else library[:at] + own + library[at + len(own) :]
