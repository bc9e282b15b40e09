"""Wanted motions: profiles, joint moves, splines, paths of the flange, programs."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import kr16cli
from kr16cli.errors import FileError, NoAnswerError
from kr16cli.simulate.build import make_reference
from kr16cli.simulate.core import Reference, Setpoint
from kr16cli.simulate.krl_program import Pace, load_program, program
from kr16cli.simulate.motion_spec import ReferenceSpec
from kr16cli.simulate.paths import (
    Circle,
    Line,
    PathMove,
    PathSpeed,
    Turn,
    arc_through,
    tracking_error,
)
from kr16cli.simulate.profiles import Quintic, Trapezoid, make_profile
from kr16cli.simulate.references import Chain, Hold, JointMove, Spline, greatest_speeds
from kr16cli.single import Arm

START = [math.radians(v) for v in (0, -80, 95, 0, 60, 0)]
END = [math.radians(v) for v in (40, -60, 80, 60, -30, 90)]


@pytest.fixture(scope="module")
def arm(data: kr16cli.RobotData) -> Arm:
    return Arm(data)


@pytest.fixture(scope="module")
def pace(arm: Arm) -> Pace:
    speed = greatest_speeds(arm.data.joints)
    return Pace("quintic", speed, [4.0 * v for v in speed], PathSpeed(0.5, 2.0))


def assert_consistent(reference: Reference, count: int = 40, tolerance: float = 1e-5) -> None:
    """Speeds and accelerations are the rates of what they claim to be, joints and flange."""
    kinks = np.array([0.0, *reference.breaks, reference.duration])
    h = 1e-5
    for t in np.linspace(0.0, reference.duration, count + 2)[1:-1].tolist():
        if np.abs(kinks - t).min() < 2 * h:
            continue
        before, now, after = (reference.joint(t + k * h) for k in (-1, 0, 1))
        assert (np.subtract(after.q, before.q) / (2 * h)) == pytest.approx(now.qd, abs=tolerance)
        assert (np.subtract(after.qd, before.qd) / (2 * h)) == pytest.approx(
            now.qdd, abs=100 * tolerance
        )
        early, task, late = (reference.task(t + k * h) for k in (-1, 0, 1))
        rate = np.subtract(late.position, early.position) / (2 * h)
        assert rate == pytest.approx(task.twist[:3], abs=tolerance)
        assert np.subtract(late.twist, early.twist) / (2 * h) == pytest.approx(
            task.acceleration, abs=100 * tolerance
        )
        turned = np.subtract(late.rotation, early.rotation) / (2 * h) @ np.transpose(task.rotation)
        spin = [turned[2, 1], turned[0, 2], turned[1, 0]]
        assert spin == pytest.approx(task.twist[3:], abs=tolerance)


def assert_closed(arm: Arm, reference: Reference) -> None:
    """The joints lead the flange where it should be."""
    for t in np.linspace(0.0, reference.duration, 25).tolist():
        position, angle = tracking_error(arm, reference.joint(t).q, reference.task(t))
        assert max(position, angle) < 1e-9


# Profiles -----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [Trapezoid, Quintic])
@pytest.mark.parametrize(("rate", "acceleration"), [(0.5, 2.0), (2.0, 0.5), (3.0, 3.0)])
def test_profile_keeps_its_limits_and_uses_one(
    kind: Callable[[float, float], Trapezoid | Quintic], rate: float, acceleration: float
) -> None:
    profile = kind(rate, acceleration)
    times = np.linspace(0.0, profile.duration, 4001)
    s, v, a = np.array([profile.at(float(t)) for t in times]).T
    assert (s[0], s[-1], v[0], v[-1]) == (0.0, 1.0, 0.0, 0.0)
    assert (np.diff(s) >= 0.0).all()
    assert v.max() <= rate * (1 + 1e-9)
    assert np.abs(a).max() <= acceleration * (1 + 1e-9)
    assert max(v.max() / rate, np.abs(a).max() / acceleration) > 0.999
    assert np.gradient(s, times)[2:-2] == pytest.approx(v[2:-2], abs=2e-3)
    assert profile.at(-1.0) == (0.0, 0.0, 0.0)
    assert profile.at(profile.duration + 1.0) == (1.0, 0.0, 0.0)


def test_trapezoid_is_the_fastest() -> None:
    assert Trapezoid(0.5, 2.0).duration == pytest.approx(2.25)
    assert Trapezoid(10.0, 4.0).duration == pytest.approx(1.0)  # a triangle
    assert make_profile("quintic", 0.5, 2.0).duration == pytest.approx(3.75)


# Joint space --------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["trapezoid", "quintic"])
def test_ptp_is_straight_synchronous_and_within_limits(arm: Arm, shape: str) -> None:
    speed = greatest_speeds(arm.data.joints, 0.5)
    acceleration = [4.0] * 6
    move = JointMove(arm, START, END, shape, speed, acceleration)  # type: ignore[arg-type]
    assert move.joint(0.0).q == START
    assert move.joint(move.duration).q == END
    way = np.subtract(END, START)
    used = []
    for t in np.linspace(0.0, move.duration, 200).tolist():
        q, qd, qdd = (np.array(v) for v in move.joint(t))
        part = (q - START) / np.where(way, way, 1.0)
        assert np.ptp(part[way != 0.0]) < 1e-12
        used.append(max((np.abs(qd) / speed).max(), (np.abs(qdd) / acceleration).max()))
    assert 0.99 < max(used) <= 1.0 + 1e-9
    assert_consistent(move)


def test_ptp_without_a_way_takes_no_time(arm: Arm) -> None:
    move = JointMove(arm, START, START, "quintic", [1.0] * 6, [1.0] * 6)
    assert move.duration == 0.0
    assert move.joint(0.5).q == START


def test_spline_goes_through_its_points_smoothly(arm: Arm) -> None:
    times, points = [0.5, 1.0, 2.0, 2.5], [START, END, START, END]
    spline = Spline(arm, times, points)
    for t, q in zip(times, points, strict=True):
        assert spline.joint(t).q == pytest.approx(q, abs=1e-12)
    assert spline.joint(0.1) == (START, (0.0,) * 6, (0.0,) * 6)
    assert np.abs(spline.joint(0.5 + 1e-9).qd).max() < 1e-6
    for t in times[1:-1]:  # even accelerations do not jump
        a, b = (spline.joint(t + d).qdd for d in (-1e-9, 1e-9))
        assert a == pytest.approx(b, abs=1e-5)
    assert_consistent(spline)


def test_spline_that_swings_beyond_a_limit_is_refused(arm: Arm) -> None:
    lower = arm.data.joints[1].lower
    near = [*START]
    near[1] = lower + 0.01
    with pytest.raises(NoAnswerError, match=r"at .* s needs A2 = -1[5-9].*lower limit is -155 deg"):
        Spline(arm, [0.0, 1.0, 1.3, 2.3], [START, near, near, START])
    with pytest.raises(NoAnswerError, match=r"at .* deg/s, its limit is"):
        Spline(arm, [0.0, 0.3], [START, END])


def test_chain_runs_its_parts_in_turn(arm: Arm) -> None:
    move = JointMove(arm, START, END, "trapezoid", [2.0] * 6, [8.0] * 6)
    chain = Chain([Hold(arm, START, 0.5), move, Hold(arm, END, 0.25)])
    assert chain.duration == pytest.approx(0.75 + move.duration)
    assert chain.joint(0.3).q == START
    assert chain.joint(0.5 + 0.3) == move.joint(0.8 - 0.5)
    assert chain.joint(99.0).q == END
    assert set(chain.breaks) == {0.5 + b for b in move.breaks}


def test_setpoint_tells_the_flange(arm: Arm) -> None:
    qd = [0.3, -0.2, 0.1, 0.5, -0.4, 0.2]
    task = Setpoint(arm, START, qd).task(3.0)
    assert task.twist == pytest.approx(np.array(arm.jacobian(START)) @ qd)
    assert task.acceleration == pytest.approx(np.array(arm.jacobian_dot(START, qd)) @ qd)


# Paths of the flange ------------------------------------------------------------------------


def test_line_is_straight_and_turns_evenly(arm: Arm) -> None:
    T = np.array(arm.fk(START))
    turn = Turn((0.6, 0.0, 0.8), 0.7)
    end = (np.array(turn.matrix(1.0)) @ T[:3, :3]).tolist()
    goal = (T[:3, 3] + [0.1, 0.3, -0.2]).tolist()
    line = Line(T[:3, 3].tolist(), goal)
    move = PathMove(arm, START, line, end, "trapezoid", PathSpeed(0.5, 2.0))
    assert_consistent(move, tolerance=1e-4)
    assert_closed(arm, move)
    last = move.task(move.duration)
    assert last.position == pytest.approx(goal, abs=1e-12)
    assert np.array(last.rotation) == pytest.approx(np.array(end), abs=1e-12)
    speeds = [np.linalg.norm(move.task(t).twist[:3]) for t in np.linspace(0, move.duration, 99)]
    assert max(speeds) <= 0.5 + 1e-12
    for t in np.linspace(0.0, move.duration, 9):
        along = np.subtract(move.task(float(t)).position, T[:3, 3])
        assert np.linalg.norm(np.cross(along, [0.1, 0.3, -0.2])) < 1e-12


def test_circle_returns_to_its_start(arm: Arm) -> None:
    spec = ReferenceSpec("circle", centre=(0.0, 0.0, -0.1), normal=(2.0, 0.0, 0.0))
    move = make_reference(spec, arm, START)
    here = np.array(arm.fk(START))[:3, 3]
    for t in np.linspace(0.0, move.duration, 20).tolist():
        assert np.linalg.norm(
            np.subtract(move.task(t).position, [here[0], here[1], here[2] - 0.1])
        ) == pytest.approx(0.1, abs=1e-12)
    assert move.joint(move.duration).q == pytest.approx(START, abs=1e-9)
    assert_consistent(move, tolerance=1e-4)
    assert_closed(arm, move)


def test_arc_goes_over_the_point_between() -> None:
    arc = arc_through([1.0, 0.0, 0.5], [0.0, -1.0, 0.5], [0.0, 1.0, 0.5])  # the long way
    assert arc.radius == pytest.approx(1.0)
    assert arc.length == pytest.approx(1.5 * math.pi)
    assert arc.at(1.0).position == pytest.approx((0.0, 1.0, 0.5))
    assert arc.at(1.0 / 3.0).position == pytest.approx((0.0, -1.0, 0.5))
    with pytest.raises(NoAnswerError, match="lie on a line"):
        arc_through([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0])


def test_derivatives_of_a_circle() -> None:
    circle = Circle([1.0, 2.0, 3.0], [1.0, 2.0, 2.5], [1.0, 1.0, 0.0], 4.0)
    h = 1e-5
    low, now, high = (circle.at(0.3 + k * h) for k in (-1, 0, 1))
    assert np.subtract(high.position, low.position) / (2 * h) == pytest.approx(now.first, abs=1e-8)
    assert np.subtract(high.first, low.first) / (2 * h) == pytest.approx(now.second, abs=1e-7)


def test_turn_by_half_has_no_shorter_way() -> None:
    one = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    half = [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    with pytest.raises(NoAnswerError, match="180 deg"):
        Turn.between(one, half)
    assert Turn.between(half, half).angle == 0.0


@pytest.mark.parametrize(
    ("spec", "reason"),
    [
        ({"offset": (2.0, 0.0, 0.0)}, r"leaves the workspace at .* s \(X .* mm\)"),
        ({"offset": (0.0, 0.0, 0.7)}, r"needs A5 = 130.2.* deg, its upper limit is 130 deg"),
        (
            {"offset": (0.0, 0.5, 0.0), "path": PathSpeed(3.0, 30.0)},
            "deg/s, its limit is",
        ),
    ],
)
def test_impossible_path_is_refused_with_its_place(
    arm: Arm, spec: dict[str, object], reason: str
) -> None:
    with pytest.raises(NoAnswerError, match=reason):
        make_reference(ReferenceSpec("line", **spec), arm, START)  # type: ignore[arg-type]


def test_path_through_the_wrist_singularity_is_refused(arm: Arm) -> None:
    """Straight through A5 = 0 with A4 off: the next configuration is elsewhere."""
    inside = [0.0, math.radians(-75), math.radians(90), 0.0, 0.0, 0.0]
    T = arm.fk(inside)
    T[1][3] -= 0.2
    T[2][3] -= 1e-6
    rows = [q for q in arm.ik(T, inside).angles if q[0] == q[0]]
    near = min(rows, key=lambda q: max(abs(a - b) for a, b in zip(q, inside, strict=True)))
    with pytest.raises(NoAnswerError, match=r"jumps to another branch at|deg/s, its limit"):
        make_reference(ReferenceSpec("line", offset=(0.0, 0.4, 0.0)), arm, near)


def test_path_that_only_turns(arm: Arm) -> None:
    spec = ReferenceSpec("line", offset=(0.0, 0.0, 0.0), abc=tuple(arm_abc(arm, 0.5)))
    move = make_reference(spec, arm, START)
    assert move.duration > 0.0
    assert_closed(arm, move)


def arm_abc(arm: Arm, by: float) -> list[float]:
    """A, B, C of the start turned about robroot's z."""
    from kr16cli.kuka import abc_from_matrix

    turned = np.array(Turn((0.0, 0.0, 1.0), by).matrix(1.0)) @ np.array(arm.fk(START))[:3, :3]
    return list(abc_from_matrix(turned.tolist()))


