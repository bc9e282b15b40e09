"""Motions of a family of robots without a controller, and how a motion moves with its parameters.

The torque is that of the scenario: none, constant, or the gravity torque of the robot in the
middle, which is what a controller that believes the file would give.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.robot import RobotData
from kr16cli.rollout import Rollout, Variation, rollout
from kr16cli.simulate.scenario import Scenario, TorqueSpec
from kr16cli.study.crowd import variation_of
from kr16cli.study.family import Family, slopes
from kr16cli.study.open_runs import answered
from kr16cli.study.spread import Uncertain, moved

_STEP = 0.004
_STEP_WITH_FRICTION = 0.001
_MOST_STEPS = 2000
_SAMPLES = 50
"""Intervals between the times that are kept."""

# Radau's method IIA of order 5: it damps what friction makes stiff (Hairer and Wanner 1996, IV.5).
_ROOT = 6.0**0.5
_NODES = np.array([(4.0 - _ROOT) / 10.0, (4.0 + _ROOT) / 10.0, 1.0])
_STAGES = np.array(
    [
        [(88 - 7 * _ROOT) / 360, (296 - 169 * _ROOT) / 1800, (-2 + 3 * _ROOT) / 225],
        [(296 + 169 * _ROOT) / 1800, (88 + 7 * _ROOT) / 360, (-2 - 3 * _ROOT) / 225],
        [(16 - _ROOT) / 36, (16 + _ROOT) / 36, 1 / 9],
    ]
)


class Steps(NamedTuple):
    """Fixed steps of a motion: `number` of `size` s; every `every`-th state is kept."""

    size: float
    number: int
    every: int

    @property
    def time(self) -> Array:
        """Times that are kept, s."""
        times: Array = self.size * self.every * np.arange(self.number // self.every + 1.0)
        return times


def steps_of(scenario: Scenario) -> Steps:
    """Steps of 4 ms, of 1 ms with drives, or the scenario's own, and some fifty samples."""
    wanted = scenario.solver.step or (_STEP_WITH_FRICTION if scenario.drives else _STEP)
    wanted = max(wanted, scenario.duration / _MOST_STEPS)
    samples = min(_SAMPLES, max(1, round(scenario.duration / wanted)))
    every = max(1, int(np.ceil(scenario.duration / (samples * wanted) - 1e-9)))
    return Steps(scenario.duration / (samples * every), samples * every, every)


def is_open(scenario: Scenario) -> bool:
    """Whether the scenario's torque does not look at the motion's error, and nothing pushes.

    Friction under a torque that follows the angles is too stiff for the steps made here.
    """
    if scenario.torque.kind == "gravity" and not scenario.drives:
        scenario = replace(scenario, torque=TorqueSpec())
    return answered(scenario) is None


def robot_of(data: RobotData, scenario: Scenario) -> Robot:
    """The robot of a scenario."""
    placed = data if scenario.gravity is None else data.with_gravity(scenario.gravity)
    return Robot(placed, payload=scenario.payload, drives=scenario.drives)


def torque_of(robot: Robot, scenario: Scenario) -> Callable[[Array], Array]:
    """The torque (n, 6) at angles (n, 6), N m."""
    if scenario.torque.kind == "gravity":
        return robot.gravity
    tau = np.array(scenario.torque.tau or (0.0,) * 6)
    return lambda q: np.broadcast_to(tau, q.shape)


def motions(family: Family, scenario: Scenario, steps: Steps) -> Array:
    """Joint angles of every robot of a family, (n, samples, 6), rad.

    By the compiled solvers, robot by robot where lengths differ; with a torque that follows the
    angles by fixed steps of RK4 on NumPy columns.
    """
    if scenario.torque.kind == "gravity":
        return _columns(family, scenario, steps)
    if not any(source.name.startswith("geometry") for source in family.sources):
        data = moved(family.data, family.sources, list(family.deviations.T))
        fields = variation_of(data, len(family), drives=family.drives)
        return _moved(family.data, scenario, steps.time, Variation(**fields))
    each = [moved(family.data, family.sources, row) for row in family.deviations.tolist()]
    return np.stack([_moved(data, scenario, steps.time)[0] for data in each])


def _moved(
    data: RobotData, scenario: Scenario, times: Array, variation: Variation | None = None
) -> Array:
    """Joint angles by the compiled solvers, (n, samples, 6)."""
    found = _solved(data, scenario, times, variation).q
    return found if found.ndim == 3 else found[None]


def _solved(
    data: RobotData, scenario: Scenario, times: Array, variation: Variation | None = None
) -> Rollout:
    """The motion under a given torque, by the scenario's RK4 or with steps to its tolerance."""
    solver = scenario.solver_used()
    fixed = solver.method == "RK4"
    return rollout(
        robot_of(data, scenario),
        scenario.q,
        scenario.qd,
        duration=scenario.duration,
        times=np.minimum(times, scenario.duration),
        method="rk4" if fixed else "dopri5",
        step=solver.step if fixed else None,
        rtol=solver.rtol,
        atol=solver.atol,
        tau=np.array(scenario.torque.tau or (0.0,) * 6),
        variation=variation,
    )


