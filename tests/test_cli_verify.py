"""kr16 verify on the command line: formats, exit codes, URDFs and recorded poses."""

from __future__ import annotations

import csv
import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import numpy.typing as npt
import pytest

import kr16cli
from command_line import complains, kr16
from kr16cli import kuka
from kr16cli.assets import asset
from kr16cli.export.urdf import urdf
from kr16cli.verify import registry
from kr16cli.verify.records import Case, Finding, Setting, SkipCase

Array = npt.NDArray[np.float64]


@pytest.fixture
def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads(asset("data/schemas/verify.json").read_text(encoding="utf-8"))
    return jsonschema.Draft202012Validator(schema)


def _case(name: str, run: Any) -> Case:
    return Case(name, "kinematics", "A title", "a = b", "anywhere", "by hand", "C", 1.0, "m", "so",
                run)  # fmt: skip


def _raise(setting: Setting) -> Finding:
    raise SkipCase("MuJoCo is not installed; run: pip install 'kr16cli[engines]'")


def _break(setting: Setting) -> Finding:
    raise ZeroDivisionError("division by zero")


@pytest.fixture
def one_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four cases: one passes, one fails, one is skipped, one raises."""
    made = [
        _case("kinematics.good", lambda s: Finding(0.5, 3, {}, "near")),
        _case("kinematics.bad", lambda s: Finding(2.0, 3, {"command": "kr16 fk 0"}, "<far> & off")),
        _case("kinematics.away", _raise),
        _case("kinematics.broken", _break),
    ]
    monkeypatch.setattr(registry, "cases", lambda suites: made)


def test_suite_as_json_follows_its_schema(validator: jsonschema.Draft202012Validator) -> None:
    done = kr16("verify", "--suite", "velocity", "--quick", "--json")
    assert done.code == 0, done.err
    found = done.json()
    validator.validate(found)
    assert found["input"] == {"suites": ["velocity"], "quick": True, "seed": 20161}
    assert found["result"]["failed"] == 0
    assert found["result"]["passed"] == len(found["result"]["cases"])


def test_same_seed_gives_the_same_answer_and_another_another_one() -> None:
    words = ("verify", "--suite", "velocity", "--quick", "--json", "--seed")
    assert kr16(*words, 5).out == kr16(*words, 5).out
    assert kr16(*words, 5).out != kr16(*words, 6).out


@pytest.mark.usefixtures("one_of_each")
def test_a_failed_case_is_exit_code_1_and_the_others_are_kept() -> None:
    done = kr16("verify", "--json")
    assert done.code == 1
    result = done.json()["result"]
    assert (result["passed"], result["failed"], result["skipped"]) == (1, 2, 1)
    broken = result["cases"][3]
    assert (broken["error"], broken["status"]) == (None, "failed")
    assert "ZeroDivisionError" in broken["evidence"]


@pytest.mark.usefixtures("one_of_each")
def test_table_shows_failures_in_full() -> None:
    done = kr16("verify")
    assert done.code == 1
    assert "FAILED kinematics.bad: A title" in done.out
    assert "kr16 fk 0" in done.out
    assert "1 passed, 2 failed, 1 skipped; grades: A 0, B 0, C 3, D 0" in done.out
    assert "skipped: MuJoCo is not installed" in done.out
    assert "\r" not in done.err  # no bar where there is no terminal


@pytest.mark.usefixtures("one_of_each")
def test_junit_is_xml_with_the_same_counts(tmp_path: Path) -> None:
    file = tmp_path / "cases.xml"
    assert kr16("verify", "--junit", file).code == 1
    root = ET.parse(file).getroot()
    suite = root.find("testsuite")
    assert suite is not None
    assert (suite.get("tests"), suite.get("failures"), suite.get("skipped")) == ("4", "2", "1")
    failure = root.find(".//testcase[@name='kinematics.bad']/failure")
    assert failure is not None
    assert failure.get("message") == "A title: <far> & off"


def test_list_names_cases_and_runs_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "run", lambda *_: pytest.fail("a case was run"))
    done = kr16("verify", "--list", "--suite", "inverse", "--suite", "datasheet")
    assert done.code == 0
    assert "inverse.complete " in done.out
    assert "datasheet.numbers " in done.out
    assert "dynamics" not in done.out.split()


def test_wrong_arguments_are_one_line() -> None:
    complains(kr16("verify", "--suite", "nothing"), "'nothing'", "choose from")
    complains(kr16("verify", "--suite", "velocity", "--seed", "-1"), "--seed is -1")
    complains(kr16("verify", "--suite", "velocity", "--seed", "x"), "--seed is x")
    complains(kr16("verify", "--robot", "missing.toml", "--suite", "velocity"), "missing.toml")
    complains(kr16("verify", "--suite", "velocity", "--junit", "/no/such/folder/x.xml"), "/no/such")


# A URDF of somebody else ---------------------------------------------------------------------


@pytest.fixture
def own_urdf(tmp_path: Path) -> Path:
    file = tmp_path / "kr16.urdf"
    file.write_text(urdf(kr16cli.load_data()), encoding="utf-8")
    return file


def _failed(done: Any) -> dict[str, dict[str, Any]]:
    return {c["id"]: c for c in done.json()["result"]["cases"] if c["status"] == "failed"}


def _change(file: Path, *pairs: tuple[str, str]) -> None:
    text = file.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new, 1)
    file.write_text(text, encoding="utf-8")


def test_our_own_urdf_differs_in_nothing(
    own_urdf: Path, validator: jsonschema.Draft202012Validator
) -> None:
    done = kr16("verify", "model", own_urdf, "--json")
    assert done.code == 0, done.out
    validator.validate(done.json())
    assert done.json()["result"]["skipped"] == 0


def test_a_longer_link_arm_is_named(own_urdf: Path) -> None:
    _change(own_urdf, ('xyz="0.68 0.0 0.0"', 'xyz="0.6801 0.0 0.0"'))
    done = kr16("verify", "model", own_urdf, "--json")
    assert done.code == 1
    failed = _failed(done)
    assert set(failed) == {
        "model.a2",
        "model.flange-position",
        "model.poses",
        "model.mass-centre",
    } - ({"model.mass-centre"} - set(failed))
    assert failed["model.a2"]["error"] == pytest.approx(0.1)
    assert "here 680.100 mm, this robot 680.000 mm" in failed["model.a2"]["evidence"]


def test_the_other_flange_is_named(own_urdf: Path) -> None:
    _change(own_urdf, ("0.158", "0.115"))
    failed = _failed(kr16("verify", "model", own_urdf, "--json"))
    assert set(failed) == {"model.d6", "model.flange-position", "model.poses"}
    assert failed["model.d6"]["error"] == pytest.approx(43.0)


def test_a_flipped_axis_is_named(own_urdf: Path) -> None:
    _change(own_urdf, ('xyz="0.0 0.0 -1.0"', 'xyz="0.0 0.0 1.0"'))
    failed = _failed(kr16("verify", "model", own_urdf, "--json"))
    assert set(failed) == {"model.signs", "model.poses"}
    assert failed["model.signs"]["worst"] == {"joints": ["A1"]}


def test_another_zero_of_a_joint_is_named(own_urdf: Path) -> None:
    text = own_urdf.read_text(encoding="utf-8")
    at = text.index('name="A2"')
    turned = text[:at] + text[at:].replace('rpy="0 0 0"', 'rpy="0 -1.5707963267948966 0"', 1)
    own_urdf.write_text(turned, encoding="utf-8")
    failed = _failed(kr16("verify", "model", own_urdf, "--json"))
    assert failed["model.zero"]["worst"] == {"A2": -90.0}
    assert set(failed) == {"model.zero", "model.poses", "model.limits-A2"}


def test_limits_and_masses_that_differ_are_named(own_urdf: Path) -> None:
    data = kr16cli.load_data()
    _change(
        own_urdf,
        (f'lower="{data.joints[2].lower!r}"', 'lower="-2.0"'),
        (f'mass value="{data.links[3].mass!r}"', 'mass value="9.0"'),
    )
    failed = _failed(kr16("verify", "model", own_urdf, "--json"))
    assert set(failed) == {"model.limits-A3", "model.mass"}
    assert "here -114.592 to 154 deg" in failed["model.limits-A3"]["evidence"]
    assert failed["model.mass"]["evidence"] == "link 4: 9 kg, this robot 8.127 kg"


def test_a_urdf_without_masses_is_judged_on_its_kinematics(tmp_path: Path) -> None:
    file = tmp_path / "l6.urdf"
    file.write_text(urdf(kr16cli.load_data("kr16_l6")), encoding="utf-8")
    done = kr16("verify", "model", file, "--robot", "kr16_l6", "--json")
    assert done.code == 0, done.out
    assert done.json()["result"]["skipped"] >= 3
    assert "model.d4" in _failed(kr16("verify", "model", file, "--json"))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("<robot", ["no XML"]),
        ("<mujoco/>", ["<mujoco>", "<robot>"]),
        ("<robot name='x'><link name='a'/></robot>", ["0 moving joints", "six"]),
        ("<robot><link name='a'/><joint name='j' type='revolute'/></robot>", ["j: parent"]),
    ],
)
def test_a_broken_urdf_is_one_line(tmp_path: Path, content: str, words: list[str]) -> None:
    file = tmp_path / "broken.urdf"
    file.write_text(content, encoding="utf-8")
    complains(kr16("verify", "model", file), "broken.urdf", *words)


def test_a_number_that_is_none_and_a_missing_file_are_one_line(own_urdf: Path) -> None:
    _change(own_urdf, ('value="8.127"', 'value="heavy"'))
    complains(kr16("verify", "model", own_urdf), "link_4", "'heavy'")
    complains(kr16("verify", "model", "missing.urdf"), "missing.urdf", "cannot be read")


# Recorded poses ------------------------------------------------------------------------------

_BASE, _TOOL = (500.0, -200.0, 100.0, 30.0, 2.0, -1.0), (10.0, 20.0, 150.0, 15.0, 40.0, -60.0)


def _record(
    file: Path,
    count: int = 25,
    noise_mm: float = 0.0,
    spoiled: tuple[int, ...] = (),
    *,
    si: bool = False,
) -> None:
    rng = np.random.default_rng(7)
    robot = kr16cli.load_robot()
    limits = np.array([(j.lower, j.upper) for j in robot.data.joints])
    q = rng.uniform(limits[:, 0], limits[:, 1], (count, 6))
    base, tool = (np.array(kuka.matrix_from_pose(pose)) for pose in (_BASE, _TOOL))
    with file.open("w", newline="", encoding="utf-8") as out:
        writer = csv.writer(out)
        writer.writerow([*(f"a{i}" for i in range(1, 7)), *"xyzabc"])
        for i, (angles, T) in enumerate(zip(q, base @ robot.fk(q) @ tool, strict=True), 1):
            pose = np.array(kuka.pose_from_matrix(T.tolist()))
            pose[:3] += rng.normal(scale=noise_mm, size=3) if noise_mm else 0.0
            pose[1] += 12.0 if i in spoiled else 0.0
            if si:
                pose = np.concatenate([pose[:3] / 1000.0, np.radians(pose[3:])])
            writer.writerow([*(angles if si else np.degrees(angles)).tolist(), *pose.tolist()])


def test_base_and_tool_come_back(
    tmp_path: Path, validator: jsonschema.Draft202012Validator
) -> None:
    file = tmp_path / "poses.csv"
    _record(file)
    done = kr16("verify", "poses", file, "--json")
    assert done.code == 0, done.out
    validator.validate(done.json())
    result = done.json()["result"]
    assert [result["base"][k] for k in "xyzabc"] == pytest.approx(_BASE, abs=1e-6)
    assert [result["tool"][k] for k in "xyzabc"] == pytest.approx(_TOOL, abs=1e-6)
    assert result["recorded"]["position_mm"] > 100.0
    assert max(row["position_mm"] for row in result["rows"]) < 1e-6


def test_recordings_in_si_say_the_same_in_si(
    tmp_path: Path, validator: jsonschema.Draft202012Validator
) -> None:
    edge, si = tmp_path / "edge.csv", tmp_path / "si.csv"
    _record(edge, 30, 0.1, (5,))
    _record(si, 30, 0.1, (5,), si=True)
    shown = kr16("verify", "poses", edge, "--json").json()
    done = kr16("verify", "poses", si, "--si", "--json")
    assert done.code == 1
    validator.validate(done.json())
    there, here = shown["result"], done.json()["result"]
    factors = [1000.0] * 3 + [np.degrees(1.0)] * 3
    for frame in ("base", "tool"):
        scaled = [here[frame][k] * f for k, f in zip("xyzabc", factors, strict=True)]
        assert scaled == pytest.approx([there[frame][k] for k in "xyzabc"], abs=1e-4)
        assert done.json()["units"][frame] == "m rad"
        assert shown["units"][frame] == "mm deg"
    for a, b in zip(there["rows"], here["rows"], strict=True):
        assert b["position_m"] * 1000.0 == pytest.approx(a["position_mm"], abs=1e-4)
        assert np.degrees(b["orientation_rad"]) == pytest.approx(a["orientation_deg"], abs=1e-4)
        assert b["outlier"] == a["outlier"] == (a["row"] == 5)
    judged = {c["id"]: (c["unit"], c["tolerance"]) for c in here["cases"]}
    assert judged["poses.position"] == ("m", 0.001)
    assert judged["poses.orientation"] == ("rad", pytest.approx(np.radians(0.1)))
    assert "X m" in kr16("verify", "poses", si, "--si").out


def test_the_shipped_recording_is_not_in_si() -> None:
    complains(kr16("verify poses example_poses --si"), "mm and degrees", "leave out --si")


def test_outliers_stand_out_of_noise(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    _record(file, 40, 0.1, (7, 19))
    done = kr16("verify", "poses", file, "--json")
    assert done.code == 1
    result = done.json()["result"]
    assert [row["row"] for row in result["rows"] if row["outlier"]] == [7, 19]
    assert set(_failed(done)) == {"poses.outliers"}
    assert [result["tool"][k] for k in "xyz"] == pytest.approx(_TOOL[:3], abs=0.3)
    assert result["rows"][6]["position_mm"] == pytest.approx(12.0, abs=0.6)
    table = kr16("verify", "poses", file)
    assert "rows that stand out: 7, 19" in table.out
    assert "best fit" in table.out


def test_poses_of_another_arm_fail(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    _record(file)
    done = kr16("verify", "poses", file, "--robot", "kr16_l6", "--json")
    assert done.code == 1
    assert "poses.position" in _failed(done)


def test_unusable_recordings_are_one_line(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    _record(file, 3)
    complains(kr16("verify", "poses", file), "3 recorded poses", "4 or more")
    rows = file.read_text(encoding="utf-8").splitlines()
    file.write_text("\n".join([rows[0], *[rows[1]] * 6]), encoding="utf-8")
    complains(kr16("verify", "poses", file), "two or more axes")
    file.write_text("\n".join([*rows, "1,2,3,4,5,6,7,8,nine,1,2,3"]), encoding="utf-8")
    complains(kr16("verify", "poses", file), "row 4", "nine")
    file.write_text("a1,a2,a3,a4,a5,a6\n1,2,3,4,5,6\n", encoding="utf-8")
    complains(kr16("verify", "poses", file), "row 1", "x, y, z")
    complains(kr16("verify", "poses", tmp_path / "none.csv"), "none.csv", "cannot be read")


def test_figures_travel_with_the_results_when_asked() -> None:
    bare = kr16("verify --suite velocity --quick --json").result()["cases"]
    full = kr16("verify --suite velocity --quick --json --figures").result()["cases"]
    assert not any("figures" in one for one in bare)
    assert any(one["figures"] for one in full)
