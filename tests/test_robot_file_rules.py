"""The rules of robot parameter files: one line for a broken rule, bodies that can exist."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kr16cli.errors import ParameterError
from kr16cli.robot_file import load_data, parse_data, problems, template
from kr16cli.robot_rules import inertia_problem, principal_moments
from kr16cli.units import rad
from robot_tables import MISSING, changed, shipped_table

# --- rules ---------------------------------------------------------------------------------

J, L, G = ("joint", 0), ("link", 1), ("geometry",)
TENSOR = [0.38, 3.4, 3.45, 0, 0, 0]
CONFLICT = {"key": "geometry.d6", "values": [0.158, 0.1], "chosen": 0.158, "reason": "r"}
CONFLICT["source"] = ["S1"]

RULES = [
    # way, value, key in the message, rule in the message
    (["schema"], "kr16.robot/2", "schema = 'kr16.robot/2'", "must be kr16.robot/1"),
    (["schema"], MISSING, "schema missing", "this key is needed"),
    (["name"], " ", "name = ' '", "one line of text"),
    (["name"], "two\nlines", "name", "one line of text"),
    (["name"], 16, "name = 16", "one line of text"),
    (["geometri"], {}, "geometri", "unknown key; did you mean geometry?"),
    (["two words\n"], 1, r"'two words\n' = 1", "unknown key"),
    (["gravity"], [0, 0], "gravity = [0, 0]", "must be a list of 3 numbers, has 2"),
    (["gravity"], -9.81, "gravity = -9.81", "must be a list of 3 numbers, is float"),
    (["gravity"], [0, 0, -9810], "gravity[3] = -9810", "looks like mm/s2"),
    (["geometry"], 5, "geometry = 5", "must be a table, is int"),
    (["geometry"], MISSING, "geometry missing", "this key is needed"),
    ([*G, "d4"], MISSING, "geometry.d4 missing", "this key is needed"),
    ([*G, "d1"], 675, "geometry.d1 = 675", "lengths are in m, at most 20; 675 looks like mm"),
    ([*G, "d1"], "0.675", "geometry.d1 = '0.675'", "must be a number in m, is text"),
    ([*G, "a1"], True, "geometry.a1 = True", "must be a number in m, is true/false"),
    ([*G, "a1"], [0.26], "geometry.a1 = [0.26]", "must be a number in m, is a list"),
    ([*G, "a1"], math.nan, "geometry.a1 = nan", "must be finite"),
    ([*G, "a3"], -math.inf, "geometry.a3 = -inf", "must be finite"),
    ([*G, "a1"], 10**400, "geometry.a1", "must be finite"),
    ([*G, "a2"], 0, "geometry.a2 = 0", "must be > 0 m"),
    ([*G, "d4"], -0.67, "geometry.d4 = -0.67", "must be > 0 m"),
    ([*G, "d6"], -1e-9, "geometry.d6 = -1e-09", "must be >= 0 m"),
    ([*G, "d5"], 0.1, "geometry.d5 = 0.1", "unknown key; did you mean"),
    ([*G, "status"], "certain", "geometry.status = 'certain'", "must be one of datasheet, agreed"),
    ([*G, "status"], MISSING, "geometry.status missing", "this key is needed"),
    ([*G, "status"], ["agreed"], "geometry.status = ['agreed']", "must be one of"),
    ([*G, "source"], [], "geometry.source = []", "must be a list of keys of SOURCES.md"),
    ([*G, "source"], "S1", "geometry.source = 'S1'", "must be a list of keys of SOURCES.md"),
    ([*G, "source"], ["S1", ""], "geometry.source[2] = ''", "must be a key of SOURCES.md"),
    ([*G, "source"], MISSING, "geometry.source missing", "this key is needed"),
    ([*G, "note"], 3, "geometry.note = 3", "must be a table"),
    ([*G, "note", "d9"], {"text": "x"}, "geometry.note.d9", "unknown key; did you mean"),
    ([*G, "note", "d1"], {}, "geometry.note.d1 = {}", "a status, a source, a text or a tolerance"),
    ([*G, "note", "d1"], "x", "geometry.note.d1 = 'x'", "must be a table, is text"),
    ([*G, "note", "d1"], {"status": "?"}, "geometry.note.d1.status = '?'", "must be one of"),
    ([*G, "note", "d1"], {"source": []}, "geometry.note.d1.source = []", "must be a list of keys"),
    ([*G, "note", "d1"], {"text": ""}, "geometry.note.d1.text = ''", "one line of text"),
    ([*G, "note", "d1"], {"txt": "x"}, "geometry.note.d1.txt = 'x'", "did you mean text?"),
    (["joint"], MISSING, "joint missing", "this key is needed"),
    (["joint"], {}, "joint = {}", "must be six [[joint]] tables"),
    (["joint"], [], "joint = 0", "must be six [[joint]] tables, in order A1 to A6"),
    (["joint", 5], MISSING, "joint = 5", "must be six [[joint]] tables, in order A1 to A6"),
    (["joint", 3], 1, "joint[4] = 1", "must be a table"),
    ([*J, "name"], "A2", "joint[1].name = 'A2'", "must be A1"),
    ([*J, "limits_deg"], MISSING, "joint[1].limits_deg missing", "this key is needed"),
    ([*J, "limits_deg"], [185, -185], "joint[1].limits_deg = [185, -185]", "lower limit"),
    ([*J, "limits_deg"], [10, 10], "joint[1].limits_deg = [10, 10]", "lower limit"),
    ([*J, "limits_deg"], [-185], "joint[1].limits_deg = [-185]", "a list of 2 numbers, has 1"),
    ([*J, "limits_deg"], [-185, 721], "joint[1].limits_deg[2] = 721", "in deg, at most 720"),
    ([*J, "limits_deg"], [-185, "x"], "joint[1].limits_deg[2] = 'x'", "must be a number in deg"),
    ([*J, "speed_deg_s"], 0, "joint[1].speed_deg_s = 0", "must be > 0 deg/s"),
    ([*J, "speed"], 2, "joint[1].speed = 2", "did you mean speed_deg_s?"),
    ([*J, "torque_nm"], -1, "joint[1].torque_nm = -1", "must be > 0 N m"),
    ([*J, "gear_ratio"], -125, "joint[1].gear_ratio = -125", "must be > 0"),
    ([*J, "gear_ratio"], MISSING, "joint[1].gear_ratio missing", "rotor_inertia needs it"),
    ([*J, "rotor_inertia"], 13, "joint[1].rotor_inertia = 13", "looks like kg cm2"),
    ([*J, "rotor_inertia"], -1e-3, "joint[1].rotor_inertia = -0.001", "must be >= 0 kg m2"),
    ([*J, "coulomb_nm"], -1, "joint[1].coulomb_nm = -1", "must be >= 0 N m"),
    ([*J, "viscous_nms"], -1, "joint[1].viscous_nms = -1", "must be >= 0 N m s/rad"),
    (["link"], {}, "link = {}", "must be six [[link]] tables"),
    (["link", 5], MISSING, "link = 5", "must be six [[link]] tables"),
    ([*L, "mass"], 0, "link[2].mass = 0", "must be > 0 kg"),
    ([*L, "mass"], 42000, "link[2].mass = 42000", "looks like g"),
    ([*L, "mass"], MISSING, "link[2].mass missing", "this key is needed"),
    ([*L, "com"], [272, 0, 0], "link[2].com[1] = 272", "looks like mm"),
    ([*L, "com"], [0, 0], "link[2].com = [0, 0]", "must be a list of 3 numbers, has 2"),
    ([*L, "inertia"], TENSOR[:5], "link[2].inertia", "must be a list of 6 numbers, has 5"),
    ([*L, "inertia"], [3.4e6] * 6, "link[2].inertia[1] = 3400000.0", "looks like kg mm2"),
    ([*L, "inertia"], [0] * 6, "link[2].inertia = [0, 0, 0, 0, 0, 0]", "positive definite"),
    ([*L, "inertia"], [-1, 3.4, 3.45, 0, 0, 0], "link[2].inertia = [-1", "positive definite"),
    ([*L, "inertia"], [1, 1, 1, 1.01, 0, 0], "link[2].inertia = [1", "positive definite"),
    ([*L, "inertia"], [1, 2, 4, 0, 0, 0], "link[2].inertia = [1, 2, 4", "triangle inequality"),
    ([*L, "inertia"], [2, 2, 2, 1.5, 0, 0], "link[2].inertia = [2, 2", "triangle inequality"),
    ([*L, "frame"], "com", "link[2].frame = 'com'", "must be one of zero-pose, dh"),
    ([*L, "tolerance"], 20, "link[2].tolerance = 20", "at most 1; 20 looks like percent"),
    ([*L, "tolerance"], -0.1, "link[2].tolerance = -0.1", "must be >= 0"),
    (["ratings", "reach_mm"], 0, "ratings.reach_mm = 0", "must be > 0 mm"),
    (["ratings", "reach"], 1.6, "ratings.reach = 1.6", "did you mean reach_mm?"),
    (["ratings", "status"], MISSING, "ratings.status missing", "this key is needed"),
    (["ratings"], [], "ratings = []", "must be a table, is a list"),
    (["conflict"], CONFLICT, "conflict = {", "must be [[conflict]] tables"),
    (["conflict", 0], 1, "conflict[1] = 1", "must be a table"),
    (["conflict", 0], {**CONFLICT, "chosen": 0.1}, "conflict[1].chosen = 0.1", "0.158"),
    (["conflict", 0], {**CONFLICT, "chosen": 0.2}, "conflict[1].chosen = 0.2", "of the values"),
    (["conflict", 0], {**CONFLICT, "values": [1, 1]}, "conflict[1].values", "different numbers"),
    (["conflict", 0], {**CONFLICT, "values": [1, math.inf]}, "conflict[1].values", "different"),
    (["conflict", 0], {**CONFLICT, "key": "geometry.d7"}, "conflict[1].key", "the dotted key"),
    (["conflict", 0], {**CONFLICT, "key": "joint[7].torque_nm"}, "conflict[1].key", "dotted key"),
    (["conflict", 0], {**CONFLICT, "key": ["x"]}, "conflict[1].key = ['x']", "dotted key"),
    (["conflict", 0, "reason"], MISSING, "conflict[1].reason missing", "this key is needed"),
    (["conflict", 0, "source"], [], "conflict[1].source = []", "must be a list of keys"),
]


@pytest.mark.parametrize(("way", "value", "key", "rule"), RULES)
def test_a_broken_rule_is_one_line_with_key_value_and_rule(way, value, key, rule):
    with pytest.raises(ParameterError) as caught:
        parse_data(changed(way, value), "robot.toml")
    message = str(caught.value)
    assert message.startswith(f"robot.toml: {key}")
    assert rule in message.removeprefix(f"robot.toml: {key}")
    assert "\n" not in message
    assert caught.value.path == "robot.toml"
    assert message.startswith(f"robot.toml: {caught.value.key} ")


@pytest.mark.parametrize(
    ("key", "factor", "shown", "rule"),
    [
        ("limits_deg", math.pi / 180, "joint[1].limits_deg", "limits are in deg; all six"),
        ("speed_deg_s", math.pi / 180, "joint[1].speed_deg_s", "speeds are in deg/s; all six"),
    ],
)
def test_radians_on_all_six_joints_are_suspected(key, factor, shown, rule):
    table = shipped_table()
    for joint in table["joint"]:
        value = joint[key]
        joint[key] = [end * factor for end in value] if isinstance(value, list) else value * factor
    with pytest.raises(ParameterError) as caught:
        parse_data(table, "robot.toml")
    assert caught.value.key == shown
    assert caught.value.rule.startswith(rule)


def test_one_joint_with_a_narrow_range_or_low_speed_is_no_suspect():
    table = changed([*J, "limits_deg"], [-1, 1])
    table["joint"][1]["speed_deg_s"] = 5
    assert parse_data(table, "robot.toml").joints[0].upper == rad(1)


def test_numbers_and_values_too_long_to_print_are_cut_short():
    for value in (10**5000, -(10**5000), [[0.158]] * 1000):
        with pytest.raises(ParameterError) as caught:
            parse_data(changed([*G, "d6"], value), "robot.toml")
        assert caught.value.key == "geometry.d6"
        assert len(str(caught.value)) < 200


def test_optional_parts_may_be_left_out():
    table = shipped_table()
    for key in ("link", "ratings", "conflict", "gravity"):
        del table[key]
    for joint in table["joint"]:
        for key in ("speed_deg_s", "torque_nm", "gear_ratio", "rotor_inertia", "note"):
            del joint[key]
    data = parse_data(table, "robot.toml")
    assert data.links == ()
    assert data.ratings == {}
    assert data.ratings_provenance is None
    assert data.joints[0].speed is None
    assert data.gravity == (0, 0, -9.81)


def test_all_problems_are_listed_and_load_data_raises_the_first(tmp_path):
    file = tmp_path / "bad.toml"
    text = template().replace("d1 = 0.675", "d1 = 675").replace("mass = 42.0", "mas = -42.0")
    file.write_text(text.replace('name = "A6"', 'name = "A7"'), encoding="utf-8")
    found = problems(file)
    assert [problem.key for problem in found] == [
        *("geometry.d1", "joint[6].name", "link[2].mas", "link[2].mass")
    ]
    with pytest.raises(ParameterError) as caught:
        load_data(file)
    assert str(caught.value) == str(found[0])
    assert caught.value.exit_code == 2


# --- inertia -------------------------------------------------------------------------------

entries = st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6)


@given(entries)
def test_principal_moments_are_numpys_eigenvalues(inertia):
    xx, yy, zz, xy, xz, yz = inertia
    expected = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    scale = max(map(abs, inertia))
    np.testing.assert_allclose(
        principal_moments(tuple(inertia)), expected, rtol=0, atol=4e-15 * scale
    )


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e5])
def test_principal_moments_of_a_known_tensor_at_any_scale(scale):
    moments = principal_moments(tuple(scale * entry for entry in (2, 2, 3, 1, 0, 0)))
    assert moments == pytest.approx((scale, 3 * scale, 3 * scale), rel=1e-14, abs=0)


def test_a_flat_plate_is_a_body_and_a_rod_is_none():
    assert inertia_problem((1.0, 2.0, 3.0, 0.0, 0.0, 0.0)) is None
    assert "positive definite" in inertia_problem((0.0, 2.0, 2.0, 0.0, 0.0, 0.0))


def test_any_cloud_of_points_is_a_body():
    """The tensor of random point masses keeps the rule; with one moment too large it breaks."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        points = rng.normal(size=(6, 3)) * rng.uniform(0.01, 1, 3)
        cloud = sum(np.dot(p, p) * np.eye(3) - np.outer(p, p) for p in points)
        V = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        low, middle, _ = np.linalg.eigvalsh(cloud)
        for body, good in (
            (cloud, True),
            (V @ np.diag([low, middle, 1.01 * (low + middle)]) @ V.T, 0),
        ):
            six = (*np.diag(body), body[0, 1], body[0, 2], body[1, 2])
            assert (inertia_problem(tuple(map(float, six))) is None) == good
