"""kr16 fk: poses, frames, tool and base, KRL, limits."""

from __future__ import annotations

import pytest
from hypothesis import given, settings

from command_line import kr16
from joint_tables import GENERIC, HOME, JOINTS, radians
from kr16cli import Arm, RobotData


def test_home_is_printed_as_typed() -> None:
    done = kr16(f"fk {HOME}")
    assert done.code == 0
    assert done.err == ""
    for text in ("1088.000", "1320.000", "90.0000", "S 2", "T 2", "mm", "deg"):
        assert text in done.out
    assert "{X 1088.0,Y 0.0,Z 1320.0,A 0.0,B 90.0,C 0.0,S 2,T 2}" in done.out
    assert "-0.0" not in done.out


def test_home_is_exact_in_json() -> None:
    result = kr16(f"fk {HOME} --json").result()
    assert result["pose"] == {
        "x": 1088.0, "y": 0.0, "z": 1320.0, "a": 0.0, "b": 90.0, "c": 0.0, "s": 2, "t": 2
    }  # fmt: skip
    assert result["matrix"] == [[0, 0, 1, 1.088], [0, 1, 0, 0], [-1, 0, 0, 1.32], [0, 0, 0, 1]]


def test_envelope_names_robot_model_units_and_input(data: RobotData) -> None:
    envelope = kr16(f"fk {HOME} --tool 0 0 100 0 -0.5 0 --json").json()
    assert envelope["schema"] == "kr16.fk/1"
    assert envelope["robot"] == data.name
    assert envelope["model_sha256"] == data.sha256
    assert envelope["units"]["x"] == "mm"
    assert envelope["units"]["matrix"] == "m"
    assert envelope["input"] == {"q": [0, -90, 90, 0, 0, 0], "tool": [0, 0, 100, 0, -0.5, 0]}


@settings(max_examples=30)
@given(JOINTS)
def test_fk_is_the_models(arm: Arm, q: tuple[float, ...]) -> None:
    result = kr16("fk", *q, "--json").result()
    want = arm.fk(radians(q))
    for row, expected in zip(result["matrix"], want, strict=True):
        assert row == pytest.approx(expected, abs=1e-14)


@given(JOINTS)
@settings(max_examples=20)
def test_si_says_the_same(q: tuple[float, ...]) -> None:
    edge = kr16("fk", *q, "--json").result()
    si = kr16("fk", *radians(q), "--si", "--json").result()
    assert si["krl"][:3] == edge["krl"][:3]
    assert si["pose"]["x"] * 1000 == pytest.approx(edge["pose"]["x"], abs=1e-9)
    assert si["matrix"][0] == pytest.approx(edge["matrix"][0], abs=1e-12)


def test_tool_and_base_compose() -> None:
    # The tool's frame seen from a base at the flange is the tool itself.
    flange = kr16("fk", *GENERIC, "--json").result()["pose"]
    base = [flange[k] for k in "xyzabc"]
    tool = [10.0, -20.0, 30.0, 40.0, -50.0, 60.0]
    words = ["fk", *GENERIC, "--base", *base, "--tool", *tool, "--json"]
    result = kr16(*words).result()
    assert (result["of"], result["in"]) == ("tool", "base")
    assert [result["pose"][k] for k in "xyzabc"] == pytest.approx(tool, abs=1e-9)


def test_tool_as_krl_frame() -> None:
    one = kr16("fk", *GENERIC, "--tool", "{X 1,Y 2,Z 3,A 4,B 5,C 6}", "--json").result()
    two = kr16("fk", *GENERIC, "--tool", 1, 2, 3, 4, 5, 6, "--json").result()
    assert one == two


def test_frames_wrist_r36_and_mass_centres(arm: Arm) -> None:
    q = radians(GENERIC)
    result = kr16("fk", *GENERIC, "--frames", "all", "--mass-centres", "--json").result()
    assert set(result["frames"]) == {*(f"frame{i}" for i in range(7)), "flange"}
    assert result["wrist_centre"] == pytest.approx([v * 1000 for v in arm.wrist_centre(q)])
    for row, expected in zip(result["R36"], arm.r36(q), strict=True):
        assert row == pytest.approx(expected, abs=1e-14)
    for row, expected in zip(result["mass_centres"], arm.mass_centres(q), strict=True):
        assert row == pytest.approx([v * 1000 for v in expected])


def test_chapter_frames_are_turned_a_quarter() -> None:
    ours = kr16("fk", *GENERIC, "--frames", "all", "--json").result()
    theirs = kr16("fk", *GENERIC, "--frames", "chapter", "--json").result()
    (x, y, z), (xb, yb, zb) = ours["wrist_centre"], theirs["wrist_centre"]
    # p_robroot = Rz(-90 deg) p_b
    assert (x, y, z) == pytest.approx((yb, -xb, zb))


def test_outside_limits_is_answered_with_a_warning() -> None:
    done = kr16("fk 0 40 0 0 -131 0")
    assert done.code == 0
    assert "A2 is 40 deg, beyond its limit 35 deg by 5 deg" in done.err
    assert "A5 is -131 deg" in done.err
    assert len(kr16("fk 0 40 0 0 -131 0 --json").json()["warnings"]) == 2
    assert kr16("fk 185 35 154 350 130 -350").err == ""


def test_krl_in_and_out() -> None:
    typed = kr16(f"fk {HOME} --json").result()
    krl = kr16("fk", "--krl", "{A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}", "--json").result()
    assert krl == typed
    back = kr16("ik", "--krl", typed["krl"], "--json").result()
    assert [one["q"] for one in back["solutions"]] == [[0, -90, 90, 0, 0, 0]]


def test_another_robot_before_and_after_the_command() -> None:
    before = kr16("--robot", "kr16_l6", *f"fk {HOME} --json".split()).json()
    after = kr16(*f"fk {HOME} --json".split(), "--robot", "kr16_l6").json()
    assert before == after
    assert before["result"]["pose"]["x"] == pytest.approx(1345)
    assert "16 L6" in before["robot"]
