"""The Denavit-Hartenberg chain of Table 3.1: every frame as a product of transforms (3.1, 3.2).

The table is read literally. `frames` is the definition that everything else is checked against;
`forward` has the closed form of the flange alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.scalars import (
    ZERO,
    Scalar,
    Trig,
    Vector,
    add,
    combine,
    neg,
    quarter_turn,
    scale,
)
from kr16cli.robot import Geometry


class Frame(NamedTuple):
    """A pose by its columns: axes x, y, z and origin p, in the axes of the parent frame."""

    x: Vector
    y: Vector
    z: Vector
    p: Vector

    def rows(self) -> list[list[Scalar]]:
        """The 4x4 homogeneous transform as row lists."""
        last = [[0.0, 0.0, 0.0, 1.0]]
        return [[self.x[i], self.y[i], self.z[i], self.p[i]] for i in range(3)] + last

    def apply(self, point: Vector) -> Vector:
        """A point given in this frame, in the parent's axes and from its origin."""
        return add(self.p, self.rotate(point))

    def rotate(self, v: Vector) -> Vector:
        """A free vector given in this frame, in the parent's axes."""
        return add(combine(v[0], self.x, v[1], self.y), scale(v[2], self.z))

    def unrotate(self, v: Vector) -> Vector:
        """A free vector given in the parent's axes, in this frame."""
        x, y, z = (a[0] * v[0] + a[1] * v[1] + a[2] * v[2] for a in (self.x, self.y, self.z))
        return x, y, z


CHAPTER_BASE = Frame((1, ZERO, ZERO), (ZERO, 1, ZERO), (ZERO, ZERO, 1), (ZERO, ZERO, ZERO))
"""The chapter's base frame b seen from itself."""

ROBROOT_BASE = Frame((ZERO, -1, ZERO), (1, ZERO, ZERO), (ZERO, ZERO, 1), (ZERO, ZERO, ZERO))
"""The chapter's base b seen from robroot: p_robroot = Rz(-90 deg) p_b, exactly."""


class DHRow(NamedTuple):
    """A row of Table 3.1: theta = q_joint + offset quarter turns; alpha in quarter turns."""

    offset: int
    d: Scalar
    a: Scalar
    alpha: int


def dh_table(g: Geometry) -> tuple[DHRow, ...]:
    """Table 3.1, rows 0 to 6, as printed; row 0 is constant, row i belongs to joint i."""
    return (
        DHRow(1, ZERO, ZERO, 2),
        DHRow(0, -g.d1, g.a1, 1),
        DHRow(0, ZERO, g.a2, 0),
        DHRow(1, ZERO, g.a3, -1),
        DHRow(0, -g.d4, ZERO, 1),
        DHRow(0, ZERO, ZERO, -1),
        DHRow(2, -g.d6, ZERO, 2),
    )


def dh_step(frame: Frame, row: DHRow, pair: tuple[Scalar, Scalar]) -> Frame:
    """Multiply by Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha), equation (3.1)."""
    c, s = quarter_turn(pair, row.offset)
    x = combine(c, frame.x, s, frame.y)
    y = combine(c, frame.y, -s, frame.x)
    z = frame.z
    p = add(frame.p, add(scale(row.d, z), scale(row.a, x)))
    y, z = ((y, z), (z, neg(y)), (neg(y), neg(z)), (neg(z), y))[row.alpha % 4]
    return Frame(x, y, z, p)


def frames(cs: Trig, g: Geometry, base: Frame = ROBROOT_BASE) -> list[Frame]:
    """The chapter's frames 0 to 6 in `base` (robroot, or CHAPTER_BASE for the chapter's b)."""
    table = dh_table(g)
    result = [dh_step(base, table[0], (1, ZERO))]
    for row, pair in zip(table[1:], cs, strict=True):
        result.append(dh_step(result[-1], row, pair))
    return result


def flange_of_frame6(frame6: Frame) -> Frame:
    """KUKA's flange: frame 6 turned half a turn about its z axis."""
    return Frame(neg(frame6.x), neg(frame6.y), frame6.z, frame6.p)


def joint_frames(links: Sequence[Frame], g: Geometry) -> list[Frame]:
    """The six joint frames that turn with the links, from `frames` 0 to 6, in the same base.

    Joint frame i has the z axis of frame i-1 and the x axis of frame i: it is frame i without
    the constant part of its row. Its origin slides along its own axis to where lengths vanish:
    to height d1 for joint 1, to the wrist centre for joints 4 to 6.
    """
    table = dh_table(g)
    result = []
    for i in range(1, 7):
        own, z = links[i], links[i - 1].z
        y = (own.y, neg(own.z), neg(own.y), own.z)[table[i].alpha % 4]
        origin = links[(0, 1, 2, 4, 4, 4)[i - 1]].p
        if i == 1:
            origin = add(origin, scale(table[1].d, z))
        result.append(Frame(own.x, y, z, origin))
    return result
