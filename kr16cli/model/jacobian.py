"""Geometric Jacobian (3.30)-(3.36), its rate (3.47)-(3.51), its determinant (3.37).

Rows: linear first, then angular; robroot axes. A column beyond the link is structurally zero.
"""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.model.forward import Arm
from kr16cli.model.scalars import (
    ZERO,
    Functions,
    Scalar,
    Trig,
    Vector,
    add,
    angle_sum,
    cross,
    scale,
    sub,
)
from kr16cli.robot import Geometry

NULL: Vector = (ZERO, ZERO, ZERO)


def _rows(columns: Sequence[tuple[Vector, Vector]]) -> list[list[Scalar]]:
    """Columns (linear, angular) as six rows."""
    return [[column[half][i] for column in columns] for half in (0, 1) for i in range(3)]


def jacobian(a: Arm, point: Vector, link: int = 6) -> list[list[Scalar]]:
    """6x6 Jacobian of a point fixed to `link` (1..6): column i is (z_i x (p - o_i), z_i).

    Equation (3.32) with the index of the origin running (the printed o_0 in every column holds
    for the first only). `point` is in robroot, m.
    """
    columns = [
        (cross(z, sub(point, o)), z) if i < link else (NULL, NULL)
        for i, (z, o) in enumerate(zip(a.axes, a.origins, strict=True))
    ]
    return _rows(columns)


def velocities(a: Arm, qd: Sequence[Scalar]) -> tuple[list[Vector], list[Vector]]:
    """Angular velocity of links 0..6 (rad/s) and velocity of the six origins (m/s), robroot."""
    omega: list[Vector] = [NULL]
    origin_rate: list[Vector] = [NULL]
    for i in range(6):
        omega.append(add(omega[-1], scale(qd[i], a.axes[i])))
        if i < 5:
            arm = sub(a.origins[i + 1], a.origins[i])
            origin_rate.append(add(origin_rate[-1], cross(omega[-1], arm)))
    return omega, origin_rate


def jacobian_dot(a: Arm, point: Vector, qd: Sequence[Scalar], link: int = 6) -> list[list[Scalar]]:
    """Time derivative of `jacobian` along qd, by (3.47)-(3.49); same shape and axes."""
    omega, origin_rate = velocities(a, qd)
    last = link - 1
    point_rate = add(origin_rate[last], cross(omega[link], sub(point, a.origins[last])))
    columns = []
    for i in range(6):
        if i >= link:
            columns.append((NULL, NULL))
            continue
        z, lever = a.axes[i], sub(point, a.origins[i])
        z_rate = cross(omega[i], z)
        linear = add(cross(z_rate, lever), cross(z, sub(point_rate, origin_rate[i])))
        columns.append((linear, z_rate))
    return _rows(columns)


def determinant(cs: Trig, g: Geometry) -> Scalar:
    """det J of the flange or wrist, m^3: the product of the three singular families (3.37)."""
    return g.a2 * wrist_factor(cs) * elbow_factor(cs, g) * shoulder_factor(cs, g)


def wrist_factor(cs: Trig) -> Scalar:
    """sin q5: zero when A4 and A6 are in line."""
    return cs[4][1]


def elbow_factor(cs: Trig, g: Geometry) -> Scalar:
    """a3 c3 + d4 s3 (m): zero when shoulder, elbow and wrist centre are in line."""
    return g.a3 * cs[2][0] + g.d4 * cs[2][1]


def shoulder_factor(cs: Trig, g: Geometry) -> Scalar:
    """Signed distance of the wrist centre from the A1 axis (m): a1 + a2 c2 + d4 c23 - a3 s23."""
    c23, s23 = angle_sum(cs[1], cs[2])
    return g.a1 + g.a2 * cs[1][0] + (g.d4 * c23 - g.a3 * s23)


def singular_families(
    cs: Trig, g: Geometry, ns: Functions
) -> tuple[tuple[str, Scalar, Scalar], ...]:
    """(family, factor of (3.37), factor over its largest value) for shoulder, elbow and wrist.

    The elbow's largest value is hypot(a3, d4), the shoulder's the reach a1 + a2 + hypot(a3, d4).
    """
    forearm = ns.sqrt(g.a3 * g.a3 + g.d4 * g.d4)
    shoulder, elbow, wrist = shoulder_factor(cs, g), elbow_factor(cs, g), wrist_factor(cs)
    return (
        ("shoulder", shoulder, shoulder / (g.a1 + g.a2 + forearm)),
        ("elbow", elbow, elbow / forearm),
        ("wrist", wrist, wrist),
    )
