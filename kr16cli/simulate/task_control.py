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

from kr16cli.model.scalars import FLOATS, matvec
from kr16cli.simulate import task_law
from kr16cli.simulate.controllers import Gain, six
from kr16cli.simulate.core import Reference, TaskTarget
from kr16cli.simulate.task_law import FOLD, NEAR, STRENGTH
from kr16cli.single import Arm


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
    return _public(_error(rotation, omega, target))


def _error(
    rotation: Sequence[Sequence[float]], omega: Sequence[float], target: TaskTarget
) -> task_law.Error:
    error = task_law.orientation_error(rotation, omega, target, FLOATS)
    if error.trig[1][0] < FOLD:
        pitch = math.degrees(error.angles[1])
        raise ArithmeticError(
            f"the orientation error has a pitch of {pitch:.4g} deg, 90 deg is singular; "
            "start nearer to the reference or move it more slowly"
        )
    return error


def _public(error: task_law.Error) -> OrientationError:
    return OrientationError([float(v) for v in error.angles], error.rates)


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
        self, arm: Arm, kp: Gain, kd: Gain, *, near: float = NEAR, strength: float = STRENGTH
    ) -> None:
        self._arm, self.kp, self.kd = arm, six(kp), six(kd)
        self.near, self.strength = near, strength

    def damping(self, q: Sequence[float]) -> float:
        """l^2 at q (rad); 0 away from singularities."""
        if not self.near:
            return 0.0
        sines = [s.sine for s in self._arm.singularities(q)]
        return float(task_law.damping(sines, FLOATS, self.near, self.strength))

    def wanted(self, q: Sequence[float], twist: Sequence[float], target: TaskTarget) -> list[float]:
        """Acceleration of the flange (m/s2, rad/s2, robroot) that the error needs."""
        T = self._arm.fk(q)
        error = _error([row[:3] for row in T[:3]], twist[3:], target)
        position = [row[3] for row in T[:3]]
        return task_law.flange_acceleration(position, twist, error, target, self.kp, self.kd)

    def acceleration(
        self, q: Sequence[float], qd: Sequence[float], target: TaskTarget
    ) -> list[float]:
        """Joint accelerations (rad/s2) wanted in state q (rad), qd (rad/s)."""
        J, drift = self._arm.jacobian(q), matvec(self._arm.jacobian_dot(q, qd), qd)
        a = self.wanted(q, matvec(J, qd), target)
        square = self.damping(q)
        brake = self.kd[0] if square else 0.0
        return task_law.joint_acceleration(J, drift, qd, a, square, brake)

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """The torques, N m."""
        return self._arm.inverse_dynamics(q, qd, self.acceleration(q, qd, reference.task(t)))
