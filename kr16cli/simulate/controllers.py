"""Controllers in joint space: wanted and measured state to torques. Plain floats.

Gains are plain numbers or one for each joint. `task_control` holds the one in task space.
"""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.simulate.core import Reference
from kr16cli.single import Arm

Gain = float | Sequence[float]


def six(gain: Gain) -> list[float]:
    """A gain for each joint."""
    return [float(gain)] * 6 if isinstance(gain, int | float) else list(map(float, gain))


def gains(frequency: Gain, damping: float = 1.0) -> tuple[list[float], list[float]]:
    """(kp, kd) of e'' + kd e' + kp e = 0 with a natural frequency (rad/s) and damping ratio."""
    omega = six(frequency)
    return [w * w for w in omega], [2.0 * damping * w for w in omega]


class Zero:
    """No torque: the motors are off and the brakes open."""

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """Zeros."""
        return [0.0] * 6


class GravityCompensation:
    """tau = G(q): without friction, the arm floats."""

    def __init__(self, arm: Arm) -> None:
        self._arm = arm

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """G(q), N m."""
        return self._arm.gravity(q)


class GravityPD:
    """tau = G(q) + Kp (q_ref - q) + Kd (qd_ref - qd).

    Args:
        arm: the robot as the controller knows it.
        kp: N m/rad.
        kd: N m s/rad.
    """

    def __init__(self, arm: Arm, kp: Gain, kd: Gain) -> None:
        self._arm, self.kp, self.kd = arm, six(kp), six(kd)

    @classmethod
    def tuned(
        cls, arm: Arm, q: Sequence[float], frequency: Gain, damping: float = 1.0
    ) -> GravityPD:
        """Gains for a natural frequency (rad/s) of each joint alone, all others held, near q.

        kp = M_ii w^2 and kd = 2 z M_ii w with the mass matrix at q (rad).
        """
        M = arm.mass_matrix(q)
        kp, kd = gains(frequency, damping)
        return cls(arm, *([M[i][i] * k[i] for i in range(6)] for k in (kp, kd)))

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """The torques, N m."""
        target = reference.joint(t)
        return [
            g + kp * (a - b) + kd * (v - w)
            for g, kp, kd, a, b, v, w in zip(
                self._arm.gravity(q), self.kp, self.kd, target.q, q, target.qd, qd, strict=True
            )
        ]


class ComputedTorque:
    """tau = M(q) (qdd_ref + Kd e' + Kp e) + C qd + G + friction, with e = q_ref - q.

    With the plant's own model the error obeys e'' + Kd e' + Kp e = 0, each joint by itself.

    Args:
        arm: the robot as the controller knows it, friction included if it has drives.
        kp: 1/s2.
        kd: 1/s.
    """

    def __init__(self, arm: Arm, kp: Gain, kd: Gain) -> None:
        self._arm, self.kp, self.kd = arm, six(kp), six(kd)

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """The torques, N m."""
        target = reference.joint(t)
        wanted = [
            acceleration + kd * (v - w) + kp * (a - b)
            for acceleration, kp, kd, a, b, v, w in zip(
                target.qdd, self.kp, self.kd, target.q, q, target.qd, qd, strict=True
            )
        ]
        return self._arm.inverse_dynamics(q, qd, wanted)
