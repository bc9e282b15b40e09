"""Control in task space: the error's angles, damping near singularities, whole loops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import kr16cli
from kr16cli.simulate import evidence
from kr16cli.simulate.controllers import gains
from kr16cli.simulate.core import Setpoint
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.loop import ClosedLoop
from kr16cli.simulate.run import Run
from kr16cli.simulate.scenario import Scenario, SolverSpec, load_scenario
from kr16cli.simulate.task_control import TaskComputedTorque, orientation_error
from kr16cli.single import Arm

Q = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
STILL = Scenario("still", Q, duration=0.4, output_step=0.02)


@pytest.fixture(scope="module")
def arm(data: kr16cli.RobotData) -> Arm:
    return Arm(data)


def test_task_errors_die_out_as_designed(data: kr16cli.RobotData) -> None:
    found = evidence.task_error_dynamics(data, 12.0, 0.5)
    assert np.abs(found.found - found.expected).max() < 1e-8
    assert np.ptp(found.found, axis=0).min() > 0.01


def test_orientation_error_is_singular_far_from_the_reference_only(arm: Arm) -> None:
    """It does not care where the reference is: at B = +-90 deg of the flange, too."""
    home = [math.radians(v) for v in (0, -90, 90, 0, 0, 0)]
    assert abs(arm.fk(home)[2][0]) == pytest.approx(1.0)
    target = Setpoint(arm, home).task(0.0)
    zero = orientation_error(target.rotation, (0.1, 0.2, 0.3), target)
    assert zero.angles == pytest.approx([0.0] * 3, abs=1e-12)
    assert np.linalg.norm(zero.rates) == pytest.approx(np.linalg.norm((0.1, 0.2, 0.3)))
    pitched = (np.array(target.rotation) @ [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]).tolist()
    with pytest.raises(ArithmeticError, match="pitch of 90 deg, 90 deg is singular"):
        orientation_error(pitched, (0.0,) * 3, target)


def test_damping_sets_in_smoothly_and_bounds_the_joints(arm: Arm) -> None:
    control = TaskComputedTorque(arm, *gains(10.0), near=0.1, strength=0.05)
    free = TaskComputedTorque(arm, *gains(10.0), near=0.0)
    at, largest = [], {True: 0.0, False: 0.0}
    for q5 in (0.2, math.asin(0.1), 0.05, 1e-3, 1e-5):
        q = [0.1, -1.1, 1.2, 0.3, q5, 0.2]
        goal = Setpoint(arm, [v + 0.05 for v in q]).task(0.0)
        at.append(control.damping(q))
        for damped, c in ((True, control), (False, free)):
            qdd = c.acceleration(q, [0.0] * 6, goal)
            largest[damped] = max(largest[damped], *map(abs, qdd))
    assert at[:2] == pytest.approx([0.0, 0.0], abs=1e-18)
    assert 0.0 < at[2] < at[3] < at[4] < 0.05**2
    assert largest[True] < 300.0
    assert largest[False] > 1e4
    on_it = [0.1, -1.1, 1.2, 0.3, 0.0, 0.2]
    assert all(map(math.isfinite, control.torque(0.0, on_it, [0.1] * 6, Setpoint(arm, Q))))


def _crossing(data: kr16cli.RobotData, arm: Arm, near: float) -> Run:
    """From A5 = -0.15 rad to 0.15 rad and A1 aside: straight past the wrist singularity."""
    start = (0.1, -1.1, 1.2, 0.3, -0.15, 0.2)
    goal = Setpoint(arm, (0.11, -1.1, 1.2, 0.3, 0.15, 0.2))
    control = TaskComputedTorque(arm, *gains(8.0), near=near)
    scenario = Scenario(
        "crossing", start, duration=2.0, output_step=0.01, solver=SolverSpec(rtol=1e-7, atol=1e-8)
    )
    return simulate(data, scenario, torque=ClosedLoop(control, goal))


def test_damping_lets_the_loop_cross_the_wrist_singularity(
    data: kr16cli.RobotData, arm: Arm
) -> None:
    """The way is the shortest; undamped, A4 and A6 spin to keep exactly to the error's line."""
    damped, free = _crossing(data, arm, 0.1), _crossing(data, arm, 0.0)
    for run in (damped, free):
        assert run.complete
        assert np.abs(np.sin(run.q[:, 4])).min() < 2e-3
        assert np.ptp(run.pose[-20:], axis=0).max() < 1e-4  # it has come to rest
        assert np.abs(run.drift).max() < 1e-2
    assert np.abs(damped.pose[-1] - free.pose[-1]).max() < 1e-5
    assert damped.q[-1] == pytest.approx([0.11, -1.1, 1.2, 0.3, 0.15, 0.2], abs=1e-4)
    assert np.abs(damped.qdd).max() < 30.0
    assert np.abs(damped.qd[:, 3]).max() < 0.5
    assert np.abs(free.qdd).max() > 1e4


def test_line_near_the_singularity_bends_a_little_and_comes_back(data: kr16cli.RobotData) -> None:
    """Damped over a wide neighbourhood, the path is left by centimetres and met again."""
    scenario = load_scenario("lin_near_wrist_singularity")
    assert scenario.controller is not None
    wide = simulate(data, replace(scenario, controller=replace(scenario.controller, near=0.2)))
    exact = simulate(data, replace(scenario, controller=replace(scenario.controller, near=0.0)))
    assert wide.error is not None and exact.error is not None
    assert exact.error.max() < 1e-6
    assert 1e-3 < wide.error[:, 0].max() < 0.04
    assert wide.error[-1].max() < 1e-5
    assert np.abs(wide.qd[:, 3]).max() < np.abs(exact.qd[:, 3]).max()
