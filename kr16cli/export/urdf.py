"""URDF, as ROS, Pinocchio, Drake and many others read it."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from kr16cli.export.tree import Inertial, Segment, Tree, header, numbers, tree
from kr16cli.model.orientation import rpy_from_rotation
from kr16cli.model.scalars import FLOATS
from kr16cli.robot import Payload, RobotData

NO_LIMIT = 1e9
"""Written for a torque or speed that the file does not say; URDF demands a number."""


def urdf(data: RobotData, payload: Payload | None = None, drives: bool = False) -> str:
    """The robot as URDF text.

    Links base_link (robroot), link_1 to link_6 and, fixed to the last, flange and tool0, both
    KUKA's flange. Numbers are written in full, so a reader gets the same doubles.

    Args:
        data: the robot; without [[link]] groups the links carry no inertial element.
        payload: load on the flange, joined to link 6.
        drives: write friction (coulomb as `friction`, viscous as `damping`).

    Raises:
        InputError: a payload for a robot without inertial data.
    """
    parts = tree(data, payload)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines += ["<!--", *(f"  {line}" for line in header(data, payload, notes(data, drives))), "-->"]
    lines += [f"<robot name={quoteattr(data.name)}>", '  <link name="base_link"/>']
    parent = "base_link"
    for segment in parts.segments:
        lines += _joint(segment, parent, drives) + _link(segment.name, segment.inertial)
        parent = segment.name
    lines += _fixed("flange", parent, numbers(parts.flange_origin), _rpy(parts))
    lines += _fixed("tool0", "flange", numbers((0.0,) * 3), numbers((0.0,) * 3))
    return "\n".join([*lines, "</robot>", ""])


def notes(data: RobotData, drives: bool = False) -> list[str]:
    """What a URDF of this robot cannot say, or says for want of a number; in sentences."""
    found = []
    if not data.links:
        found.append(f"{data.name} has no inertial data: links are without inertial elements.")
    for what, key, unit in (("effort", "torque", "N m"), ("velocity", "speed", "rad/s")):
        silent = [j.name for j in data.joints if getattr(j, key) is None]
        if silent:
            found.append(
                f"No {key} limit is known for {', '.join(silent)}: {what} is {NO_LIMIT:g} {unit}."
            )
    if drives and any(j.reflected_inertia for j in data.joints):
        found.append("URDF has no place for rotor inertia: it is left out; MJCF keeps it.")
    return found


def _joint(segment: Segment, parent: str, drives: bool) -> list[str]:
    joint = segment.joint
    effort, velocity = (NO_LIMIT if v is None else v for v in (joint.torque, joint.speed))
    lines = [
        f'  <joint name={quoteattr(joint.name)} type="revolute">',
        f'    <parent link="{parent}"/>',
        f'    <child link="{segment.name}"/>',
        f'    <origin xyz="{numbers(segment.origin)}" rpy="0 0 0"/>',
        f'    <axis xyz="{numbers(segment.axis)}"/>',
        f'    <limit lower="{joint.lower!r}" upper="{joint.upper!r}" '
        f'effort="{effort!r}" velocity="{velocity!r}"/>',
    ]
    if drives:
        damping, friction = joint.viscous or 0.0, joint.coulomb or 0.0
        lines.append(f'    <dynamics damping="{damping!r}" friction="{friction!r}"/>')
    return [*lines, "  </joint>"]


def _link(name: str, inertial: Inertial | None) -> list[str]:
    if inertial is None:
        return [f'  <link name="{name}"/>']
    entries = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), inertial.inertia, strict=True)
    return [
        f'  <link name="{name}">',
        "    <inertial>",
        f'      <origin xyz="{numbers(inertial.com)}" rpy="0 0 0"/>',
        f'      <mass value="{inertial.mass!r}"/>',
        "      <inertia " + " ".join(f'{key}="{value!r}"' for key, value in entries) + "/>",
        "    </inertial>",
        "  </link>",
    ]


def _fixed(name: str, parent: str, xyz: str, rpy: str) -> list[str]:
    return [
        f'  <joint name="{name}_fixed" type="fixed">',
        f'    <parent link="{parent}"/>',
        f'    <child link="{name}"/>',
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
        "  </joint>",
        f'  <link name="{name}"/>',
    ]


def _rpy(parts: Tree) -> str:
    """The flange's axes as URDF's roll, pitch, yaw: psi, theta, phi of (3.44)."""
    rows = [list(row) for row in zip(*parts.flange_axes, strict=True)]
    phi, theta, psi = rpy_from_rotation(rows, FLOATS)
    return numbers([v + 0.0 for v in (psi, theta, phi)])
