"""The robot parameter files and their loader."""

from __future__ import annotations

import copy
import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kr16cli.assets import asset
from kr16cli.errors import FileError, Kr16Error, ParameterError
from kr16cli.robot_file import load_data, parse_data, problems, template
from kr16cli.robot_rules import inertia_problem, principal_moments
from kr16cli.units import rad

SHIPPED = ("kr16_2", "chapter3", "kr16_l6")
MISSING = object()


def shipped_table(name="kr16_2"):
    return tomllib.loads(asset(f"data/{name}.toml").read_text(encoding="utf-8"))


def put(table, way, value):
    """Set, or with MISSING remove, what the way of keys and indices leads to."""
    *parents, last = way
    for step in parents:
        table = table[step]
    if value is MISSING:
        del table[last]
    else:
        table[last] = value


def changed(way, value, name="kr16_2"):
    table = shipped_table(name)
    put(table, way, value)
    return table


def leaves(node, way=()):
    """Every (way, value) below a node that is no table and no list."""
    if isinstance(node, dict | list):
        steps = node.items() if isinstance(node, dict) else enumerate(node)
        for step, below in steps:
            yield from leaves(below, (*way, step))
    else:
        yield way, node


def is_number(value):
    return isinstance(value, int | float) and not isinstance(value, bool)


def numbers_of(table):
    """Ways to the robot's numbers; conflicts repeat some of them and are no data."""
    return [way for way, value in leaves(table) if is_number(value) and way[0] != "conflict"]


# --- the three files -----------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_file_has_no_problem_and_loads(name):
    assert problems(name) == []
    data = load_data(name)
    assert len(data.joints) == 6
    assert [joint.name for joint in data.joints] == ["A1", "A2", "A3", "A4", "A5", "A6"]
    assert data.path.endswith(f"{name}.toml")


def test_the_default_robot_is_the_kr_16_2_with_its_exact_numbers():
    data = load_data()
    assert data.name == "KUKA KR 16-2"
    assert data.geometry == (0.675, 0.260, 0.680, 0.035, 0.670, 0.158)
    assert data.gravity == (0.0, 0.0, -9.81)
    lower, upper = (-185, -155, -130, -350, -130, -350), (185, 35, 154, 350, 130, 350)
    assert [joint.lower for joint in data.joints] == [math.radians(angle) for angle in lower]
    assert [joint.upper for joint in data.joints] == [math.radians(angle) for angle in upper]
    assert [joint.speed for joint in data.joints] == pytest.approx(
        [2.7227136331, 2.7227136331, 2.7227136331, 5.7595865316, 5.7595865316, 10.7337748998]
    )
    assert [joint.torque for joint in data.joints] == [1844, 1634, 814, 252, 241, 106]
    assert data.joints[0].reflected_inertia == pytest.approx(20.3125)
    assert [link.mass for link in data.links] == [76, 42, 39, 8.127, 5.671, 0.83]
    assert sum(link.mass for link in data.links) == pytest.approx(171.628)
    assert data.links[0].com == (0.11943281710738861, 0.01893971351796477, -0.11081148781550763)
    assert data.links[2].inertia == (
        *(0.3489343262386583, 1.2811461009154064, 1.3461363881923905),
        *(-0.04222656717537889, -0.02257926235892911, -0.019997105197268134),
    )
    assert data.links[0].tolerance == 0.10
    assert data.links[5].tolerance is None
    assert data.ratings["payload_kg"] == 16
    assert data.ratings["mass_kg"] == 235