def _columns(family: Family, scenario: Scenario, steps: Steps) -> Array:
    numbers = family.parameters(slice(None), beside=False)
    torque = torque_of(robot_of(family.data, scenario), scenario)

    def rate(state: Array) -> Array:
        q, qd = state[:, :6], state[:, 6:]
        qdd = family.each_with(numbers, "forward_dynamics", q, qd, torque(q))
        return np.hstack([qd, qdd])

    state = np.tile(np.array([*scenario.q, *scenario.qd]), (len(family), 1))
    kept = [state[:, :6]]
    for i in range(1, steps.number + 1):
        state = _stepped(rate, state, steps.size)
        if i % steps.every == 0:
            kept.append(state[:, :6])
    return np.stack(kept, axis=1)


def _stepped(rate: Callable[[Array], Array], state: Array, h: float) -> Array:
    """One step of RK4."""
    k1 = rate(state)
    k2 = rate(state + 0.5 * h * k1)
    k3 = rate(state + 0.5 * h * k2)
    after: Array = state + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + rate(state + h * k3))
    return after


def sensitivities(
    data: RobotData, sources: Sequence[Uncertain], scenario: Scenario, steps: Steps
) -> Array:
    """Derivative of the motion with respect to each source, (samples, d, 6), rad per unit.

    The variational equation S' = A S + B along the motion by Radau's method, a linear system
    each step: A from the exact derivatives of forward dynamics, B = -M^-1 d tau / d p, in which
    the torque of inverse dynamics is a polynomial of degree two in each number.
    """
    robot = robot_of(data, scenario)
    torque = torque_of(robot, scenario)
    h, n = steps.size, steps.number
    states = _along(robot, torque, scenario, steps)
    A, B = _linear(robot, sources, states, torque, scenario)
    A, B = (v.reshape(n, 3, *v.shape[1:]) for v in (A, B))
    # Stages K_i = A_i (S + h sum_j a_ij K_j) + B_i: K = P S + R for all steps at once.
    system = -h * np.einsum("ij,nikl->nikjl", _STAGES, A).reshape(n, 36, 36)
    system += np.eye(36)
    known = np.concatenate([A.reshape(n, 36, 12), B.reshape(n, 36, -1)], axis=2)
    solved = np.linalg.solve(system, known).reshape(n, 3, 12, -1)
    rise = h * np.einsum("i,nikl->nkl", _STAGES[2], solved)
    S = np.zeros((12, len(sources)))
    kept = [S[:6].T]
    for i, each in enumerate(rise, 1):
        S = S + each[:, :12] @ S + each[:, 12:]
        if i % steps.every == 0:
            kept.append(S[:6].T)
    return np.stack(kept)


def _along(
    robot: Robot, torque: Callable[[Array], Array], scenario: Scenario, steps: Steps
) -> Array:
    """States of the motion at the nodes of every step, (3 number, 12)."""
    begins = steps.size * np.arange(steps.number)
    times = (begins[:, None] + steps.size * _NODES).reshape(-1)
    if scenario.torque.kind != "gravity":
        found = _solved(robot.data, scenario, times)
        return np.hstack([found.q, found.qd])

    def rate(state: Array) -> Array:
        q, qd = state[:, :6], state[:, 6:]
        return np.hstack([qd, robot.forward_dynamics(q, qd, torque(q))])

    state, kept = np.array([[*scenario.q, *scenario.qd]]), []
    for h in np.diff(times, prepend=0.0).tolist():
        state = _stepped(rate, state, h)
        kept.append(state[0])
    return np.array(kept)


def _linear(
    robot: Robot,
    sources: Sequence[Uncertain],
    states: Array,
    torque: Callable[[Array], Array],
    scenario: Scenario,
) -> tuple[Array, Array]:
    """A (n, 12, 12) and B (n, 12, d) of the variational equation at states (n, 12)."""
    q, qd = np.ascontiguousarray(states[:, :6]), np.ascontiguousarray(states[:, 6:])
    tau = np.ascontiguousarray(torque(q))
    by_q, by_qd, inverse = robot.forward_dynamics_derivatives(q, qd, tau)
    if scenario.torque.kind == "gravity":
        still = np.zeros_like(q)
        rigid = robot.inverse_dynamics_derivatives(q, still, still)
        by_q = by_q + inverse @ rigid.dtau_dq
    A = np.zeros((len(q), 12, 12))
    A[:, :6, 6:] = np.eye(6)
    A[:, 6:, :6], A[:, 6:, 6:] = by_q, by_qd
    qdd = robot.forward_dynamics(q, qd, tau)
    by_source = slopes(
        robot.data, sources, "inverse_dynamics", q, qd, qdd,
        payload=robot.payload, drives=robot.drives,
    )  # fmt: skip
    B = np.zeros((len(q), 12, len(sources)))
    B[:, 6:] = -inverse @ np.moveaxis(by_source, 0, -1)
    return A, B
