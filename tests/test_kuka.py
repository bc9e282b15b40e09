"""KUKA's edge: A, B, C, Status and Turn, full turns, payload, KRL text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kr16cli import RobotData, kuka, units
from kr16cli.errors import InputError
from kr16cli.krl import format_e6axis, format_e6pos, parse_krl

_ANGLES = st.one_of(
    st.floats(-180, 180),
    st.sampled_from([0.0, 45.0, -45.0, 90.0, -90.0, 180.0, -180.0, 89.9999999, 90 - 1e-10]),
)
_LENGTHS = st.floats(-5000, 5000)
_POSES = st.tuples(_LENGTHS, _LENGTHS, _LENGTHS, _ANGLES, _ANGLES, _ANGLES)


def _gap(a: list[list[float]], b: list[list[float]]) -> float:
    return max(abs(x - y) for r, s in zip(a, b, strict=True) for x, y in zip(r, s, strict=True))


@given(_POSES)
def test_printed_pose_reproduces_the_matrix(pose: tuple[float, ...]) -> None:
    T = kuka.matrix_from_pose(pose)
    again = kuka.matrix_from_pose(kuka.pose_from_matrix(T))
    # A is 0 by choice where hypot(r11, r21) < 1e-9, which turns by at most as much.
    assert _gap(T, again) < 2e-9


@given(st.floats(-180, 180), st.floats(-89.99, 89.99), st.floats(-180, 180))
def test_angles_come_back_away_from_the_pole(a: float, b: float, c: float) -> None:
    *_, a2, b2, c2 = kuka.pose_from_matrix(kuka.matrix_from_pose((0, 0, 0, a, b, c)))
    for angle, again in ((a, a2), (b, b2), (c, c2)):
        assert abs(math.remainder(angle - again, 360)) < 1e-9


@pytest.mark.parametrize(("b", "c"), [(90.0, 30.0), (-90.0, 30.0), (90.0, 0.0)])
def test_a_is_zero_at_the_poles(b: float, c: float) -> None:
    T = kuka.matrix_from_pose((0, 0, 0, 20.0, b, c))
    a, b2, c2 = kuka.pose_from_matrix(T)[3:]
    assert a == 0.0
    assert b2 == pytest.approx(b)
    assert c2 == pytest.approx(c - 20.0 if b > 0 else c + 20.0)


def test_home_is_exact_and_without_negative_zero() -> None:
    pose = kuka.pose_from_matrix(kuka.matrix_from_pose((1088, 0, 1320, 0, 90, 0)))
    assert pose == [1088.0, 0.0, 1320.0, 0.0, 90.0, 0.0]
    assert all(math.copysign(1, v) == 1 for v in pose)


def test_half_turns_are_positive() -> None:
    R = [[-1.0, -0.0, 0.0], [-0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    assert kuka.abc_from_matrix(R) == (math.pi, 0.0, 0.0)
    R = [[1.0, 0.0, 0.0], [0.0, -1.0, -0.0], [0.0, -0.0, -1.0]]
    assert kuka.abc_from_matrix(R) == (0.0, 0.0, math.pi)


@given(_POSES)
def test_si_and_edge_units_agree(pose: tuple[float, ...]) -> None:
    si = [*(units.metres(v) for v in pose[:3]), *(units.rad(v) for v in pose[3:])]
    assert _gap(kuka.matrix_from_pose(pose), kuka.matrix_from_pose(si, si=True)) < 1e-15


# Status by rule (robot data, section 4): bit 1 switches at A3 = -atan(35/670) = -2.9903 deg.
@pytest.mark.parametrize(
    ("q_deg", "status"),
    [
        ((0, -90, 90, 0, 0, 0), 2),
        ((0, -90, 90, 0, -10, 0), 6),
        ((0, -90, -2.98, 0, 10, 0), 2),
        ((0, -90, -3.0, 0, 10, 0), 0),
        ((0, -155, 100, 0, 10, 0), 2),
        ((0, -150, 0, 0, 10, 0), 3),
        ((0, -150, -30, 0, -10, 0), 5),
    ],
)
def test_status_by_rule(data: RobotData, q_deg: tuple[float, ...], status: int) -> None:
    assert kuka.status([units.rad(v) for v in q_deg], data.geometry) == status


@pytest.mark.parametrize(
    ("q_deg", "turn"),
    [
        ((91, -45, 37, 1, -1, 0), 18),  # $AXIS_ACT published with its T
        ((0, -90, 90, 0, 0, 0), 2),
        ((-1, -1, -1, -1, -1, -1), 63),
        ((1e-13, -1e-13, 0, 0, 0, 0), 0),
    ],
)
def test_turn_by_rule(q_deg: tuple[float, ...], turn: int) -> None:
    assert kuka.turn([units.rad(v) for v in q_deg]) == turn


def test_full_turns_stay_within_limits_and_start_with_the_original(data: RobotData) -> None:
    limits = [(joint.lower, joint.upper) for joint in data.joints]
    q = [units.rad(v) for v in (-179, -60, 80, 20, 30, -15)]
    variants = kuka.full_turn_variants(q, limits)
    assert variants[0] == q
    # A1 also at 181, A4 also at -340, A6 also at 345: two values each.
    assert len(variants) == 8
    assert len({kuka.turn(v) for v in variants}) == 8
    for variant in variants:
        assert all(lo - 1e-9 <= a <= hi + 1e-9 for a, (lo, hi) in zip(variant, limits, strict=True))
        assert all(
            abs(math.remainder(a - b, math.tau)) < 1e-12 for a, b in zip(variant, q, strict=True)
        )


def test_full_turns_keep_an_angle_that_no_turn_brings_inside() -> None:
    limits = [(0.0, 1.0)] * 6
    assert kuka.full_turn_variants([2.0] * 6, limits) == [[2.0] * 6]


def test_full_turns_bring_an_angle_inside() -> None:
    limits = [(0.0, 6.0)] * 6
    (variant,) = kuka.full_turn_variants([-1.0, 1.0, 1.0, 1.0, 1.0, 1.0], limits)
    assert variant[0] == pytest.approx(math.tau - 1.0)


def test_turn_switch_is_near_but_not_at_zero() -> None:
    q = [units.rad(v) for v in (0.0, 1.0, 1.0, 1.9, 1.0, -2.1)]
    assert kuka.near_turn_switch(q) == [3]


# KRL text ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "{X 1088.0,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2}",
        " { x 1088 , y 0.0 ,Z 1.32e3, a 0, b 90., C -0, s 'B010', t 'H2' } ",
        "{E6POS: X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2,E1 0.0,E2 0,E3 0,E4 0,E5 0,E6 0}",
        "DECL E6POS XP1={X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2}",
        "decl global e6pos xp1 = {X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2} ; home",
        "POS P[3]={X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2}\n",
        "$POS_ACT={T 2,S 2,C 0,B 90,A 0,Z 1320,Y 0,X 1088}",
    ],
)
def test_positions_are_read(text: str) -> None:
    record = parse_krl(text)
    assert record.numbers(kuka.POSE_FIELDS) == [1088, 0, 1320, 0, 90, 0]
    assert (record.whole("S"), record.whole("T")) == (2, 2)


def test_what_is_left_out_is_none_and_axes_are_recognised() -> None:
    assert parse_krl("{X 1,Y 2,Z 3,A 4,B 5,C 6}").whole("S") is None
    record = parse_krl("{A1 1,A2 -2,A3 3,A4 4,A5 5,A6 6}")
    assert record.type == "E6AXIS"
    with pytest.raises(InputError, match="lacks A6"):
        parse_krl("{A1 1,A2 2,A3 3,A4 4,A5 5}").numbers(kuka.AXIS_FIELDS)


@pytest.mark.parametrize(
    ("text", "at", "why"),
    [
        ("", 1, "expected an aggregate"),
        ("X 1", 1, "expected an aggregate"),
        ("{", 2, "field name, the text ends"),
        ("{}", 2, "field name, found '}'"),
        ("{X}", 3, "X needs a number, found '}'"),
        ("{X 1,Y abc}", 8, "Y needs a number, found 'abc'"),
        ("{X 1 Y 2}", 6, "expected ',' or '}' after X"),
        ("{X 1,X 2}", 6, "given twice"),
        ("{X 1,A1 2}", 6, "unknown field A1"),
        ("{Q 1}", 2, "unknown field Q"),
        ("{X 1", 5, "expected ',' or '}' after X, the text ends"),
        ("{X 1} {Y 2}", 7, "nothing may follow"),
        ("{S 2.5}", 4, "whole number"),
        ("{T -1}", 4, "whole number"),
        ("{X 1e999}", 4, "too large"),
        ("{X nan}", 4, "needs a number"),
        ("{X 1.2.3}", 4, "needs a number"),
        ("{S 'B12'}", 4, "needs a number"),
        ("{WRONG: X 1}", 2, "unknown type WRONG"),
        ("{M 1,CM 3}", 9, "inner aggregate"),
    ],
)
def test_malformed_text_is_pointed_at(text: str, at: int, why: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_krl(text)
    message = str(caught.value)
    assert f"character {at}: " in message
    assert why in message
    assert "\n" not in message


@given(st.text(alphabet="{}XYZABCSTE16 ,.:='-\n", max_size=40))
def test_any_text_is_read_or_refused_in_one_line(text: str) -> None:
    try:
        record = parse_krl(text)
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert record.fields


@given(_POSES, st.integers(0, 7), st.integers(0, 63))
def test_position_text_round_trip(pose: tuple[float, ...], s: int, t: int) -> None:
    record = parse_krl(format_e6pos(pose, s, t))
    assert record.numbers(kuka.POSE_FIELDS) == pytest.approx(pose, abs=1e-9)
    assert (record.whole("S"), record.whole("T")) == (s, t)


@given(st.tuples(*[_ANGLES] * 6))
def test_axis_text_round_trip(q: tuple[float, ...]) -> None:
    assert parse_krl(format_e6axis(q)).numbers(kuka.AXIS_FIELDS) == pytest.approx(q, abs=1e-9)


def test_text_has_no_negative_zero() -> None:
    assert format_e6axis([-0.0, -1e-12, 1, 2, 3, 4]).startswith("{A1 0.0,A2 0.0,A3 1")


# Payload ----------------------------------------------------------------------------------------


def test_load_data_turns_principal_moments_into_flange_axes() -> None:
    text = "{M 16,CM {X 10,Y 20,Z 120,A 90,B 0,C 0},J {X 0.1,Y 0.3,Z 0.35}}"
    load = kuka.parse_load_data(text)
    assert load.mass == 16
    assert load.com == pytest.approx((0.010, 0.020, 0.120))
    assert load.inertia == pytest.approx((0.3, 0.1, 0.35, 0, 0, 0))


def test_payload_of_numbers_and_of_text_agree() -> None:
    numbers = kuka.payload_from_numbers([16, 10, 20, 120, 0.36, 0.36, 0.36])
    text = "{M 16,CM {X 10,Y 20,Z 120,A 11,B 22,C 33},J {X 0.36,Y 0.36,Z 0.36}}"
    other = kuka.parse_load_data(text)
    assert numbers.com == other.com
    assert numbers.inertia == pytest.approx(other.inertia, abs=1e-15)
    assert kuka.payload_from_numbers([16, 0.01, 0.02, 0.12], si=True).com == numbers.com


@pytest.mark.parametrize(
    ("numbers", "why"),
    [
        ([-1, 0, 0, 0], "mass is -1 kg"),
        ([1, 0, 0, 0, -0.1, 0.1, 0.1], "negative"),
        ([1, 0, 0, 0, 0.1, 0.1, 0.3], "no rigid body"),
    ],
)
def test_impossible_payloads_are_refused(numbers: list[float], why: str) -> None:
    with pytest.raises(InputError, match=why):
        kuka.payload_from_numbers(numbers)


def test_load_data_must_be_load_data() -> None:
    with pytest.raises(InputError, match="LOAD_DATA"):
        kuka.parse_load_data("{X 1}")
