"""Jacobian of any point on any link, its rate, its determinant and the singular families."""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import duals
import kr16cli
import oracles
import strategies as sg
from kr16cli.model import chain, forward, jacobian
from kr16cli.model.scalars import FLOATS
from kr16cli.model.view import Axes, View

ARM = kr16cli.Arm(kr16cli.load_data())
G = ARM.geometry
STEP = 1e-20  # complex step: no difference is formed, so no rounding limits how small it is

links = st.integers(1, 6)
points = st.none() | st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3)
axes = st.sampled_from(get_args(Axes))


def floats(rows: Any) -> np.ndarray:
    return np.array(rows, dtype=object).astype(float)


def frame_of(cs: Any, link: int) -> Any:
    """The frame a point of `link` is given in: frame i of Table 3.1, the flange for link 6."""
    frames = chain.frames(cs, G)
    return chain.flange_of_frame6(frames[6]) if link == 6 else frames[link]


def complex_turns(q: list[float], direction: np.ndarray) -> list[tuple[complex, complex]]:
    """(cos, sin) pairs of q + i STEP direction."""
    angles = [complex(v, STEP * d) for v, d in zip(q, direction, strict=True)]
    return [(cmath.cos(a), cmath.sin(a)) for a in angles]


def rotation_to(q: list[float], named: str) -> np.ndarray:
    """Rotation from robroot's axes to the named ones."""
    if named == "flange":
        return oracles.flange(G, *oracles.turns(q))[:3, :3].T
    return np.eye(3) if named == "robroot" else oracles.ROBROOT_OF_BASE[:3, :3].T.astype(float)


@given(sg.everywhere, links, points, axes)
def test_columns_are_the_complex_step_derivatives(
    q: list[float], link: int, point: list[float] | None, named: str
) -> None:
    """Linear rows: derivative of the point; angular rows: [w]x = R' R^T; any point, any axes."""
    ours = floats(View(G, link, point, named).jacobian(FLOATS.trig(q)))
    expected = np.zeros((6, 6))
    place = point or [0.0, 0.0, 0.0]
    rotation = floats(frame_of(FLOATS.trig(q), link).rows())[:3, :3]
    for i, unit in enumerate(np.eye(6)):
        frame = frame_of(complex_turns(q, unit), link)
        rows = np.array([[complex(v) for v in row] for row in frame.rows()])
        moved = (rows @ np.array([*place, 1.0])).imag / STEP
        turning = rows[:3, :3].imag / STEP @ rotation.T
        expected[:, i] = [*moved[:3], turning[2, 1], turning[0, 2], turning[1, 0]]
    turn = rotation_to(q, named)
    expected = np.vstack([turn @ expected[:3], turn @ expected[3:]])
    assert np.abs(ours - expected).max() <= 1e-14


@given(sg.generic, links, points)
def test_columns_are_central_differences(
    q: list[float], link: int, point: list[float] | None
) -> None:
    h = 1e-6
    ours = np.array(ARM.jacobian(q, link=link, point=point))[:3]
    place = np.array([*(point or [0.0, 0.0, 0.0]), 1.0])

    def position(angles: np.ndarray) -> np.ndarray:
        return (floats(frame_of(FLOATS.trig(angles), link).rows()) @ place)[:3]

    for i, unit in enumerate(h * np.eye(6)):
        slope = (position(np.array(q) + unit) - position(np.array(q) - unit)) / (2 * h)
        assert ours[:, i] == pytest.approx(slope, abs=1e-9)


@given(sg.everywhere, links, points)
def test_jacobian_equals_the_oracles(q: list[float], link: int, point: list[float] | None) -> None:
    c, s = oracles.turns(q)
    frames = [oracles.ROBROOT_OF_BASE @ frame for frame in oracles.dh_frames(G, c, s)]
    frames[6] = oracles.flange(G, c, s)
    here = frames[link] @ np.array([*(point or [0.0, 0.0, 0.0]), 1.0])
    expected = oracles.jacobian(G, c, s, here[:3], link)
    assert np.abs(np.array(ARM.jacobian(q, link=link, point=point)) - expected).max() <= 5e-15


