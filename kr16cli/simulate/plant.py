"""The equations of motion as a first-order system for any solver. Plain floats.

M(q) qdd + C(q, qd) qd + G(q) + friction = tau + J^T w + contact
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from kr16cli.robot import JointData
from kr16cli.simulate.core import Torque
from kr16cli.single import Arm

SIZE = 16
"""Numbers of a state: q (rad), qd (rad/s), then four works (J): of the torques, lost in
friction, of the external wrench, of the contact with joint stops."""

WORKS = SIZE - 12

WORK_TOLERANCE = 1e3
"""The works' absolute tolerance over that of the angles, J/rad: a work is an integral of
torque over angle, and torques are of this size (N m)."""

FADE = 0.05
"""Over this part of its speed limit, from the limit on, a drive's torque fades to nothing."""

_NOTHING = (0.0,) * 6


@dataclass(frozen=True)
class Limits:
    """What the plant does about the limits of the robot's file.

    `joint`: "report" (only events), "stop" (the run ends there) or "contact": stops of rubber
    that push back with k d (1 + c dd/dt) at a depth d, never pulling (Hunt and Crossley 1975).
    k is such that the joint's greatest torque presses it `depth` (rad) deep; c is `bounce`
    (s/rad): the larger, the less it bounces.
    `torque`: drives give no more than their greatest torque. `speed`: a drive's torque that
    would speed a joint up further fades to zero between its speed limit and 5 % above.
    """

    joint: Literal["report", "stop", "contact"] = "report"
    torque: bool = False
    speed: bool = False
    depth: float = 0.01
    bounce: float = 0.5


@dataclass(frozen=True)
class Wrench:
    """An external force (N) and moment (N m) at the flange.

    In `axes` of robroot or of the flange, from `start` to `end` (s); None: to the end of the run.
    """

    force: Sequence[float] = (0.0,) * 3
    moment: Sequence[float] = (0.0,) * 3
    axes: Literal["robroot", "flange"] = "robroot"
    start: float = 0.0
    end: float | None = None

    @property
    def breaks(self) -> list[float]:
        """Times at which it begins and ends, s."""
        return [t for t in (self.start, self.end) if t]


