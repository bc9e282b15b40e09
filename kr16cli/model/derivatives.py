"""Exact derivatives of inverse and forward dynamics, in closed form by recursion.

Turn joint j by a constant small angle: every point r beyond it is displaced along
xi_j = z_j x (r - o_j), and this displacement moves with the body. Its second derivative is the
change of the point's acceleration a (gravity counted as the base's acceleration upward):

  da = z_j'' x (r - o_j) + 2 z_j' x (r - o_j)' + z_j x (a - a_j),  a_j of the origin o_j.

Torque i is the sum of xi_i . a dm over the points beyond joint i. For j <= i all of it turns
along, the terms with z_j x a cancel, and what is left is

  d tau_i / d q_j = z_j'' . n1 + 2 z_j' . n2 - z_j . (a_j x f1)

with the moments f1, n1, n2 of the unit motion of axis i (`coriolis.Reach`). For i < j column j
is a force and moment passed down to joint i, f and n the wrench that joint j transmits:

  force = z'' x h + 2 z' x p + z x f - m z x a_j,
  moment = J z'' + 2 D z' + z x n - h x (z x a_j).

C qd is quadratic in qd with symmetric symbols (3.41), so d tau / d qd is 2 C. Compare Singh,
Russell and Wensing, Efficient analytical derivatives of rigid-body dynamics using spatial
vector algebra, IEEE Robotics and Automation Letters 7(2), 2022.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model import dynamics
from kr16cli.model.coriolis import (
    Flow,
    axis_rate,
    column,
    composites,
    reach_out,
    unit_reach,
)
from kr16cli.model.dynamics import AT_REST, Motion, Wrench, joint_steps, wrench_out
from kr16cli.model.inertia import Body
from kr16cli.model.scalars import ZERO, Scalar, Trig, Vector, add, cross, dot, sub
from kr16cli.robot import Geometry

Matrix = list[list[Scalar]]


class Derivatives(NamedTuple):
    """Of torques with respect to q, qd, qdd; or of accelerations to q, qd, tau; 6 x 6 each."""

    q: Matrix
    qd: Matrix
    last: Matrix


def inverse_dynamics_derivatives(
    cs: Trig,
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    gravity: Sequence[Scalar],
    rotors: Sequence[Scalar] = AT_REST,
) -> Derivatives:
    """d tau / d q (N m), d tau / d qd = 2 C (N m s) and d tau / d qdd = M (kg m2), no friction."""
    trail = joint_steps(g, cs)
    moving = list(dynamics.motions(trail, qd, qdd, dynamics.base_acceleration(gravity)))
    wrenches = dynamics.joint_wrenches(trail, moving, bodies)
    omegas = [m.omega for m in moving]
    by_q, by_qd = _square(), _square()
    for i, total, flow in composites(trail, omegas, bodies):
        turned = _turned(total, flow, moving[i], wrenches[i])
        pushed = column(total, flow, omegas[i])
        reach = unit_reach(total, flow)
        by_q[i][i] = turned[1][2]
        by_qd[i][i] = _twice(pushed[1][2])
        for j in range(i - 1, -1, -1):
            turned = wrench_out(*turned, *trail[j + 1])
            pushed = wrench_out(*pushed, *trail[j + 1])
            reach = reach_out(reach, omegas[j], trail[j + 1])
            z_rate, (ax, ay, _) = axis_rate(omegas[j]), moving[j].acceleration
            swing = dot(_axis_rate2(moving[j]), reach.moment) + _twice(dot(z_rate, reach.rate))
            by_q[j][i] = turned[1][2]
            by_q[i][j] = swing + (ay * reach.force[0] - ax * reach.force[1])
            by_qd[j][i] = _twice(pushed[1][2])
            by_qd[i][j] = _twice(dot(z_rate, reach.moment) + reach.rate[2])
    return Derivatives(by_q, by_qd, dynamics.mass_matrix(cs, bodies, g, rotors))


def forward_dynamics_derivatives(
    cs: Trig,
    qd: Sequence[Scalar],
    tau: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    gravity: Sequence[Scalar],
    rotors: Sequence[Scalar] = AT_REST,
    slopes: Sequence[Scalar] = AT_REST,
) -> Derivatives:
    """d qdd / d q (1/s2), d qdd / d qd (1/s) and d qdd / d tau = M^-1 (1/(kg m2)).

    M qdd + b = tau holds along every change, so d qdd = M^-1 (d tau - d (inverse dynamics)), the
    latter at this qdd. `tau` is without friction, `slopes` are d friction / d qd.
    """
    factors = dynamics.factored(dynamics.mass_matrix(cs, bodies, g, rotors))
    bias = dynamics.bias(cs, qd, bodies, g, gravity)
    qdd = dynamics.solved(factors, [t - b for t, b in zip(tau, bias, strict=True)])
    by_q, by_qd, _ = inverse_dynamics_derivatives(cs, qd, qdd, bodies, g, gravity)
    for i in range(6):
        by_qd[i][i] = by_qd[i][i] + slopes[i]
    inverse = _square()
    for j in range(6):
        column_j = dynamics.solved(factors, [1 if i == j else ZERO for i in range(6)])
        for i in range(j, 6):
            inverse[i][j] = inverse[j][i] = column_j[i]
    return Derivatives(_minus_solved(factors, by_q), _minus_solved(factors, by_qd), inverse)


def _turned(total: Body, flow: Flow, motion: Motion, wrench: Wrench) -> Wrench:
    """Force and moment of column i of d tau / d q, from the composite beyond its axis."""
    (nxx, nxy, _), (nyx, nyy, _), (nzx, nzy, nzz) = flow.n
    x, y, _ = (_twice(v) for v in axis_rate(motion.omega))
    z_rate2 = _axis_rate2(motion)
    spin: Vector = ((nyy + nzz) * x - nxy * y, (nxx + nzz) * y - nyx * x, -(nzx * x + nzy * y))
    sway = _about_z(motion.acceleration)
    force = add(cross(z_rate2, total.h), cross((x, y, ZERO), flow.p))
    force = sub(add(force, _about_z(wrench[0])), (total.m * sway[0], total.m * sway[1], ZERO))
    moment = add(add(total.times(z_rate2), spin), _about_z(wrench[1]))
    return force, sub(moment, cross(total.h, sway))


def _axis_rate2(motion: Motion) -> Vector:
    """z'' of the frame's z axis, U z."""
    x, y, z = (row[2] for row in motion.u)
    return x, y, z


def _about_z(v: Vector) -> Vector:
    """z x v."""
    return -v[1], v[0], ZERO


def _twice(v: Scalar) -> Scalar:
    return v + v


def _square() -> Matrix:
    return [[ZERO] * 6 for _ in range(6)]


def _minus_solved(factors: dynamics.Factors, matrix: Matrix) -> Matrix:
    """-A^-1 B, column by column."""
    columns = [dynamics.solved(factors, [-v for v in c]) for c in zip(*matrix, strict=True)]
    return [list(row) for row in zip(*columns, strict=True)]
