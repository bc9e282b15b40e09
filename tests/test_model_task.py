"""Task-space dynamics of section 3.6 for x = (p, phi, theta, psi) of the flange."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given

import kr16cli
import oracles
import strategies as sg
from kr16cli.errors import NoAnswerError

ARM = kr16cli.Arm(kr16cli.load_data())
G = ARM.geometry


def state(q: np.ndarray) -> np.ndarray:
    """(p, phi, theta, psi) of the flange, from the oracle's pose, away from theta = 90 deg."""
    pose = oracles.flange(G, *oracles.turns(q))
    r = pose[:3, :3]
    theta = np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0]))
    angles = np.arctan2(r[1, 0], r[0, 0]), theta, np.arctan2(r[2, 1], r[2, 2])
    return np.array([*pose[:3, 3], *angles])


def turned(difference: np.ndarray) -> np.ndarray:
    """Differences of states with angles brought to (-pi, pi]."""
    angles = np.remainder(difference[3:] + np.pi, 2 * np.pi) - np.pi
    return np.concatenate([difference[:3], angles])


def away(q: list[float]) -> None:
    """Only configurations off theta = +-90 deg; `sg.regular` is off the singularities."""
    assume(abs(np.cos(state(np.array(q))[4])) > 0.05)


@given(sg.regular)
def test_analytic_jacobian_is_the_derivative_of_the_state(q: list[float]) -> None:
    away(q)
    h = 1e-6
    zeros = [0.0] * 6
    ours = np.array(ARM.task_space(q, zeros).jacobian)
    for i, unit in enumerate(h * np.eye(6)):
        slope = turned(state(np.array(q) + unit) - state(np.array(q) - unit)) / (2 * h)
        assert ours[:, i] == pytest.approx(slope, abs=1e-6)


@given(sg.regular, sg.rates)
def test_its_rate_is_its_derivative_along_the_motion(q: list[float], qd: list[float]) -> None:
    away(q)
    h = 1e-7
    ours = np.array(ARM.task_space(q, qd).jacobian_dot)
    ahead, behind = (
        np.array(ARM.task_space((np.array(q) + s * h * np.array(qd)).tolist(), qd).jacobian)
        for s in (1, -1)
    )
    assert np.abs(ours - (ahead - behind) / (2 * h)).max() <= 1e-4 * (1 + np.abs(ours).max())


@given(sg.regular, sg.rates, sg.rates)
def test_task_forces_move_the_state(q: list[float], qd: list[float], qdd: list[float]) -> None:
    """Mx x'' + Cx x' + Gx = Ja^-T tau with x' = Ja q', x'' = Ja q'' + Ja' q'."""
    away(q)
    task = ARM.task_space(q, qd)
    Mx, Cx, Gx, Ja, rate = (np.array(v) for v in task)
    speed = Ja @ qd
    push = Ja @ qdd + rate @ qd
    force = np.linalg.solve(Ja.T, ARM.inverse_dynamics(q, qd, qdd))
    terms = np.abs(Mx) @ np.abs(push) + np.abs(Cx) @ np.abs(speed) + np.abs(Gx)
    assert np.abs(Mx @ push + Cx @ speed + Gx - force).max() <= 1e-10 * terms.max()


@given(sg.regular, sg.rates)
def test_task_matrices_hold_the_joint_space_properties(q: list[float], qd: list[float]) -> None:
    """Mx symmetric positive definite, and x'^T (Mx' - 2 Cx) x' = 0."""
    away(q)
    Mx, Cx, _, Ja, rate = (np.array(v) for v in ARM.task_space(q, qd))
    assert np.abs(Mx - Mx.T).max() <= 1e-11 * np.abs(Mx).max()
    assert (np.linalg.eigvalsh((Mx + Mx.T) / 2) > 0).all()
    speed, M = Ja @ qd, np.array(ARM.mass_matrix(q))
    C = np.array(ARM.coriolis_matrix(q, qd))
    back = np.linalg.inv(Ja)
    mass_rate = back.T @ (C + C.T) @ back - Mx @ rate @ back - (Mx @ rate @ back).T
    power = speed @ (mass_rate - 2 * Cx) @ speed
    scale = np.abs(speed) @ (np.abs(mass_rate) + np.abs(Cx)) @ np.abs(speed)
    assert abs(power) <= 1e-10 * (scale + 1)
    assert speed @ Mx @ speed == pytest.approx(qd @ M @ qd, rel=1e-9, abs=1e-12)


def test_arrays_give_the_same_as_one_at_a_time(robot: kr16cli.Robot) -> None:
    rng = np.random.default_rng(30)
    q, qd = rng.uniform(-1, 1, (5, 1, 6)), rng.uniform(-2, 2, (3, 6))
    q[..., 4] += 1.5
    many = robot.task_space(q, qd)
    assert [v.shape for v in many] == [(5, 3, 6, 6)] * 2 + [(5, 3, 6)] + [(5, 3, 6, 6)] * 2
    for i in range(5):
        for j in range(3):
            one = robot.task_space(q[i, 0], qd[j])
            for a, b in zip(one, many, strict=True):
                assert np.asarray(a) == pytest.approx(b[i, j], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("q", "word"),
    [
        ([0, -np.pi / 2, np.pi / 2, 0, 0.0, 0], "B ="),  # home: the flange looks forward
        ([0, -1.2, 1.4, 0, 0.0, 0], "wrist"),
        ([0, -1.2, sg.STRAIGHT, 0.5, 1.0, 0], "elbow"),
        (sg.on_shoulder([0.3, 0, 0, 0.5, 0.7, 0.2], 0.8, 1, 0.0), "shoulder"),
    ],
)
def test_singular_places_have_no_task_space(q: list[float], word: str) -> None:
    with pytest.raises(NoAnswerError, match=word):
        ARM.task_space(q, [0.0] * 6)
