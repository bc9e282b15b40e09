"""Let a scenario happen to a robot: `simulate`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kr16cli.api import Robot
from kr16cli.robot import RobotData
from kr16cli.simulate.events import LimitWatch
from kr16cli.simulate.integrate import Integration, Solution, sample_times
from kr16cli.simulate.plant import WORK_TOLERANCE, Plant
from kr16cli.simulate.run import Run
from kr16cli.simulate.scenario import Scenario
from kr16cli.simulate.torque import Torque, make_torque


def simulate(
    data: RobotData,
    scenario: Scenario,
    *,
    torque: Torque | None = None,
    on_step: Callable[[float], None] = lambda t: None,
) -> Run:
    """Simulate a scenario.

    Args:
        data: the robot, with inertial data.
        scenario: what happens.
        torque: drives the joints in place of the scenario's torque.
        on_step: told the time (s) after each step of the solver.

    Returns:
        The run; where the solver failed, the part before that, marked by `failure`.

    Raises:
        InputError: the robot has no inertial data.
        FileError: the scenario's torque file cannot be used.
    """
    placed = data if scenario.gravity is None else data.with_gravity(scenario.gravity)
    robot = Robot(placed, payload=scenario.payload, drives=scenario.drives)
    arm = robot.arm
    _ = arm.base_bodies  # complains now if there are none
    torque = torque or make_torque(scenario.torque, arm, scenario.folder)
    start = np.array([*scenario.q, *scenario.qd, 0.0, 0.0])
    weights = np.array([1.0] * 12 + [WORK_TOLERANCE] * 2)
    integration = Integration(
        Plant(arm, torque), scenario.solver_used(), weights, LimitWatch(data.joints), on_step
    )
    times = sample_times(scenario.duration, scenario.output_step)
    return _record(data, scenario, robot, torque, integration.run(start, times, torque.breaks))


def _record(
    data: RobotData, scenario: Scenario, robot: Robot, torque: Torque, solution: Solution
) -> Run:
    """The run that a solution amounts to."""
    time, state = solution.time, solution.state
    q, qd = (np.ascontiguousarray(state[:, k : k + 6]) for k in (0, 6))
    tau = np.array(
        [
            torque(t, angles, rates)
            for t, angles, rates in zip(time.tolist(), q.tolist(), qd.tolist(), strict=True)
        ]
    )
    T = robot.fk(q)
    kinetic, potential = robot.energy(q, qd)
    return Run(
        time=time,
        q=q,
        qd=qd,
        qdd=robot.forward_dynamics(q, qd, tau),
        tau=tau,
        pose=np.hstack([T[:, :3, 3], robot.rpy(T)]),
        energy_kinetic=kinetic,
        energy_potential=potential,
        work_torque=state[:, 12].copy(),
        work_friction=state[:, 13].copy(),
        events=tuple(solution.events),
        statistics=solution.statistics,
        failure=solution.failure,
        scenario=scenario.describe(),
        robot=data.name,
        model_sha256=data.sha256,
    )
