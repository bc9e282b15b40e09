"""The suites pass on the shipped robot, and fail on faults put into the model and the data."""

from __future__ import annotations

import ast
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kr16cli
from kr16cli.kernels.engine import engine_name, has_native
from kr16cli.model import chain, coriolis, dynamics, forward, inertia, jacobian, posture
from kr16cli.robot import RobotData
from kr16cli.verify import measure, registry, report_text, sampling
from kr16cli.verify.engines import SOURCES
from kr16cli.verify.independent import exponentials, roots
from kr16cli.verify.records import Result, Setting

_SUITES = ("kinematics", "inverse", "velocity", "dynamics", "simulation", "datasheet", "engines")


def _verdicts(suite: str, robot: kr16cli.Robot | None = None, seed: int = 20161) -> list[Result]:
    setting = Setting(robot or kr16cli.load_robot(), seed, quick=True)
    return list(registry.run(registry.cases([suite]), setting))


def _failures(suite: str, robot: kr16cli.Robot | None = None) -> set[str]:
    return {r.id for r in _verdicts(suite, robot) if r.status == "failed"}


def _fails(suite: str) -> bool:
    """Whether a case fails; stops at the first that does."""
    setting = Setting(kr16cli.load_robot(), quick=True)
    return any(r.status == "failed" for r in registry.run(registry.cases([suite]), setting))


@pytest.mark.parametrize("suite", _SUITES)
def test_suite_passes_on_the_shipped_robot(suite: str) -> None:
    results = _verdicts(suite)
    assert [(r.id, r.error, r.evidence) for r in results if r.status == "failed"] == []
    assert sum(r.status == "passed" for r in results) >= len(results) / 2


@pytest.mark.parametrize("suite", ["kinematics", "inverse", "velocity", "dynamics"])
@pytest.mark.parametrize("seed", [1, 2])
def test_tolerances_do_not_hang_on_a_seed(suite: str, seed: int) -> None:
    wrong = [(r.id, r.error) for r in _verdicts(suite, seed=seed) if r.status == "failed"]
    assert wrong == []


def test_kinematics_only_robot_skips_dynamics_and_passes_the_rest() -> None:
    robot = kr16cli.load_robot("kr16_l6")
    for suite in ("kinematics", "inverse", "velocity", "dynamics", "simulation", "datasheet"):
        results = _verdicts(suite, robot)
        assert [(r.id, r.evidence) for r in results if r.status == "failed"] == []
    assert all(r.status == "skipped" for r in _verdicts("simulation", robot))


def test_every_numbered_equation_has_a_property_case_beside_its_audit() -> None:
    named = {e for c in registry.cases(_SUITES) for e in c.equations}
    assert {f"3.{k}" for k in range(1, 52)} <= named
    audited = {e for c in registry.cases(["chapter"]) for e in c.equations}
    assert {f"3.{k}" for k in range(1, 52)} <= audited


def test_every_known_motion_is_a_case_of_the_simulation() -> None:
    ids = {c.id.partition(".")[2] for c in registry.cases(["simulation"])}
    assert ids >= {
        "order", "energy", "work", "pendulum", "joint-errors", "task-errors", "reversal",
        "mujoco", "pinocchio", "lagrange",
    }  # fmt: skip


def test_cases_on_other_engines_say_so_and_name_an_engine_there_is() -> None:
    for case in registry.cases(_SUITES):
        others = [name for name in SOURCES if name in case.id.split(".")]
        assert case.engine == (others[0] if others else None), case.id


def test_model_runs_on_its_own_source_unless_an_engine_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("KR16_ENGINE", raising=False)
    with registry.model_source():
        assert engine_name() == "numpy"
        with registry.using_engine("native" if has_native() else "numpy"):
            assert engine_name() == ("native" if has_native() else "numpy")
        assert engine_name() == "numpy"
    assert "KR16_ENGINE" not in os.environ
    monkeypatch.setenv("KR16_ENGINE", "numpy")
    with registry.model_source():
        pass
    assert os.environ["KR16_ENGINE"] == "numpy"


def test_every_case_says_what_it_is() -> None:
    for case in registry.cases(_SUITES):
        assert case.id.startswith(f"{case.suite}.")
        texts = (case.title, case.statement, case.regime, case.method, case.reason, case.unit)
        assert all(texts), case.id
        assert case.tolerance > 0


def test_results_are_json_and_their_worst_case_can_be_pasted() -> None:
    from command_line import kr16

    results = _verdicts("kinematics")
    assert json.dumps([report_text.entry(r) for r in results], allow_nan=False)
    command = next(r.worst["command"] for r in results if "command" in r.worst)
    assert kr16(*command.split()[1:]).code == 0


@pytest.mark.parametrize(
    "path", sorted(Path(exponentials.__file__).parent.glob("*.py")), ids=lambda p: p.stem
)
def test_independent_code_imports_nothing_of_the_model(path: Path) -> None:
    allowed = {"kr16cli.robot", "kr16cli.verify.independent"}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module]
            for name in filter(None, names):
                inside = name.startswith("kr16cli")
                assert not inside or any(name.startswith(a) for a in allowed), name


