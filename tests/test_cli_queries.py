"""kr16 fk, ik, jacobian, dynamics: what single queries answer."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from command_line import complains, kr16
from kr16cli import Arm, Payload, RobotData, units
from kr16cli.assets import asset

_HOME = "0 -90 90 0 0 0"
_GENERIC = (10.0, -70.0, 80.0, 35.0, -40.0, 200.0)
_WIDE = ((-185, 185), (-155, 35), (-130, 154), (-350, 350), (-130, 130), (-350, 350))
_JOINTS = st.tuples(*(st.one_of(st.floats(*r), st.integers(*r)) for r in _WIDE))


def _rad(q: Any) -> list[float]:
    return [units.rad(v) for v in q]


def _valid(name: str, envelope: dict[str, Any]) -> None:
    schema = json.loads(asset(f"data/schemas/{name}.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(envelope, schema)


# fk ---------------------------------------------------------------------------------------------


def test_home_is_printed_as_typed() -> None:
    done = kr16(f"fk {_HOME}")
    assert done.code == 0
    assert done.err == ""
    for text in ("1088.000", "1320.000", "90.0000", "S 2", "T 2", "mm", "deg"):
        assert text in done.out
    assert "{X 1088.0,Y 0.0,Z 1320.0,A 0.0,B 90.0,C 0.0,S 2,T 2}" in done.out
    assert "-0.0" not in done.out


def test_home_is_exact_in_json() -> None:
    result = kr16(f"fk {_HOME} --json").result()
    assert result["pose"] == {
        "x": 1088.0, "y": 0.0, "z": 1320.0, "a": 0.0, "b": 90.0, "c": 0.0, "s": 2, "t": 2
    }  # fmt: skip
    assert result["matrix"] == [[0, 0, 1, 1.088], [0, 1, 0, 0], [-1, 0, 0, 1.32], [0, 0, 0, 1]]


def test_envelope_names_robot_model_units_and_input(data: RobotData) -> None:
    envelope = kr16(f"fk {_HOME} --tool 0 0 100 0 -0.5 0 --json").json()
    assert envelope["schema"] == "kr16.fk/1"
    assert envelope["robot"] == data.name
    assert envelope["model_sha256"] == data.sha256
    assert envelope["units"]["x"] == "mm"
    assert envelope["units"]["matrix"] == "m"
    assert envelope["input"] == {"q": [0, -90, 90, 0, 0, 0], "tool": [0, 0, 100, 0, -0.5, 0]}


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("fk 1 -2 3 4 -5 6", "fk"),
        ("fk 1 -2 3 4 -5 6 --frames all --mass-centres --tool 1 2 3 4 5 6", "fk"),
        ("fk 1 -2 3 4 -5 6 --base 1 2 3 4 5 6", "fk"),
        ("fk 1 -2 3 4 -5 6 --si --frames chapter", "fk"),
        ("ik 1088 0 1320 0 90 0", "ik"),
        ("ik 1200 300 900 20 100 5 --turns", "ik"),
        ("jacobian 1 -2 3 4 -5 6", "jacobian"),
        ("jacobian 0 -90 90 0 0 0 --qd 1 2 3 4 5 -6 --link 3 --point com", "jacobian"),
        ("dynamics 1 -2 3 4 -5 6", "dynamics"),
        ("dynamics 1 -2 3 4 -5 6 --qd 1 2 3 4 5 6 --qdd 1 2 3 4 5 6 --tau 1 2 3 4 5 6 --task "
         "--christoffel --drives --payload 5 0 0 100 1 1 1 --gravity 0 1 -9", "dynamics"),
        ("dynamics 0 -90 90 0 0 0 --task", "dynamics"),
        ("info", "info"),
        ("info --robot kr16_l6", "info"),
    ],
)  # fmt: skip
def test_envelopes_fit_their_schemas(command: str, name: str) -> None:
    _valid(name, kr16(f"{command} --json").json())


def test_a_schema_refuses_what_is_wrong() -> None:
    envelope = kr16(f"fk {_HOME} --json").json()
    envelope["result"]["pose"]["s"] = 9
    with pytest.raises(jsonschema.ValidationError):
        _valid("fk", envelope)


@settings(max_examples=30)
@given(_JOINTS)
def test_fk_is_the_models(arm: Arm, q: tuple[float, ...]) -> None:
    result = kr16("fk", *q, "--json").result()
    want = arm.fk(_rad(q))
    for row, expected in zip(result["matrix"], want, strict=True):
        assert row == pytest.approx(expected, abs=1e-14)


@given(_JOINTS)
@settings(max_examples=20)
def test_si_says_the_same(q: tuple[float, ...]) -> None:
    edge = kr16("fk", *q, "--json").result()
    si = kr16("fk", *_rad(q), "--si", "--json").result()
    assert si["krl"][:3] == edge["krl"][:3]
    assert si["pose"]["x"] * 1000 == pytest.approx(edge["pose"]["x"], abs=1e-9)
    assert si["matrix"][0] == pytest.approx(edge["matrix"][0], abs=1e-12)


def test_tool_and_base_compose() -> None:
    # The tool's frame seen from a base at the flange is the tool itself.
    flange = kr16("fk", *_GENERIC, "--json").result()["pose"]
    base = [flange[k] for k in "xyzabc"]
    tool = [10.0, -20.0, 30.0, 40.0, -50.0, 60.0]
    words = ["fk", *_GENERIC, "--base", *base, "--tool", *tool, "--json"]
    result = kr16(*words).result()
    assert (result["of"], result["in"]) == ("tool", "base")
    assert [result["pose"][k] for k in "xyzabc"] == pytest.approx(tool, abs=1e-9)


def test_tool_as_krl_frame() -> None:
    one = kr16("fk", *_GENERIC, "--tool", "{X 1,Y 2,Z 3,A 4,B 5,C 6}", "--json").result()
    two = kr16("fk", *_GENERIC, "--tool", 1, 2, 3, 4, 5, 6, "--json").result()
    assert one == two


def test_frames_wrist_r36_and_mass_centres(arm: Arm) -> None:
    q = _rad(_GENERIC)
    result = kr16("fk", *_GENERIC, "--frames", "all", "--mass-centres", "--json").result()
    assert set(result["frames"]) == {*(f"frame{i}" for i in range(7)), "flange"}
    assert result["wrist_centre"] == pytest.approx([v * 1000 for v in arm.wrist_centre(q)])
    for row, expected in zip(result["R36"], arm.r36(q), strict=True):
        assert row == pytest.approx(expected, abs=1e-14)
    for row, expected in zip(result["mass_centres"], arm.mass_centres(q), strict=True):
        assert row == pytest.approx([v * 1000 for v in expected])


def test_chapter_frames_are_turned_a_quarter() -> None:
    ours = kr16("fk", *_GENERIC, "--frames", "all", "--json").result()
    theirs = kr16("fk", *_GENERIC, "--frames", "chapter", "--json").result()
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
    typed = kr16(f"fk {_HOME} --json").result()
    krl = kr16("fk", "--krl", "{A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}", "--json").result()
    assert krl == typed
    back = kr16("ik", "--krl", typed["krl"], "--json").result()
    assert [one["q"] for one in back["solutions"]] == [[0, -90, 90, 0, 0, 0]]


def test_another_robot_before_and_after_the_command() -> None:
    before = kr16("--robot", "kr16_l6", *f"fk {_HOME} --json".split()).json()
    after = kr16(*f"fk {_HOME} --json".split(), "--robot", "kr16_l6").json()
    assert before == after
    assert before["result"]["pose"]["x"] == pytest.approx(1345)
    assert "16 L6" in before["robot"]


# ik ---------------------------------------------------------------------------------------------


@given(_JOINTS)
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
        assert all(lo <= a <= hi for a, (lo, hi) in zip(one["q"], _WIDE, strict=True))
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


# jacobian ---------------------------------------------------------------------------------------


def test_jacobian_is_the_models_and_measures_agree(arm: Arm) -> None:
    result = kr16("jacobian", *_GENERIC, "--json").result()
    want = arm.jacobian(_rad(_GENERIC))
    for row, expected in zip(result["jacobian"], want, strict=True):
        assert row == pytest.approx(expected, abs=1e-14)
    product = math.prod(result["singular_values"])
    assert abs(result["determinant"]) == pytest.approx(product)
    assert result["manipulability"] == pytest.approx(product)
    largest, *_, smallest = result["singular_values"]
    assert result["condition"] == pytest.approx(largest / smallest)


@pytest.mark.parametrize("point", ["flange", "wrist", "tool", "com", "10 -20 30"])
def test_jacobian_moves_its_named_point(arm: Arm, point: str) -> None:
    """The linear rows against a difference quotient of the point itself."""
    tool = ["--tool", 5, 6, 7, 10, 20, 30]
    result = kr16("jacobian", *_GENERIC, *tool, "--point", *point.split(), "--json").result()
    local = {"flange": (0, 0, 0), "wrist": (0, 0, -0.158), "tool": (0.005, 0.006, 0.007)}

    def position(q: list[float]) -> list[float]:
        if point == "com":
            return arm.mass_centres(q)[5]
        T = arm.fk(q)
        p = local.get(point, (0.010, -0.020, 0.030))
        return [sum(T[i][k] * p[k] for k in range(3)) + T[i][3] for i in range(3)]

    q, h = _rad(_GENERIC), 1e-6
    for j in range(6):
        ahead = position([v + h * (i == j) for i, v in enumerate(q)])
        behind = position([v - h * (i == j) for i, v in enumerate(q)])
        for row in range(3):
            slope = (ahead[row] - behind[row]) / (2 * h)
            assert result["jacobian"][row][j] == pytest.approx(slope, abs=1e-8)


def test_jacobian_rate_is_a_difference_quotient(arm: Arm) -> None:
    qd = (10, -20, 30, -40, 50, 60)
    result = kr16("jacobian", *_GENERIC, "--qd", *qd, "--json").result()
    h, q = 1e-6, _rad(_GENERIC)
    ahead, behind = (
        arm.jacobian([a + s * h * v for a, v in zip(q, _rad(qd), strict=True)]) for s in (1, -1)
    )
    for rate, a, b in zip(result["jacobian_dot"], ahead, behind, strict=True):
        slope = [(x - y) / (2 * h) for x, y in zip(a, b, strict=True)]
        assert rate == pytest.approx(slope, abs=1e-8)


def test_singular_jacobian_has_no_condition_but_a_reason() -> None:
    done = kr16(f"jacobian {_HOME} --json")
    result = done.result()
    assert result["condition"] is None
    assert "zero to rounding" in result["condition_reason"]
    assert result["rate_matrix_inverse"] is None
    assert "B = +-90" in result["rate_matrix_inverse_reason"]
    assert [one["kind"] for one in result["singularities"] if one["near"]] == ["wrist"]
    assert re.search(r"\bnan\b", kr16(f"jacobian {_HOME}").out) is None


def test_axes_turn_the_rows() -> None:
    robroot = kr16("jacobian", *_GENERIC, "--json").result()
    flange = kr16("jacobian", *_GENERIC, "--axes", "flange", "--json").result()
    assert flange["singular_values"] == pytest.approx(robroot["singular_values"])
    # In flange axes A6 turns about -z.
    assert [row[5] for row in flange["jacobian"]] == pytest.approx([0, 0, 0, 0, 0, -1], abs=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--link 7", ("--link", "7", "1 to 6")),
        ("--axes world", ("--axes", "world", "robroot")),
        ("--point elbow", ("--point", "elbow", "wrist")),
        ("--point 1 2", ("--point", "3 numbers", "got 2")),
        ("--point tool", ("--point tool", "--tool")),
        ("--point wrist --link 3", ("--point wrist", "link 6")),
    ],
)
def test_jacobian_refuses(options: str, words: tuple[str, ...]) -> None:
    complains(kr16(f"jacobian {_HOME} {options}"), *words)


# dynamics ---------------------------------------------------------------------------------------


def test_dynamics_is_the_models(data: RobotData) -> None:
    qd, qdd, tau = (10, 20, -30, 40, 50, 60), (1, 2, 3, 4, -5, 6), (1, 2, 3, 4, 5, -6)
    load = ["--payload", 10, 5, 6, 100, 0.1, 0.2, 0.25]
    words = ["dynamics", *_GENERIC, "--qd", *qd, "--qdd", *qdd, "--tau", *tau, *load, "--drives"]
    result = kr16(*words, "--json").result()
    payload = Payload(10, (0.005, 0.006, 0.1), (0.1, 0.2, 0.25, 0, 0, 0))
    arm = Arm(data, payload=payload, drives=True)
    q, qd_rad = _rad(_GENERIC), _rad(qd)
    assert result["torque"] == pytest.approx(arm.inverse_dynamics(q, qd_rad, _rad(qdd)))
    assert result["acceleration"] == pytest.approx(arm.forward_dynamics(q, qd_rad, tau))
    assert result["gravity"] == pytest.approx(arm.gravity(q))
    assert tuple(result["energy"].values()) == pytest.approx(arm.energy(q, qd_rad))
    assert result["base_wrench"] == pytest.approx(arm.base_wrench(q, qd_rad, _rad(qdd)))
    for row, expected in zip(result["mass_matrix"], arm.mass_matrix(q), strict=True):
        assert row == pytest.approx(expected, abs=1e-12)


def test_torque_from_the_parts() -> None:
    """M qdd + C qd + G of the printed result is its printed torque."""
    qd, qdd = (10, 20, -30, 40, 50, 60), (1, 2, 3, 4, -5, 6)
    words = ["dynamics", *_GENERIC, "--qd", *qd, "--qdd", *qdd, "--json"]
    r = kr16(*words).result()
    for i in range(6):
        parts = sum(r["mass_matrix"][i][j] * units.rad(qdd[j]) for j in range(6))
        parts += sum(r["coriolis_matrix"][i][j] * units.rad(qd[j]) for j in range(6))
        assert r["torque"][i] == pytest.approx(parts + r["gravity"][i], abs=1e-9)


@pytest.mark.parametrize(
    "words",
    [
        ("--payload", "{M 16,CM {X 0,Y 0,Z 120,A 0,B 0,C 0},J {X 0.36,Y 0.36,Z 0.36}}"),
        ("--load-data", "{M 16,CM {X 0,Y 0,Z 120,A 0,B 0,C 0},J {X 0.36,Y 0.36,Z 0.36}}"),
        ("--payload", 16, 0, 0, 120, 0.36, 0.36, 0.36),
        ("--payload", 16, 0, 0, 0.12, 0.36, 0.36, 0.36, "--si"),
    ],
)
def test_payload_in_every_form(words: tuple[object, ...]) -> None:
    result = kr16("dynamics", 0, 0, 0, 0, 0, 0, *words, "--json").result()
    empty = kr16("dynamics 0 0 0 0 0 0 --json").result()
    more = result["base_wrench"][2] - empty["base_wrench"][2]
    assert more == pytest.approx(16 * 9.81)


def test_payload_before_the_joint_angles() -> None:
    one = kr16(f"dynamics --payload 16 0 0 -120 {_HOME} --json").result()
    two = kr16(f"dynamics {_HOME} --payload 16 0 0 -120 --json").result()
    three = kr16(f"dynamics --payload 16 0 0 -120 0.1 0.1 0.1 {_HOME} --json").result()
    assert one == two != three


def test_gravity_points_where_it_is_told() -> None:
    r = kr16(f"dynamics {_HOME} --gravity 0 0 0 --json").result()
    assert r["gravity"] == pytest.approx([0] * 6)
    r = kr16(f"dynamics {_HOME} --gravity 0 -5 0 --json").result()
    assert r["base_wrench"][:3] == pytest.approx([0, 5 * 171.628, 0])


def test_overload_is_warned_about() -> None:
    done = kr16("dynamics 0 0 0 0 0 0 --payload 200 0 0 500 --qdd 0 0 0 0 0 0")
    assert done.code == 0
    assert "payload 200 kg exceeds the rated 16 kg" in done.err
    assert "A2 needs" in done.err


def test_task_space_or_the_reason() -> None:
    r = kr16("dynamics 10 -70 80 35 -40 20 --task --json").result()
    assert len(r["task"]["mass_matrix"]) == 6
    home = kr16(f"dynamics {_HOME} --task --json").json()
    assert home["result"]["task"] is None
    assert "singular" in home["result"]["task_reason"]
    assert home["warnings"]


def test_no_inertial_data_no_dynamics() -> None:
    complains(kr16(f"dynamics {_HOME} --robot kr16_l6"), "KR 16 L6", "no inertial data")


# numbers beyond what a double holds -------------------------------------------------------------

_LOAD = "--payload 1e308 0 0 1e308"


@pytest.mark.parametrize(
    "command",
    [
        "dynamics 0 -60 90 0 30 0 --payload 1e300 0 0 100 --tau 1 1 1 1 1 1",
        f"dynamics 0 -60 90 0 30 0 {_LOAD}",
        "dynamics 0 -60 90 0 30 0 --qd 1e200 1e200 0 0 0 0",
        "dynamics 0 -60 90 0 30 0 --gravity 1e308 1e308 1e308",
        "dynamics 0 -60 90 0 30 0 --tau 1e308 1e308 1e308 1e308 1e308 1e308",
        "jacobian 0 0 0 0 0 0 --tool 1e200 0 0 0 0 0",
        "jacobian 0 0 0 0 0 0 --qd 1e308 1e308 1e308 1e308 1e308 1e308 --si --axes flange",
        "jacobian 0 0 0 0 0 0 --point 1e308 1e308 1e308 --si",
        "fk 0 -90 90 0 0 0 --tool 1e308 1e308 1e308 45 45 45 "
        "--base 1.7e308 1.7e308 1.7e308 45 45 45",
        "fk 0 -90 90 0 0 0 --si --base 1e308 1e308 1e308 0 0 0",
        f"export urdf {_LOAD}",
        f"export mjcf {_LOAD}",
        "export urdf --payload 1 0 0 1e300",
    ],
)
def test_overflow_is_said_in_one_line(command: str) -> None:
    for form in ("--json", "") if not command.startswith("export") else ("",):
        done = kr16(f"{command} {form}")
        complains(done, "large")


@given(st.lists(st.sampled_from([0.0, 1.0, 1e-320, -1e150, 1e200, -1e308, 1.7e308]), min_size=25))
@settings(max_examples=40)
def test_no_number_is_our_bug(numbers: list[float]) -> None:
    q, six, more, (mass, *centre) = numbers[:6], numbers[6:12], numbers[12:18], numbers[18:22]
    for words in (
        ["fk", *q, "--tool", *six, "--base", *more],
        ["ik", *q, "--tool", *six, "--near", *more],
        ["jacobian", *q, "--tool", *six, "--qd", *more],
        ["dynamics", *q, "--qd", *six, "--tau", *more, "--payload", abs(mass), *centre, "--task"],
        ["export", "urdf", "--payload", abs(mass), *centre],
    ):
        done = kr16(*words, *["--json"] * (words[0] != "export"))
        assert done.code in (0, 2, 3), done.err
        assert not re.search(r"\b(inf|nan)\b", done.out, re.IGNORECASE)


def test_arithmetic_that_fails_on_ordinary_numbers_is_our_bug(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def divide(arm: Arm, q: list[float]) -> float:
        return 1.0 / 0.0

    monkeypatch.setattr(Arm, "determinant", divide)
    complains(kr16(f"jacobian {_HOME}"), "our bug", "ZeroDivisionError", code=70)
    complains(kr16("jacobian 1e40 0 0 0 0 0"), "large")


def test_help_says_how_coulomb_friction_is_regularised(data: RobotData) -> None:
    text = " ".join(kr16("dynamics --help").out.split())
    assert "qd/sqrt(qd^2 + 0.01^2)" in text
    (percent,) = map(float, re.findall(r"within ([0-9.]+) % of its value at 20 deg/s", text))
    qd = units.rad(20.0)
    torque = Arm(data, drives=True).friction([qd] * 6)
    for joint, value in zip(data.joints, torque, strict=True):
        coulomb = joint.coulomb or 0.0
        lost = 1 - (value - (joint.viscous or 0.0) * qd) / coulomb
        assert round(100 * lost, 2) == percent
