"""terminalsAndIcons.xml of FMI 3.0: what of the variables is plugged in together.

A joint's drive is a plug: its torque flows in, angle and speed are seen. The flange is one, too:
the wrench flows in, the pose is seen. References are a plug of signals. Members have the same
names in the robot and in its controller, so their plugs fit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from kr16cli.fmi.native.table import Item
from kr16cli.fmi.variables import JOINTS, POSE, Part, six

SIGNAL, INFLOW, OUTFLOW = "signal", "inflow", "outflow"
_TARGETS = ("q_ref", "qd_ref", "qdd_ref")


class Member(NamedTuple):
    """A variable, its name in the plug, and its kind."""

    variable: str
    name: str
    kind: str


def document(listed: Sequence[Item], part: Part) -> Element:
    """The whole document.

    Args:
        listed: the variables; with rows of six as arrays, all joints are one plug.
        part: the robot or its controller.
    """
    root = Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    look = SubElement(root, "GraphicalRepresentation")
    box = {"x1": "-100.0", "y1": "-100.0", "x2": "100.0", "y2": "100.0"}
    SubElement(look, "CoordinateSystem", {**box, "suggestedScalingFactorTo_mm": "0.1"})
    SubElement(look, "Icon", box)
    terminals = SubElement(root, "Terminals")
    arrays = any(item.name == "q" for item in listed)
    for name, text, members in _terminals(part, arrays=arrays):
        terminal = SubElement(terminals, "Terminal", {
            "name": name, "matchingRule": "plug", "description": text,
        })  # fmt: skip
        for member in members:
            SubElement(terminal, "TerminalMemberVariable", {
                "variableName": member.variable, "memberName": member.name,
                "variableKind": member.kind,
            })  # fmt: skip
    return root


def _terminals(part: Part, *, arrays: bool) -> Iterator[tuple[str, str, list[Member]]]:
    """Name, description and members of each terminal."""
    flow = INFLOW if part is Part.ROBOT else OUTFLOW
    text = "Drive of a joint: torque in, angle and speed seen"
    if part is Part.CONTROLLER:
        text = "Drive of a joint: torque out, angle and speed measured"
    kinds = (("tau", flow), ("q", SIGNAL), ("qd", SIGNAL))
    for index in [""] if arrays else [f"[{i}]" for i in JOINTS]:
        yield (
            f"joint{index}" if index else "joints",
            text if index else text.replace("a joint", "the joints"),
            [Member(name + index, name, kind) for name, kind in kinds],
        )
    names = _TARGETS if arrays else [name for stem in _TARGETS for name in six(stem)]
    members = [Member(name, name, SIGNAL) for name in names]
    yield "reference", "Wanted angles, speeds and accelerations of the joints", members
    if part is Part.ROBOT:
        pushed = ["wrench"] if arrays else six("wrench")
        members = [Member(name, name, INFLOW) for name in pushed]
        members += [Member(name, name, SIGNAL) for name in POSE]
        yield "flange", "Flange: force and moment in, pose seen; axes of robroot", members
