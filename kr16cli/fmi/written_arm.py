"""The arm of `single` and the controller in task space on the functions of `written`."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.kernels.straight_arm import StraightArm
from kr16cli.simulate.core import TaskTarget
from kr16cli.simulate.task_control import TaskComputedTorque
from kr16cli.simulate.task_law import FOLD
from kr16cli.single import Matrix

NAMES = (
    "fk",
    "jacobian",
    "jacobian_dot",
    "mass_matrix",
    "gravity",
    "friction",
    "inverse_dynamics",
    "forward_dynamics",
    "solve",
    "energy",
    "task",
)
"""The functions of `written`. Friction is a function of its own, no part of the dynamics."""


class WrittenArm(StraightArm):
    """An arm on the functions of `written`, with what else an FMU asks for."""

    def solve(self, matrix: Matrix, right: Sequence[float]) -> list[float]:
        """x of A x = b for a symmetric positive definite 6x6 matrix."""
        flat = [v for row in matrix for v in row]
        return self._functions["solve"](self._numbers, flat, right)

    def task_acceleration(
        self,
        q: Sequence[float],
        qd: Sequence[float],
        target: Sequence[float],
        kp: Sequence[float],
        kd: Sequence[float],
    ) -> list[float]:
        """`task_law` with its own damping: qdd (rad/s2), then cos of the pitch error."""
        return self._functions["task"](self._numbers, q, qd, target, kp, kd)


class WrittenTaskControl(TaskComputedTorque):
    """Computed torque in task space, its law written out."""

    _arm: WrittenArm
    _last: tuple[TaskTarget, list[float]] | None = None

    def acceleration(
        self, q: Sequence[float], qd: Sequence[float], target: TaskTarget
    ) -> list[float]:
        """Joint accelerations (rad/s2) wanted in state q (rad), qd (rad/s)."""
        if self._last is None or self._last[0] is not target:
            turned = [v for row in target.rotation for v in row]
            flat = [*target.position, *turned, *target.twist, *target.acceleration]
            self._last = target, flat
        found = self._arm.task_acceleration(q, qd, self._last[1], self.kp, self.kd)
        if found[6] < FOLD:
            return super().acceleration(q, qd, target)  # says what is wrong
        return found[:6]
