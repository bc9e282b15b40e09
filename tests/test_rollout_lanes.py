"""Rollouts of many: equal to single ones and between engines, none disturbed by another."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kr16cli
from kernel_cases import native
from kr16cli.rollout import Variation, rollout
from rollout_cases import SPEED, START, TORQUE, peer

METHODS: list[dict[str, Any]] = [{"method": "dopri5"}, {"method": "rk4", "step": 2e-3}]


@pytest.fixture(params=METHODS, ids=["dopri5", "rk4"])
def method(request: pytest.FixtureRequest) -> dict[str, Any]:
    return dict(request.param)


def test_lanes_are_the_single_arm(
    robot: kr16cli.Robot, engine: str, method: dict[str, Any]
) -> None:
    """To rounding, and with as many steps: more trajectories than lanes, of different lengths."""
    n, span = (101, 0.5) if engine == "native" else (30, 0.05)
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (n, 6))
    times = np.array([0.0, 0.4 * span, span])
    many = rollout(robot, q, duration=span, times=times, **method)
    picked = [0, 1, n // 2, n - 1]
    for i in picked:
        one = rollout(robot, q[i], duration=span, times=times, **method)
        assert np.abs(many.q[i] - one.q).max() < 1e-11
        assert np.abs(many.qd[i] - one.qd).max() < 1e-10
        assert (many.steps[i], many.rejected[i]) == (one.steps, one.rejected)
    assert many.complete.all()


@native
@pytest.mark.parametrize(("count", "span"), [(1, 0.5), (5, 0.5), (30, 0.1)])
def test_engines_agree(
    robot: kr16cli.Robot,
    monkeypatch: pytest.MonkeyPatch,
    method: dict[str, Any],
    count: int,
    span: float,
) -> None:
    """And make the same steps."""
    q = np.random.default_rng(2).uniform(-1.0, 1.0, (count, 6))
    tau = TORQUE * np.random.default_rng(3).uniform(-1.0, 1.0, (count, 3, 6))
    runs = []
    for name in ("native", "numpy"):
        monkeypatch.setenv("KR16_ENGINE", name)
        runs.append(
            rollout(
                robot,
                q,
                duration=span,
                times=np.linspace(0.0, span, 7),
                tau=tau,
                hold=0.3 * span,
                wrench=(10.0, 20.0, 30.0, 0.5, 0.3, 0.1),
                wrench_axes="flange",
                variation=Variation(payload_mass=np.linspace(0.0, 16.0, count)),
                **method,
            )
        )
    assert np.abs(runs[0].q - runs[1].q).max() < 1e-9
    assert (runs[0].steps == runs[1].steps).all()
    assert (runs[0].rejected == runs[1].rejected).all()
    assert (runs[0].reached == span).all()


@native
def test_engines_agree_on_the_swing(
    robot: kr16cli.Robot, monkeypatch: pytest.MonkeyPatch, method: dict[str, Any]
) -> None:
    ends = []
    for name in ("native", "numpy"):
        monkeypatch.setenv("KR16_ENGINE", name)
        ends.append(rollout(robot, START, duration=2.0, **method).q[-1])
    assert np.abs(ends[0] - ends[1]).max() < 1e-9


LOADS = np.array([0.0, 5.0, 16.0])
LINKS = np.array([1.0, 1.1, 0.9])


def varied(
    kind: str, data: kr16cli.RobotData
) -> tuple[kr16cli.Robot, Variation, list[kr16cli.Robot]]:
    """A robot, three variations of it, and the three robots they mean."""
    robot = kr16cli.Robot(data)
    if kind == "payload":
        com, inertia = (0.02, 0.0, 0.1), (0.05, 0.06, 0.04, 0.0, 0.01, 0.0)
        return (
            robot.with_payload(3.0),  # replaced, not added to
            Variation(payload_mass=LOADS, payload_com=com, payload_inertia=inertia),
            [robot.with_payload(0.0), *(robot.with_payload(m, com, inertia) for m in LOADS[1:])],
        )
    if kind == "gravity":
        vectors = ((0.0, 0.0, -9.81), (4.9, 0.0, -8.5), (0.0, 0.0, -1.62))
        return robot, Variation(gravity=vectors), [robot.with_gravity(g) for g in vectors]
    if kind == "links":
        mass = np.array([[link.mass * f for link in data.links] for f in LINKS])
        inertia = np.array([[[v * f for v in link.inertia] for link in data.links] for f in LINKS])
        com = np.array([[[v * f for v in link.com] for link in data.links] for f in LINKS])
        robots = []
        for f in LINKS:
            links = tuple(
                replace(
                    link,
                    mass=link.mass * f,
                    com=tuple(v * f for v in link.com),
                    inertia=tuple(v * f for v in link.inertia),
                )
                for link in data.links
            )
            robots.append(kr16cli.Robot(replace(data, links=links)))
        return robot, Variation(link_mass=mass, link_com=com, link_inertia=inertia), robots
    joints = [
        tuple(
            replace(
                j,
                coulomb=(j.coulomb or 0.0) * f,
                viscous=(j.viscous or 0.0) * f,
                rotor_inertia=(j.rotor_inertia or 0.0) * f,
            )
            for j in data.joints
        )
        for f in LINKS
    ]
    return (
        robot,
        Variation(
            coulomb=[[j.coulomb for j in row] for row in joints],
            viscous=[[j.viscous for j in row] for row in joints],
            rotor_inertia=[[j.reflected_inertia for j in row] for row in joints],
        ),
        [kr16cli.Robot(replace(data, joints=row), drives=True) for row in joints],
    )


@pytest.mark.parametrize("lanes", [1, 2])  # a few are run one by one, more in lanes
@pytest.mark.parametrize("kind", ["payload", "gravity", "links", "drives"])
def test_numbers_of_their_own_are_robots_of_their_own(
    data: kr16cli.RobotData, engine: str, method: dict[str, Any], kind: str, lanes: int
) -> None:
    robot, variation, robots = varied(kind, data)
    q = np.broadcast_to(START, (lanes, 3, 6))
    own = rollout(robot, q, SPEED, duration=0.03, variation=variation, **method)
    for i, other in enumerate(robots):
        alone = rollout(other, START, SPEED, duration=0.03, **method)
        assert np.abs(own.q[:, i] - alone.q).max() < 1e-10
        assert own.steps[0, i] == alone.steps
    assert np.abs(own.q[0, 1, -1] - own.q[0, 2, -1]).max() > 1e-5


@pytest.mark.parametrize("lanes", [1, 5])
def test_torques_are_held_between_samples(
    robot: kr16cli.Robot, engine: str, method: dict[str, Any], lanes: int
) -> None:
    """Three samples of 0.07 s; the last is held to the end."""
    table = TORQUE * np.random.default_rng(4).uniform(-1.0, 1.0, (3, 6))
    times = np.array([0.0, 0.05, 0.07, 0.1, 0.2, 0.3])
    expected = peer(
        robot, START, times, lambda t, q: table[min(int(t / 0.07 + 1e-12), 2)], (0.07, 0.14)
    )
    own = rollout(
        robot,
        np.broadcast_to(START, (lanes, 6)),
        duration=0.3,
        times=times,
        tau=table,
        hold=0.07,
        **method,
    )
    assert np.abs(own.q - expected[:, :6]).max() < 1e-7
    each = rollout(
        robot, START, duration=0.3, times=times, tau=np.stack([table] * lanes), hold=0.07, **method
    )
    assert (each.q == own.q).all()


def test_axes_broadcast(robot: kr16cli.Robot, engine: str, method: dict[str, Any]) -> None:
    own = rollout(
        robot,
        np.zeros((3, 1, 6)) + START,
        duration=0.05,
        tau=np.zeros((2, 6)),
        times=[0.05],
        **method,
    )
    assert own.q.shape == own.qd.shape == (3, 2, 1, 6)
    assert own.reached.shape == own.steps.shape == own.evaluations.shape == (3, 2)
    empty = rollout(robot, np.zeros((0, 6)), duration=1.0, **method)
    assert empty.q.shape == (0, 2, 6)
    assert empty.complete.shape == (0,)
    one = rollout(robot, START, duration=0.05, **method)
    assert one.q.shape == (2, 6)
    assert one.steps.shape == ()


WILD = np.array([0.0, 1e7, -1e7, 1e7, 0.0, 0.0])


@pytest.mark.parametrize("wild", [WILD, WILD * 1e100, WILD * 1e200], ids=["1e7", "1e107", "1e207"])
def test_diverging_trajectory_is_marked_and_disturbs_no_other(
    robot: kr16cli.Robot, engine: str, method: dict[str, Any], wild: Any
) -> None:
    q = np.random.default_rng(5).uniform(-1.0, 1.0, (6, 6))
    qd = np.zeros((6, 6))
    times = np.array([0.0, 0.01, 0.1])
    calm = rollout(robot, q, qd, duration=0.1, times=times, max_steps=300, **method)
    assert calm.complete.all()
    qd[3] = wild
    own = rollout(robot, q, qd, duration=0.1, times=times, max_steps=300, **method)
    assert own.complete.tolist() == [True] * 3 + [False] + [True] * 2
    assert (own.q[3, 0] == q[3]).all()
    assert np.isnan(own.q[3, -1]).all()
    assert np.isnan(own.qd[3, -1]).all()
    assert own.reached[3] < 0.1
    others = [0, 1, 2, 4, 5]
    assert (own.q[others] == calm.q[others]).all()
    alone = rollout(robot, q[3], qd[3], duration=0.1, times=times, max_steps=300, **method)
    assert alone.reached == pytest.approx(own.reached[3], rel=1e-3)
    assert np.isnan(alone.q[-1]).all()


def test_used_up_steps_end_a_trajectory(robot: kr16cli.Robot, engine: str) -> None:
    for q in (START, np.stack([START] * 5)):
        own = rollout(robot, q, duration=1.0, times=[0.01, 1.0], max_steps=20)
        assert not own.complete.any()
        assert (own.steps + own.rejected <= 20).all()
        assert np.isfinite(own.q[..., 0, :]).all()
        assert np.isnan(own.q[..., 1, :]).all()
        assert ((own.reached > 0.01) & (own.reached < 1.0)).all()


def test_angles_of_many_turns_are_angles(robot: kr16cli.Robot, engine: str) -> None:
    """Beyond the range of the kernels' own sine as well."""
    turns = 2.0 * np.pi * np.array([40_000, 0, 0, -30_000, 0, 50_000])
    for n in (1, 5):
        q = np.stack([START] * n)
        plain = rollout(robot, q, duration=0.1)
        turned = rollout(robot, q + turns, duration=0.1, atol=1e-9, rtol=1e-15)
        assert np.abs(turned.q - turns - plain.q).max() < 1e-8


@native
@pytest.mark.parametrize("count", [3, 90])
def test_threads_change_nothing(robot: kr16cli.Robot, method: dict[str, Any], count: int) -> None:
    q = np.random.default_rng(6).uniform(-1.0, 1.0, (count, 6))
    alone = rollout(robot, q, duration=0.1, **method)
    shared = rollout(robot, q, duration=0.1, threads=3, **method)
    assert np.abs(alone.q - shared.q).max() < 1e-12


@native
def test_other_threads_go_on(robot: kr16cli.Robot) -> None:
    ticks, over = [0], threading.Event()

    def tick() -> None:
        while not over.wait(0.001):
            ticks[0] += 1

    clock = threading.Thread(target=tick)
    clock.start()
    before = ticks[0]
    rollout(robot, START, duration=100.0, method="rk4", step=1e-3)
    during = ticks[0] - before
    over.set()
    clock.join()
    assert during > 3
