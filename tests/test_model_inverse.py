"""Inverse kinematics: eight branches that close, in every regime, and none that is missing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import kr16cli
import oracles
import strategies as sg
from kr16cli.robot import Geometry

DATA = kr16cli.load_data()
ARM = kr16cli.Arm(DATA)
G = DATA.geometry

CLOSURE = 1e-9  # m and rad: what every returned solution is promised to keep
REGIMES = sorted(sg.REGIMES)


def sines(q: np.ndarray) -> np.ndarray:
    """Sines of the distances to the shoulder, elbow and wrist families, (..., 3), signed."""
    _, q2, q3, _, q5, _ = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    forearm = math.hypot(sg.A3, sg.D4)
    shoulder = sg.A1 + sg.A2 * np.cos(q2) + sg.D4 * np.cos(q2 + q3) - sg.A3 * np.sin(q2 + q3)
    elbow = sg.A3 * np.cos(q3) + sg.D4 * np.sin(q3)
    reach = sg.A1 + sg.A2 + forearm
    return np.stack([shoulder / reach, elbow / forearm, np.sin(q5)], axis=-1)


def solve(pose: np.ndarray, near: list[float] | None = None) -> np.ndarray:
    """The eight rows, from the single-query path."""
    return np.array(ARM.ik(pose.tolist(), near).angles)


def pose_of(q: list[float]) -> np.ndarray:
    """A pose made without the package."""
    return oracles.flange(G, *oracles.turns(q))


def worst_gap(pose: np.ndarray, rows: np.ndarray) -> float:
    """Largest closure error (m or rad) of the rows, by the oracle's forward kinematics."""
    return max(float(np.max(e)) for e in oracles.gap(oracles.flange(G, *oracles.turns(rows)), pose))


@pytest.mark.parametrize("regime", REGIMES)
@given(pick=st.data())
def test_every_solution_reproduces_the_pose(regime: str, pick: st.DataObject) -> None:
    """In every regime, whatever `near` supplies free angles; rows are whole or NaN."""
    q = pick.draw(sg.REGIMES[regime])
    near = pick.draw(st.none() | st.just(q) | sg.generic)
    pose = pose_of(q)
    rows = solve(pose, near)
    found = rows[np.isfinite(rows).all(axis=1)]
    assert (np.isfinite(rows).all(axis=1) == np.isfinite(rows).any(axis=1)).all()
    assert len(found) > 0  # a pose made by forward kinematics has a solution
    assert worst_gap(pose, found) <= CLOSURE
    assert (found > -math.pi).all()
    assert (found <= math.pi).all()


@given(sg.regular, st.sampled_from([0.0, sg.PI]))
def test_configuration_with_a_straight_wrist_comes_back_given_near(
    q: list[float], q5: float
) -> None:
    q = [*q[:4], q5, q[5]]
    assert back(q) <= 1e-10  # rounding over `regular`, and A5 within the wrist's tolerance


@given(sg.REGIMES["singular_shoulder"])
def test_configuration_with_the_wrist_over_a1_comes_back_given_near(q: list[float]) -> None:
    _, elbow, wrist = np.abs(sines(q))
    assume(min(elbow, wrist) > 1e-2)
    assert back(q) <= 1e-8  # the wrist centre is taken onto the axis from up to 1e-10 m


@pytest.mark.parametrize("at", [sg.STRAIGHT, sg.STRAIGHT + sg.PI])
@given(q=sg.regular)
def test_configuration_with_a_straight_elbow_comes_back(q: list[float], at: float) -> None:
    """To the square root of rounding, times 75 at A2 when folded: a2 / (a2 - hypot(a3, d4))."""
    q = [*q[:2], at, *q[3:]]
    assume(abs(sines(q)[0]) > 1e-2)
    assert back(q) <= (1e-7 if at < 0 else 1e-5) / abs(sines(q)[2])


def back(q: list[float]) -> float:
    """How near to q its own pose's solutions come, given q as the last known configuration."""
    rows = solve(pose_of(q), q)
    return float(oracles.angle_gap(rows[np.isfinite(rows).all(axis=1)], q).min())


@given(sg.regular)
def test_configuration_comes_back_without_near(q: list[float]) -> None:
    rows = solve(pose_of(q))
    found = rows[np.isfinite(rows).all(axis=1)]
    assert oracles.angle_gap(found, q).min() <= 1e-11


