"""The variables of a native FMU: those of the pythonfmu FMU, and what a version of FMI adds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from kr16cli.fmi.native import slots
from kr16cli.fmi.variables import Part, Start, Variable
from kr16cli.fmi.variables import table as common
from kr16cli.robot import RobotData

STATES = ("q", "qd")
"""Variables that are continuous states; each is followed by its derivative."""

DERIVATIVES = {"qd": "q", "qdd": "qd"}
"""Derivatives, and of which variables."""


class Item(NamedTuple):
    """One variable of the description: a scalar, or six of them as an array."""

    name: str
    members: tuple[Variable, ...]

    @property
    def first(self) -> Variable:
        """The scalar, or the first of the array."""
        return self.members[0]


def items(known: Sequence[Variable], *, arrays: bool) -> tuple[Item, ...]:
    """The variables of a description; with `arrays`, six that belong together are one."""
    return tuple(_items(known, arrays=arrays))


def _items(known: Sequence[Variable], *, arrays: bool) -> Iterator[Item]:
    place = 0
    while place < len(known):
        name = known[place].name
        many = 6 if arrays and name.endswith("[1]") else 1
        members = tuple(known[place : place + many])
        yield Item(name.removesuffix("[1]") if many > 1 else name, members)
        place += many


def variables(data: RobotData, start: Start, part: Part, *, version: int) -> tuple[Variable, ...]:
    """The table in the order of value references, which begin with 1.

    Args:
        data: the robot.
        start: start values.
        part: the robot or its controller.
        version: of FMI, 2 or 3; 3 needs the time and the event indicators as variables.
    """
    known = tuple(map(slots.native, common(data, start, part)))
    if version == 2:
        return known
    margins = _margins(data) if part is Part.ROBOT else ()
    time = Variable("time", "Time", "independent", "continuous", "Time")
    return (*known, *margins, time)


def _margins(data: RobotData) -> Sequence[Variable]:
    texts = {
        "lower": ("Angle", "its lower limit"),
        "upper": ("Angle", "its upper limit"),
        "speed": ("AngularVelocity", "its speed limit"),
        "torque": ("Torque", "its greatest torque"),
    }
    found = []
    for name in slots.MARGINS:
        what, joint = name.removeprefix("margin.").rstrip("]").split("[")
        kind, limit = texts[what]
        text = f"What is left of {data.joints[int(joint) - 1].name} to {limit}"
        found.append(Variable(name, kind, "local", "continuous", text))
    return found
