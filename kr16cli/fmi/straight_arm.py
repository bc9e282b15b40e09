"""The arm of `single`, its dynamics run by the straight-line text of `straight`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from kr16cli.kernels.parameters import pack, parameters
from kr16cli.robot import Payload, RobotData
from kr16cli.single import Arm, Matrix

Functions = Mapping[str, Callable[..., list[float]]]
NAMES = ("acceleration", "torque", "gravity", "masses")
"""The functions of `straight`."""


class StraightArm(Arm):
    """An arm whose torques and accelerations come from written-out functions.

    Args:
        data: the robot's numbers; the geometry must be the functions' own.
        functions: those of `straight`.
        payload: load on the flange.
        drives: count rotor inertia and friction.
    """

    def __init__(
        self,
        data: RobotData,
        functions: Functions,
        *,
        payload: Payload | None = None,
        drives: bool = False,
    ) -> None:
        super().__init__(data, payload=payload, drives=drives)
        self._acceleration, self._torque = functions["acceleration"], functions["torque"]
        self._gravity, self._masses = functions["gravity"], functions["masses"]

    @cached_property
    def _numbers(self) -> list[float]:
        return pack(parameters(self))

    def gravity(self, q: Sequence[float]) -> list[float]:
        """G(q), N m."""
        return self._gravity(q, self._numbers)

    def mass_matrix(self, q: Sequence[float]) -> Matrix:
        """M(q), kg m2."""
        lower = iter(self._masses(q, self._numbers))
        M = [[0.0] * 6 for _ in range(6)]
        for i in range(6):
            for j in range(i + 1):
                M[i][j] = M[j][i] = next(lower)
        return M

    def inverse_dynamics(
        self, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
    ) -> list[float]:
        """Joint torques M qdd + C qd + G + friction, N m."""
        rigid = self._torque(q, qd, qdd, self._numbers)
        return [t + f for t, f in zip(rigid, self.friction(qd), strict=True)]

    def forward_dynamics(
        self, q: Sequence[float], qd: Sequence[float], tau: Sequence[float]
    ) -> list[float]:
        """Joint accelerations for torques tau (N m), rad/s2."""
        net = [t - f for t, f in zip(tau, self.friction(qd), strict=True)] if self.drives else tau
        return self._acceleration(q, qd, net, self._numbers)
