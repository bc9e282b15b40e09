"""One configuration at a time, quickly, for the thousands of calls of a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kr16cli.api import Robot
from kr16cli.kernels.engine import engine_name
from kr16cli.kernels.straight import straight_arm
from kr16cli.single import Arm, Matrix


class FastArm(Arm):
    """An `Arm` whose costly answers come from the kernels; the numbers differ by rounding.

    Lists in and out, as controllers and plant expect. Numbers that are not finite raise
    InputError, a ValueError, where plain floats would give NaN.
    """

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot.data, payload=robot.payload, drives=robot.drives)
        self._robot = robot

    def forward_dynamics(
        self, q: Sequence[float], qd: Sequence[float], tau: Sequence[float]
    ) -> list[float]:
        """Joint accelerations, rad/s2."""
        result = self._robot.forward_dynamics(np.array(q), np.array(qd), np.array(tau))
        answer: list[float] = result.tolist()
        return answer

    def inverse_dynamics(
        self, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
    ) -> list[float]:
        """Joint torques, N m."""
        result = self._robot.inverse_dynamics(np.array(q), np.array(qd), np.array(qdd))
        answer: list[float] = result.tolist()
        return answer

    def gravity(self, q: Sequence[float]) -> list[float]:
        """G(q), N m."""
        answer: list[float] = self._robot.gravity(np.array(q)).tolist()
        return answer

    def mass_matrix(self, q: Sequence[float]) -> Matrix:
        """M(q), kg m2."""
        rows: Matrix = self._robot.mass_matrix(np.array(q)).tolist()
        return rows

    def flange_jacobian(self, q: Sequence[float]) -> Matrix:
        """Of the flange, robroot axes."""
        rows: Matrix = self._robot.jacobian(np.array(q)).tolist()
        return rows

    def flange_jacobian_dot(self, q: Sequence[float], qd: Sequence[float]) -> Matrix:
        """Its rate."""
        rows: Matrix = self._robot.jacobian_dot(np.array(q), np.array(qd)).tolist()
        return rows


def quickest_arm(robot: Robot) -> Arm:
    """The robot's arm on the compiled kernels where they are there, else on straight-line Python.

    Writing forward dynamics out takes 30 ms and saves 0.2 ms a call.
    """
    if engine_name() == "native":
        return FastArm(robot)
    return straight_arm(robot.data, payload=robot.payload, drives=robot.drives)
