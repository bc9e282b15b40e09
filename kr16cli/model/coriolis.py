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

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from kr16cli.model.dynamics import Wrench, joint_steps, rotated, shifted, wrench_out
from kr16cli.model.inertia import NOWHERE, Body, Step, turn_in, turn_out
from kr16cli.model.scalars import ZERO, Scalar, Trig, Vector, add, cross, dot
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


def composites(
    trail: Sequence[tuple[Step, Scalar, Scalar]], omegas: Sequence[Vector], bodies: Sequence[Body]
) -> Iterator[tuple[int, Body, Flow]]:
    """(i, body, its motion) of links i to 5 as one, i from 5 to 0, in joint frame i."""
    total, flow = bodies[5], body_flow(bodies[5], omegas[5])
    yield 5, total, flow
    for i in range(4, -1, -1):
        step, c, s = trail[i + 1]
        d_rate = cross(omegas[i], step.shift)
        turned = rotated(total, step.alpha, c, s)
        flow = flow_out(flow, turned.h, step.shift, d_rate, total.m, (step.alpha, c, s))
        flow = flow + body_flow(bodies[i], omegas[i])
        total = shifted(turned, step.shift) + bodies[i]
        yield i, total, flow


class Reach(NamedTuple):
    """Moments of a body under the unit motion xi = z_i x (r - o_i) about a frame's origin o.

    `force` sum m xi, `moment` sum m (r - o) x xi, `rate` sum m (r - o)' x xi: f1, n1, n2.
    """

    force: Vector
    moment: Vector
    rate: Vector


def unit_reach(total: Body, flow: Flow) -> Reach:
    """The moments in the axis' own frame."""
    (nxx, _, _), (_, nyy, _), (nzx, nzy, _) = flow.n
    force = (-total.h[1], total.h[0], ZERO)
    return Reach(force, (total.xz, total.yz, total.zz), (-nzx, -nzy, nxx + nyy))


def reach_out(reach: Reach, omega: Vector, turn: tuple[Step, Scalar, Scalar]) -> Reach:
    """The moments in the parent's axes, about its origin; the parent turns with `omega`."""
    step, c, s = turn
    force, moment = wrench_out(reach.force, reach.moment, step, c, s)
    rate = turn_out(reach.rate, step.alpha, c, s)
    return Reach(force, moment, add(rate, cross(cross(omega, step.shift), force)))


def axis_rate(omega: Vector) -> Vector:
    """z' of the frame's z axis."""
    return omega[1], -omega[0], ZERO


def column(total: Body, flow: Flow, omega: Vector) -> Wrench:
    """Force and moment of a column of C, from the composite beyond its axis."""
    (nxx, _, nxz), (_, nyy, nyz), _ = flow.n
    z_rate = axis_rate(omega)
    force = add(cross(z_rate, total.h), (-flow.p[1], flow.p[0], ZERO))
    return force, add(total.times(z_rate), (-nxz, -nyz, nxx + nyy))


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
    for i, total, flow in composites(trail, omegas, bodies):
        force, moment = column(total, flow, omegas[i])
        reach = unit_reach(total, flow)
        matrix[i][i] = moment[2]
        for j in range(i - 1, -1, -1):
            force, moment = wrench_out(force, moment, *trail[j + 1])
            matrix[j][i] = moment[2]
            reach = reach_out(reach, omegas[j], trail[j + 1])
            matrix[i][j] = dot(axis_rate(omegas[j]), reach.moment) + reach.rate[2]
    return matrix


def christoffel(cs: Trig, bodies: Sequence[Body], g: Geometry) -> list[list[list[Scalar]]]:
    """C_k(i, j) of (3.41), index k first: C(q, qd)[k][j] = sum_i qd_i C_k(i, j).

    C is linear in qd, so its value for the unit velocity e_i is the slice with that i.
    """
    slices = []
    for i in range(6):
        unit = [1 if j == i else ZERO for j in range(6)]
        slices.append(coriolis_matrix(cs, unit, bodies, g))
    return [[slices[i][k] for i in range(6)] for k in range(6)]