@given(sg.everywhere)
def test_index_says_the_branch(q: list[float]) -> None:
    """4*shoulder + 2*elbow + wrist by the definitions, where signs are beyond rounding."""
    rows = solve(pose_of(q), q)
    for index, row in enumerate(rows):
        if not np.isfinite(row).all():
            continue
        shoulder, elbow, wrist = sines(row)
        if abs(shoulder) > 1e-9:
            assert (index >> 2 & 1) == (shoulder < 0)
        if abs(elbow) > 1e-7:
            assert (index >> 1 & 1) == (elbow > 0)
        if abs(wrist) > 1e-9:
            assert (index & 1) == (row[4] < 0)


@given(sg.regular)
def test_configuration_stands_in_its_own_row(q: list[float]) -> None:
    shoulder, elbow, _ = sines(q)
    index = 4 * (shoulder < 0) + 2 * (elbow > 0) + (q[4] < 0)
    assert oracles.angle_gap(solve(pose_of(q))[index], q) <= 1e-11


@given(sg.generic)
def test_first_shoulder_is_atan2_of_the_chapter(q: list[float]) -> None:
    pose = pose_of(q)
    centre = pose[:3, 3] - G.d6 * pose[:3, 2]
    x_c, y_c = -centre[1], centre[0]  # the chapter's base
    rows = solve(pose)
    for index in range(4):
        if np.isfinite(rows[index]).all():
            assert oracles.angle_gap(rows[index][:1], [math.atan2(x_c, y_c)]) <= 1e-14


@given(sg.everywhere)
def test_rows_come_in_wrist_pairs(q: list[float]) -> None:
    """Both wrists or none: (3.26) leaves zero, four or eight solutions, merged ones counted."""
    there = np.isfinite(solve(pose_of(q), q)).all(axis=1)
    assert (there[0::2] == there[1::2]).all()
    assert there.sum() in (4, 8)


# Merged rows --------------------------------------------------------------------------------


@given(sg.regular.map(lambda q: [*q[:4], 0.0, q[5]]))
def test_straight_wrist_keeps_q4_of_near_and_merges_the_pair(q: list[float]) -> None:
    """The posture that has q5 = 0; the pose's other postures need not be singular."""
    rows = solve(pose_of(q), q)
    index = int(np.nanargmin(oracles.angle_gap(rows, q)))
    assert rows[index].tolist() == rows[index ^ 1].tolist()
    assert rows[index][3] == pytest.approx(q[3], abs=1e-15)
    assert rows[index][4] == 0.0


@given(sg.regular, sg.generic)
def test_straight_wrist_keeps_the_sum_of_q4_and_q6(q: list[float], near: list[float]) -> None:
    """(3.28): whatever q4 is kept, q6 makes up for it."""
    q = [*q[:4], 0.0, q[5]]
    pose = pose_of(q)
    rows = solve(pose, near)
    pick = int(np.nanargmin(np.abs(rows[:, 4]) + oracles.angle_gap(rows[:, :3], q[:3])))
    assert rows[pick][3] == pytest.approx(near[3], abs=1e-15)
    assert oracles.angle_gap([rows[pick][3] + rows[pick][5]], [q[3] + q[5]]) <= 1e-11


@given(sg.REGIMES["singular_shoulder"], sg.angle)
def test_wrist_centre_over_a1_keeps_q1_of_near_and_merges_the_shoulders(
    q: list[float], last: float
) -> None:
    rows = solve(pose_of(q), [last, 0, 0, 0, 0, 0])
    assert np.isfinite(rows).all()
    assert np.abs(rows[:, 0] - last).max() <= 1e-15
    assert rows[:4].tolist() == rows[4:].tolist()


@pytest.mark.parametrize("name", ["singular_stretched", "singular_folded"])
@given(pick=st.data())
def test_straight_elbow_merges_the_elbow_pair(name: str, pick: st.DataObject) -> None:
    """Equal rows, on the shoulder side that the configuration is on."""
    q = pick.draw(sg.REGIMES[name])
    assume(abs(sines(q)[0]) > 1e-6)
    rows = solve(pose_of(q), q)
    shoulder = 4 * int(sines(q)[0] < 0)
    assert np.isfinite(rows[shoulder : shoulder + 4]).all()
    assert rows[shoulder : shoulder + 2].tolist() == rows[shoulder + 2 : shoulder + 4].tolist()


