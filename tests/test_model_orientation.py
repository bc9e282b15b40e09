"""Roll, pitch, yaw (KUKA's A, B, C) and their rates, equations (3.44)-(3.46)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import duals
import kr16cli
import oracles
import strategies as sg
from kr16cli.model import orientation
from kr16cli.model.scalars import FLOATS

HALF = math.pi / 2
pole_offset = st.just(0.0) | st.floats(-12.0, -3.0).map(lambda e: 10.0**e)
pitch = (
    st.floats(-HALF, HALF)
    | st.builds(lambda d: HALF - d, pole_offset)
    | st.builds(lambda d: d - HALF, pole_offset)
)
rpy = st.tuples(sg.angle, pitch, sg.angle)
away_from_pole = st.tuples(sg.angle, st.floats(-1.5, 1.5), sg.angle)


def rotation_of(angles: tuple[float, float, float]) -> np.ndarray:
    a, b, c = angles
    return oracles.rotation(2, a) @ oracles.rotation(1, b) @ oracles.rotation(0, c)


def angles_of(rotation: np.ndarray) -> tuple[float, float, float]:
    return orientation.rpy_from_rotation(rotation.tolist(), FLOATS)


@given(rpy)
def test_rotation_is_z_then_y_then_x(angles: tuple[float, float, float]) -> None:
    ours = np.array(orientation.rotation_from_rpy(FLOATS.trig(angles)))
    assert np.abs(ours - rotation_of(angles)).max() <= 1e-15


@given(rpy)
def test_angles_reproduce_the_rotation_at_and_near_the_pole(
    angles: tuple[float, float, float],
) -> None:
    """At the pole B is known to the square root of rounding alone, yet the rotation holds."""
    rotation = rotation_of(angles)
    assert np.abs(rotation_of(angles_of(rotation)) - rotation).max() <= 3e-9


@given(away_from_pole)
def test_angles_come_back_away_from_the_pole(angles: tuple[float, float, float]) -> None:
    assert oracles.angle_gap(angles_of(rotation_of(angles)), angles) <= 1e-13


@given(rpy)
def test_angles_are_principal(angles: tuple[float, float, float]) -> None:
    phi, theta, psi = angles_of(rotation_of(angles))
    assert -math.pi <= phi <= math.pi
    assert -HALF <= theta <= HALF
    assert -math.pi <= psi <= math.pi


@pytest.mark.parametrize("sign", [1, -1])
def test_a_is_zero_at_the_pole(sign: int) -> None:
    """Only A - C (or A + C) is defined there; the stated choice is A = 0."""
    rotation = oracles.rotation(2, 0.7) @ np.array([[0, 0, sign], [0, 1, 0], [-sign, 0, 0.0]])
    phi, theta, psi = angles_of(rotation)
    assert (phi, theta) == (0.0, sign * HALF)
    assert psi == pytest.approx(-sign * 0.7, abs=1e-15)


@given(away_from_pole, st.lists(sg.rate, min_size=3, max_size=3))
def test_rate_matrix_turns_angle_rates_into_angular_velocity(
    angles: tuple[float, float, float], rates: list[float]
) -> None:
    """Against the rotation itself: [omega]x = R' R^T by central differences."""
    h = 1e-6
    a, d = np.array(angles), np.array(rates)
    turning = (rotation_of(a + h * d) - rotation_of(a - h * d)) / (2 * h) @ rotation_of(a).T
    omega = np.array([turning[2, 1], turning[0, 2], turning[1, 0]])
    ours = np.array(orientation.rate_matrix(FLOATS.trig(angles)), dtype=float) @ d
    assert np.abs(ours - omega).max() <= 1e-8


@given(away_from_pole)
def test_inverse_rate_matrix_inverts(angles: tuple[float, float, float]) -> None:
    cs = FLOATS.trig(angles)
    b, back = (
        np.array(m(cs), dtype=float)
        for m in (orientation.rate_matrix, orientation.inverse_rate_matrix)
    )
    assert np.abs(b @ back - np.eye(3)).max() <= 1e-14
    assert np.abs(back - np.linalg.inv(b)).max() <= 1e-11


@given(rpy, st.lists(sg.rate, min_size=3, max_size=3))
def test_rate_matrix_dot_is_its_derivative(
    angles: tuple[float, float, float], rates: list[float]
) -> None:
    cs = list(zip(*duals.dual_turns(*oracles.turns(angles), rates), strict=True))
    rows = [[v + duals.Dual(0.0) for v in row] for row in orientation.rate_matrix(cs)]
    ours = np.array(orientation.rate_matrix_dot(FLOATS.trig(angles), rates), dtype=object).astype(
        float
    )
    assert np.abs(ours - duals.eps(rows).astype(float)).max() <= 1e-14


def test_arrays_give_the_same_as_one_at_a_time(robot: kr16cli.Robot) -> None:
    poses = robot.fk(np.random.default_rng(3).uniform(-3, 3, (5, 4, 6)))
    poses[0, 0, :3, :3] = rotation_of((0.3, HALF, 0.0))
    angles = robot.rpy(poses)
    assert angles.shape == (5, 4, 3)
    assert robot.rate_matrix(angles).shape == (5, 4, 3, 3)
    for index in np.ndindex(5, 4):
        assert angles[index] == pytest.approx(angles_of(poses[index][:3, :3]), abs=1e-15)
        b = np.array(orientation.rate_matrix(FLOATS.trig(angles[index])), dtype=float)
        assert robot.rate_matrix(angles)[index] == pytest.approx(b, abs=1e-15)


def test_pose_distance_is_accurate_for_small_angles() -> None:
    base = np.eye(4)
    for angle in (0.0, 1e-15, 1e-9, 1e-3, 1.0, 3.0, math.pi):
        other = np.eye(4)
        other[:3, :3] = oracles.rotation(1, angle)
        other[:3, 3] = (3 * angle, 0, 4 * angle)
        position, turn = orientation.pose_distance(base.tolist(), other.tolist(), FLOATS)
        assert position == pytest.approx(5 * angle, rel=1e-15)
        # Half a turn leaves the sine at its flat top: the square root of rounding is lost.
        assert turn == pytest.approx(angle, rel=1e-14 if angle < 3 else 1e-7)