# Files --------------------------------------------------------------------------------------


def test_waypoints_come_in_radians_or_degrees(arm: Arm, tmp_path: Path) -> None:
    for name, unit, factor in (("q", "rad", 1.0), ("a", "deg", 180.0 / math.pi)):
        header = ",".join(["time [s]", *(f"{name}{i} [{unit}]" for i in range(1, 7))])
        rows = [
            ",".join(map(repr, [t, *(factor * v for v in q)]))
            for t, q in ((0.0, START), (2.0, END), (3.0, END))
        ]
        (tmp_path / "w.csv").write_text("\n".join([header, *rows]))
        reference = make_reference(ReferenceSpec("csv", file="w.csv"), arm, START, tmp_path)
        assert reference.duration == 3.0
        assert reference.joint(2.0).q == pytest.approx(END, abs=1e-12)
    (tmp_path / "w.csv").write_text("time,a1,a2,a3,a4,a5\n0,1,2,3,4,5\n")
    with pytest.raises(FileError, match=r"header lacks a6; it must name time,q1.* or time,a1"):
        make_reference(ReferenceSpec("csv", file="w.csv"), arm, START, tmp_path)


PROGRAM = """
DEF demo()                     ; lines like this are passed over
PTP {A1 0,A2 -80,A3 95,A4 0,A5 60,A6 0}
$VEL.CP = 0.4
LIN {X 1057.11, Y 150, Z 984.8}
WAIT SEC 0.25
CIRC {X 1057.11,Y 0,Z 834.8}, {X 1057.11,Y -150,Z 984.8}
PTP {X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 2,T 2}
END
"""


