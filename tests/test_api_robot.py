"""The array API: paths of inverse kinematics, tool, payload, gravity, what else a Robot says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

import kr16cli
import oracles
import strategies as sg
from array_methods import CHUNK, METHODS, TOOL, motions, same
from kr16cli.errors import InputError, NoAnswerError, ShapeError

# Inverse kinematics and paths ---------------------------------------------------------------


def test_unreachable_poses_are_nan_among_reachable_ones(robot: kr16cli.Robot) -> None:
    T = robot.fk(motions(4)[0])
    T[1, :3, 3] += 10
    T[3, :3, 3] = 0, 0, 1e6
    Q = robot.ik(T)
    there = np.isfinite(Q).all(axis=-1).any(axis=-1)
    assert there.tolist() == [True, False, True, False]
    assert np.isnan(Q[[1, 3]]).all()
    position, angle = robot.closure(T[:, None], Q)
    assert (np.isnan(position) == np.isnan(Q).any(axis=-1)).all()
    assert (np.isnan(angle) == np.isnan(Q).any(axis=-1)).all()


@pytest.mark.parametrize("far", [1e150, 1e300, -1e300])
def test_absurdly_far_poses_are_nan_without_a_warning(far: float, robot: kr16cli.Robot) -> None:
    """Squares overflow on the way; warnings are errors in this suite."""
    T = robot.fk(np.zeros((3, 6)))
    T[1, :3, 3] = far
    Q = robot.ik(T)
    assert np.isnan(Q[1]).all()
    assert np.isfinite(Q[0]).any()
    assert np.isnan(robot.ik(T[1])).all()


def _path(n: int = 200) -> np.ndarray:
    """Joint angles along a smooth path through a straight wrist and over A1's whole turns."""
    t = np.linspace(0, 1, n)
    return np.stack(
        [
            3.0 * t,
            -1.4 + 0.5 * t,
            1.5 - 0.3 * t,
            0.3 + 0 * t,
            0.6 - 1.2 * t,  # through zero in the middle
            8.0 * t,
        ],
        axis=-1,
    )


def test_path_is_followed_through_a_straight_wrist(robot: kr16cli.Robot) -> None:
    """q5 changes its sign, so the branch changes: nearness holds the path, not the index."""
    q = _path()
    got = robot.ik_path(robot.fk(q), q[0])
    assert np.abs(got - q).max() <= 1e-9  # A6 beyond a whole turn included


def test_path_stays_continuous_from_any_start(robot: kr16cli.Robot) -> None:
    q = _path()
    for near in ([2.0, -1, 1, 2, -1, 3], [0.0] * 6):
        got = robot.ik_path(robot.fk(q), near)
        position, angle = robot.closure(robot.fk(q), got)
        assert max(position.max(), angle.max()) <= 1e-9
        assert np.abs(np.diff(got, axis=0)).max() <= 0.2


def test_path_keeps_the_free_angles_as_state(robot: kr16cli.Robot) -> None:
    """Straight wrist all the way: A4 stays where it was, A6 makes up; likewise A1 over its axis."""
    q = _path(50)
    q[:, 4] = 0.0
    start = [*q[0][:3], 1.1, 0.0, q[0][5] + q[0][3] - 1.1]
    got = robot.ik_path(robot.fk(q), start)
    assert np.abs(got[:, 3] - 1.1).max() <= 1e-12
    assert np.abs(got[:, 3] + got[:, 5] - q[:, 3] - q[:, 5]).max() <= 1e-9

    over = np.array(sg.on_shoulder([0.7, 0, 0, 0.4, 0.8, 0.1], 1.0, 1, 0.0))
    poses = np.repeat(robot.fk(over)[None], 5, axis=0)
    for first in (0.7, -2.0):
        assert np.abs(robot.ik_path(poses, [first, 0, 0, 0, 0, 0])[:, 0] - first).max() <= 1e-12


def test_path_takes_the_smallest_largest_move(robot: kr16cli.Robot) -> None:
    T = robot.fk(np.array([0.4, -1.2, 1.3, 0.7, 0.9, -0.5]))
    rows = robot.ik(T)
    rows = rows[np.isfinite(rows).all(axis=1)]
    assert len(rows) >= 4
    for row in rows:
        near = row + 0.02 * np.array([1, -1, 1, -1, 1, -1])
        assert np.abs(robot.ik_path(T[None], near)[0] - row).max() <= 1e-12


