"""The places of a native instance's values, the same for every robot, part and version of FMI.

A slot is the index of a value inside the C. A value reference leads to a slot by the table that
`numbers` puts into the library.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

from kr16cli.fmi import outputs
from kr16cli.fmi.variables import TYPES, Start, Variable, six, table
from kr16cli.robot import Geometry, JointData, Provenance, RobotData

METHODS = (("dormand_prince", "Dormand and Prince, order 5(4), by error; solver.step is not used"),)
"""Solver methods that only native FMUs have, after those of the table of variables."""

WANTED = six("tau_wanted")
"""Outputs of a controller: its table calls them tau."""

MARGINS = [
    f"margin.{what}[{i}]" for what in ("lower", "upper", "speed", "torque") for i in range(1, 7)
]
"""Event indicators: what is left to a limit; negative beyond it."""

FARTHEST = 1e5
"""Angles beyond this (rad, 16 000 turns) are refused: `kr16_sincos` takes no larger ones."""

KINDS = ("Real", "Integer", "Boolean")

GROUPS = ("qdd", "tau_applied", "pose", "energy", "limit.position", "limit.speed", "limit.torque",
          "tau_wanted", "margin")  # fmt: skip
"""Slots that are computed together when one is asked for; the others hold what they hold."""


def _any_robot() -> RobotData:
    """A robot of no particular numbers: names, types and ranges of variables need no others."""
    origin = Provenance("derived", ())
    joints = tuple(JointData(f"A{i}", -1.0, 1.0, origin) for i in range(1, 7))
    return RobotData(
        "any", Geometry(*(1.0,) * 6), origin, joints, (), (0.0, 0.0, -9.81), {}, None, (), "any"
    )


@lru_cache(maxsize=1)
def slots() -> tuple[Variable, ...]:
    """All slots in order: the variables of a robot's FMU, then those that only the C knows."""
    known = [native(v) for v in table(_any_robot(), Start(q=(0.0,) * 6))]
    more = [Variable(name, "Torque", "output", "continuous", name) for name in WANTED]
    margins = [
        Variable(name, "Torque" if "torque" in name else "Angle", "local", "continuous", name)
        for name in MARGINS
    ]
    time = Variable("time", "Time", "independent", "continuous", "Time")
    return (*known, *more, *margins, time)


def native(variable: Variable) -> Variable:
    """The variable as a native FMU has it: with more solver methods."""
    if variable.name != "solver.method":
        return variable
    assert variable.high is not None
    first = int(variable.high) + 1
    text = "".join(f", {k} {name}" for k, (name, _) in enumerate(METHODS, first))
    return variable._replace(
        description=variable.description + text, high=variable.high + len(METHODS)
    )


def places() -> dict[str, int]:
    """Slot by name."""
    return {v.name: place for place, v in enumerate(slots())}


def constant(name: str) -> str:
    """The C constant of a slot: payload.com.x becomes SLOT_PAYLOAD_COM_X, q[1] SLOT_Q.

    Of six that belong together only the first is named.
    """
    stem = name.removesuffix("[1]")
    return "SLOT_" + stem.replace(".", "_").replace("[", "_").replace("]", "").upper()


def bounds(variable: Variable) -> tuple[float, float]:
    """What may be set: parameters have ranges, but angles may lie beyond a joint's limits."""
    if variable.type == "Angle":
        return -FARTHEST, FARTHEST
    checked = variable.causality == "parameter"
    low, high = (variable.low, variable.high) if checked else (None, None)
    return (-math.inf if low is None else low, math.inf if high is None else high)


def header() -> Iterator[str]:
    """Lines of C: an enumeration of the slots, and the table of their names and ranges."""
    yield "enum {"
    for place, variable in enumerate(slots()):
        if "[" not in variable.name or variable.name.endswith("[1]"):
            yield f"    {constant(variable.name)} = {place},"
    yield f"    SLOTS = {len(slots())}"
    yield "};"
    yield ""
    yield "/* Slots that are computed together. */"
    names = ("none", *GROUPS)
    yield "enum { " + ", ".join(f"GROUP_{n.replace('.', '_').upper()}" for n in names) + " };"
    yield ""
    ranges = list(dict.fromkeys(map(_range, slots())))
    yield "/* What may be set: lowest, highest, unit. */"
    yield "#define KR16_RANGE_ROWS { \\"
    for low, high, unit in ranges:
        yield f'    {{{_number(low)}, {_number(high)}, "{unit}"}}, \\'
    yield "}"
    yield ""
    stems = list(dict.fromkeys(v.name.partition("[")[0] for v in slots()))
    yield "/* Kind, group, range and name of each slot. */"
    yield "#define KR16_SLOT_ROWS { \\"
    for v in slots():
        name = outputs.group(v.name)
        group = GROUPS.index(name) + 1 if name in GROUPS else 0
        codes = KINDS.index(v.base), group, ranges.index(_range(v))
        yield f"    {{{', '.join(map(str, codes))}, {stems.index(v.name.partition('[')[0])}}}, \\"
    yield "}"
    yield ""
    yield f"#define KR16_STEM {max(map(len, stems)) + 1}"
    yield "#define KR16_STEM_ROWS { \\"
    yield from (f'    "{stem}", \\' for stem in stems)
    yield "}"


def _range(variable: Variable) -> tuple[float, float, str]:
    return (*bounds(variable), TYPES[variable.type].unit)


def _number(value: float) -> str:
    return repr(value) if math.isfinite(value) else ("-HUGE_VAL" if value < 0 else "HUGE_VAL")
