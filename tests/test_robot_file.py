"""The robot parameter files that ship: their numbers, sources, JSON Schema and hash."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import jsonschema
import numpy as np
import pytest

from kr16cli.assets import asset
from kr16cli.errors import ParameterError
from kr16cli.robot_file import load_data, parse_data, problems, template
from kr16cli.units import rad
from robot_tables import SHIPPED, changed, leaves, put, shipped_table

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


def test_loading_imports_no_array_library():
    code = (
        "import sys; from kr16cli.robot_file import load_data; load_data();"
        "print({'numpy', 'scipy', 'matplotlib', 'difflib'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


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


def is_number(value):
    return isinstance(value, int | float) and not isinstance(value, bool)


def numbers_of(table):
    """Ways to the robot's numbers; conflicts repeat some of them and are no data."""
    return [way for way, value in leaves(table) if is_number(value) and way[0] != "conflict"]


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