def test_path_out_of_reach_names_the_pose(robot: kr16cli.Robot) -> None:
    T = robot.fk(_path(5))
    T[3, :3, 3] += 10
    with pytest.raises(NoAnswerError, match=r"T\[3\] is out of reach"):
        robot.ik_path(T)
    with pytest.raises(InputError, match=r"\(n, 4, 4\)"):
        robot.ik_path(T[0])


def test_empty_path_is_empty(robot: kr16cli.Robot) -> None:
    assert robot.ik_path(np.empty((0, 4, 4))).shape == (0, 6)


# Tool, payload, gravity ---------------------------------------------------------------------


def test_tool_moves_the_pose_the_solutions_and_the_jacobian(robot: kr16cli.Robot) -> None:
    tooled = robot.with_tool(TOOL)
    q, qd, _ = motions(20)
    assert np.abs(tooled.fk(q) - robot.fk(q) @ TOOL).max() <= 2e-15
    T = tooled.fk(q)
    Q = tooled.ik(T, near=q)
    assert np.nanmax(np.abs(tooled.closure(T[:, None], Q))) <= 1e-13
    same(Q, robot.ik(robot.fk(q), near=q), rel=1e-9)
    c, s = oracles.turns(q)
    expected = oracles.jacobian(robot.data.geometry, c, s, T[:, :3, 3])
    assert np.abs(tooled.jacobian(q) - expected).max() <= 5e-15
    h = 1e-6
    slope = (tooled.jacobian(q + h * qd) - tooled.jacobian(q - h * qd)) / (2 * h)
    assert np.abs(tooled.jacobian_dot(q, qd) - slope).max() <= 1e-7
    path = tooled.ik_path(tooled.fk(_path(20)), _path(20)[0])
    assert np.abs(path - _path(20)).max() <= 1e-9
    assert (tooled.with_tool(None).fk(q) == robot.fk(q)).all()


def test_tool_of_one_configuration_and_of_many_agree(robot: kr16cli.Robot) -> None:
    tooled = robot.with_tool(TOOL)
    q = motions(3)[0]
    for one, many in zip(q, tooled.fk(q), strict=True):
        same(tooled.fk(one), many)
        same(tooled.jacobian(one), tooled.jacobian(one[None])[0])


def test_tool_that_is_no_pose_is_refused(robot: kr16cli.Robot) -> None:
    with pytest.raises(InputError, match="tool"):
        robot.with_tool(np.diag([1, 1, -1, 1.0]))
    with pytest.raises(ShapeError, match="tool"):
        robot.with_tool(np.eye(3))


def test_with_payload_replaces_and_leaves_the_first_alone(robot: kr16cli.Robot) -> None:
    q, qd, qdd = motions(5)
    before = robot.inverse_dynamics(q, qd, qdd)
    loaded = robot.with_payload(16, (0, 0, 0.12)).with_payload(8, (0, 0, 0.1))
    other = kr16cli.load_robot(payload=kr16cli.Payload(8.0, (0, 0, 0.1)))
    assert (loaded.inverse_dynamics(q, qd, qdd) == other.inverse_dynamics(q, qd, qdd)).all()
    assert (robot.inverse_dynamics(q, qd, qdd) == before).all()
    none = loaded.with_payload(0)
    assert (none.inverse_dynamics(q, qd, qdd) == before).all()


def test_with_gravity_turns_the_weight(robot: kr16cli.Robot) -> None:
    weightless = robot.with_gravity((0, 0, 0))
    q = motions(5)[0]
    assert (weightless.gravity(q) == 0).all()
    lying = robot.with_gravity((9.81, 0, 0))
    assert np.abs(lying.gravity(q)[:, 0]).max() > 1
    assert (robot.with_gravity(robot.data.gravity).gravity(q) == robot.gravity(q)).all()


