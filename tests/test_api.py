"""The array API: shapes, broadcasting, kinds of input, `out=`, threads, errors, batch = loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given

import kr16cli
import oracles
import strategies as sg
from kr16cli.errors import InputError, NoAnswerError, NonFiniteError, ShapeError

CHUNK = 2048  # configurations per piece of a batch; the borders are tried one by one


class Method(NamedTuple):
    """A method of Robot: its name, how many (..., 6) arguments it takes, its trailing shape."""

    name: str
    arguments: int
    shape: tuple[int, ...]

    def __call__(self, robot: kr16cli.Robot, rows: Any, **options: Any) -> Any:
        return getattr(robot, self.name)(*rows[: self.arguments], **options)


METHODS = [
    Method("fk", 1, (4, 4)),
    Method("mass_centres", 1, (6, 3)),
    Method("jacobian", 1, (6, 6)),
    Method("mass_centre_jacobians", 1, (6, 6, 6)),
    Method("jacobian_dot", 2, (6, 6)),
    Method("mass_matrix", 1, (6, 6)),
    Method("coriolis_matrix", 2, (6, 6)),
    Method("christoffel", 1, (6, 6, 6)),
    Method("gravity", 1, (6,)),
    Method("inverse_dynamics", 3, (6,)),
    Method("forward_dynamics", 3, (6,)),
    Method("base_wrench", 3, (6,)),
]
each_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)

TOOL = np.array([[0, 0, 1, 0.1], [0, 1, 0, -0.05], [-1, 0, 0, 0.2], [0, 0, 0, 1.0]])
ARGUMENT_NAMES = {"forward_dynamics": ("q", "qd", "tau")}


def argument_names(method: Method) -> tuple[str, ...]:
    return ARGUMENT_NAMES.get(method.name, ("q", "qd", "qdd"))[: method.arguments]


def motions(*shape: int, seed: int = 50) -> list[np.ndarray]:
    """q, qd and qdd (or tau) of a leading shape."""
    rng = np.random.default_rng(seed)
    return [rng.uniform(-3, 3, (*shape, 6)) for _ in range(3)]


def same(a: Any, b: Any, rel: float = 1e-13) -> None:
    """Equal up to rounding of the largest number: sine and cosine may differ in the last place."""
    a, b = np.asarray(a), np.asarray(b)
    assert a.shape == b.shape
    assert (np.isnan(a) == np.isnan(b)).all()
    if a.size:
        assert np.nanmax(np.abs(a - b), initial=0) <= rel * (1 + np.nanmax(np.abs(b), initial=0))


# Shapes -------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("lead", [(), (1,), (7,), (2, 3), (2, 1, 3), (0,), (3, 0)])
def test_result_has_leading_and_own_shape(
    method: Method, lead: tuple[int, ...], robot: kr16cli.Robot
) -> None:
    result = method(robot, motions(*lead))
    assert result.shape == lead + method.shape
    assert result.dtype == np.float64
    assert result.flags.c_contiguous
    assert result.flags.writeable


@pytest.mark.parametrize("lead", [(), (7,), (2, 3), (0,)])
def test_other_shapes(lead: tuple[int, ...], robot: kr16cli.Robot) -> None:
    q, qd, _ = motions(*lead)
    T = robot.fk(q)
    assert robot.ik(T).shape == (*lead, 8, 6)
    frames = robot.frames(q)
    assert [f.shape for f in frames] == [
        (*lead, 7, 4, 4),
        (*lead, 4, 4),
        (*lead, 3),
        (*lead, 3, 3),
    ]
    assert [f.shape for f in robot.singularity(q)] == [lead] * 4
    assert [e.shape for e in robot.energy(q, qd)] == [lead] * 2
    assert robot.rpy(T).shape == (*lead, 3)
    assert robot.rate_matrix(robot.rpy(T)).shape == (*lead, 3, 3)
    assert robot.friction(qd).shape == (*lead, 6)
    assert [e.shape for e in robot.closure(T, robot.ik(T)[..., 0, :])] == [lead] * 2


@pytest.mark.parametrize("method", [m for m in METHODS if m.arguments > 1], ids=lambda m: m.name)
def test_arguments_broadcast(method: Method, robot: kr16cli.Robot) -> None:
    q, qd, qdd = motions(5, 1)[0], motions(4)[1], motions()[2]
    wide = [np.broadcast_to(v, (5, 4, 6)).copy() for v in (q, qd, qdd)]
    assert (method(robot, (q, qd, qdd)) == method(robot, wide)).all()


def test_near_broadcasts_against_poses(robot: kr16cli.Robot) -> None:
    q, near, _ = motions(5, 1)
    q[..., 4] = 0.0
    near = motions(4)[1]
    T = robot.fk(q)
    wide = robot.ik(np.broadcast_to(T, (5, 4, 4, 4)), np.broadcast_to(near, (5, 4, 6)))
    assert np.array_equal(robot.ik(T, near), wide, equal_nan=True)
    assert robot.ik(T[0, 0], near).shape == (4, 8, 6)


def test_closure_broadcasts_solutions_against_poses(robot: kr16cli.Robot) -> None:
    T = robot.fk(motions(5)[0])
    position, angle = robot.closure(T[:, None], robot.ik(T))
    assert position.shape == angle.shape == (5, 8)
    assert np.nanmax(position) <= 1e-14
    assert np.nanmax(angle) <= 1e-14


# Batch = loop -------------------------------------------------------------------------------


@each_method
def test_batch_equals_loop(method: Method, robot: kr16cli.Robot) -> None:
    rows = motions(40)
    loop = [method(robot, [v[i] for v in rows]) for i in range(40)]
    many = method(robot, rows)
    for one, row in zip(loop, many, strict=True):
        same(row, one, rel=1e-11 if method.name == "forward_dynamics" else 1e-13)


@each_method
@pytest.mark.parametrize("n", [CHUNK - 1, CHUNK, CHUNK + 1, 2 * CHUNK + 1])
def test_chunk_borders_leave_no_mark(method: Method, n: int, robot: kr16cli.Robot) -> None:
    """Cyclic rows, so the whole is known from its first 100."""
    rows = [np.resize(v, (n, 6)) for v in motions(100)]
    few = method(robot, motions(100))
    result = method(robot, rows)
    assert result.shape == (n, *method.shape)
    expected = np.resize(few, (n, *method.shape))
    # Vector and scalar ends of a loop may round sine and cosine differently.
    same(result, expected, rel=1e-11 if method.name == "forward_dynamics" else 1e-13)


@pytest.mark.parametrize("n", [CHUNK - 1, CHUNK, CHUNK + 1, 2 * CHUNK + 1])
def test_inverse_kinematics_at_chunk_borders(n: int, robot: kr16cli.Robot) -> None:
    T = np.resize(robot.fk(motions(100)[0]), (n, 4, 4))
    Q = robot.ik(T, threads=2)
    same(Q, np.resize(robot.ik(T[:100]), (n, 8, 6)), rel=1e-11)
    assert np.nanmax(robot.closure(T[:, None], Q)) <= 1e-12


def test_inverse_kinematics_batch_equals_loop(robot: kr16cli.Robot) -> None:
    q = motions(40)[0]
    T = robot.fk(q)
    many = robot.ik(T, near=q)
    for pose, near, rows in zip(T, q, many, strict=True):
        same(rows, robot.ik(pose, near), rel=1e-10)


@each_method
def test_threads_change_nothing(method: Method, robot: kr16cli.Robot) -> None:
    rows = motions(3 * CHUNK + 5)
    assert (method(robot, rows, threads=2) == method(robot, rows)).all()


def test_threads_change_no_energy_frame_or_solution(robot: kr16cli.Robot) -> None:
    q, qd, _ = motions(2 * CHUNK + 5)
    for a, b in zip(robot.frames(q), robot.frames(q, threads=2), strict=True):
        assert (a == b).all()
    for a, b in zip(robot.energy(q, qd), robot.energy(q, qd, threads=2), strict=True):
        assert (a == b).all()
    T = robot.fk(q)
    assert np.array_equal(robot.ik(T), robot.ik(T, threads=2), equal_nan=True)


# Kinds of input -----------------------------------------------------------------------------


def _strided(v: np.ndarray) -> np.ndarray:
    wide = np.zeros((2 * len(v), 12))
    wide[::2, ::2] = v
    return wide[::2, ::2]


def _read_only(v: np.ndarray) -> np.ndarray:
    other = v.copy()
    other.setflags(write=False)
    return other


KINDS: dict[str, Callable[[np.ndarray], Any]] = {
    "fortran": np.asfortranarray,
    "strided": _strided,
    "reversed": lambda v: v[::-1].copy()[::-1],
    "read-only": _read_only,
    "big-endian": lambda v: v.astype(">f8"),
    "list": lambda v: v.tolist(),
    "tuples": lambda v: tuple(map(tuple, v.tolist())),
    "objects": lambda v: v.astype(object),
}


@each_method
@pytest.mark.parametrize("kind", KINDS)
def test_any_layout_gives_the_same(method: Method, kind: str, robot: kr16cli.Robot) -> None:
    rows = motions(9)
    assert (method(robot, [KINDS[kind](v) for v in rows]) == method(robot, rows)).all()


@each_method
def test_integers_and_single_precision_are_taken_as_doubles(
    method: Method, robot: kr16cli.Robot
) -> None:
    whole = [np.round(v) for v in motions(5)]
    assert (method(robot, [v.astype(int) for v in whole]) == method(robot, whole)).all()
    single = [v.astype(np.float32) for v in motions(5)]
    double = [v.astype(np.float64) for v in single]
    result = method(robot, single)
    assert result.dtype == np.float64
    assert (result == method(robot, double)).all()


@each_method
def test_inputs_stay_as_they_were(method: Method, robot: kr16cli.Robot) -> None:
    rows = motions(9)
    copies = [v.copy() for v in rows]
    method(robot, rows)
    assert all((a == b).all() for a, b in zip(rows, copies, strict=True))


# out= ---------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("lead", [(), (9,), (CHUNK + 3,), (2, 3)])
def test_out_is_filled_and_returned(
    method: Method, lead: tuple[int, ...], robot: kr16cli.Robot
) -> None:
    rows = motions(*lead)
    fresh = method(robot, rows)
    out = np.full(lead + method.shape, np.nan)
    assert method(robot, rows, out=out) is out
    assert (out == fresh).all()

    wide = np.full((*lead, *method.shape[:-1], 2 * method.shape[-1]), np.nan)
    strided = wide[..., ::2]
    assert method(robot, rows, out=strided) is strided
    assert (strided == fresh).all()
    assert np.isnan(wide[..., 1::2]).all()


def test_out_of_inverse_kinematics(robot: kr16cli.Robot) -> None:
    T = robot.fk(motions(9)[0])
    out = np.zeros((9, 8, 6))
    assert robot.ik(T, out=out) is out
    assert np.array_equal(out, robot.ik(T), equal_nan=True)


@each_method
def test_out_that_does_not_fit_is_refused(method: Method, robot: kr16cli.Robot) -> None:
    rows = motions(3)
    shape = (3, *method.shape)
    with pytest.raises(ShapeError, match="out has shape"):
        method(robot, rows, out=np.empty((4, *method.shape)))
    with pytest.raises(InputError, match="out is float32; expected float64"):
        method(robot, rows, out=np.empty(shape, dtype=np.float32))
    with pytest.raises(InputError, match="out is list"):
        method(robot, rows, out=np.empty(shape).tolist())
    with pytest.raises(InputError, match="out is read-only"):
        method(robot, rows, out=_read_only(np.empty(shape)))


# Errors -------------------------------------------------------------------------------------


@each_method
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_number_is_named_with_its_index(
    method: Method, bad: float, robot: kr16cli.Robot
) -> None:
    for k, name in enumerate(argument_names(method)):
        rows = motions(4, 3)
        rows[k][2, 1, 5] = bad
        with pytest.raises(NonFiniteError) as caught:
            method(robot, rows)
        assert (caught.value.name, caught.value.index) == (name, (2, 1, 5))
        assert str(caught.value).startswith(f"{name}[2, 1, 5] is {bad}")
        assert "\n" not in str(caught.value)


@each_method
@pytest.mark.parametrize("shape", [(), (5,), (7,), (6, 1), (3, 5)])
def test_wrong_shape_is_named(method: Method, shape: tuple[int, ...], robot: kr16cli.Robot) -> None:
    for k, name in enumerate(argument_names(method)):
        rows: list[Any] = motions()
        rows[k] = np.zeros(shape)
        with pytest.raises(ShapeError, match=f"^{name} has shape .*expected"):
            method(robot, rows)


@each_method
@pytest.mark.parametrize(
    "value", ["text", [1, 2, 3, 4, 5, "six"], [None] * 6, [1j] * 6, [[1, 2], [3]], [True] * 6]
)
def test_what_is_no_number_is_refused(method: Method, value: Any, robot: kr16cli.Robot) -> None:
    for k, name in enumerate(argument_names(method)):
        rows: list[Any] = motions()
        rows[k] = value
        with pytest.raises(InputError, match=rf"^{name}\b"):
            method(robot, rows)


def test_leading_shapes_that_do_not_broadcast_are_named(robot: kr16cli.Robot) -> None:
    with pytest.raises(InputError, match=r"q \(3,\), qd \(4,\)"):
        robot.coriolis_matrix(np.zeros((3, 6)), np.zeros((4, 6)))


def test_matrices_that_are_no_poses_are_named(robot: kr16cli.Robot) -> None:
    T = robot.fk(motions(3)[0])
    broken = T.copy()
    broken[1, :3, :3] *= 1.01
    with pytest.raises(InputError, match=r"T\[1\] holds no rotation"):
        robot.ik(broken)
    mirrored = T.copy()
    mirrored[2, :3, 0] *= -1
    with pytest.raises(InputError, match=r"T\[2\].*det -1"):
        robot.ik(mirrored)
    shifted = T.copy()
    shifted[0, 3, 0] = 1.0
    with pytest.raises(InputError, match=r"T.*last row"):
        robot.ik(shifted)
    empty = T.copy()
    empty[1, 2, 3] = np.nan
    with pytest.raises(NonFiniteError, match=r"T\[1, 2, 3\] is nan"):
        robot.ik(empty)
    with pytest.raises(ShapeError, match="T has shape"):
        robot.ik(T[..., :3, :])


def test_jacobian_options_are_checked(robot: kr16cli.Robot) -> None:
    q = np.zeros(6)
    for link in (0, 7, -1):
        with pytest.raises(InputError, match=f"link is {link}"):
            robot.jacobian(q, link=link)
    with pytest.raises(InputError, match="point has shape"):
        robot.jacobian(q, point=np.zeros((2, 3)))
    with pytest.raises(InputError, match="axes"):
        robot.jacobian(q, axes="tool")  # type: ignore[arg-type]


def test_dynamics_without_data_says_what_is_missing() -> None:
    other = kr16cli.load_robot("kr16_l6")
    assert other.fk(np.zeros(6))[0, 3] == pytest.approx(0.26 + 0.68 + 0.97 + 0.115)
    with pytest.raises(InputError, match="no inertial data"):
        other.mass_matrix(np.zeros(6))


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
