"""The Christoffel Coriolis matrix (3.40)-(3.41) by recursion, without symbolic expansion.

For particles, M = sum m J^T J has the Christoffel matrix C = sum m J^T J_dot. Integrated over
rigid bodies, column j of J_dot is a velocity field affine in the position, so C needs, beside
mass m, first moment h and inertia J of the composite bodies, two more moments of their motion:
p = int r' dm (momentum relative to the origin) and N = int r' r^T dm (r' the velocity). With
z' = omega x z the rate of joint axis z (the e3 of its frame) and D = tr(N) 1 - N:

  upper triangle, force of column j:  f = z' x h + z x p,  n = J z' + D z, passed down to i <= j;
  lower triangle, C_ij for j < i:     z'_j . n1 + z_j . n2 with n1 = J z_i + o_ij x f1,
                                      n2 = D^T z_i + o'_ij x f1,  f1 = z_i x h.

C + C^T = M_dot and C qd = bias - G hold identically (checked in `verify` and the tests).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.dynamics import joint_steps, rotated, shifted, wrench_out
from kr16cli.model.inertia import NOWHERE, Body, Step, turn_in, turn_out
from kr16cli.model.scalars import ZERO, Scalar, Trig, Vector, add, cross
from kr16cli.robot import Geometry

Matrix3 = tuple[Vector, Vector, Vector]


class Flow(NamedTuple):
    """Moments of a body's motion about a frame's origin: p, and N by rows."""

    p: Vector
    n: Matrix3

    def __add__(self, other: Flow) -> Flow:  # type: ignore[override]  # a sum of bodies
        a, b = self.n, other.n
        n = (add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2]))
        return Flow(add(self.p, other.p), n)


def body_flow(b: Body, omega: Vector) -> Flow:
    """The moments of a body turning with omega about the origin: p = w x h, N = [w]x S.

    S = tr(J)/2 1 - J is the matrix of second moments; its columns are crossed with omega.
    """
    half = (b.xx + b.yy + b.zz) / 2
    columns = (
        (half - b.xx, -b.xy, -b.xz),
        (-b.xy, half - b.yy, -b.yz),
        (-b.xz, -b.yz, half - b.zz),
    )
    x, y, z = (cross(omega, column) for column in columns)
    return Flow(cross(omega, b.h), _transposed((x, y, z)))


def _transposed(a: Matrix3) -> Matrix3:
    x, y, z = zip(*a, strict=True)
    return x, y, z


def _outer_sum(n: Matrix3, a: Vector, b: Vector, c: Vector, d: Vector) -> Matrix3:
    """N + a b^T + c d^T."""
    x, y, z = (
        (
            row[0] + a[i] * b[0] + c[i] * d[0],
            row[1] + a[i] * b[1] + c[i] * d[1],
            row[2] + a[i] * b[2] + c[i] * d[2],
        )
        for i, row in enumerate(n)
    )
    return x, y, z


def flow_out(
    flow: Flow, h: Vector, d: Vector, d_rate: Vector, m: Scalar, turn: tuple[int, Scalar, Scalar]
) -> Flow:
    """The moments of a child's composite in the parent's axes and about the parent's origin.

    `h` is the composite's first moment in the parent's axes (about the child's origin); the
    child's origin lies at d and moves with d_rate.
    """
    x, y, z = (turn_out(row, *turn) for row in flow.n)  # rows: N R^T
    n = _transposed((x, y, z))
    x, y, z = (turn_out(column, *turn) for column in n)  # columns: R N R^T
    n = _transposed((x, y, z))
    p = add(turn_out(flow.p, *turn), (m * d_rate[0], m * d_rate[1], m * d_rate[2]))
    return Flow(p, _outer_sum(n, p, d, d_rate, h))


def coriolis_matrix(
    cs: Trig, qd: Sequence[Scalar], bodies: Sequence[Body], g: Geometry
) -> list[list[Scalar]]:
    """C(q, qd) with the Christoffel symbols of (3.41), kg m2/s; linear in qd."""
    trail = joint_steps(g, cs)
    omegas: list[Vector] = []
    omega = NOWHERE
    for (step, c, s), rate in zip(trail, qd, strict=True):
        omega = turn_in(omega, step.alpha, c, s)
        omega = (omega[0], omega[1], omega[2] + rate)
        omegas.append(omega)

    matrix: list[list[Scalar]] = [[ZERO] * 6 for _ in range(6)]
    total, flow = bodies[5], body_flow(bodies[5], omegas[5])
    for i in range(5, -1, -1):
        _fill(matrix, i, total, flow, omegas, trail)
        if i:
            step, c, s = trail[i]
            d_rate = cross(omegas[i - 1], step.shift)
            turned = rotated(total, step.alpha, c, s)
            flow = flow_out(flow, turned.h, step.shift, d_rate, total.m, (step.alpha, c, s))
            flow = flow + body_flow(bodies[i - 1], omegas[i - 1])
            total = shifted(turned, step.shift) + bodies[i - 1]
    return matrix


def _fill(
    matrix: list[list[Scalar]],
    i: int,
    total: Body,
    flow: Flow,
    omegas: Sequence[Vector],
    trail: Sequence[tuple[Step, Scalar, Scalar]],
) -> None:
    """Column i above and row i left of the diagonal, from the composite of links i and after."""
    wx, wy, _ = omegas[i]
    (nxx, _, nxz), (_, nyy, nyz), (nzx, nzy, _) = flow.n
    axis_rate = (wy, -wx, ZERO)
    spin = nxx + nyy
    force = add(cross(axis_rate, total.h), (-flow.p[1], flow.p[0], ZERO))
    moment = add(total.times(axis_rate), (-nxz, -nyz, spin))
    f1: Vector = (-total.h[1], total.h[0], ZERO)
    n1: Vector = (total.xz, total.yz, total.zz)
    n2: Vector = (-nzx, -nzy, spin)
    matrix[i][i] = moment[2]
    for j in range(i - 1, -1, -1):
        step, c, s = trail[j + 1]
        force, moment = wrench_out(force, moment, step, c, s)
        matrix[j][i] = moment[2]
        n2 = turn_out(n2, step.alpha, c, s)
        f1, n1 = wrench_out(f1, n1, step, c, s)
        n2 = add(n2, cross(cross(omegas[j], step.shift), f1))
        matrix[i][j] = omegas[j][1] * n1[0] - omegas[j][0] * n1[1] + n2[2]


def christoffel(cs: Trig, bodies: Sequence[Body], g: Geometry) -> list[list[list[Scalar]]]:
    """C_k(i, j) of (3.41), index k first: C(q, qd)[k][j] = sum_i qd_i C_k(i, j).

    C is linear in qd, so its value for the unit velocity e_i is the slice with that i.
    """
    slices = []
    for i in range(6):
        unit = [1 if j == i else ZERO for j in range(6)]
        slices.append(coriolis_matrix(cs, unit, bodies, g))
    return [[slices[i][k] for i in range(6)] for k in range(6)]
