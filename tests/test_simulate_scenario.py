"""Scenario files: what they mean, and what is refused."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import numpy.typing as npt
import pytest

import kr16cli
from kr16cli.errors import FileError, ParameterError
from kr16cli.simulate.loop import Sampling
from kr16cli.simulate.motion_spec import ControllerSpec
from kr16cli.simulate.plant import Limits, Wrench
from kr16cli.simulate.scenario import (
    SolverSpec,
    TorqueSpec,
    load_scenario,
    parse_scenario,
    with_options,
)
from kr16cli.simulate.scenario_check import problems_in
from scenes import LOAD, TAU, torque_csv

Array = npt.NDArray[np.float64]

_DATA = Path(__file__).resolve().parent.parent / "data"
_SHIPPED = sorted(path.stem for path in (_DATA / "scenarios").glob("*.toml"))
_SCHEMA = json.loads((_DATA / "schemas" / "scenario.json").read_text(encoding="utf-8"))

# Scenario files -----------------------------------------------------------------------------

_GOOD: dict[str, Any] = {
    "schema": "kr16.scenario/1",
    "name": "test",
    "duration_s": 1.0,
    "output_step_s": 0.1,
    "initial": {"q_deg": [0, -90, 90, 0, 0, 0], "qd": [0.1, 0, 0, 0, 0, 0]},
    "torque": {"kind": "constant", "tau_nm": [1, 2, 3, 4, 5, 6]},
    "payload": {"mass": 16, "com": [0, 0, 0.12], "inertia": [0.3, 0.3, 0.3, 0, 0, 0]},
    "solver": {"method": "RK45", "rtol": 1e-6, "atol": 1e-8, "max_steps": 10},
}

# The same with a controller.
_DRIVEN: dict[str, Any] = {
    "schema": "kr16.scenario/1",
    "name": "driven",
    "duration_s": 1.0,
    "initial": {"q_deg": [0, -90, 90, 0, 0, 0]},
    "limits": {"joint": "contact", "torque": True, "speed": True, "depth_deg": 1, "bounce": 0.1},
    "wrench": {"moment_nm": [1, 2, 3], "axes": "flange", "start_s": 0.5},
    "controller": {"kind": "pd"},
    "reference": {"kind": "ptp", "q_deg": [10, -90, 90, 0, 30, 0], "speed_percent": 50},
    "solver": {"method": "SemiImplicitEuler", "step_s": 0.001},
}

_DROP = object()


def _with(changes: dict[str, Any], good: dict[str, Any] = _GOOD) -> dict[str, Any]:
    """The good table with dotted keys set, or dropped."""
    table = copy.deepcopy(good)
    for dotted, value in changes.items():
        *path, last = dotted.split(".")
        place = table
        for key in path:
            place = place[key]
        if value is _DROP:
            del place[last]
        else:
            place[last] = value
    return table


def test_good_table_means_what_it_says() -> None:
    jsonschema.Draft202012Validator(_SCHEMA).validate(_GOOD)
    scenario = parse_scenario(_GOOD, "test.toml")
    assert scenario.q == pytest.approx((0, -np.pi / 2, np.pi / 2, 0, 0, 0), abs=1e-15)
    assert scenario.qd[0] == 0.1
    assert scenario.torque == TorqueSpec("constant", (1, 2, 3, 4, 5, 6))
    assert scenario.payload == kr16cli.Payload(16, (0, 0, 0.12), (0.3, 0.3, 0.3, 0, 0, 0))
    assert scenario.solver == SolverSpec("RK45", 1e-6, 1e-8, 10)
    assert json.loads(json.dumps(scenario.describe())) == scenario.describe()


_BAD: list[tuple[dict[str, Any], str, str]] = [
    ({"schema": "kr16.robot/1"}, "schema", "must be kr16.scenario/1"),
    ({"name": _DROP}, "name", "this key is needed"),
    ({"duration": 2}, "duration", "unknown key; did you mean duration_s?"),
    ({"duration_s": 0}, "duration_s", "must be > 0 s"),
    ({"duration_s": -1.0}, "duration_s", "must be > 0 s"),
    ({"duration_s": 1e6}, "duration_s", "looks like ms"),
    ({"duration_s": "1"}, "duration_s", "must be a number in s, is text"),
    ({"duration_s": True}, "duration_s", "is true/false"),
    ({"output_step_s": 0.0}, "output_step_s", "must be > 0 s"),
    ({"drives": 1}, "drives", "must be true or false"),
    ({"gravity": [0, 9.81]}, "gravity", "list of 3 numbers, has 2"),
    ({"initial": 1}, "initial", "must be a table"),
    ({"initial.q_deg": [0, 0, 0, 0, 0]}, "initial.q_deg", "list of 6 numbers, has 5"),
    ({"initial.q_deg": [0, 0, 0, 0, 0, 1e3]}, "initial.q_deg[6]", "at most 720"),
    ({"initial.q_deg": _DROP}, "initial.q_deg", "six joint angles"),
    ({"initial.q": [0.0] * 6}, "initial.q", "stands beside q_deg"),
    ({"initial.qd_deg_s": [0.0] * 6}, "initial.qd", "stands beside qd_deg_s"),
    ({"initial.q_dge": [0] * 6}, "initial.q_dge", "did you mean q_deg?"),
    ({"torque.kind": "gravty"}, "torque.kind", "one of zero, constant, gravity, csv"),
    ({"torque.kind": _DROP}, "torque.kind", "this key is needed"),
    ({"torque.tau_nm": _DROP}, "torque.tau_nm", 'kind = "constant" needs it'),
    ({"torque.kind": "zero"}, "torque.tau_nm", 'not to "zero"'),
    ({"torque.kind": "csv", "torque.tau_nm": _DROP}, "torque.file", 'kind = "csv" needs it'),
    ({"torque.file": "a.csv"}, "torque.file", 'belongs to kind = "csv"'),
    ({"torque.tau_nm": [1e9, 0, 0, 0, 0, 0]}, "torque.tau_nm[1]", "at most 1e+06"),
    ({"payload.mass": -1}, "payload.mass", "must be > 0 kg"),
    ({"payload.mass": _DROP}, "payload.mass", "this key is needed"),
    ({"payload.com": [0, 0, 120]}, "payload.com[3]", "looks like mm"),
    ({"solver.method": "dop853"}, "solver.method", "must be one of auto, DOP853"),
    ({"solver.rtol": 1e-16}, "solver.rtol", "must be >= 1e-13"),
    ({"solver.atol": 0}, "solver.atol", "must be >= 1e-15"),
    ({"solver.max_steps": 0}, "solver.max_steps", "whole number of 1 or more"),
    ({"solver.max_steps": 1.5}, "solver.max_steps", "whole number of 1 or more"),
    ({"solver": {"method": "RK4", "rtol": 1e-6}}, "solver.rtol", "means nothing to a fixed step"),
    ({"solver": {"method": "RK45", "step_s": 1e-3}}, "solver.step_s", "belongs to RK4 or"),
    ({"solver": {"method": "RK4", "step_s": 5}}, "solver.step_s", "at most 0.1"),
    ({"limits": {"joint": "hard"}}, "limits.joint", "one of report, stop, contact"),
    ({"limits": {"torque": 1}}, "limits.torque", "must be true or false"),
    ({"limits": {"joint": "stop", "bounce": 1.0}}, "limits.bounce", 'belongs to joint = "contact"'),
    ({"limits": {"joints": "stop"}}, "limits.joints", "did you mean joint?"),
    ({"wrench": {}}, "wrench.force_n", "force_n, moment_nm or both"),
    ({"wrench": {"force_n": [1, 2]}}, "wrench.force_n", "list of 3 numbers"),
    ({"wrench": {"force_n": [1, 2, 3], "axes": "tool"}}, "wrench.axes", "robroot, flange"),
    ({"reference": {"kind": "hold"}}, "reference", "needs a [controller]"),
    ({"controller": {"kind": "zero"}}, "torque", "stands beside [controller]"),
]
_LOOP: list[tuple[dict[str, Any], str, str]] = [
    ({"controller.kind": "pid"}, "controller.kind", "one of zero, gravity, pd"),
    ({"controller.kind": _DROP}, "controller.kind", "this key is needed"),
    ({"controller.gain": 3}, "controller.gain", "unknown key"),
    ({"controller.damping_ratio": 0}, "controller.damping_ratio", "must be > 0"),
    ({"controller.kp": [1] * 6}, "controller.kd", "kp needs it"),
    (
        {"controller.kp": [1] * 6, "controller.kd": [1] * 6, "controller.natural_frequency": 3},
        "controller.natural_frequency",
        "stands beside kp and kd",
    ),
    ({"controller.kp": [-1] * 6}, "controller.kp[1]", "must be >= 0"),
    ({"controller.near_singular": 0.1}, "controller.near_singular", 'belongs to kind = "task'),
    ({"controller.delay_s": 0.1}, "controller.period_s", "delay_s needs it"),
    ({"controller.period_s": 4}, "controller.period_s", "looks like ms"),
    ({"controller.kind": "gravity"}, "reference", 'means nothing to the controller "gravity"'),
    ({"reference": _DROP}, "reference", 'controller "pd" needs it'),
    ({"reference.kind": "spline"}, "reference.kind", "one of hold, ptp, line"),
    ({"reference.q": [0.0] * 6}, "reference.q", "stands beside q_deg"),
    ({"reference.q_deg": _DROP}, "reference.q", 'kind = "ptp" needs it, or q_deg'),
    ({"reference.speed_m_s": 1}, "reference.speed_m_s", 'means nothing to kind = "ptp"'),
    ({"reference.speed_percent": 120}, "reference.speed_percent", "at most 100"),
    ({"reference.acceleration_deg_s2": [1, 2]}, "reference.acceleration_deg_s2", "list of 6"),
    ({"reference.profile": "cubic"}, "reference.profile", "one of quintic, trapezoid"),
    ({"reference": {"kind": "csv"}}, "reference.file", 'kind = "csv" needs it'),
    ({"reference": {"kind": "krl", "program": " "}}, "reference.program", "a statement a line"),
    ({"reference": {"kind": "line"}}, "reference.position_mm", "needs it, or offset_mm"),
    (
        {"reference": {"kind": "line", "offset_mm": [1, 2, 30000]}},
        "reference.offset_mm[3]",
        "at most 20000",
    ),
    (
        {"reference": {"kind": "circle", "centre_offset_mm": [0, 0, 1]}},
        "reference.normal",
        'kind = "circle" needs it',
    ),
]
# Rules that a JSON Schema cannot say.
_BEYOND_SCHEMA: list[tuple[dict[str, Any], str, str]] = [
    (
        {"wrench": {"force_n": [1, 2, 3], "start_s": 2, "end_s": 1}},
        "wrench.end_s",
        "must come after start_s = 2",
    ),
    ({"output_step_s": 2.0}, "output_step_s", "must not exceed duration_s = 1"),
    ({"output_step_s": 1e-8}, "output_step_s", "samples, more than 1000000"),
    ({"duration_s": float("nan")}, "duration_s", "must be finite"),
    ({"initial.q_deg": [0, float("inf"), 0, 0, 0, 0]}, "initial.q_deg[2]", "must be finite"),
    ({"payload.inertia": [1, 0.1, 0.1, 0, 0, 0]}, "payload.inertia", "triangle inequality"),
]


@pytest.mark.parametrize(("changes", "key", "rule"), _BAD + _BEYOND_SCHEMA)
def test_bad_scenario_is_refused_by_key_and_rule(
    changes: dict[str, Any], key: str, rule: str
) -> None:
    with pytest.raises(ParameterError) as caught:
        parse_scenario(_with(changes), "test.toml")
    assert caught.value.key == key
    assert rule in caught.value.rule
    assert str(caught.value).startswith(f"test.toml: {key} ")


@pytest.mark.parametrize(("changes", "key", "rule"), _BAD)
def test_schema_refuses_what_the_loader_refuses(
    changes: dict[str, Any], key: str, rule: str
) -> None:
    assert not jsonschema.Draft202012Validator(_SCHEMA).is_valid(_with(changes))


@pytest.mark.parametrize(("changes", "key", "rule"), _LOOP)
def test_bad_controller_or_reference_is_refused(
    changes: dict[str, Any], key: str, rule: str
) -> None:
    table = _with(changes, _DRIVEN)
    with pytest.raises(ParameterError) as caught:
        parse_scenario(table, "test.toml")
    assert caught.value.key == key
    assert rule in caught.value.rule
    assert not jsonschema.Draft202012Validator(_SCHEMA).is_valid(table)


@pytest.mark.parametrize(
    ("centre", "normal", "key"),
    [
        ([0, 0, 0], [1, 0, 0], "centre_offset_mm"),
        ([0, 0, 100], [0, 0, 0], "normal"),
        ([0, 10, 100], [0, 0, 1], "centre_offset_mm"),
    ],
)
def test_circle_that_is_none_is_refused(centre: list[int], normal: list[int], key: str) -> None:
    circle = {"kind": "circle", "centre_offset_mm": centre, "normal": normal}
    with pytest.raises(ParameterError) as caught:
        parse_scenario(_with({"reference": circle}, _DRIVEN), "test.toml")
    assert caught.value.key == f"reference.{key}"


def test_driven_table_means_what_it_says() -> None:
    jsonschema.Draft202012Validator(_SCHEMA).validate(_DRIVEN)
    scenario = parse_scenario(_DRIVEN, "test.toml")
    assert scenario.limits == Limits("contact", True, True, np.radians(1.0), 0.1)
    assert scenario.wrench == Wrench((0, 0, 0), (1, 2, 3), "flange", 0.5, None)
    assert scenario.controller == ControllerSpec("pd")
    assert scenario.reference is not None
    assert scenario.reference.end == pytest.approx(np.radians([10, -90, 90, 0, 30, 0]))
    assert scenario.reference.speed_part == 0.5
    assert scenario.solver_used() == SolverSpec("SemiImplicitEuler", step=0.001)
    assert json.loads(json.dumps(scenario.describe())) == scenario.describe()
    sampled = _with({"controller.period_s": 0.004, "controller.delay_s": 0.002}, _DRIVEN)
    del sampled["solver"]
    scenario = parse_scenario(sampled, "test.toml")
    assert scenario.controller is not None
    assert scenario.controller.sampling == Sampling(0.004, 0.002)
    assert scenario.solver_used() == SolverSpec("RK4", step=0.004)


@pytest.mark.parametrize(
    "table",
    [
        {},
        [],
        {"initial": []},
        {"torque": {"kind": []}},
        None,
        {"controller": [], "reference": 3, "limits": 1, "wrench": "x"},
        {"controller": {"kind": []}, "reference": {"kind": {}, "program": 3, "normal": "xyz"}},
        {"reference": {"kind": "circle", "centre_offset_mm": ["a", 1, 2], "normal": [1]}},
    ],
)
def test_check_never_raises(table: Any) -> None:
    assert problems_in(table, "x")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"name = ", "no TOML"),
        (b"\xff\xfe", "not UTF-8 text at byte 0"),
        (b"", "schema missing"),
        (b"a = " + b"[" * 2000, "no TOML"),
    ],
)
def test_unreadable_scenario_is_refused(tmp_path: Path, content: bytes, reason: str) -> None:
    (tmp_path / "s.toml").write_bytes(content)
    with pytest.raises(FileError, match=reason):
        load_scenario(tmp_path / "s.toml")


def test_unknown_scenario_names_the_shipped_ones(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"shipped: .*free_swing"):
        load_scenario("free_swin")
    with pytest.raises(FileError, match="is a directory"):
        load_scenario(tmp_path)


def test_method_of_an_option_drops_what_the_file_says_to_the_other_kind(tmp_path: Path) -> None:
    fixed = with_options("free_swing", {"solver": {"method": "RK4", "step_s": 1e-3}})
    assert fixed.solver == SolverSpec("RK4", step=1e-3)
    path = tmp_path / "fixed.toml"
    path.write_text(
        'schema = "kr16.scenario/1"\nname = "fixed"\nduration_s = 1\n[initial]\n'
        'q_deg = [0, 0, 0, 0, 0, 0]\n[solver]\nmethod = "RK4"\nstep_s = 0.002\n'
    )
    assert with_options(path, {"solver": {"method": "RK45"}}).solver == SolverSpec("RK45")
    assert with_options(path, {"solver": {"step_s": 1e-3}}).solver == SolverSpec("RK4", step=1e-3)
    with pytest.raises(ParameterError, match=r"solver.rtol = 1e-06: means nothing"):
        with_options("free_swing", {"solver": {"method": "RK4", "rtol": 1e-6}})


def test_options_replace_values_of_the_file(tmp_path: Path) -> None:
    torque_csv(tmp_path / "tau.csv", [[0.0, *TAU]])
    toml = (
        'schema = "kr16.scenario/1"\nname = "mine"\nduration_s = 2\noutput_step_s = 0.5\n'
        "[initial]\nq_deg = [1, 2, 3, 4, 5, 6]\nqd_deg_s = [6, 5, 4, 3, 2, 1]\n"
        '[torque]\nkind = "csv"\nfile = "tau.csv"\n[solver]\nrtol = 1e-6\n'
    )
    path = tmp_path / "mine.toml"
    path.write_text(toml, encoding="utf-8")
    same = with_options(path, {"initial": {"q_deg": None}, "torque": None, "drives": None})
    assert same == load_scenario(path)
    assert same.folder == tmp_path
    changed = with_options(
        path,
        {"initial": {"q": [0.5] * 6}, "solver": {"method": "RK45"}, "torque": {"kind": "zero"}},
        LOAD,
    )
    assert changed.q == (0.5,) * 6
    assert changed.qd == same.qd
    assert changed.solver == SolverSpec("RK45", 1e-6)
    assert changed.torque == TorqueSpec()
    assert changed.payload == LOAD
    driven = with_options("step_disturbance", {"torque": {"kind": "zero"}, "duration_s": 0.5})
    assert driven.controller is None and driven.reference is None
    with pytest.raises(ParameterError, match="options: duration_s = -1"):
        with_options(path, {"duration_s": -1.0})