def test_a_value_that_is_not_finite_is_the_worst() -> None:
    found = measure.finding([0.1, np.nan, 0.2], "compared", q=np.zeros((3, 6)))
    assert np.isnan(found.error)
    assert "sample 1 is not finite" in found.evidence
    assert np.isnan(measure.finding([], "compared").error)
    assert measure.counted([False, True, True], "counted").error == 2.0


def test_root_finders_find_the_configuration_a_pose_was_made_from() -> None:
    g = kr16cli.load_data().geometry
    rng = np.random.default_rng(3)
    q = sampling.regular(rng, 20, kr16cli.load_data())
    found = roots.quartic(g, exponentials.flange(g, q))
    gaps = np.nanmin(np.abs(found.angles - q[:, None]).max(axis=2), axis=1)
    assert gaps.max() < 1e-7
    assert set(found.number.tolist()) <= {4, 8}


# Faults ---------------------------------------------------------------------------------------


def _scaled(function: Callable[..., Any], factor: float) -> Callable[..., Any]:
    """The function with its first result a little wrong."""

    def wrong(*args: Any, **options: Any) -> Any:
        value = function(*args, **options)
        if isinstance(value, list) and isinstance(value[0], list):
            return [[value[0][0] * factor, *value[0][1:]], *value[1:]]
        if isinstance(value, list):
            return [value[0] * factor, *value[1:]]
        return value * factor

    return wrong


@pytest.mark.parametrize(
    ("module", "name", "suite"),
    [
        (forward, "r36", "kinematics"),
        (jacobian, "jacobian", "velocity"),
        (jacobian, "jacobian_dot", "velocity"),
        (jacobian, "determinant", "velocity"),
        (dynamics, "mass_matrix", "dynamics"),
        (coriolis, "coriolis_matrix", "dynamics"),
        (dynamics, "gravity_torque", "dynamics"),
        (dynamics, "friction", "dynamics"),
    ],
    ids=lambda v: getattr(v, "__name__", str(v)),
)
def test_a_factor_of_a_millionth_is_found(
    module: Any, name: str, suite: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, name, _scaled(getattr(module, name), 1 + 1e-6))
    assert _fails(suite)


def test_a_wrong_sign_in_table_3_1_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    true = chain.dh_table

    def wrong(g: Any) -> Any:
        rows = list(true(g))
        rows[3] = rows[3]._replace(a=-rows[3].a)
        return tuple(rows)

    monkeypatch.setattr(chain, "dh_table", wrong)
    assert {"kinematics.closed-form", "kinematics.table"} <= _failures("kinematics")


def test_a_lost_parameter_in_regrouping_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    true = inertia.regroup

    def wrong(bodies: Any, g: Any) -> Any:
        first, *rest = true(bodies, g)
        return (first._replace(zz=first.zz + 0.001), *rest)

    monkeypatch.setattr(inertia, "regroup", wrong)
    assert "dynamics.mass-matrix" in _failures("dynamics")


def test_a_swapped_branch_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    from kr16cli.model import inverse

    true = inverse.solve_near

    def wrong(*args: Any) -> Any:
        found = true(*args)
        angles = [found.angles[i ^ 2] for i in range(8)]
        return found._replace(angles=angles)

    monkeypatch.setattr(inverse, "solve_near", wrong)
    assert {"inverse.recovery", "inverse.labels"} <= _failures("inverse")


def test_a_status_bit_the_other_way_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    true = posture.status
    monkeypatch.setattr(kr16cli.api, "status", lambda q, g: true(q, g) ^ 2)
    assert "kinematics.status-turn" in _failures("kinematics")
    assert "datasheet.poses" in _failures("datasheet")


def _longer(data: RobotData) -> RobotData:
    return replace(data, geometry=data.geometry._replace(d4=data.geometry.d4 + 1e-4))


def _heavier(data: RobotData) -> RobotData:
    link = replace(data.links[2], mass=data.links[2].mass * 1.001)
    return replace(data, links=(*data.links[:2], link, *data.links[3:]))


def _geared(data: RobotData) -> RobotData:
    joint = replace(data.joints[3], gear_ratio=74.518)
    return replace(data, joints=(*data.joints[:3], joint, *data.joints[4:]))


def _rated(data: RobotData) -> RobotData:
    return replace(data, ratings={**data.ratings, "payload_kg": 16.016})


@pytest.mark.parametrize("change", [_longer, _heavier, _geared, _rated], ids=lambda f: f.__name__)
def test_a_changed_number_is_found(change: Callable[[RobotData], RobotData]) -> None:
    robot = kr16cli.Robot(change(kr16cli.load_data()))
    assert "datasheet.numbers" in _failures("datasheet", robot)
