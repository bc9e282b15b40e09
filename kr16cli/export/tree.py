"""The robot as a tree of links: what every export format writes, in its own words.

All link frames have robroot's axes at the zero pose, and their origins where a parameter
file's "zero-pose" frames have them: link 1 at (0, 0, d1), links 2 and 3 on their joints, links
4 to 6 at the wrist centre. So every joint's own rotation is the identity, and exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

from kr16cli.errors import InputError
from kr16cli.model.chain import Frame, flange_of_frame6, frames, joint_frames
from kr16cli.model.inertia import Body, body_about, moved, steps
from kr16cli.model.scalars import Vector, add, cross, scale, sub
from kr16cli.robot import Inertia6, JointData, LinkData, Payload, RobotData, Vector3

_ZERO_POSE = ((1.0, 0.0),) * 6
_UNIT: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Inertial:
    """Mass (kg), mass centre (m) and inertia about it (kg m2, tensor entries), in link axes."""

    mass: float
    com: Vector3
    inertia: Inertia6


@dataclass(frozen=True)
class Segment:
    """A joint with the link that it turns.

    `origin` (m) is the link's frame in the parent link's, whose axes it shares at angle zero;
    `axis` is a unit vector of both. `inertial` is None for a kinematics-only robot.
    """

    name: str
    joint: JointData
    origin: Vector3
    axis: Vector3
    inertial: Inertial | None


@dataclass(frozen=True)
class Tree:
    """The six segments, and KUKA's flange on link 6: origin (m) and axes x, y, z as columns."""

    segments: tuple[Segment, ...]
    flange_origin: Vector3
    flange_axes: tuple[Vector3, Vector3, Vector3]


def tree(data: RobotData, payload: Payload | None = None) -> Tree:
    """The robot as a tree; the payload joins link 6.

    Raises:
        InputError: a payload for a robot whose link masses are not known, or one too large
            for the numbers of link 6 to be finite.
    """
    if payload is not None and payload.mass and not data.links:
        raise InputError(
            f"{data.name} ({data.path}) has no inertial data to add a payload of "
            f"{payload.mass:g} kg to; use a file with six [[link]] groups"
        )
    g = data.geometry
    at_zero = frames(_ZERO_POSE, g)
    turning = joint_frames(at_zero, g)
    shifts = [turning[i].rotate(step.shift) for i, step in enumerate(steps(g))]
    origins = [_vector((0.0, 0.0, g.d1)), *map(_vector, shifts)]
    flange = flange_of_frame6(at_zero[6])
    inertials: list[Inertial | None] = [None] * 6
    if data.links:
        bodies = [_body(link, at_zero[i + 1], turning[i].p) for i, link in enumerate(data.links)]
        inertials = [_own(link, body) for link, body in zip(data.links, bodies, strict=True)]
        if payload is not None and payload.mass:
            load = body_about(payload.mass, payload.com, payload.inertia)
            axes = Frame(flange.x, flange.y, flange.z, (0.0, 0.0, 0.0))
            last = _inertial(bodies[5] + moved(load, axes, sub(flange.p, turning[5].p)))
            if not all(map(math.isfinite, (last.mass, *last.com, *last.inertia))):
                raise InputError(
                    "the payload's numbers are so large that the inertia of link 6 with it "
                    "overflows (1.8e308); give smaller ones"
                )
            inertials[5] = last
    segments = (
        Segment(f"link_{i}", joint, origin, _vector(frame.z), inertial)
        for i, joint, origin, frame, inertial in zip(
            range(1, 7), data.joints, origins, turning, inertials, strict=True
        )
    )
    return Tree(
        segments=tuple(segments),
        flange_origin=_vector(scale(g.d6, flange.z)),
        flange_axes=(_vector(flange.x), _vector(flange.y), _vector(flange.z)),
    )


def _body(link: LinkData, dh: Frame, origin: Vector) -> Body:
    """A link of the file as a body in its zero-pose frame, whose origin lies at `origin`."""
    body = body_about(link.mass, link.com, link.inertia)
    if link.frame == "zero-pose":
        return body
    return moved(body, Frame(dh.x, dh.y, dh.z, (0.0, 0.0, 0.0)), sub(dh.p, origin))


def _own(link: LinkData, body: Body) -> Inertial:
    """A link without payload; the file's own numbers where no frame has to change."""
    if link.frame == "zero-pose":
        return Inertial(link.mass, link.com, link.inertia)
    return _inertial(body)


def _inertial(body: Body) -> Inertial:
    """A body about its mass centre."""
    centre = scale(1.0 / body.m, body.h)
    # Steiner: J_origin - m (c.c 1 - c c^T) = J_origin + m [c]x [c]x, column by column.
    columns = [add(body.times(e), scale(body.m, cross(centre, cross(centre, e)))) for e in _UNIT]
    six = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    inertia = cast("Inertia6", tuple(float(columns[j][i]) + 0.0 for i, j in six))
    return Inertial(float(body.m), _vector(centre), inertia)


def _vector(v: Sequence[object]) -> Vector3:
    """Floats for structural zeros and ones, without -0.0."""
    x, y, z = (float(cast("float", value)) + 0.0 for value in v)
    return x, y, z


def header(data: RobotData, payload: Payload | None, notes: Sequence[str]) -> list[str]:
    """What a reader of the file should know, as lines of text fit for an XML comment."""
    load = f", with a payload of {payload.mass:g} kg joined to link 6" if payload else ""
    lines = [
        f"{data.name}{load}; written by kr16cli.",
        f"Numbers: SHA-256 {data.sha256} of the parameter file.",
        "base_link is KUKA's ROBROOT (x forward, z up), flange and tool0 are KUKA's flange.",
        "m, rad, kg, kg m2; joint angles have KUKA's sign and zero.",
        *_statuses(data),
        *notes,
        "Not affiliated with KUKA. Not for safety functions.",
    ]
    return [line.replace("--", "- -") for line in lines]


def _statuses(data: RobotData) -> list[str]:
    """Where the inertial numbers come from, in a line."""
    if not data.links:
        return []
    found = list(dict.fromkeys(link.provenance.status for link in data.links))
    return [f"Masses and inertias are {' or '.join(found)}; see the parameter file."]


def numbers(values: Sequence[float]) -> str:
    """Numbers of an XML attribute, each in the shortest text that reads back the same."""
    return " ".join(repr(float(v)) for v in values)
