"""Motions whose course is known beforehand, for `verify` and the tests.

Each function simulates one and returns what came out beside what must.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy.integrate

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.robot import Payload, RobotData
from kr16cli.simulate.controllers import ComputedTorque, gains
from kr16cli.simulate.core import Setpoint
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.fast import quickest_arm
from kr16cli.simulate.fixed import STEPS
from kr16cli.simulate.loop import ClosedLoop
from kr16cli.simulate.plant import Limits, Wrench
from kr16cli.simulate.run import Run
from kr16cli.simulate.scenario import Scenario, Six, SolverSpec, TorqueSpec
from kr16cli.simulate.task_control import TaskComputedTorque, orientation_error
from kr16cli.single import Arm

ORDERS = {"SemiImplicitEuler": 1, "RK4": 4, "RK45": 5, "DOP853": 8}
"""Order of each method whose step can be fixed."""

_BENT: Six = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
_MOVING: Six = (0.4, -0.3, 0.2, 0.5, -0.6, 0.7)
_TIGHT = SolverSpec("DOP853", 1e-12, 1e-13)
_COUNTS = {
    "SemiImplicitEuler": (25, 50, 100),
    "RK4": (5, 10, 20),
    "RK45": (4, 8, 16),
    "DOP853": (4, 6, 8),
}


class Convergence(NamedTuple):
    """Steps (s), errors of the angles at the end (rad), fitted and designed order."""

    steps: list[float]
    errors: list[float]
    slope: float
    expected: int


class Comparison(NamedTuple):
    """What came out and what must, at times (n,) s: arrays (n, k)."""

    time: Array
    found: Array
    expected: Array


def convergence(
    data: RobotData,
    method: str,
    duration: float = 0.3,
    *,
    counts: Sequence[int] | None = None,
    exact: Array | None = None,
) -> Convergence:
    """Order of a method of `ORDERS` by ever smaller fixed steps, on a fall from a moving start.

    SciPy's methods step evenly when their tolerance is wide and their greatest step is set.

    Args:
        data: the robot.
        method: whose order.
        duration: of the fall, s.
        counts: how many steps it is cut into, again and again.
        exact: where it ends, where `fall_end` of this duration is known.
    """
    rates, start = _fall(data)
    exact = fall_end(data, duration) if exact is None else exact
    cuts = counts or _COUNTS[method]
    steps = [duration / count for count in cuts]
    ends = [
        _fixed(rates, start, count, h, method)
        if method in STEPS
        else _solve(rates, start, duration, method, rtol=1e3, atol=1e3, first_step=h, max_step=h)
        for count, h in zip(cuts, steps, strict=True)
    ]
    errors = [float(np.abs(end - exact)[:6].max()) for end in ends]
    slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
    return Convergence(steps, errors, slope, ORDERS[method])


def fall_end(data: RobotData, duration: float) -> Array:
    """(12,) State at the end of the fall of `convergence`, by DOP853 at rtol 1e-12."""
    rates, start = _fall(data)
    return _solve(rates, start, duration, "DOP853", rtol=1e-12, atol=1e-13)


def _fall(data: RobotData) -> tuple[Callable[[float, Any], list[float]], Array]:
    """Rates of the state (q, qd) without torques, and a moving start."""
    arm = quickest_arm(Robot(data))

    def rates(t: float, y: Any) -> list[float]:
        state = list(map(float, y))
        return [*state[6:], *arm.forward_dynamics(state[:6], state[6:], (0.0,) * 6)]

    return rates, np.array([*_BENT, *_MOVING])


def _fixed(
    rates: Callable[[float, Any], list[float]], start: Array, count: int, h: float, method: str
) -> Array:
    state = start.tolist()
    for k in range(count):
        state = STEPS[method](rates, k * h, state, h)
    return np.array(state)


def _solve(
    rates: Callable[[float, Any], list[float]],
    start: Array,
    duration: float,
    method: str,
    **options: float,
) -> Array:
    done = scipy.integrate.solve_ivp(rates, (0.0, duration), start, method, **options)
    end: Array = done.y[:, -1]
    return end


class Locking:
    """Torques that hold all joints but one still, and leave that one free."""

    breaks: Sequence[float] = ()

    def __init__(self, arm: Arm, joint: int) -> None:
        self._arm, self._joint = arm, joint

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """Inverse dynamics of the acceleration that the free joint takes without torque."""
        i, rest = self._joint, [0.0] * 6
        bias = self._arm.inverse_dynamics(q, qd, rest)
        rest[i] = -bias[i] / self._arm.mass_matrix(q)[i][i]
        tau = self._arm.inverse_dynamics(q, qd, rest)
        tau[i] = 0.0
        return tau


def pendulum(
    data: RobotData,
    *,
    joint: int = 1,
    amplitude: float = 1.5,
    duration: float = 1.5,
    payload: Payload | None = None,
    samples: int = 50,
) -> Comparison:
    """One joint swings while the others are held: a physical pendulum.

    From rest at `amplitude` (rad) beside its lowest place its angle theta obeys
    theta'' = -w^2 sin theta, solved by theta = 2 asin(k cd(w t, k)), k = sin(amplitude / 2),
    with Jacobi's elliptic functions.
    """
    from scipy.special import ellipj

    arm = Arm(data, payload=payload)
    q = list(_BENT)
    # Its gravity torque is a cos q + b sin q; it hangs where that is 0 and rises with q.
    sample = []
    for angle in (0.0, math.pi / 2.0):
        q[joint] = angle
        sample.append(arm.gravity(q)[joint])
    lowest = math.atan2(-sample[0], sample[1])
    omega = math.sqrt(math.hypot(*sample) / arm.mass_matrix(q)[joint][joint])
    q[joint] = lowest + amplitude
    first = (q[0], q[1], q[2], q[3], q[4], q[5])
    scenario = Scenario(
        "pendulum", first, duration=duration, output_step=duration / samples, payload=payload,
        solver=SolverSpec(rtol=1e-10, atol=1e-11),
    )  # fmt: skip
    run = simulate(data, scenario, torque=Locking(arm, joint))
    k = math.sin(0.5 * amplitude)
    _, cn, dn, _ = ellipj(omega * run.time, k * k)
    exact = np.repeat(np.array([first]), len(run.time), axis=0)
    exact[:, joint] = lowest + 2.0 * np.arcsin(k * cn / dn)
    return Comparison(run.time, run.q, exact)


def designed_decay(
    time: Array, error: Array, rate: Array, frequency: float, damping: float
) -> Array:
    """Solution (n, k) of e'' + 2 z w e' + w^2 e = 0 from e(0), e'(0) (k,)."""
    t = time[:, None]
    alpha = damping * frequency
    root = frequency * frequency * (1.0 - damping * damping)
    if abs(root) < 1e-12 * frequency * frequency:
        c, s = np.ones_like(t), t
    elif root > 0.0:
        w = math.sqrt(root)
        c, s = np.cos(w * t), np.sin(w * t) / w
    else:
        w = math.sqrt(-root)
        c, s = np.cosh(w * t), np.sinh(w * t) / w
    decay: Array = np.exp(-alpha * t) * (error * c + (rate + alpha * error) * s)
    return decay


def joint_error_dynamics(
    data: RobotData,
    frequency: float = 12.0,
    damping: float = 0.7,
    *,
    drives: bool = False,
    duration: float = 0.6,
) -> Comparison:
    """Computed torque brings six joints to a set point as designed, each by itself."""
    arm = Arm(data, drives=drives)
    offset = np.array([0.2, -0.15, 0.1, 0.3, -0.25, 0.4])
    goal = Setpoint(arm, (np.array(_BENT) + offset).tolist())
    controller = ComputedTorque(arm, *gains(frequency, damping))
    scenario = Scenario("error dynamics", _BENT, _MOVING, duration, output_step=0.02, drives=drives)
    run = simulate(data, scenario, torque=ClosedLoop(controller, goal))
    found = np.array(goal.joint(0.0).q) - run.q
    rate = -np.array(_MOVING)
    return Comparison(run.time, found, designed_decay(run.time, found[0], rate, frequency, damping))


def task_error_dynamics(
    data: RobotData, frequency: float = 12.0, damping: float = 0.7, *, duration: float = 0.6
) -> Comparison:
    """Computed torque in task space brings the flange to a set point as designed.

    Six errors: place (m) and the roll, pitch and yaw of R_ref^T R (rad).
    """
    arm = Arm(data)
    goal = Setpoint(
        arm, [q + d for q, d in zip(_BENT, (0.1, -0.1, 0.1, 0.3, -0.2, 0.4), strict=True)]
    )
    controller = TaskComputedTorque(arm, *gains(frequency, damping), near=0.0)
    scenario = Scenario("error dynamics", _BENT, duration=duration, output_step=0.02)
    run = simulate(data, scenario, torque=ClosedLoop(controller, goal))
    target = goal.task(0.0)

    def error(q: Sequence[float]) -> list[float]:
        T = arm.fk(q)
        angles = orientation_error([row[:3] for row in T[:3]], (0.0,) * 3, target).angles
        return [*(target.position[i] - T[i][3] for i in range(3)), *angles]

    found = np.array([error(q) for q in run.q.tolist()])
    return Comparison(
        run.time, found, designed_decay(run.time, found[0], np.zeros(6), frequency, damping)
    )


def busy_run(data: RobotData, duration: float = 0.3) -> Run:
    """A run with all that can do work: torques beyond the drives', friction, wrench, stops.

    Its `drift` is what no work explains.
    """
    joints = data.joints
    start: Six = (0.2, -1.1, joints[2].upper - 0.05, 0.3, 0.6, -0.4)
    return simulate(
        data,
        Scenario(
            "busy", start, (0.5, -0.5, 2.0, 1.0, -1.0, 2.0), duration, 0.01,
            torque=TorqueSpec("constant", (3000.0, -900.0, 200.0, 60.0, -20.0, 5.0)),
            payload=Payload(10.0, (0.02, -0.03, 0.12), (0.2, 0.2, 0.1, 0.0, 0.0, 0.0)),
            drives=True, limits=Limits("contact", torque=True, speed=True),
            wrench=Wrench((50.0, -80.0, 30.0), (5.0, 3.0, -4.0), "flange", 0.05, 0.2),
        ),
    )  # fmt: skip


def conservative_swing(
    data: RobotData, duration: float = 60.0, payload: Payload | None = None
) -> Run:
    """A swing without torques and friction: its energy stays, so that its `drift` is error."""
    step = duration / 200.0 if duration > 1.0 else duration / 6.0
    return simulate(data, Scenario("swing", _BENT, _MOVING, duration, step, payload=payload))


def reversal(data: RobotData, duration: float = 0.5) -> Comparison:
    """A motion run backward from its end, beside the motion itself."""
    scenario = Scenario("reversal", _BENT, _MOVING, duration, duration / 20.0, solver=_TIGHT)
    forth = simulate(data, scenario)
    turned = replace(scenario, q=tuple(forth.q[-1]), qd=tuple(-forth.qd[-1]))
    back = simulate(data, turned)
    return Comparison(forth.time, back.q[::-1], forth.q)