def test_options_survive_each_other(robot: kr16cli.Robot) -> None:
    """Tool, payload, drives and gravity in any order: the same robot."""
    q, qd, qdd = motions(5)
    a = kr16cli.load_robot(drives=True, tool=TOOL).with_payload(9, (0, 0, 0.1))
    a = a.with_gravity((1, 2, -9))
    b = kr16cli.load_robot(drives=True).with_gravity((1, 2, -9))
    b = b.with_payload(9, (0, 0, 0.1)).with_tool(TOOL)
    assert (a.inverse_dynamics(q, qd, qdd) == b.inverse_dynamics(q, qd, qdd)).all()
    assert (a.fk(q) == b.fk(q)).all()
    assert a.drives
    assert (a.friction(qd) != 0).all()


@given(sg.everywhere)
def test_singularity_factors_multiply_to_the_determinant(q: list[float]) -> None:
    robot = kr16cli.Robot(kr16cli.load_data())
    for angles in (np.array(q), np.array([q])):
        factors = robot.singularity(angles)
        product = 0.680 * factors.shoulder * factors.elbow * factors.wrist
        assert factors.determinant == pytest.approx(product, abs=1e-16)
        determinant = np.linalg.det(robot.jacobian(angles))
        assert factors.determinant == pytest.approx(determinant, abs=2e-15)


def test_from_parameters_is_load_robot_of_the_same_table() -> None:
    import tomllib

    from kr16cli.assets import asset

    text = asset("data/chapter3.toml").read_text(encoding="utf-8")
    a, b = kr16cli.Robot.from_parameters(tomllib.loads(text)), kr16cli.load_robot("chapter3")
    assert a.data.sha256 == b.data.sha256
    q, qd, _ = motions(3)
    assert (a.coriolis_matrix(q, qd) == b.coriolis_matrix(q, qd)).all()


def test_frames_agree_with_fk_and_each_other(robot: kr16cli.Robot) -> None:
    q = motions(9)[0]
    frames = robot.frames(q)
    assert np.abs(frames.flange - robot.fk(q)).max() <= 2e-15
    assert np.abs(frames.wrist_centre - frames.dh[:, 4, :3, 3]).max() == 0
    d6 = robot.data.geometry.d6
    behind = frames.flange[:, :3, 3] - d6 * frames.flange[:, :3, 2]
    assert np.abs(frames.wrist_centre - behind).max() <= 2e-15
    seen = np.swapaxes(frames.dh[:, 3, :3, :3], 1, 2) @ frames.dh[:, 6, :3, :3]
    assert np.abs(frames.R36 - seen).max() <= 2e-15


def test_repr_says_what_is_on(robot: kr16cli.Robot) -> None:
    assert "KR 16-2" in repr(robot)
    assert "payload 16.0 kg" in repr(robot.with_payload(16))
    assert "drives" in repr(kr16cli.load_robot(drives=True))


def test_mass_centre_jacobians_are_the_oracles(robot: kr16cli.Robot) -> None:
    """(3.31)-(3.36) link by link, the payload counted to link 6."""
    loaded = robot.with_payload(16, (0.05, -0.08, 0.12))
    q = motions(20)[0]
    c, s = oracles.turns(q)
    g = robot.data.geometry
    others = oracles.moments(g, oracles.bodies(g, robot.data.links, loaded.payload), c, s)
    ours = loaded.mass_centre_jacobians(q)
    for i, other in enumerate(others):
        expected = np.concatenate([other.linear, other.angular], axis=-2)
        assert np.abs(ours[:, i] - expected).max() <= 5e-15


def test_rate_matrix_and_its_inverse_multiply_to_one(robot: kr16cli.Robot) -> None:
    rpy = np.random.default_rng(51).uniform(-1.4, 1.4, (4, 5, 3))
    product = robot.rate_matrix(rpy) @ robot.inverse_rate_matrix(rpy)
    assert np.abs(product - np.eye(3)).max() <= 1e-14


def test_numbers_are_repeatable(robot: kr16cli.Robot) -> None:
    """Equal input, equal bytes."""
    rows = motions(2 * CHUNK)
    for method in METHODS:
        assert method(robot, rows).tobytes() == method(robot, rows).tobytes()
    assert math.isfinite(float(np.sum(robot.fk(rows[0]))))
