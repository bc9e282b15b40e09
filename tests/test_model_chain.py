"""Forward kinematics: two forms in the package, two more in the oracles, and poses by hand."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kr16cli
import oracles
import strategies as sg
from kr16cli.model import chain, forward
from kr16cli.robot import Geometry

KR16 = Geometry(0.675, 0.260, 0.680, 0.035, 0.670, 0.158)
ARMS = [KR16, Geometry(0.675, 0.260, 0.680, 0.035, 0.970, 0.115), Geometry(0.4, 0, 0.5, 0, 0.3, 0)]

ULP = 2e-15  # m; coordinates below 2 m have units of 2.2e-16, and a dozen operations

arms = st.sampled_from(ARMS)
rational = st.fractions(-5, 5, max_denominator=50)
rational_turns = st.lists(rational.map(oracles.rational_turn), min_size=6, max_size=6)
lengths = st.fractions(-2, 2, max_denominator=100)
rational_arms = st.builds(Geometry, *[lengths] * 6)


def pairs(q: list[float]) -> list[tuple[float, float]]:
    return [(math.cos(v), math.sin(v)) for v in q]


def matrix(frame: chain.Frame) -> np.ndarray:
    return np.array(frame.rows(), dtype=float)


@given(sg.everywhere, arms)
def test_closed_form_equals_the_product_of_dh_transforms(q: list[float], g: Geometry) -> None:
    product = chain.flange_of_frame6(chain.frames(pairs(q), g)[6])
    assert np.abs(matrix(product) - matrix(forward.flange(pairs(q), g))).max() <= ULP


@settings(max_examples=30)
@given(rational_turns, rational_arms)
def test_closed_form_equals_the_product_exactly(
    cs: list[tuple[Fraction, Fraction]], g: Geometry
) -> None:
    product = chain.flange_of_frame6(chain.frames(cs, g)[6]).rows()
    closed = forward.flange(cs, g).rows()
    for a, b in zip(product[:3], closed[:3], strict=True):
        assert a == b
        assert all(isinstance(v, Fraction) for v in b)


@settings(max_examples=30)
@given(rational_turns, rational_arms)
def test_flange_equals_the_product_of_exponentials_exactly(
    cs: list[tuple[Fraction, Fraction]], g: Geometry
) -> None:
    c, s = (np.array(v, dtype=object) for v in zip(*cs, strict=True))
    assert forward.flange(cs, g).rows() == oracles.flange(g, c, s).tolist()


@settings(max_examples=30)
@given(rational_turns, rational_arms)
def test_every_frame_equals_the_literal_table_exactly(
    cs: list[tuple[Fraction, Fraction]], g: Geometry
) -> None:
    c, s = (np.array(v, dtype=object) for v in zip(*cs, strict=True))
    table = oracles.dh_frames(g, c, s)
    ours = [np.array(f.rows(), dtype=object) for f in chain.frames(cs, g, chain.CHAPTER_BASE)]
    for i, (a, b) in enumerate(zip(ours, table, strict=True)):
        assert (np.vectorize(float)(a) == b).all() if i == 0 else (a[:3] - b[:3] == 0).all()


@given(sg.everywhere, arms)
def test_robroot_is_the_chapters_base_turned_by_minus_90_degrees(
    q: list[float], g: Geometry
) -> None:
    """The same numbers, rows exchanged: no rounding separates the two bases."""
    in_base = chain.frames(pairs(q), g, chain.CHAPTER_BASE)
    in_robroot = chain.frames(pairs(q), g)
    for a, b in zip(in_base, in_robroot, strict=True):
        assert (oracles.ROBROOT_OF_BASE @ matrix(a) == matrix(b)).all()


@given(sg.everywhere, arms)
def test_flange_is_frame_6_turned_half_a_turn(q: list[float], g: Geometry) -> None:
    frame6 = chain.frames(pairs(q), g)[6]
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    assert (matrix(chain.flange_of_frame6(frame6)) == matrix(frame6) @ half_turn).all()


@given(sg.everywhere, arms)
def test_every_frame_is_a_proper_rotation(q: list[float], g: Geometry) -> None:
    for frame in [*chain.frames(pairs(q), g), forward.flange(pairs(q), g)]:
        r = matrix(frame)[:3, :3]
        assert np.abs(r.T @ r - np.eye(3)).max() <= 4e-15
        assert np.linalg.det(r) == pytest.approx(1, abs=4e-15)


@given(sg.everywhere, arms)
def test_wrist_centre_of_3_8_is_the_origin_of_frames_4_and_5(q: list[float], g: Geometry) -> None:
    links = chain.frames(pairs(q), g)
    centre = np.array(forward.arm(pairs(q), g).wrist, dtype=float)
    pose = matrix(forward.flange(pairs(q), g))
    for other in (links[4].p, links[5].p, pose[:3, 3] - g.d6 * pose[:3, 2]):
        assert np.abs(np.array(other, dtype=float) - centre).max() <= ULP


@given(sg.everywhere, arms)
def test_r36_of_3_22_is_frame_6_seen_from_frame_3(q: list[float], g: Geometry) -> None:
    links = chain.frames(pairs(q), g)
    seen = matrix(links[3])[:3, :3].T @ matrix(links[6])[:3, :3]
    assert np.abs(seen - np.array(forward.r36(pairs(q)))).max() <= ULP


@given(sg.everywhere, arms)
def test_joint_frames_stand_on_their_joint_axes(q: list[float], g: Geometry) -> None:
    c, s = oracles.turns(q)
    z, o = oracles.axes_and_points(g, oracles.motions(g, c, s))
    links = chain.frames(pairs(q), g)
    for i, frame in enumerate(chain.joint_frames(links, g)):
        m = matrix(frame)
        assert np.abs(m[:3, 2] - z[i]).max() <= ULP
        assert np.abs(np.cross(m[:3, 3] - o[i], z[i])).max() <= ULP
        assert np.abs(m[:3, 0] - matrix(links[i + 1])[:3, 0]).max() <= ULP
        assert np.linalg.det(m[:3, :3]) == pytest.approx(1, abs=4e-15)


@pytest.mark.parametrize(
    ("q_deg", "position", "z_axis"),
    [
        ((0, 0, 0, 0, 0, 0), (1.768, 0, 0.640), (1, 0, 0)),
        ((0, -90, 90, 0, 0, 0), (1.088, 0, 1.320), (1, 0, 0)),
        ((90, -90, 90, 0, 0, 0), (0, -1.088, 1.320), (0, -1, 0)),
        ((0, 0, -90, 0, 0, 0), (0.975, 0, 1.503), (0, 0, 1)),
        ((0, -90, 90, 0, 90, 0), (0.930, 0, 1.162), (0, 0, -1)),
        ((0, -90, 90, 90, 90, 0), (0.930, -0.158, 1.320), (0, -1, 0)),
        ((0, -90, 0, 0, 0, 180), (0.295, 0, 2.183), (0, 0, 1)),
    ],
)
def test_pose_worked_out_by_hand(
    robot: kr16cli.Robot,
    q_deg: tuple[float, ...],
    position: tuple[float, ...],
    z_axis: tuple[float, ...],
) -> None:
    pose = robot.fk(np.radians(q_deg))
    assert pose[:3, 3] == pytest.approx(position, abs=1e-15)
    assert pose[:3, 2] == pytest.approx(z_axis, abs=1e-15)


def test_zero_pose_has_b_of_90_degrees(robot: kr16cli.Robot) -> None:
    assert robot.fk(np.zeros(6)).tolist() == oracles.zero_flange(KR16).tolist()


@pytest.mark.parametrize("name", ["kr16_2", "kr16_l6", "chapter3"])
def test_shipped_arm_equals_the_product_of_exponentials(name: str) -> None:
    arm = kr16cli.load_robot(name)
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (1000, 6))
    expected = oracles.flange(arm.data.geometry, *oracles.turns(q))
    assert np.abs(arm.fk(q) - expected).max() <= ULP
