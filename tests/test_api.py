"""The array API: shapes, broadcasting, kinds of input, `out=`, threads, errors, batch = loop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import kr16cli
from array_methods import CHUNK, METHODS, Method, argument_names, each_method, motions, same
from kr16cli.errors import InputError, NonFiniteError, ShapeError

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
