"""Inertial parameters: from a file's links to the numbers the recursions use.

Recursions run in *joint frames*: joint frame i turns with link i, its z axis is joint axis i
(the chapter's z_(i-1)), its origin lies on that axis. Frame i of Table 3.1 is joint frame i
moved by the constant part of its row. `ORIGINS` and `steps` say where the joint frames are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.chain import Frame, dh_table, flange_of_frame6, frames, joint_frames
from kr16cli.model.scalars import ZERO, Scalar, Vector, add, cross, dot, scale, structural, sub
from kr16cli.robot import Geometry, LinkData, Payload


class Body(NamedTuple):
    """Ten inertial parameters about a frame's origin: m, h = m c, and the inertia tensor J.

    Units kg, kg m, kg m2; tensor entries, not negated products.
    """

    m: Scalar
    h: Vector
    xx: Scalar
    yy: Scalar
    zz: Scalar
    xy: Scalar
    xz: Scalar
    yz: Scalar

    def __add__(self, other: Body) -> Body:  # type: ignore[override]  # a sum of bodies
        """Both bodies, fixed together."""
        rest = (a + b for a, b in zip(self[2:], other[2:], strict=True))
        return Body(self.m + other.m, add(self.h, other.h), *rest)

    def times(self, v: Vector) -> Vector:
        """J v."""
        return (
            self.xx * v[0] + self.xy * v[1] + self.xz * v[2],
            self.xy * v[0] + self.yy * v[1] + self.yz * v[2],
            self.xz * v[0] + self.yz * v[1] + self.zz * v[2],
        )


EMPTY = Body(ZERO, (ZERO,) * 3, *(ZERO,) * 6)


class Step(NamedTuple):
    """From joint frame i to joint frame i+1.

    Shift (in frame i, m), quarter turns about x, and the quarter turns that Table 3.1 adds to
    the next angle.
    """

    shift: Vector
    alpha: int
    offset: int


def steps(g: Geometry) -> tuple[Step, ...]:
    """The five steps between the six joint frames, from Table 3.1.

    Joint frame 1 lies at height d1 on the A1 axis; frames 4, 5 and 6 at the wrist centre: an
    origin may slide along its own axis, and these choices leave the fewest non-zero lengths.
    """
    table = dh_table(g)
    shifts = ((g.a1, ZERO, ZERO), (g.a2, ZERO, ZERO), (g.a3, -g.d4, ZERO), NOWHERE, NOWHERE)
    return tuple(
        Step(shift, row.alpha, following.offset)
        for shift, row, following in zip(shifts, table[1:6], table[2:], strict=True)
    )


NOWHERE: Vector = (ZERO, ZERO, ZERO)


def turn_in(v: Vector, alpha: int, c: Scalar, s: Scalar) -> Vector:
    """A vector of the parent's axes in the child's: Rz(-theta) Rx(-alpha) v."""
    x, y, z = v
    if alpha % 4 == 1:
        y, z = z, -y
    elif alpha % 4 == 3:
        y, z = -z, y
    return c * x + s * y, c * y - s * x, z


def turn_out(v: Vector, alpha: int, c: Scalar, s: Scalar) -> Vector:
    """A vector of the child's axes in the parent's: Rx(alpha) Rz(theta) v."""
    x, y, z = c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]
    if alpha % 4 == 1:
        return x, -z, y
    if alpha % 4 == 3:
        return x, z, -y
    return x, y, z


def body_about(mass: Scalar, com: Vector, inertia: Sequence[Scalar]) -> Body:
    """A rigid body with inertia about its mass centre, given about the frame's origin."""
    x, y, z = com
    ixx, iyy, izz, ixy, ixz, iyz = inertia
    return Body(
        mass,
        (mass * x, mass * y, mass * z),
        ixx + mass * (y * y + z * z),
        iyy + mass * (x * x + z * z),
        izz + mass * (x * x + y * y),
        ixy - mass * x * y,
        ixz - mass * x * z,
        iyz - mass * y * z,
    )


def moved(body: Body, rotation: Frame, shift: Vector) -> Body:
    """The body seen from a frame in which its own frame has axes `rotation` and origin `shift`."""
    h = rotation.rotate(body.h)
    columns = [rotation.rotate(body.times(rotation.unrotate(e))) for e in _UNIT]
    s, m = shift, body.m
    both = 2 * dot(s, h) + m * dot(s, s)

    def entry(i: int, j: int) -> Scalar:
        product = s[i] * h[j] + h[i] * s[j] + m * s[i] * s[j]
        return columns[j][i] + (both - product if i == j else -product)

    return Body(
        m,
        add(h, scale(m, s)),
        *(entry(i, j) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))),
    )


