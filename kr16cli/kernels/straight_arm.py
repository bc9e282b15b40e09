"""The arm of `single` on written-out functions, those of `straight` or of an FMU."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from kr16cli.kernels.parameters import pack, parameters
from kr16cli.model.inverse import Solutions
from kr16cli.model.scalars import Trig
from kr16cli.robot import Payload, RobotData
from kr16cli.single import Arm, Base, Matrix

Functions = Mapping[str, Callable[..., list[float]]]
"""By name of an `Arm`'s method: function(p, its arguments) -> one flat list, with p of `pack`."""

NAMES = (
    "fk",
    "frames",
    "ik",
    "jacobian",
    "jacobian_dot",
    "mass_matrix",
    "coriolis_matrix",
    "gravity",
    "friction",
    "inverse_dynamics",
    "forward_dynamics",
    "energy",
)
"""What is written out. Friction is a function of its own, no part of the dynamics."""

_FRAMES = (*(f"frame{i}" for i in range(7)), "flange")
_ZEROS = (0.0,) * 6


class StraightArm(Arm):
    """An arm whose answers come from written-out functions; the numbers differ by rounding.

    Args:
        data: the robot's numbers.
        functions: of `NAMES`; "frames", "ik" and "coriolis_matrix" may be left to the model.
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
        self._functions = functions

    @cached_property
    def _numbers(self) -> list[float]:
        return pack(parameters(self))

    @cached_property
    def _dynamic(self) -> list[float]:
        """The numbers of a robot that has inertial data."""
        self.require_inertia()
        return self._numbers

    def fk(self, q: Sequence[float], cs: Trig | None = None) -> Matrix:
        """T_robroot_flange; see `Arm`."""
        if cs is not None:
            return super().fk(q, cs)
        return _rows(self._functions["fk"](self._numbers, q), 4)

    def frames(
        self, q: Sequence[float], base: Base = "robroot", cs: Trig | None = None
    ) -> dict[str, Matrix]:
        """Poses of all frames; see `Arm`."""
        if base != "robroot" or cs is not None or "frames" not in self._functions:
            return super().frames(q, base, cs)
        rows = _rows(self._functions["frames"](self._numbers, q), 4)
        return {name: rows[4 * i : 4 * i + 4] for i, name in enumerate(_FRAMES)}

    def ik(self, pose: Sequence[Sequence[float]], near: Sequence[float] | None = None) -> Solutions:
        """All eight solutions; see `Arm`."""
        if "ik" not in self._functions:
            return super().ik(pose, near)
        T = [*pose[0], *pose[1], *pose[2], 0.0, 0.0, 0.0, 1.0]
        v = self._functions["ik"](self._numbers, T, near or _ZEROS)
        return Solutions(
            _rows(v[:48], 6),
            [(v[48], v[49]), (v[50], v[51])],
            on_axis=v[52],
            straight_wrist=v[53:57],
            folded=v[57:59],
            wrist_sine=v[59:63],
            beyond=v[63:65],
            turn=v[65:],
        )

    def flange_jacobian(self, q: Sequence[float]) -> Matrix:
        """Of the flange, robroot axes."""
        return _rows(self._functions["jacobian"](self._numbers, q), 6)

    def flange_jacobian_dot(self, q: Sequence[float], qd: Sequence[float]) -> Matrix:
        """Its rate."""
        return _rows(self._functions["jacobian_dot"](self._numbers, q, qd), 6)

    def mass_matrix(self, q: Sequence[float]) -> Matrix:
        """M(q), kg m2."""
        return _rows(self._functions["mass_matrix"](self._dynamic, q), 6)

    def coriolis_matrix(self, q: Sequence[float], qd: Sequence[float]) -> Matrix:
        """C(q, qd) with Christoffel symbols, kg m2/s."""
        if "coriolis_matrix" not in self._functions:
            return super().coriolis_matrix(q, qd)
        return _rows(self._functions["coriolis_matrix"](self._dynamic, q, qd), 6)

    def gravity(self, q: Sequence[float]) -> list[float]:
        """G(q), N m."""
        return self._functions["gravity"](self._dynamic, q)

    def friction(self, qd: Sequence[float]) -> list[float]:
        """Friction torque against qd, N m; zeros without drives."""
        return self._functions["friction"](self._numbers, qd) if self.drives else [0.0] * 6

    def inverse_dynamics(
        self, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
    ) -> list[float]:
        """Joint torques M qdd + C qd + G + friction, N m."""
        rigid = self._functions["inverse_dynamics"](self._dynamic, q, qd, qdd)
        if not self.drives:
            return rigid
        return [t + f for t, f in zip(rigid, self.friction(qd), strict=True)]

    def forward_dynamics(
        self, q: Sequence[float], qd: Sequence[float], tau: Sequence[float]
    ) -> list[float]:
        """Joint accelerations for torques tau (N m), rad/s2."""
        if self.drives:
            tau = [t - f for t, f in zip(tau, self.friction(qd), strict=True)]
        return self._functions["forward_dynamics"](self._dynamic, q, qd, tau)

    def energy(self, q: Sequence[float], qd: Sequence[float]) -> tuple[float, float]:
        """(kinetic, potential) energy, J; potential zero at robroot's origin."""
        kinetic, potential = self._functions["energy"](self._dynamic, q, qd)
        return kinetic, potential


def _rows(flat: list[float], width: int) -> Matrix:
    return [flat[i : i + width] for i in range(0, len(flat), width)]
