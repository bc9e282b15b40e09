"""The formulas of computed torque in task space, on scalars of any kind.

`task_control` runs them on floats; native FMUs hold them printed as C.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.dynamics import solve_symmetric
from kr16cli.model.orientation import (
    inverse_rate_matrix,
    rate_matrix,
    rate_matrix_dot,
    rpy_from_rotation,
)
from kr16cli.model.scalars import Functions, Scalar, Trig, cross, matvec
from kr16cli.model.task import product, transpose
from kr16cli.simulate.core import TaskTarget

FOLD = 0.02
"""cos of the pitch error below which the error angles are given up: 88.9 deg."""

NEAR = 0.1
"""Sine of a singular family below which damping sets in."""

STRENGTH = 0.05
"""Greatest root of the damping, m and rad alike."""

Rows = Sequence[Sequence[Scalar]]


class Error(NamedTuple):
    """Error angles Phi (phi, theta, psi in rad), their (cos, sin) pairs, and rates (rad/s)."""

    angles: list[Scalar]
    trig: Trig
    rates: list[Scalar]


def orientation_error(
    rotation: Rows, omega: Sequence[Scalar], target: TaskTarget, ns: Functions
) -> Error:
    """Roll, pitch and yaw of R_ref^T R and their rates; no answer at a pitch of +-90 deg.

    Args:
        rotation: R, 3x3 rows, robroot.
        omega: angular velocity of R, rad/s, robroot.
        target: R_ref and its twist.
        ns: the functions of the scalars.
    """
    back = transpose(target.rotation)
    angles = list(rpy_from_rotation(product(back, rotation), ns))
    cs = ns.trig(angles)
    gap = [a - b for a, b in zip(omega, target.twist[3:], strict=True)]
    return Error(angles, cs, matvec(inverse_rate_matrix(cs), matvec(back, gap)))


def flange_acceleration(
    position: Sequence[Scalar],
    twist: Sequence[Scalar],
    error: Error,
    target: TaskTarget,
    kp: Sequence[Scalar],
    kd: Sequence[Scalar],
) -> list[Scalar]:
    """Acceleration of the flange (m/s2, rad/s2, robroot) that e'' + Kd e' + Kp e = 0 needs.

    Args:
        position: of the flange, m, robroot.
        twist: of the flange, m/s and rad/s, robroot.
        error: of the orientation.
        target: the flange's wanted motion.
        kp: 1/s2, for x, y, z and the three error angles.
        kd: 1/s.
    """
    linear = [
        target.acceleration[i]
        + kd[i] * (target.twist[i] - twist[i])
        + kp[i] * (target.position[i] - position[i])
        for i in range(3)
    ]
    a_phi = [-kd[3 + i] * error.rates[i] - kp[3 + i] * error.angles[i] for i in range(3)]
    relative = [
        a + b
        for a, b in zip(
            matvec(rate_matrix_dot(error.trig, error.rates), error.rates),
            matvec(rate_matrix(error.trig), a_phi),
            strict=True,
        )
    ]
    w_ref, w = target.twist[3:], twist[3:]
    x, y, z = (a - b for a, b in zip(w, w_ref, strict=True))
    dragged = cross((w_ref[0], w_ref[1], w_ref[2]), (x, y, z))
    turned = matvec(target.rotation, relative)
    return linear + [
        a + b + c for a, b, c in zip(target.acceleration[3:], dragged, turned, strict=True)
    ]


def damping(
    sines: Sequence[Scalar], ns: Functions, near: float = NEAR, strength: float = STRENGTH
) -> Scalar:
    """l^2 for the sines of the three singular families: 0 unless one is below `near` (> 0)."""
    sizes = [ns.where(s < 0.0, -s, s) for s in sines]
    sine = sizes[0]
    for size in sizes[1:]:
        sine = ns.where(size < sine, size, sine)
    share = sine / near
    return ns.where(sine < near, strength**2 * (1.0 - share * share), sine * 0.0)


def joint_acceleration(
    J: Rows,
    drift: Sequence[Scalar],
    qd: Sequence[Scalar],
    wanted: Sequence[Scalar],
    square: Scalar,
    brake: Scalar,
) -> list[Scalar]:
    """qdd (rad/s2) that minimises |J qdd + J' qd - a|^2 + l^2 |qdd + brake qd|^2.

    With x = qdd + brake qd: min |J x - (b + brake J qd)|^2 + l^2 |x|^2 with b = a - J' qd, by the
    normal equations on the row side, x = J^T (J J^T + l^2)^-1 (...).

    Args:
        J: Jacobian of the flange, robroot.
        drift: J' qd, m/s2 and rad/s2.
        qd: joint speeds, rad/s.
        wanted: a, acceleration of the flange, m/s2 and rad/s2.
        square: l^2.
        brake: 1/s; 0 where l^2 is 0.
    """
    b = [u - v for u, v in zip(wanted, drift, strict=True)]
    moved = matvec(J, [brake * v for v in qd])
    gram = product(J, transpose(J))
    for i in range(6):
        gram[i][i] += square
    y = solve_symmetric(gram, [u + v for u, v in zip(b, moved, strict=True)])
    x = matvec(transpose(J), y)
    return [u - brake * v for u, v in zip(x, qd, strict=True)]