_UNIT: tuple[Vector, Vector, Vector] = ((1, ZERO, ZERO), (ZERO, 1, ZERO), (ZERO, ZERO, 1))
_ZERO_POSE = ((1, ZERO),) * 6


def link_body(link: LinkData, index: int, g: Geometry) -> Body:
    """Link `index` (1..6) of a file as a body in joint frame `index`."""
    return _link_body(link, index, _zero_pose(g))


def payload_body(payload: Payload, g: Geometry) -> Body:
    """A load given in flange axes from the flange origin, as a body in joint frame 6."""
    return _payload_body(payload, _zero_pose(g))


def _zero_pose(g: Geometry) -> tuple[list[Frame], list[Frame]]:
    """The chapter's frames 0 to 6 and the six joint frames at q = 0."""
    links = frames(_ZERO_POSE, g)
    return links, joint_frames(links, g)


def _link_body(link: LinkData, index: int, at_zero: tuple[list[Frame], list[Frame]]) -> Body:
    body = body_about(link.mass, link.com, link.inertia)
    links, joints = at_zero
    joint = joints[index - 1]
    own = links[index] if link.frame == "dh" else Frame(*_UNIT, p=joint.p)
    return moved(body, *_seen_from(joint, own))


def _payload_body(payload: Payload, at_zero: tuple[list[Frame], list[Frame]]) -> Body:
    body = body_about(payload.mass, payload.com, payload.inertia)
    links, joints = at_zero
    return moved(body, *_seen_from(joints[5], flange_of_frame6(links[6])))


def _seen_from(frame: Frame, other: Frame) -> tuple[Frame, Vector]:
    """Axes and origin of `other` in `frame`, both given in the same base."""
    x, y, z = (frame.unrotate(axis) for axis in (other.x, other.y, other.z))
    return Frame(x, y, z, NOWHERE), frame.unrotate(sub(other.p, frame.p))


def robot_bodies(
    links: Sequence[LinkData], payload: Payload | None, g: Geometry
) -> tuple[Body, ...]:
    """The six moving links in their joint frames; the payload joins link 6."""
    at_zero = _zero_pose(g)
    bodies = [_link_body(link, i, at_zero) for i, link in enumerate(links, 1)]
    if payload is not None and payload.mass != 0:
        bodies[5] = bodies[5] + _payload_body(payload, at_zero)
    return tuple(bodies)


def regroup(bodies: Sequence[Body], g: Geometry) -> tuple[Body, ...]:
    """Base (minimal) parameters: same joint torques for every motion and gravity, fewer numbers.

    Mass on a joint axis (a rod: m, h_z, J = diag(Y, Y, 0)) belongs to either of the links that
    the joint connects, for it moves with both. So from the last link down, the rod with a
    link's m, h_z and J_yy is handed to the link before; of link 1 only J_zz, h_x and h_y ever
    turn. 38 numbers stay (36 are seen when gravity is along z). Regrouped links are no bodies:
    use the full set for masses, potential energy and base wrench.
    """
    result, between = list(bodies), steps(g)
    for i in range(5, 0, -1):
        body, step = result[i], between[i - 1]
        rod, result[i] = _take_rod(body)
        result[i - 1] = result[i - 1] + _rod_in_parent(rod, step)
    first = result[0]
    result[0] = EMPTY._replace(h=(first.h[0], first.h[1], ZERO), zz=first.zz)
    return tuple(result)


def _take_rod(body: Body) -> tuple[tuple[Scalar, Scalar, Scalar], Body]:
    """(m, h_z, Y) of the rod on the z axis, and the body without it."""
    rest = body._replace(m=ZERO, h=(body.h[0], body.h[1], ZERO), xx=body.xx - body.yy, yy=ZERO)
    return (body.m, body.h[2], body.yy), rest


def _rod_in_parent(rod: tuple[Scalar, Scalar, Scalar], step: Step) -> Body:
    """The rod as part of the parent link."""
    m, hz, y = rod
    ex, ey = (turn_out(e, step.alpha, 1, ZERO) for e in _UNIT[:2])
    body = Body(m, (ZERO, ZERO, hz), y, y, ZERO, ZERO, ZERO, ZERO)
    return moved(body, Frame(ex, ey, cross(ex, ey), NOWHERE), step.shift)


def sparse(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """The bodies with exact zeros made structural, so that recursions skip them."""
    return tuple(
        Body(
            structural(b.m),
            (structural(b.h[0]), structural(b.h[1]), structural(b.h[2])),
            *(structural(v) for v in b[2:]),
        )
        for b in bodies
    )