@given(sg.generic, sg.angle)
def test_arm_folded_onto_its_shoulder_keeps_q2_of_near(q: list[float], last: float) -> None:
    """Only an arm with a2 = hypot(a3, d4) can: A2 is free then, and the pose still closes."""
    g = Geometry(0.675, 0.260, 0.5, 0.3, 0.4, 0.158)
    arm = kr16cli.Arm(replace(DATA, geometry=g))
    q = [q[0], q[1], math.pi - math.atan2(g.a3, g.d4), *q[3:]]
    pose = oracles.flange(g, *oracles.turns(q))
    solution = arm.ik(pose.tolist(), [0, last, 0, 0, 0, 0])
    rows = np.array(solution.angles)[:4]
    assert solution.folded[0]
    assert np.abs(rows[:, 1] - last).max() <= 1e-15
    distance, angle = oracles.gap(oracles.flange(g, *oracles.turns(rows)), pose)
    assert max(distance.max(), angle.max()) <= 1.1e-9  # `fold` moves the centre by up to 1e-9


# Out of reach -------------------------------------------------------------------------------


@given(sg.generic, st.floats(1e-9, 10.0))
def test_a_stretched_arm_is_the_end_of_reach(q: list[float], more: float) -> None:
    """One nanometre and more beyond, no branch of this shoulder; never an exception."""
    q = [*q[:2], sg.STRAIGHT, *q[3:]]
    pose = pose_of(q)
    centre = pose[:3, 3] - G.d6 * pose[:3, 2]
    c, s = oracles.turns(q)
    _, points = oracles.axes_and_points(G, oracles.motions(G, c, s))
    outward = (centre - points[1]) / np.linalg.norm(centre - points[1])
    pose[:3, 3] += more * outward
    side = 4 * int(sines(q)[0] < 0)
    rows = solve(pose, q)
    assert np.isnan(rows[side : side + 4]).all()
    others = rows[np.isfinite(rows).all(axis=1)]
    assert len(others) == 0 or worst_gap(pose, others) <= CLOSURE


@given(st.tuples(*[st.floats(-1e6, 1e6)] * 3), sg.generic)
def test_any_pose_gets_an_answer(position: tuple[float, ...], q: list[float]) -> None:
    """Rows that close, or NaN: here against the reach, worked out from the wrist centre."""
    pose = pose_of(q)
    pose[:3, 3] = position
    centre = pose[:3, 3] - G.d6 * pose[:3, 2]
    radius = math.hypot(centre[0], centre[1])
    forearm = math.hypot(G.a3, G.d4)
    rows = solve(pose)
    for shoulder, r in enumerate((radius, -radius)):
        reach = math.hypot(r - G.a1, centre[2] - G.d1)
        margin = min(G.a2 + forearm - reach, reach - abs(G.a2 - forearm))
        block = rows[4 * shoulder : 4 * shoulder + 4]
        if abs(margin) > 1e-9:
            assert np.isfinite(block).all() == (margin > 0)
            assert np.isnan(block).all() == (margin < 0)


# Completeness -------------------------------------------------------------------------------


def _sample_poses() -> list[list[float]]:
    rng = np.random.default_rng(11)
    eight = [0.4, -1.2, 1.3, 0.7, 0.9, -0.5]
    four = [-0.3, 0.2, 0.3, 1.0, -1.1, 2.0]  # outstretched: the other shoulder is out of reach
    return [eight, four, *rng.uniform(-np.pi, np.pi, (4, 6)).tolist()]


@pytest.mark.parametrize("q", _sample_poses())
def test_no_branch_is_missing_and_none_is_made_up(q: list[float]) -> None:
    """Newton from 600 random starts finds the same set, knowing nothing of branches."""
    pose = pose_of(q)
    rows = solve(pose)
    ours = rows[np.isfinite(rows).all(axis=1)]
    starts = np.random.default_rng(12).uniform(-np.pi, np.pi, (600, 6))
    theirs = oracles.roots(G, pose, starts)
    assert len(theirs) == len(ours)
    for row in theirs:
        assert oracles.angle_gap(ours, row).min() <= 1e-8


