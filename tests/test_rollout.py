"""Rollouts against SciPy: motion, drives, wrench, the order and energy of fixed steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import kr16cli
from kernel_cases import native
from kr16cli.bench.rollouts import measure
from kr16cli.rollout import Rollout, rollout
from rollout_cases import SPEED, START, peer


def test_swing_is_scipys(robot: kr16cli.Robot, engine: str) -> None:
    span = 2.0 if engine == "native" else 0.3
    times = np.linspace(0.0, span, 14)
    own = rollout(robot, START, duration=span, times=times, rtol=1e-10, atol=1e-10)
    expected = peer(robot, START, times)
    assert own.complete
    assert np.abs(own.q - expected[:, :6]).max() < 1e-8
    assert np.abs(own.qd - expected[:, 6:]).max() < 1e-7


def test_drives_count(engine: str) -> None:
    """At speed: near rest regularised friction is stiff."""
    robot, times = kr16cli.load_robot(drives=True), np.linspace(0.0, 0.03, 4)
    own = rollout(robot, START, SPEED, duration=0.03, times=times, rtol=1e-11, atol=1e-11)
    expected = peer(robot, START, times, qd=SPEED)
    assert np.abs(own.q - expected[:, :6]).max() < 1e-9
    free = rollout(kr16cli.load_robot(), START, SPEED, duration=0.03).q[-1]
    assert np.abs(own.q[-1] - free).max() > 1e-3


def test_fixed_step_has_order_four(robot: kr16cli.Robot, engine: str) -> None:
    """At its steps, and between them by cubics."""
    times = np.array([0.1771, 0.32])
    exact = peer(robot, START, times)[:, :6]
    steps = (0.32 / 10, 0.32 / 20, 0.32 / 40)
    runs = [rollout(robot, START, duration=0.32, times=times, method="rk4", step=h) for h in steps]
    errors = np.array([np.abs(run.q - exact).max(axis=1) for run in runs])
    assert (np.log2(errors[:-1] / errors[1:]) > 3.3).all()
    assert (np.log2(errors[0] / errors[-1]) / 2 > 3.6).all()
    assert [int(run.steps) for run in runs] == [10, 20, 40]


@native
def test_fixed_step_of_a_millisecond_keeps_the_energy(robot: kr16cli.Robot) -> None:
    times = np.linspace(0.0, 10.0, 101)
    own = rollout(robot, START, duration=10.0, times=times, method="rk4", step=1e-3)
    kinetic, potential = robot.energy(own.q, own.qd)
    drift = np.abs(kinetic + potential - kinetic[0] - potential[0]).max()
    assert drift < 1e-6 * kinetic.max()
    assert int(own.steps) == 10_000


@pytest.mark.parametrize("axes", ["robroot", "flange"])
@pytest.mark.parametrize("lanes", [1, 5])
def test_wrench_pushes_by_the_jacobian(
    robot: kr16cli.Robot, engine: str, axes: Any, lanes: int
) -> None:
    wrench = np.array([30.0, -50.0, 80.0, 0.5, 0.3, -0.2])
    times = np.array([0.0, 0.2])
    expected = peer(robot, START, times, lambda t, q: robot.jacobian(q, axes=axes).T @ wrench)[
        -1, :6
    ]
    own = rollout(
        robot,
        np.broadcast_to(START, (lanes, 6)),
        duration=0.2,
        rtol=1e-11,
        atol=1e-11,
        wrench=wrench,
        wrench_axes=axes,
    )
    assert np.abs(own.q[:, -1] - expected).max() < 1e-9


def test_samples_do_not_change_the_motion(robot: kr16cli.Robot, engine: str) -> None:
    few = rollout(robot, START, duration=0.2)
    many = rollout(robot, START, duration=0.2, times=np.linspace(0.0, 0.2, 500))
    assert (few.q[-1] == many.q[-1]).all()
    assert few.evaluations == many.evaluations
    none = rollout(robot, START, duration=0.2, times=[])
    assert none.q.shape == (0, 6)
    assert none.reached == 0.2
    twice = rollout(robot, START, duration=0.2, times=[0.1, 0.1])
    assert (twice.q[0] == twice.q[1]).all()


def test_longest_step_is_kept(robot: kr16cli.Robot, engine: str) -> None:
    own = rollout(robot, START, duration=0.2, rtol=1e-3, atol=1e-3, step=0.01)
    assert own.steps >= 19


def test_memory_grows_with_the_samples_alone(robot: kr16cli.Robot, engine: str) -> None:
    own: Rollout = rollout(robot, START, duration=0.2, method="rk4", step=1e-3, times=[0.2])
    assert own.q.base is not None
    assert own.q.base.size == 12


@native
def test_figures_are_times(robot: kr16cli.Robot) -> None:
    figures = measure(robot, rounds=1, duration=0.01)
    assert len(figures) == 3
    for figure in figures:
        assert figure.seconds > 0.0
        assert all(seconds > 0.0 for seconds in figure.peers.values())
