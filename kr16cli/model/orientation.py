"""Roll-pitch-yaw of section 3.6.1, which is KUKA's A, B, C: R = Rz(phi) Ry(theta) Rx(psi)."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.model.scalars import ZERO, Functions, Scalar, Trig, Vector, sum_of
from kr16cli.tolerances import TOLERANCES

Rows = Sequence[Sequence[Scalar]]


def rotation_from_rpy(cs: Trig) -> list[list[Scalar]]:
    """R of (3.44) as rows; `cs` are the (cos, sin) pairs of phi (A), theta (B), psi (C)."""
    (ca, sa), (cb, sb), (cc, sc) = cs
    return [
        [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
        [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
        [-sb, cb * sc, cb * cc],
    ]


def rpy_from_rotation(r: Rows, ns: Functions) -> Vector:
    """(phi, theta, psi) of a rotation, rad; theta in [-pi/2, pi/2].

    Equation (3.45) in the form that also reproduces the rotation at theta = +-90 deg, where
    only phi -+ psi is defined: phi is chosen as 0 there.
    """
    horizontal = ns.sqrt(r[0][0] * r[0][0] + r[1][0] * r[1][0])
    pole = horizontal < TOLERANCES.pole
    phi = ns.where(pole, horizontal * 0, ns.atan2(r[1][0], r[0][0]))
    c, s = ns.cos(phi), ns.sin(phi)
    theta = ns.atan2(-r[2][0], horizontal)
    psi = ns.atan2(s * r[0][2] - c * r[1][2], c * r[1][1] - s * r[0][1])
    return phi, theta, psi


def rate_matrix(cs: Trig) -> list[list[Scalar]]:
    """B of (3.46): omega = B (phi', theta', psi'); singular at theta = +-90 deg.

    `cs` are the (cos, sin) pairs of phi, theta (and psi, not used).
    """
    (ca, sa), (cb, sb) = cs[0], cs[1]
    return [[ZERO, -sa, ca * cb], [ZERO, ca, sa * cb], [1, ZERO, -sb]]


def inverse_rate_matrix(cs: Trig) -> list[list[Scalar]]:
    """B^-1: (phi', theta', psi') = B^-1 omega. Division by cos(theta): guard the pole before."""
    (ca, sa), (cb, sb) = cs[0], cs[1]
    return [[ca * sb / cb, sa * sb / cb, 1], [-sa, ca, ZERO], [ca / cb, sa / cb, ZERO]]


def rate_matrix_dot(cs: Trig, rates: Sequence[Scalar]) -> list[list[Scalar]]:
    """Time derivative of B for the angle rates (phi', theta', psi')."""
    (ca, sa), (cb, sb) = cs[0], cs[1]
    a, b = rates[0], rates[1]
    return [
        [ZERO, -(ca * a), -(sa * cb * a) - ca * sb * b],
        [ZERO, -(sa * a), ca * cb * a - sa * sb * b],
        [ZERO, ZERO, -(cb * b)],
    ]


def rotation_defect(r: Rows) -> tuple[Scalar, Scalar]:
    """(|R|_F^2 - 3, |R|_F^2 - 3 - 2 (det R - 1)): both zero exactly for rotations.

    For singular values 1 + e_i they are 2 sum e_i and about 2 sum e_i^2, so the second is the
    square of the distance from a rotation where the first is zero.
    """
    size = sum_of(v * v for row in r for v in row[:3]) - 3
    (a, b, c), (d, e, f), (g, h, i) = (row[:3] for row in r)
    det = a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)
    return size, size - 2 * (det - 1)


def pose_distance(
    a: Sequence[Sequence[Scalar]], b: Sequence[Sequence[Scalar]], ns: Functions
) -> tuple[Scalar, Scalar]:
    """(distance of origins in m, angle of the relative rotation in rad) of two poses (rows).

    The angle is 2 asin(|Ra - Rb|_F / (2 sqrt 2)): accurate for small angles, where the trace
    formula loses half its digits.
    """
    gap = sum_of((a[i][3] - b[i][3]) * (a[i][3] - b[i][3]) for i in range(3))
    chord = sum_of((a[i][j] - b[i][j]) * (a[i][j] - b[i][j]) for i in range(3) for j in range(3))
    half = ns.sqrt(chord / 8)
    rest = 1 - half * half
    return ns.sqrt(gap), 2 * ns.atan2(half, ns.sqrt(ns.where(rest < 0, rest * 0, rest)))
