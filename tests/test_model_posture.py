"""Status and Turn by the published rules, worked out here in words of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

import kr16cli
import oracles
import strategies as sg
from kr16cli.model import posture

DATA = kr16cli.load_data()
G = DATA.geometry


@pytest.mark.parametrize(
    ("q_deg", "status", "turn"),
    [
        ((0, -90, 90, 0, 0, 0), 2, 0b000010),
        ((0, 0, 0, 0, 0, 0), 2, 0),
        ((91, -45, 37, 1, -1, 0), 6, 0b010010),  # turn 18, read from a controller
        ((0, -90, -2.9, 0, 10, 0), 2, 0b000110),
        ((0, -90, -3.1, 0, 10, 0), 0, 0b000110),  # the switch is at -atan(35/670) = -2.99 deg
        ((0, -150, 10, 0, 10, 0), 3, 0b000010),  # leaning back: the wrist is behind A1
        ((0, -90, 90, 0, -1, 0), 6, 0b010010),
        ((0, -90, 90, -1, 1, -1), 2, 0b101010),
        ((-1, -90, 90, 0, 180, 0), 6, 0b000011),
        ((0, -90, 90, 0, -180, 0), 6, 0b010010),
    ],
)
def test_table(q_deg: tuple[float, ...], status: int, turn: int) -> None:
    q = np.radians(q_deg).tolist()
    assert (posture.status(q, G), posture.turn(q)) == (status, turn)


@given(sg.generic)
def test_status_says_where_the_wrist_the_elbow_and_a5_are(q: list[float]) -> None:
    """Bit 0 from the wrist centre itself, bit 1 from the straight line through the elbow."""
    moves = oracles.motions(G, *oracles.turns(q))
    _, points = oracles.axes_and_points(G, moves)
    ahead = points[3][:2] @ [math.cos(q[0]), -math.sin(q[0])]
    upper, fore = points[2] - points[1], points[3] - points[2]
    normal = np.array([-math.sin(q[0]), -math.cos(q[0]), 0.0])
    bend = np.cross(upper, fore) @ normal  # sign of the elbow, about the axis of A3 reversed
    expected = (ahead < 0) + 2 * (bend <= 0) + 4 * (q[4] < 0)
    if min(abs(ahead), abs(bend), abs(q[4])) > 1e-9:
        assert posture.status(q, G) == expected


@given(sg.generic)
def test_turn_has_a_bit_for_each_negative_angle(q: list[float]) -> None:
    if min(map(abs, q)) > 1e-9:
        bits = [posture.turn(q) >> i & 1 for i in range(6)]
        assert bits == [int(v < 0) for v in q]


@given(sg.regular)
def test_status_names_each_of_the_eight_solutions(q: list[float]) -> None:
    """S of the rows that are there: all different, so that S and a pose choose a row."""
    arm = kr16cli.Arm(DATA)
    rows = [r for r in arm.ik(arm.fk(q)).angles if not np.isnan(r).any()]
    assert len({posture.status(r, G) for r in rows}) == len(rows)


def test_arrays_keep_the_leading_shape(robot: kr16cli.Robot) -> None:
    q = np.random.default_rng(40).uniform(-6, 6, (3, 2, 6))
    status, turn = robot.status_turn(q)
    assert status.shape == turn.shape == (3, 2)
    assert status.dtype == turn.dtype == np.int64
    for index in np.ndindex(3, 2):
        assert status[index] == posture.status(q[index].tolist(), G)
        assert turn[index] == posture.turn(q[index].tolist())