def test_the_chapter_file_puts_mass_centres_where_equation_3_29_does():
    """Frames multiplied from Table 3.1 here, with r_i as the file's comments state them."""
    data, rng = load_data("chapter3"), np.random.default_rng(329)
    g = data.geometry
    r1, r2, r3, r4, r5, r6 = 0.400, 0.270, 0.560, 0.120, 0.040, 0.130
    for q in rng.uniform(-3, 3, (5, 6)):
        half, pi = math.pi / 2, math.pi
        rows = [
            *((half, 0, 0, pi), (q[0], -g.d1, g.a1, half), (q[1], 0, g.a2, 0)),
            *((q[2] + half, 0, g.a3, -half), (q[3], -g.d4, 0, half)),
            *((q[4], 0, 0, -half), (q[5] + pi, -g.d6, 0, pi)),
        ]
        frames, T = [], np.eye(4)
        for angle, d, a, alpha in rows:
            c, s, ca, sa = math.cos(angle), math.sin(angle), math.cos(alpha), math.sin(alpha)
            T = T @ [
                [c, -s * ca, s * sa, a * c],
                [s, c * ca, -c * sa, a * s],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
            frames.append(T)
        o1, o5 = frames[1][:3, 3], frames[5][:3, 3]
        printed = [
            np.array([0, 0, r1]),
            o1 + frames[2][:3, 0] * r2,
            *(o5 + frames[4][:3, 1] * r for r in (r3, r4)),
            *(o5 - frames[5][:3, 2] * r for r in (r5, r6)),
        ]
        for i, link in enumerate(data.links, 1):
            assert link.frame == "dh"
            p = frames[i] @ [*link.com, 1.0]
            np.testing.assert_allclose(p[:3], printed[i - 1], rtol=0, atol=2e-15)


def test_the_chapter_file_has_the_tensors_of_equation_3_39_and_no_drives():
    data = load_data("chapter3")
    for link in data.links[:3]:
        assert all(product != 0 for product in link.inertia[3:])
    for link in data.links[3:]:
        assert link.inertia[3:] == (0, 0, 0)
        assert len(set(link.inertia[:3])) == 3
    assert all(joint.torque is joint.gear_ratio is joint.coulomb is None for joint in data.joints)
    assert {link.provenance.status for link in data.links} == {"estimated"}


def test_the_l6_is_kinematics_only_with_its_own_forearm_and_wrist():
    data, standard = load_data("kr16_l6"), load_data()
    assert data.links == ()
    assert data.geometry == standard.geometry._replace(d4=0.970, d6=0.115)
    assert [joint.speed for joint in data.joints[3:]] == [rad(335), rad(355), rad(647)]
    assert all(joint.rotor_inertia is None for joint in data.joints)
    assert all(joint.reflected_inertia == 0 for joint in data.joints)


def test_an_angle_typed_at_a_limit_is_within_it():
    for name in SHIPPED:
        for joint, table in zip(load_data(name).joints, shipped_table(name)["joint"], strict=True):
            low, high = map(float, table["limits_deg"])
            assert joint.lower <= rad(low) < rad(high) <= joint.upper


def test_single_keys_carry_their_own_provenance():
    joint = load_data().joints[2]
    assert joint.provenance.status == "agreed"
    assert joint.provenance.of("torque_nm").status == "sibling"
    assert joint.provenance.of("torque_nm").source == ("S8",)
    assert joint.provenance.of("limits_deg") is joint.provenance
    assert joint.provenance.notes["coulomb_nm"] == "ratio 60; with 125: 87.5"


def test_the_conflict_on_the_flange_is_told_in_words():
    (conflict,) = load_data().conflicts
    assert conflict.startswith("geometry.d6: 0.158 or 0.115; 0.158 m is used: ")
    assert conflict.endswith("(S1, S2, S3, S4, S5, S14)")


@pytest.mark.parametrize("name", SHIPPED)
def test_every_source_key_stands_in_sources_md(name):
    rows = asset("data/SOURCES.md").read_text(encoding="utf-8").splitlines()
    known = {row.split("|")[1].strip() for row in rows if row.startswith("| ")}
    used = {value for way, value in leaves(shipped_table(name)) if "source" in way}
    assert used <= known


def test_the_template_is_a_commented_file_that_loads(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(template(), encoding="utf-8")
    assert load_data(file).sha256 == load_data().sha256
    lines = template().splitlines()
    assert sum("#" in line for line in lines) > len(lines) / 4


# --- the JSON Schema -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def validator():
    schema = json.loads(asset("data/schemas/robot.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_file_fulfils_the_json_schema(name, validator):
    assert list(validator.iter_errors(shipped_table(name))) == []


def test_the_json_schema_knows_the_loaders_keys_and_no_other(validator):
    for way in {way[:-1] for way, _ in leaves(shipped_table())}:
        table = shipped_table()
        node = table
        for step in way:
            node = node[step]
        if isinstance(node, dict):
            node["strange"] = 1
            assert not validator.is_valid(table), way
            with pytest.raises(ParameterError, match="unknown key"):
                parse_data(table, "robot.toml")


# --- the hash ------------------------------------------------------------------------------


def reversed_order(node):
    """The same tables with their keys in the other order."""
    if isinstance(node, dict):
        return {key: reversed_order(node[key]) for key in reversed(node)}
    return [reversed_order(below) for below in node] if isinstance(node, list) else node


def test_the_hash_ignores_comments_order_format_sources_and_path(tmp_path):
    expected = load_data().sha256
    assert len(expected) == 64
    text = template()
    bare = "\n".join(line.split("  #")[0] for line in text.splitlines() if line[:1] != "#")
    file = tmp_path / "bare.toml"
    file.write_text(bare.replace("0.260", "26e-2"), encoding="utf-8-sig", newline="\r\n")
    assert load_data(file).sha256 == expected
    table = reversed_order(shipped_table())
    assert parse_data(table, "elsewhere").sha256 == expected
    del table["conflict"], table["gravity"], table["geometry"]["note"]
    table["link"][1]["com"][2] = -0.0
    table["joint"][0].update(status="recalled", source=["S99"], torque_nm=1844.0)
    assert parse_data(table, "elsewhere").sha256 == expected


@pytest.mark.parametrize("name", SHIPPED)
def test_the_hash_depends_on_every_number_and_on_the_name(name):
    seen = {load_data(name).sha256}
    ways = [way for way in numbers_of(shipped_table(name)) if "note" not in way]
    for way in ways:
        table = shipped_table(name)
        table.pop("conflict", None)
        node = table
        for step in way:
            node = node[step]
        put(table, way, node * 1.0001 if node else 1e-6)
        seen.add(parse_data(table, "robot.toml").sha256)
    seen.add(parse_data(changed(["name"], "Other", name), "robot.toml").sha256)
    assert len(seen) == len(ways) + 2


# --- rules ---------------------------------------------------------------------------------

J, L, G = ("joint", 0), ("link", 1), ("geometry",)
TENSOR = [0.38, 3.4, 3.45, 0, 0, 0]
RADIANS = [{"limits_deg": [-3.2, 3.2]}] * 6
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


# --- files that are no parameter files -----------------------------------------------------


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b" \n\t\n", "is empty"),
        (b'schema = "kr16.robot/1"\nname = \n', "at line 2"),
        (b"a = 1\na = 2\n", "Cannot overwrite a value"),
        (b"name = '\xff'", "not UTF-8 text at byte 8"),
        (b"a = " + b"[" * 100_000, "no TOML"),
        (b"a = " + b"1" * 5_000, "no TOML"),
    ],
)
def test_a_file_that_is_no_toml_is_one_line(content, reason, tmp_path):
    file = tmp_path / "robot.toml"
    file.write_bytes(content)
    for function in (load_data, problems):
        with pytest.raises(FileError) as caught:
            function(file)
        assert str(caught.value).startswith(f"{file}: ")
        assert reason in str(caught.value)
        assert "\n" not in str(caught.value)
        assert caught.value.exit_code == 2


def test_a_file_that_cannot_be_read_is_one_line(tmp_path):
    with pytest.raises(FileError, match="No such file"):
        load_data(tmp_path / "absent.toml")
    with pytest.raises(FileError, match="is a directory"):
        load_data(tmp_path)
    with pytest.raises(FileError, match="is a directory"):
        load_data("")
    with pytest.raises(FileError, match="cannot be read"):
        load_data("a\0b.toml")


def test_a_bare_name_is_a_shipped_robot_unless_a_file_has_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_data("kr16_l6").name == "KUKA KR 16 L6"
    with pytest.raises(FileError, match="shipped: chapter3, kr16_2, kr16_l6"):
        load_data("kr17")
    Path("kr16_l6").write_text(template(), encoding="utf-8")
    assert load_data("kr16_l6").name == "KUKA KR 16-2"


# --- any input -----------------------------------------------------------------------------

WAYS = [way for way, _ in leaves(shipped_table())]
WAYS += sorted({way[:n] for way in WAYS for n in range(1, len(way))}, key=str)
scalars = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([10**400, math.nan, math.inf, -0.0, 1e308, 5e-324])
    | st.floats()
    | st.text(max_size=5)
    | st.dates()
)
anything = st.recursive(
    scalars,
    lambda below: st.lists(below, max_size=6) | st.dictionaries(st.text(max_size=5), below),
    max_leaves=8,
)


@given(st.lists(st.tuples(st.sampled_from(WAYS), anything | st.just(MISSING)), max_size=3))
def test_no_table_raises_anything_but_our_errors(mutations):
    table = copy.deepcopy(shipped_table())
    for way, value in mutations:
        try:
            put(table, way, value)
        except (KeyError, IndexError, TypeError):
            continue  # an earlier mutation took the place away
    try:
        data = parse_data(table, "robot.toml")
    except Kr16Error as error:
        assert "\n" not in str(error)
        assert str(error).isprintable()
    else:
        assert all(math.isfinite(length) for length in data.geometry)
        assert len(data.sha256) == 64


@given(anything)
def test_no_value_in_place_of_the_table_raises_anything_but_our_errors(table):
    with pytest.raises(Kr16Error):
        parse_data(table, "robot.toml")


def test_loading_imports_no_array_library():
    code = (
        "import sys; from kr16cli.robot_file import load_data; load_data();"
        "print({'numpy', 'scipy', 'matplotlib', 'difflib'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
