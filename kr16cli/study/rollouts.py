"""Motions of a family of robots without a controller, and how a motion moves with its parameters.

Fixed steps of RK4. The torque is that of the scenario: none, constant, or the gravity torque of
the robot in the middle, which is what a controller that believes the file would give.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.robot import RobotData
from kr16cli.rollout import Variation, rollout
from kr16cli.simulate.scenario import Scenario
from kr16cli.study.family import Family, slopes
from kr16cli.study.spread import Uncertain, moved

OPEN = ("zero", "constant", "gravity")
"""Torques that do not look at the motion's error."""
_STEP = 0.004
_SAMPLES = 50
"""Intervals between the times that are kept."""


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
    """Steps of at most 4 ms, or the scenario's own, and some fifty samples."""
    wanted = scenario.solver.step or _STEP
    samples = min(_SAMPLES, max(1, round(scenario.duration / wanted)))
    every = max(1, int(np.ceil(scenario.duration / (samples * wanted) - 1e-9)))
    return Steps(scenario.duration / (samples * every), samples * every, every)


def is_open(scenario: Scenario) -> bool:
    """Whether the scenario's torque is one of `OPEN`, with nothing that pushes or stops."""
    return (
        scenario.controller is None
        and scenario.wrench is None
        and scenario.torque.kind in OPEN
        and scenario.limits.joint == "report"
        and not scenario.limits.torque
        and not scenario.limits.speed
    )


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

    By the compiled rollouts where they know all that differs; else, with a torque that follows
    the angles or lengths that differ, the same steps on NumPy columns.
    """
    lengths = any(source.name.startswith("geometry") for source in family.sources)
    if scenario.torque.kind != "gravity" and not lengths:
        return _compiled(family, scenario, steps)
    return _columns(family, scenario, steps)


def _compiled(family: Family, scenario: Scenario, steps: Steps) -> Array:
    robot = robot_of(family.data, scenario)
    motion = rollout(
        robot,
        np.tile(scenario.q, (len(family), 1)),
        np.tile(scenario.qd, (len(family), 1)),
        duration=scenario.duration,
        times=np.minimum(steps.time, scenario.duration),
        method="rk4",
        step=steps.size * (1.0 + 1e-9),
        tau=np.array(scenario.torque.tau or (0.0,) * 6),
        variation=_variation(family),
    )
    return motion.q


def _variation(family: Family) -> Variation:
    """The numbers of each robot of a family."""
    n = len(family)
    data = moved(family.data, family.sources, list(family.deviations.T))

    def table(values: Sequence[Any]) -> Array:
        return np.stack([np.broadcast_to(np.asarray(v, dtype=float), n) for v in values], axis=-1)

    made = {
        "link_mass": table([link.mass for link in data.links]),
        "link_com": np.stack([table(link.com) for link in data.links], axis=1),
        "link_inertia": np.stack([table(link.inertia) for link in data.links], axis=1),
    }
    if family.drives:
        joints = data.joints
        made["rotor_inertia"] = table([joint.reflected_inertia for joint in joints])
        made["coulomb"] = table([0.0 if j.coulomb is None else j.coulomb for j in joints])
        made["viscous"] = table([0.0 if j.viscous is None else j.viscous for j in joints])
    return Variation(**made)


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
        state = _stepped(rate, state, steps.size)[0]
        if i % steps.every == 0:
            kept.append(state[:, :6])
    return np.stack(kept, axis=1)


def _stepped(
    rate: Callable[[Array], Array], state: Array, h: float
) -> tuple[Array, tuple[Array, ...]]:
    """One step of RK4, and the four states at which the rate was asked."""
    k1 = rate(state)
    second = state + 0.5 * h * k1
    k2 = rate(second)
    third = state + 0.5 * h * k2
    k3 = rate(third)
    fourth = state + h * k3
    after = state + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + rate(fourth))
    return after, (state, second, third, fourth)


def sensitivities(
    data: RobotData, sources: Sequence[Uncertain], scenario: Scenario, steps: Steps
) -> Array:
    """Derivative of the motion with respect to each source, (samples, d, 6), rad per unit.

    The variational equation S' = A S + B along the motion, with the same RK4: A from the exact
    derivatives of forward dynamics, B = -M^-1 d tau / d p, in which the torque of inverse
    dynamics is a polynomial of degree two in each number.
    """
    robot = robot_of(data, scenario)
    torque = torque_of(robot, scenario)

    def rate(state: Array) -> Array:
        q, qd = state[:, :6], state[:, 6:]
        return np.hstack([qd, robot.forward_dynamics(q, qd, torque(q))])

    state = np.array([[*scenario.q, *scenario.qd]])
    stages = []
    for _ in range(steps.number):
        state, asked = _stepped(rate, state, steps.size)
        stages.append(np.vstack(asked))
    A, B = _linear(robot, sources, np.vstack(stages), torque, scenario)
    A, B = (v.reshape(steps.number, 4, *v.shape[1:]) for v in (A, B))
    S = np.zeros((12, len(sources)))
    kept, h = [S[:6].T], steps.size
    for i, (a, b) in enumerate(zip(A, B, strict=True), 1):
        k1 = a[0] @ S + b[0]
        k2 = a[1] @ (S + 0.5 * h * k1) + b[1]
        k3 = a[2] @ (S + 0.5 * h * k2) + b[2]
        k4 = a[3] @ (S + h * k3) + b[3]
        S = S + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)
        if i % steps.every == 0:
            kept.append(S[:6].T)
    return np.stack(kept)


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
