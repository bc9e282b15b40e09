"""kr16 ik: branches, turns, Status and Turn, singular poses, and what is out of reach."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings

from command_line import kr16
from joint_tables import JOINTS, WIDE


@given(JOINTS)
@settings(max_examples=40)
def test_ik_gives_the_configuration_back(q: tuple[float, ...]) -> None:
    pose = kr16("fk", *q, "--json").result()["pose"]
    done = kr16("ik", *(pose[k] for k in "xyzabc"), "--near", *q, "--json")
    solutions = done.json()["result"]["solutions"]
    assert done.code == 0
    assert all(one["residual"] < 1e-9 for one in solutions)
    if abs(q[4]) > 1 and min(abs(pose["x"]), abs(pose["y"])) > 1:
        nearest = solutions[0]["q"]
        assert max(abs(a - b) for a, b in zip(nearest, q, strict=True)) < 1e-3


def test_all_eight_branches_are_listed_or_explained() -> None:
    result = kr16("ik 700 300 900 20 170 5 --json").result()
    bits = [tuple(one["branch"].values()) for one in (*result["solutions"], *result["missing"])]
    assert sorted(bits) == [(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    assert len({tuple(round(v, 6) for v in one["q"]) for one in result["solutions"]}) == len(
        result["solutions"]
    )


def test_solutions_come_nearest_first() -> None:
    near = (0, -90, 90, 300, 0, -300)
    result = kr16("ik", 700, 300, 900, 20, 170, 5, "--near", *near, "--json").result()
    moves = [
        max(abs(a - b) for a, b in zip(one["q"], near, strict=True)) for one in result["solutions"]
    ]
    assert moves == sorted(moves)
    assert len(moves) > 1


def test_full_turns_are_variants_within_limits() -> None:
    plain = kr16("ik 1200 300 900 20 100 5 --json").result()["solutions"]
    more = kr16("ik 1200 300 900 20 100 5 --turns --json").result()["solutions"]
    assert len(more) > len(plain)
    inside = [one for one in more if one["within_limits"]]
    for one in inside:
        assert all(lo <= a <= hi for a, (lo, hi) in zip(one["q"], WIDE, strict=True))
        assert one["residual"] < 1e-9
    # S and T together name one configuration only.
    assert len({(one["status"], one["turn"]) for one in inside}) == len(inside)


def test_status_and_turn_select() -> None:
    pose = "1200 300 900 20 100 5"
    for one in kr16(f"ik {pose} --turns --json").result()["solutions"]:
        chosen = kr16(f"ik {pose} --status {one['status']} --turn {one['turn']} --json").json()
        assert [o["q"] for o in chosen["result"]["solutions"]] == [one["q"]]
    nothing = kr16(f"ik {pose} --status 7 --json")
    assert nothing.code == 3
    assert nothing.json()["result"]["solutions"] == []
    assert "no solution has Status 7" in nothing.err


def test_out_of_reach_says_by_how_much() -> None:
    done = kr16("ik 3000 0 1000 0 90 0 --json")
    assert done.code == 3
    result = done.json()["result"]
    assert result["solutions"] == []
    assert len(result["missing"]) == 8
    # Wrist centre at (2842, 0, 1000), A2 axis at (260, 0, 675): shoulder 0.
    distance = math.hypot(2842 - 260, 1000 - 675)
    excess = distance - 680 - math.hypot(670, 35)
    assert f"out of reach by {excess:.3f} mm" in result["missing"][0]["reason"]
    assert len(done.err.splitlines()) == 1


def test_only_outside_the_limits_is_exit_3_with_the_list() -> None:
    pose = kr16("fk 0 -90 160 0 30 0 --json").result()["pose"]
    done = kr16("ik", *(pose[k] for k in "xyzabc"), "--status", pose["s"], "--json")
    result = done.json()["result"]
    assert done.code == 3
    (one,) = [s for s in result["solutions"] if s["violations"][0]["joint"] == "A3"]
    assert one["violations"][0]["limit"] == pytest.approx(154)
    assert one["violations"][0]["excess"] == pytest.approx(6)
    assert "A3 is 160 deg" in done.err


def test_wrist_singularity_keeps_a4_of_near() -> None:
    result = kr16("ik 1088 0 1320 0 90 0 --near 0 -90 90 25 0 0 --json").result()
    first = result["solutions"][0]
    assert first["q"] == pytest.approx([0, -90, 90, 25, 0, -25], abs=1e-9)
    assert result["singularity"]["kind"] == "wrist"
    assert result["singularity"]["free_joint"] == "A4"
    assert any("coincides" in one["reason"] for one in result["missing"])


def test_shoulder_singularity_keeps_a1_of_near() -> None:
    # Wrist centre on the A1 axis, flange pointing down.
    result = kr16("ik 0 0 1500 0 180 0 --near 33 -90 90 0 0 0 --json").result()
    assert result["singularity"]["kind"] == "shoulder"
    assert result["solutions"][0]["q"][0] == pytest.approx(33)


def test_stretched_arm_merges_the_elbow_pair() -> None:
    a3 = -math.degrees(math.atan2(35, 670))
    pose = kr16("fk", 0, -60, a3, 0, 40, 0, "--json").result()["pose"]
    result = kr16("ik", *(pose[k] for k in "xyzabc"), "--json").result()
    assert any("coincides" in one["reason"] for one in result["missing"])
    assert all(one["residual"] < 1e-9 for one in result["solutions"])


def test_ik_table_rounds_and_names_units() -> None:
    done = kr16("ik 1088 0 1320 0 90 0")
    assert "angles in deg" in done.out
    assert "-90.0000" in done.out
    assert "nan" not in done.out