@given(sg.everywhere, sg.rates, links, points, axes)
def test_rate_is_the_complex_step_derivative(
    q: list[float], qd: list[float], link: int, point: list[float] | None, named: str
) -> None:
    """Of the robroot components, then shown in axes that stand still."""
    ours = floats(View(G, link, point, named).jacobian_dot(FLOATS.trig(q), qd))
    rows = View(G, link, point).jacobian(complex_turns(q, np.array(qd)))
    rate = np.array([[complex(v) for v in row] for row in rows]).imag / STEP
    turn = rotation_to(q, named)
    expected = np.vstack([turn @ rate[:3], turn @ rate[3:]])
    assert np.abs(ours - expected).max() <= 2e-14 * (1 + np.abs(qd).max())


@given(sg.generic, sg.rates)
def test_rate_is_the_central_difference_along_qd(q: list[float], qd: list[float]) -> None:
    h = 1e-6
    a, d = np.array(q), np.array(qd)
    slope = (np.array(ARM.jacobian(a + h * d)) - np.array(ARM.jacobian(a - h * d))) / (2 * h)
    assert np.abs(np.array(ARM.jacobian_dot(q, qd)) - slope).max() <= 1e-7


_turns = st.lists(
    st.fractions(-4, 4, max_denominator=20).map(oracles.rational_turn), min_size=6, max_size=6
)
_speeds = st.lists(st.fractions(-3, 3, max_denominator=9), min_size=6, max_size=6)


@settings(max_examples=20)
@given(_turns, _speeds, links)
def test_jacobian_and_rate_equal_the_oracles_exactly(
    cs: list[tuple[Fraction, Fraction]], qd: list[Fraction], link: int
) -> None:
    """On fractions, by the product of exponentials and dual numbers: no rounding anywhere."""
    g = type(G)(*(Fraction(repr(v)) for v in G))
    point = [Fraction(1, 7), Fraction(-2, 5), Fraction(3, 11)]
    c, s = (np.array(v, dtype=object) for v in zip(*cs, strict=True))
    c, s = duals.dual_turns(c, s, qd)
    frames = [oracles.ROBROOT_OF_BASE @ frame for frame in oracles.dh_frames(g, c, s)]
    frames[6] = oracles.flange(g, c, s)
    here = frames[link] @ np.array([*point, 1], dtype=object)
    expected = oracles.jacobian(g, c, s, here[:3], link)
    view = View(g, link, point)
    _assert_exact(view.jacobian(cs), duals.real(expected))
    _assert_exact(view.jacobian_dot(cs, qd), duals.eps(expected))


def _assert_exact(rows: Any, expected: np.ndarray) -> None:
    """Equal element by element; a structural zero equals 0."""
    for row, wanted in zip(rows, expected, strict=True):
        for value, other in zip(row, wanted, strict=True):
            assert (value if isinstance(value, Fraction | int) else float(value)) == other


@given(sg.everywhere)
def test_mass_centre_jacobians_move_the_mass_centres(q: list[float]) -> None:
    """(3.31): d p_ci / dq for each link, the mass centre given in the link's own frame."""
    centres = np.array(ARM.mass_centres(q))
    cs = FLOATS.trig(q)
    for link in range(1, 7):
        frame = floats(frame_of(cs, link).rows())
        local = frame[:3, :3].T @ (centres[link - 1] - frame[:3, 3])
        ours = np.array(ARM.jacobian(q, link=link, point=local.tolist()))
        expected = oracles.jacobian(G, *oracles.turns(q), centres[link - 1], link)
        assert np.abs(ours - expected).max() <= 1e-14