def test_program_runs_point_by_point(arm: Arm, pace: Pace, tmp_path: Path) -> None:
    (tmp_path / "demo.src").write_text(PROGRAM)
    q0 = [*START]
    q0[0] = 0.2
    reference = load_program(tmp_path / "demo.src", arm, q0, pace)
    assert reference.joint(0.0).q == q0
    home = [math.radians(v) for v in (0, -90, 90, 0, 0, 0)]
    assert reference.joint(reference.duration).q == pytest.approx(home, abs=1e-9)
    assert_closed(arm, reference)
    places = np.array(
        [reference.task(t).position for t in np.linspace(0, reference.duration, 2000)]
    )
    for point in ((1.05711, 0.15, 0.9848), (1.05711, 0.0, 0.8348), (1.05711, -0.15, 0.9848)):
        assert np.linalg.norm(places - point, axis=1).min() < 2e-3


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "holds no motion"),
        ("PTP", "needs 1 point in braces, found 0"),
        ("PTP HOME", "needs 1 point in braces"),
        ("CIRC {X 1,Y 2,Z 3}", "needs 2 points in braces, found 1"),
        ("PTP {A1 0,A2 -90}", "lacks A3"),
        ("LIN {X 1000,Y 0}", "lacks Z"),
        ("LIN {X 1000,Y 0,Z 900,A 0}", "lacks B, C"),
        ("LIN {X 1000,Y 0,Z 900} C_DIS", "C_DIS is not understood"),
        ("MOVE {A1 0}", "unknown statement MOVE; known: PTP"),
        ("WAIT 3", "WAIT needs SEC"),
        ("WAIT SEC x", "needs a number"),
        ("$VEL.CP = 0", "must be above 0"),
        ("PTP {A1 0,A2 x}", "A2 needs a number"),
    ],
)
def test_bad_program_is_refused_by_line(arm: Arm, pace: Pace, text: str, reason: str) -> None:
    with pytest.raises(FileError, match=r"^p: (line 2|holds)") as caught:
        program(f"; demo\n{text}\n", arm, START, pace, "p")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("PTP {A1 0,A2 40,A3 90,A4 0,A5 0,A6 0}", "A2 = 40 deg, its upper limit is 35 deg"),
        ("PTP {X 5000,Y 0,Z 900,A 0,B 90,C 0}", "out of reach"),
        ("PTP {X 1088,Y 0,Z 1320,A 0,B 90,C 0,S 5,T 2}", "no configuration of the pose has S 5"),
        ("LIN {X 5000,Y 0,Z 900}", "leaves the workspace"),
    ],
)
def test_motion_out_of_reach_names_its_line(arm: Arm, pace: Pace, text: str, reason: str) -> None:
    with pytest.raises(NoAnswerError, match="p: line 1: ") as caught:
        program(text, arm, START, pace, "p")
    assert reason in str(caught.value)
