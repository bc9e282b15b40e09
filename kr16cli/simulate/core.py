"""What plant, controllers and references agree on, and steps of fixed length. Plain floats.

Nothing here needs NumPy or SciPy, so that the same code can run inside an FMU.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from kr16cli.model.scalars import matvec
from kr16cli.single import Arm, Matrix

Rates = Callable[[float, Sequence[float]], Sequence[float]]
"""Right-hand side: time (s) and state to the state's rate of change."""


class Torque(Protocol):
    """What drives the joints.

    `breaks` are the times (s, rising) at which the torque is not smooth; the solver starts
    afresh there, so that no step of it spans a kink. A torque that keeps still between breaks
    may say so by an attribute `steady` that is true: compiled solvers can then serve it.
    """

    @property
    def breaks(self) -> Sequence[float]:
        """Times of kinks, s."""

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """Six joint torques (N m) at time t (s) in state q (rad), qd (rad/s)."""


class JointTarget(NamedTuple):
    """Where the joints should be: angles (rad), speeds (rad/s), accelerations (rad/s2)."""

    q: Sequence[float]
    qd: Sequence[float]
    qdd: Sequence[float]


class TaskTarget(NamedTuple):
    """Where the flange should be, in robroot.

    `position` (m), `rotation` (3x3 rows), `twist` (linear m/s, then angular rad/s) and its rate
    `acceleration` (m/s2, rad/s2).
    """

    position: Sequence[float]
    rotation: Matrix
    twist: Sequence[float]
    acceleration: Sequence[float]


class Reference(Protocol):
    """A motion that is wanted; it rests at its end from `duration` (s) on."""

    @property
    def duration(self) -> float:
        """Time at which the motion is over, s."""

    @property
    def breaks(self) -> Sequence[float]:
        """Times at which its acceleration jumps, s, rising."""

    def joint(self, t: float) -> JointTarget:
        """The motion of the joints at time t (s)."""

    def task(self, t: float) -> TaskTarget:
        """The motion of the flange at time t (s)."""


class Controller(Protocol):
    """Turns a wanted and a measured state into torques; it has no memory."""

    def torque(
        self, t: float, q: Sequence[float], qd: Sequence[float], reference: Reference
    ) -> list[float]:
        """Six joint torques (N m) at time t (s) in the measured state q (rad), qd (rad/s)."""


def task_target(arm: Arm, target: JointTarget) -> TaskTarget:
    """The flange's motion for a motion of the joints: x' = J qd, x'' = J qdd + J' qd."""
    T, J = arm.fk(target.q), arm.jacobian(target.q)
    turning = matvec(arm.jacobian_dot(target.q, target.qd), target.qd)
    straight = matvec(J, target.qdd)
    return TaskTarget(
        [row[3] for row in T[:3]],
        [row[:3] for row in T[:3]],
        matvec(J, target.qd),
        [a + b for a, b in zip(straight, turning, strict=True)],
    )


class Setpoint:
    """A reference that is set from outside: the same target whatever the time.

    Args:
        arm: the robot, for the flange's motion.
        q: joint angles, rad.
        qd: joint speeds, rad/s.
        qdd: joint accelerations, rad/s2.
    """

    duration = 0.0
    breaks: Sequence[float] = ()

    def __init__(
        self,
        arm: Arm,
        q: Sequence[float],
        qd: Sequence[float] = (0.0,) * 6,
        qdd: Sequence[float] = (0.0,) * 6,
    ) -> None:
        self._arm = arm
        self._target = JointTarget(list(q), list(qd), list(qdd))
        self._flange: TaskTarget | None = None

    def joint(self, t: float) -> JointTarget:
        """The target of the joints."""
        return self._target

    def task(self, t: float) -> TaskTarget:
        """The target of the flange."""
        if self._flange is None:
            self._flange = task_target(self._arm, self._target)
        return self._flange


def rk4_step(rates: Rates, t: float, state: Sequence[float], h: float) -> list[float]:
    """One step of the classical Runge-Kutta method of order 4.

    Args:
        rates: right-hand side.
        t: time, s.
        state: any number of floats.
        h: step, s.

    Returns:
        The state at t + h.
    """
    half = 0.5 * h
    k1 = rates(t, state)
    k2 = rates(t + half, [y + half * k for y, k in zip(state, k1, strict=True)])
    k3 = rates(t + half, [y + half * k for y, k in zip(state, k2, strict=True)])
    k4 = rates(t + h, [y + h * k for y, k in zip(state, k3, strict=True)])
    return [
        y + h / 6.0 * (a + 2.0 * (b + c) + d)
        for y, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)
    ]


def euler_step(rates: Rates, t: float, state: Sequence[float], h: float) -> list[float]:
    """One step of the semi-implicit Euler method, order 1: new speeds move the angles.

    Arguments and result as for `rk4_step`; the state begins with six angles and six speeds.
    What follows them takes an explicit step.
    """
    rate = rates(t, state)
    new = [y + h * k for y, k in zip(state, rate, strict=True)]
    return [y + h * v for y, v in zip(state[:6], new[6:12], strict=True)] + new[6:]