@given(sg.everywhere)
def test_second_mass_centre_jacobian_of_3_36(q: list[float]) -> None:
    """As printed, in the chapter's base; the mass centre lies r2 along the upper arm."""
    r2 = 0.27
    ours = np.array(ARM.jacobian(q, link=2, point=[r2 - G.a2, 0, 0], axes="chapter"))
    (c1, s1), (c2, s2) = FLOATS.trig(q[:2])
    expected = np.zeros((6, 6))
    expected[0, :2] = c1 * (G.a1 + r2 * c2), -r2 * s1 * s2
    expected[1, :2] = -s1 * (G.a1 + r2 * c2), -r2 * c1 * s2
    expected[2, 1] = -r2 * c2
    expected[3, 1], expected[4, 1], expected[5, 0] = -c1, s1, -1
    assert np.abs(ours - expected).max() <= 1e-15


@given(sg.everywhere)
def test_determinant_of_3_37_is_the_determinant(q: list[float]) -> None:
    table = oracles.jacobian(G, *oracles.turns(q))
    assert ARM.determinant(q) == pytest.approx(np.linalg.det(table), abs=2e-15)


@given(sg.everywhere)
def test_determinant_is_the_product_of_the_three_factors(q: list[float]) -> None:
    cs = FLOATS.trig(q)
    factors = (
        jacobian.wrist_factor(cs),
        jacobian.elbow_factor(cs, G),
        jacobian.shoulder_factor(cs, G),
    )
    assert ARM.determinant(q) == pytest.approx(G.a2 * math.prod(factors), abs=1e-16)


@pytest.mark.parametrize(
    ("family", "regimes"),
    [
        ("wrist", ("near_wrist", "near_wrist_pi", "singular_wrist", "singular_wrist_pi")),
        ("elbow", ("near_stretched", "near_folded", "singular_stretched", "singular_folded")),
        ("shoulder", ("near_shoulder", "singular_shoulder")),
    ],
)
@given(pick=st.data())
def test_family_is_named_and_measured(
    family: str, regimes: tuple[str, ...], pick: st.DataObject
) -> None:
    """Near one family its factor vanishes with the distance, and the arm says so."""
    q = pick.draw(st.one_of(*(sg.REGIMES[name] for name in regimes)))
    found = {s.family: s for s in ARM.singularities(q)}[family]
    reach = {
        "wrist": 1.0,
        "elbow": math.hypot(G.a3, G.d4),
        "shoulder": 0.94 + math.hypot(G.a3, G.d4),
    }
    expected = {
        "wrist": math.sin(q[4]),
        "elbow": math.hypot(G.a3, G.d4) * math.sin(q[2] - sg.STRAIGHT),
        "shoulder": float(np.dot(np.array(forward.arm(FLOATS.trig(q), G).wrist[:2]), heading(q))),
    }[family]
    assert found.factor == pytest.approx(expected, abs=5e-16)
    assert found.sine == pytest.approx(expected / reach[family], abs=1e-15)
    assert found.near == (abs(found.sine) < 1e-3)


def heading(q: list[float]) -> tuple[float, float]:
    """The horizontal direction the arm points to after A1."""
    return math.cos(q[0]), -math.sin(q[0])


@pytest.mark.parametrize("family", ["wrist", "stretched", "folded", "shoulder"])
@given(pick=st.data())
def test_jacobian_loses_rank_on_a_family(family: str, pick: st.DataObject) -> None:
    q = pick.draw(sg.REGIMES[f"singular_{family}"])
    values = np.linalg.svd(np.array(ARM.jacobian(q)), compute_uv=False)
    assert values[-1] <= 1e-15


@given(sg.regular)
def test_jacobian_has_full_rank_elsewhere(q: list[float]) -> None:
    assert np.linalg.svd(np.array(ARM.jacobian(q)), compute_uv=False)[-1] > 1e-6


@given(sg.everywhere, sg.rates)
def test_power_is_the_same_in_any_axes(q: list[float], qd: list[float]) -> None:
    """Speeds shown in other axes keep their lengths."""
    for rate in (ARM.jacobian, lambda a, axes: ARM.jacobian_dot(a, qd, axes=axes)):
        twists = [np.array(rate(q, axes=named)) @ qd for named in get_args(Axes)]
        for half in (slice(0, 3), slice(3, 6)):
            lengths = [np.linalg.norm(twist[half]) for twist in twists]
            assert np.ptp(lengths) <= 1e-13 * (1 + max(lengths))