def test_newton_finds_nothing_out_of_reach() -> None:
    pose = pose_of([0.0] * 6)
    pose[0, 3] += 0.7
    assert np.isnan(solve(pose)).all()
    starts = np.random.default_rng(12).uniform(-np.pi, np.pi, (100, 6))
    assert len(oracles.roots(G, pose, starts)) == 0


# Batches ------------------------------------------------------------------------------------


def _batch(regime: str, n: int) -> np.ndarray:
    """Many configurations of a regime, seeded: what hypothesis is too slow for."""
    rng = np.random.default_rng(REGIMES.index(regime))
    q = rng.uniform(-np.pi, np.pi, (n, 6))
    gap = 10.0 ** rng.uniform(-12, -3, n) * rng.choice([-1, 1], n)
    gap = gap * (not regime.startswith("singular"))
    if "wrist_pi" in regime:
        q[:, 4] = np.pi - np.abs(gap)
    elif "wrist" in regime:
        q[:, 4] = gap
    elif "stretched" in regime:
        q[:, 2] = sg.STRAIGHT + gap
    elif "folded" in regime:
        q[:, 2] = sg.STRAIGHT + np.pi + gap
    elif "shoulder" in regime or "all" in regime:
        bends, sides = rng.uniform(-2.4, 2.4, n), rng.choice([-1, 1], n)
        q = np.array([sg.on_shoulder(*a) for a in zip(q.tolist(), bends, sides, gap, strict=True)])
        if "all" in regime:
            q[:, 4] = rng.choice([0.0, np.pi, 1e-11, -1e-7], n)
    elif regime == "limits":
        limits = np.radians(sg.LIMITS_DEG)
        q = np.where(rng.random((n, 6)) < 0.5, limits[:, 0], limits[:, 1])
    elif regime == "round":
        q = np.radians(rng.choice([0, 45, -45, 90, -90, 135, -135, 180], (n, 6)))
    return q


@pytest.mark.parametrize("regime", REGIMES)
def test_batch_closes(regime: str, robot: kr16cli.Robot) -> None:
    q = _batch(regime, 3000)
    T = oracles.flange(G, *oracles.turns(q))
    rows = robot.ik(T, near=q)
    there = np.isfinite(rows).all(axis=-1)
    assert there.any(axis=1).all()
    position, angle = oracles.gap(oracles.flange(G, *oracles.turns(rows)), T[:, None])
    assert max(position[there].max(), angle[there].max()) <= CLOSURE
    ours = robot.closure(T[:, None], rows)
    assert np.nanmax(np.abs(ours[0] - position)) <= 5e-15
    assert np.nanmax(np.abs(ours[1] - angle)) <= 1e-7  # arcsine of the oracle near half a turn
    assert (np.isnan(ours[0]) == ~there).all()


@pytest.mark.parametrize("regime", [r for r in REGIMES if "singular" not in r])
def test_configuration_comes_back_as_far_as_the_pose_knows_it(
    regime: str, robot: kr16cli.Robot
) -> None:
    """Rounding of the pose over the Jacobian's smallest singular value, near a singularity too.

    Below 1e-6 the pose no longer tells to first order; there the tests of merged rows hold.
    """
    q = _batch(regime, 3000)
    weakest = np.linalg.svd(oracles.jacobian(G, *oracles.turns(q)), compute_uv=False)[:, -1]
    q, weakest = q[weakest > 1e-6], weakest[weakest > 1e-6]
    assert len(q) >= 300
    rows = robot.ik(oracles.flange(G, *oracles.turns(q)))
    gaps = np.nanmin(oracles.angle_gap(rows, q[:, None]), axis=1)
    assert (gaps <= 1e-14 / weakest).all()


@given(sg.everywhere, st.none() | sg.generic)
def test_one_and_many_give_the_same_rows(q: list[float], near: list[float] | None) -> None:
    robot = kr16cli.Robot(DATA)
    T = pose_of(q)
    one = robot.ik(T, near)
    many = robot.ik(T[None], near)[0]
    assert (np.isnan(one) == np.isnan(many)).all()
    there = np.isfinite(one).all(axis=1)
    # NumPy's own sine and atan2 may differ from the C library's in the last place; near a
    # singularity that shows in the angles, never in the pose.
    assert worst_gap(T, many[there]) <= CLOSURE
    if np.abs(sines(one[there])).min() > 1e-3:
        assert oracles.angle_gap(one[there], many[there]).max() <= 1e-11
