"""Closed-form forward kinematics: the flange, the joint axes and the wrist centre in robroot.

The chapter's (3.3)-(3.6) and (3.9), factored by the unit vectors they are built from:
f and l span the horizontal plane after A1 (forward, and left of the chapter's x_b sense), u is
up, e points along the forearm, p is perpendicular to it in the arm's plane.
"""

from __future__ import annotations

from typing import NamedTuple

from kr16cli.model.chain import Frame
from kr16cli.model.scalars import ZERO, Scalar, Trig, Vector, angle_sum, combine, neg
from kr16cli.robot import Geometry


class Arm(NamedTuple):
    """What a configuration looks like in robroot.

    `axes` are the six joint axes z_0..z_5, `origins` a point on each; `flange_z` the approach
    axis, `tangent` and `lateral` the axes across it before A6 turns; `wrist` is o_c of (3.8).
    """

    axes: tuple[Vector, ...]
    origins: tuple[Vector, ...]
    wrist: Vector
    flange_z: Vector
    tangent: Vector
    lateral: Vector
    flange_p: Vector


def arm(cs: Trig, g: Geometry) -> Arm:
    """Joint axes, origins, wrist centre and flange position in robroot (m)."""
    (c1, s1), (c2, s2), (c4, s4), (c5, s5) = cs[0], cs[1], cs[3], cs[4]
    c23, s23 = angle_sum(cs[1], cs[2])
    swing = (s1, c1, ZERO)  # -l, the axis of A2 and A3
    e = (c23 * c1, -(c23 * s1), -s23)
    p = (-(s23 * c1), s23 * s1, -c23)
    across = combine(c4, p, -s4, swing)
    lateral = combine(-s4, p, -c4, swing)
    flange_z = combine(c5, e, s5, across)
    tangent = combine(c5, across, -s5, e)

    elbow_r, elbow_z = g.a1 + g.a2 * c2, g.d1 - g.a2 * s2
    wrist_r = elbow_r + (g.d4 * c23 - g.a3 * s23)
    wrist = (c1 * wrist_r, -(s1 * wrist_r), elbow_z - (g.d4 * s23 + g.a3 * c23))
    shoulder = (g.a1 * c1, -(g.a1 * s1), g.d1)
    elbow = (c1 * elbow_r, -(s1 * elbow_r), elbow_z)
    flange_p = tuple(w + g.d6 * z for w, z in zip(wrist, flange_z, strict=True))
    return Arm(
        axes=((ZERO, ZERO, -1), swing, swing, neg(e), neg(lateral), neg(flange_z)),
        origins=((ZERO, ZERO, g.d1), shoulder, elbow, wrist, wrist, wrist),
        wrist=wrist,
        flange_z=flange_z,
        tangent=tangent,
        lateral=lateral,
        flange_p=flange_p,
    )


def flange(cs: Trig, g: Geometry) -> Frame:
    """T_robroot_flange: (3.3)-(3.6) of the chapter, with flange = frame 6 Rz(180 deg)."""
    a = arm(cs, g)
    c6, s6 = cs[5]
    x = combine(c6, a.tangent, s6, a.lateral)
    y = combine(s6, a.tangent, -c6, a.lateral)
    return Frame(x, y, a.flange_z, a.flange_p)


def r36(cs: Trig) -> list[list[Scalar]]:
    """Rotation from frame 3 to frame 6 as rows, equation (3.22)."""
    (c4, s4), (c5, s5), (c6, s6) = cs[3], cs[4], cs[5]
    return [
        [s4 * s6 - c4 * c5 * c6, -(c6 * s4) - c4 * c5 * s6, c4 * s5],
        [-(c4 * s6) - c5 * c6 * s4, c4 * c6 - c5 * s4 * s6, s4 * s5],
        [-(c6 * s5), -(s5 * s6), -c5],
    ]
