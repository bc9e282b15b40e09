"""The equations of motion as a first-order system for any solver."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from kr16cli.simulate.torque import Torque
from kr16cli.single import Arm

SIZE = 14
"""Numbers of a state: q (rad), qd (rad/s), work of the torques, work lost in friction (J)."""

WORK_TOLERANCE = 1e3
"""The works' absolute tolerance over that of the angles, J/rad: a work is an integral of
torque over angle, and torques are of this size (N m)."""


class Plant:
    """M(q) qdd + C(q, qd) qd + G(q) + friction = tau.

    The two works are integrated beside the motion, so that the energy balance is as exact as
    the motion itself.

    Args:
        arm: the robot with its payload, on floats: one configuration a call is its case.
        torque: what drives the joints.
    """

    def __init__(self, arm: Arm, torque: Torque) -> None:
        self.arm, self.torque = arm, torque

    def rates(self, t: float, state: Any) -> list[float]:
        """Time derivative of a state (14 numbers); NaNs where it lies beyond the floats."""
        y = state.tolist()
        q, qd = y[:6], y[6:12]
        try:
            tau = self.torque(t, q, qd)
            qdd = self.arm.forward_dynamics(q, qd, tau)
            lost = _power(self.arm.friction(qd), qd) if self.arm.drives else 0.0
            return [*qd, *qdd, _power(tau, qd), lost]
        except (ArithmeticError, ValueError):  # the sine of infinity, say: the solver steps back
            return [math.nan] * SIZE


def _power(force: Sequence[float], speed: Sequence[float]) -> float:
    return sum(f * v for f, v in zip(force, speed, strict=True))