class Plant:
    """The robot under joint torques, an external wrench and its limits.

    The works are integrated beside the motion, so that the energy balance is as exact as the
    motion itself. A state may leave them out at its end: then its rates do so, too.

    Args:
        arm: the robot with its payload, on floats: one configuration a call is its case.
        torque: what drives the joints.
        limits: what happens at limits.
        wrench: what pushes the flange.
    """

    def __init__(
        self,
        arm: Arm,
        torque: Torque,
        *,
        limits: Limits | None = None,
        wrench: Wrench | None = None,
    ) -> None:
        self.arm, self.torque = arm, torque
        self.limits, self.wrench = limits or Limits(), wrench
        self.trouble: str | None = None  # the first since it was last cleared
        joints = arm.data.joints
        self._torques = [_or_infinity(j.torque if self.limits.torque else None) for j in joints]
        self._speeds = [_or_infinity(j.speed if self.limits.speed else None) for j in joints]
        self._bound = self.limits.torque or self.limits.speed
        self._stops = self._make_stops(joints) if self.limits.joint == "contact" else ()

    def _make_stops(self, joints: Sequence[JointData]) -> tuple[tuple[float, float, float], ...]:
        """(lower, upper, stiffness in N m/rad) of each joint."""
        return tuple(
            (j.lower, j.upper, (j.torque or STOP_TORQUE) / self.limits.depth) for j in joints
        )

    def applied(self, tau: Sequence[float], qd: Sequence[float]) -> list[float]:
        """What the drives give of torques tau (N m) asked for, at speeds qd (rad/s)."""
        if not self._bound:
            return list(tau)
        given = []
        for asked, rate, most, speed in zip(tau, qd, self._torques, self._speeds, strict=True):
            value = max(-most, min(most, asked))
            if value * rate > 0.0 and abs(rate) > speed:
                value *= max(0.0, 1.0 - (abs(rate) / speed - 1.0) / FADE)
            given.append(value)
        return given

    def contact(self, q: Sequence[float], qd: Sequence[float]) -> list[float]:
        """Torques of the joint stops, N m; zeros away from them."""
        if not self._stops:
            return list(_NOTHING)
        return [
            self._push(lower - angle, -rate, k) - self._push(angle - upper, rate, k)
            for angle, rate, (lower, upper, k) in zip(q, qd, self._stops, strict=True)
        ]

    def _push(self, depth: float, speed: float, k: float) -> float:
        return max(0.0, k * depth * (1.0 + self.limits.bounce * speed)) if depth > 0.0 else 0.0

    @property
    def holds(self) -> bool:
        """Whether all that acts on the arm, gravity aside, keeps still between breaks."""
        steady = getattr(self.torque, "steady", False)
        return steady and not (self._stops or self.arm.drives or self.limits.speed)

    def pushing(self, t: float) -> Wrench | None:
        """The external wrench, if it acts at time t (s)."""
        w = self.wrench
        if w is None or t < w.start or (w.end is not None and t >= w.end):
            return None
        return w

    def external(self, t: float, q: Sequence[float]) -> list[float]:
        """J^T w: joint torques (N m) of the wrench at time t (s)."""
        w = self.pushing(t)
        if w is None:
            return list(_NOTHING)
        rows = self.arm.jacobian(q, axes=w.axes)
        load = (*w.force, *w.moment)
        return [sum(load[i] * rows[i][j] for i in range(6)) for j in range(6)]

    def acceleration(
        self, t: float, q: Sequence[float], qd: Sequence[float], tau: Sequence[float]
    ) -> list[float]:
        """Joint accelerations (rad/s2) under torques tau (N m) that the drives give."""
        return self.arm.forward_dynamics(q, qd, self._total(tau, self._others(t, q, qd)))

    def _others(self, t: float, q: Sequence[float], qd: Sequence[float]) -> list[list[float]]:
        """Torques of the wrench and of the stops, where there are such."""
        found = [self.external(t, q)] if self.wrench else []
        return [*found, self.contact(q, qd)] if self._stops else found

    @staticmethod
    def _total(tau: Sequence[float], others: Sequence[Sequence[float]]) -> Sequence[float]:
        return [sum(v) for v in zip(tau, *others, strict=True)] if others else tau

    def rates(self, t: float, state: Any) -> list[float]:
        """Time derivative of a state (12 to 16 numbers); NaNs where it lies beyond the floats.

        `trouble` then says what was wrong, if the torque could tell.
        """
        y = state.tolist() if hasattr(state, "tolist") else list(state)
        q, qd = y[:6], y[6:12]
        try:
            tau = self.torque(t, q, qd)
            if self._bound:
                tau = self.applied(tau, qd)
            others = self._others(t, q, qd)
            qdd = self.arm.forward_dynamics(q, qd, self._total(tau, others))
            if len(y) == 12:
                return [*qd, *qdd]
            lost = _power(self.arm.friction(qd), qd) if self.arm.drives else 0.0
            pushed = _power(others[0], qd) if self.wrench else 0.0
            stopped = _power(others[-1], qd) if self._stops else 0.0
            return [*qd, *qdd, _power(tau, qd), lost, pushed, stopped][: len(y)]
        except (ArithmeticError, ValueError) as error:  # the solver steps back
            self.trouble = self.trouble or str(error)
            return [math.nan] * len(y)


STOP_TORQUE = 1000.0
"""Torque (N m) that presses a joint `Limits.depth` deep where the file gives it no greatest."""


def _or_infinity(value: float | None) -> float:
    return math.inf if value is None else value


def _power(force: Sequence[float], speed: Sequence[float]) -> float:
    return sum(f * v for f, v in zip(force, speed, strict=True))
