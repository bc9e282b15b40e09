"""Computed torque in task space, section 3.6, with the error angles of (3.44). Plain floats.

The orientation error is R_e = R_ref^T R and its roll, pitch and yaw Phi: zero on the
reference, singular at a pitch error of 90 deg, wherever the reference is. With
w_e = R_ref^T (w - w_ref) = B(Phi) Phi' (3.46), an acceleration of the error angles a_Phi needs
  alpha = alpha_ref + w_ref x (w - w_ref) + R_ref (B' Phi' + B a_Phi).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.dynamics import solve_symmetric
from kr16cli.model.orientation import (
    inverse_rate_matrix,
    rate_matrix,
    rate_matrix_dot,
    rpy_from_rotation,
)
from kr16cli.model.scalars import FLOATS, cross, matvec
from kr16cli.model.task import product, transpose
from kr16cli.simulate.controllers import Gain, six
from kr16cli.simulate.core import Reference, TaskTarget
from kr16cli.single import Arm

FOLD = 0.02
"""cos of the pitch error below which the error angles are given up: 88.9 deg."""


class OrientationError(NamedTuple):
    """Error angles Phi (phi, theta, psi in rad) and their rates (rad/s)."""

    angles: list[float]
    rates: list[float]


def orientation_error(
    rotation: Sequence[Sequence[float]], omega: Sequence[float], target: TaskTarget
) -> OrientationError:
    """Roll, pitch and yaw of R_ref^T R and their rates.

    Args:
        rotation: R, 3x3 rows, robroot.
        omega: angular velocity of R, rad/s, robroot.
        target: R_ref and its twist.

    Raises:
        ArithmeticError: a pitch error of 88.9 deg or more, where the rates have no bound.
    """
    back = transpose(target.rotation)
    angles = [float(v) for v in rpy_from_rotation(product(back, rotation), FLOATS)]
    cs = FLOATS.trig(angles)
    if cs[1][0] < FOLD:
        pitch = math.degrees(angles[1])
        raise ArithmeticError(
            f"the orientation error has a pitch of {pitch:.4g} deg, 90 deg is singular; "
            "start nearer to the reference or move it more slowly"
        )
    gap = [a - b for a, b in zip(omega, target.twist[3:], strict=True)]
    return OrientationError(angles, matvec(inverse_rate_matrix(cs), matvec(back, gap)))


class TaskComputedTorque:
    """tau = M qdd + C qd + G + friction with qdd = J^-1 (a - J' qd).

    a makes the position error and the error angles obey e'' + Kd e' + Kp e = 0. Where the
    smallest of the three singular sines (`Arm.singularities`) is below `near`, qdd is damped
    least squares instead: it minimises |J qdd + J' qd - a|^2 + l^2 |qdd + brake qd|^2 with
    l^2 = strength^2 (1 - (sine / near)^2), so it moves over smoothly and brakes what the task
    does not see; the error then is no longer as designed.

    Args:
        arm: the robot as the controller knows it.
        kp: 1/s2, for x, y, z and the three error angles.
        kd: 1/s.
        near: sine below which damping sets in; 0 switches it off.
        strength: greatest l, m and rad alike.
    """

    def __init__(
        self, arm: Arm, kp: Gain, kd: Gain, *, near: float = 0.1, strength: float = 0.05
    ) -> None:
        self._arm, self.kp, self.kd = arm, six(kp), six(kd)
        self.near, self.strength = near, strength

    def damping(self, q: Sequence[float]) -> float:
        """l^2 at q (rad); 0 away from singularities."""
        sine = min(abs(s.sine) for s in self._arm.singularities(q))
        return 0.0 if sine >= self.near else self.strength**2 * (1.0 - (sine / self.near) ** 2)

    def wanted(self, q: Sequence[float], twist: Sequence[float], target: TaskTarget) -> list[float]:
        """Acceleration of the flange (m/s2, rad/s2, robroot) that the error needs."""
        T = self._arm.fk(q)
        error = orientation_error([row[:3] for row in T[:3]], twist[3:], target)
        kp, kd = self.kp, self.kd
        linear = [
            target.acceleration[i]
            + kd[i] * (target.twist[i] - twist[i])
            + kp[i] * (target.position[i] - T[i][3])
            for i in range(3)
        ]
        cs, rates = FLOATS.trig(error.angles), error.rates
        a_phi = [-kd[3 + i] * rates[i] - kp[3 + i] * error.angles[i] for i in range(3)]
        relative = [
            a + b
            for a, b in zip(
                matvec(rate_matrix_dot(cs, rates), rates), matvec(rate_matrix(cs), a_phi),
                strict=True,
            )
        ]  # fmt: skip
        w_ref, w = target.twist[3:], twist[3:]
        x, y, z = (a - b for a, b in zip(w, w_ref, strict=True))
        dragged = cross((w_ref[0], w_ref[1], w_ref[2]), (x, y, z))
        turned = matvec(target.rotation, relative)
        return linear + [
            a + b + c for a, b, c in zip(target.acceleration[3:], dragged, turned, strict=True)
        ]

    def acceleration(
        self, q: Sequence[float], qd: Sequence[float], target: TaskTarget
    ) -> list[float]:
        """Joint accelerations (rad/s2) wanted in state q (rad), qd (rad/s)."""
        J = self._arm.jacobian(q)
        a = self.wanted(q, matvec(J, qd), target)
        drift = matvec(self._arm.jacobian_dot(q, qd), qd)
        b = [u - v for u, v in zip(a, drift, strict=True)]
        square = self.damping(q)
        # With x = qdd + brake qd: min |J x - (b + brake J qd)|^2 + l^2 |x|^2, by the normal
        # equations on the row side, x = J^T (J J^T + l^2)^-1 (...).
        brake = self.kd[0] if square else 0.0
        moved = matvec(J, [brake * v for v in qd])
        gram = product(J, transpose(J))
        for i in range(6):
            gram[i][i] += square
        y = solve_symmetric(gram, [u + v for u, v in zip(b, moved, strict=True)])
        x = matvec(transpose(J), y)
        return [u - brake * v for u, v in zip(x, qd, strict=True)]

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """The torques, N m."""
        return self._arm.inverse_dynamics(q, qd, self.acceleration(q, qd, reference.task(t)))
