"""MJCF, MuJoCo's own model format."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import quoteattr

from kr16cli.errors import InputError
from kr16cli.export.tree import Inertial, Segment, Tree, header, numbers, tree
from kr16cli.robot import JointData, Payload, RobotData


def mjcf(
    data: RobotData,
    payload: Payload | None = None,
    drives: bool = False,
    gravity: Sequence[float] | None = None,
) -> str:
    """The robot as MJCF text: bodies link_1 to link_6, a site on the flange, a motor a joint.

    Radians, numbers in full. A motor's control is the joint torque in N m.
    MuJoCo has no joint speed limits; the file's are left out.

    Args:
        data: the robot, with inertial data.
        payload: load on the flange, joined to link 6.
        drives: write rotor inertia (armature, J G^2) and friction (damping, frictionloss).
        gravity: in robroot, m/s2; None is the file's.

    Raises:
        InputError: no inertial data; MuJoCo moves no body without mass.
    """
    if not data.links:
        raise InputError(
            f"{data.name} ({data.path}) has no inertial data, 0 of 6 links, and MuJoCo moves no "
            "body without mass; export urdf, or use a file with six [[link]] groups"
        )
    parts = tree(data, payload)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines += ["<!--", *(f"  {line}" for line in header(data, payload, notes(data, drives))), "-->"]
    lines += [
        f"<mujoco model={quoteattr(data.name)}>",
        '  <compiler angle="radian" autolimits="true"/>',
        f'  <option gravity="{numbers(data.gravity if gravity is None else gravity)}"/>',
        "  <worldbody>",
        '    <body name="base_link">',
        *_bodies(parts, drives),
        "    </body>",
        "  </worldbody>",
        "  <actuator>",
        *(f"    {_motor(joint)}" for joint in data.joints),
        "  </actuator>",
        "</mujoco>",
        "",
    ]
    return "\n".join(lines)


def notes(data: RobotData, drives: bool = False) -> list[str]:
    """What an MJCF of this robot says in another way; in sentences."""
    if drives and any(joint.coulomb for joint in data.joints):
        return ["MuJoCo's frictionloss is a constraint; kr16cli's Coulomb friction is smooth."]
    return []


def _bodies(parts: Tree, drives: bool) -> list[str]:
    """The six bodies, each inside the one before, with the flange in the last."""
    opening: list[str] = []
    closing: list[str] = []
    for depth, segment in enumerate(parts.segments, 3):
        pad = "  " * depth
        opening.append(f'{pad}<body name="{segment.name}" pos="{numbers(segment.origin)}">')
        opening += [f"{pad}  {line}" for line in _contents(segment, drives)]
        closing.insert(0, f"{pad}</body>")
    x, y, _ = parts.flange_axes
    place = f'pos="{numbers(parts.flange_origin)}" xyaxes="{numbers((*x, *y))}"'
    pad = "  " * 9
    sites = [f'{pad}<site name="{name}" {place}/>' for name in ("flange", "tool0")]
    return [*opening, *sites, *closing]


def _contents(segment: Segment, drives: bool) -> list[str]:
    joint = segment.joint
    own = [
        f"<joint name={quoteattr(joint.name)}",
        'type="hinge"',
        f'axis="{numbers(segment.axis)}"',
        f'range="{numbers((joint.lower, joint.upper))}"',
    ]
    if drives:
        own.append(f'armature="{joint.reflected_inertia!r}"')
        own.append(f'damping="{joint.viscous or 0.0!r}" frictionloss="{joint.coulomb or 0.0!r}"')
    lines = [] if segment.inertial is None else [_inertial(segment.inertial)]
    return [*lines, " ".join(own) + "/>"]


def _inertial(inertial: Inertial) -> str:
    return (
        f'<inertial pos="{numbers(inertial.com)}" mass="{inertial.mass!r}" '
        f'fullinertia="{numbers(inertial.inertia)}"/>'
    )


def _motor(joint: JointData) -> str:
    name = quoteattr(joint.name)
    limit = f' ctrlrange="{numbers((-joint.torque, joint.torque))}"' if joint.torque else ""
    return f"<motor name={name} joint={name}{limit}/>"
