"""What a run tells: events, failures, limits, the record and its files."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import kr16cli
from kr16cli.errors import FileError
from kr16cli.simulate.events import Event, LimitWatch
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.integrate import sample_times
from kr16cli.simulate.run import UNITS, load_run
from kr16cli.simulate.scenario import (
    Scenario,
    SolverSpec,
    TorqueSpec,
)
from kr16cli.simulate.scenario_check import METHODS
from kr16cli.simulate.summary import envelope, warnings
from scenes import BENT, LOAD, TAU

Array = npt.NDArray[np.float64]

# Events, failures, limits -------------------------------------------------------------------


def test_limit_is_passed_when_a_uniform_turn_says(data: kr16cli.RobotData) -> None:
    """Without gravity, A6 alone turns uniformly: link 6 spins about a principal axis."""
    limit = data.joints[5].upper
    scenario = Scenario(
        name="spin",
        q=(0.0, -1.0, 1.0, 0.0, 0.5, limit - 0.5),
        qd=(0.0,) * 5 + (2.0,),
        gravity=(0.0, 0.0, 0.0),
    )
    run = simulate(data, scenario)
    assert [(e.joint, e.kind, e.value) for e in run.events] == [("A6", "leave_upper", limit)]
    assert run.events[0].time == pytest.approx(0.25, abs=1e-8)
    assert any("A6 passes its upper limit of 350 deg at 0.25 s" in w for w in warnings(run, data))


def test_two_passages_within_one_step_are_found(data: kr16cli.RobotData) -> None:
    lower = data.joints[1].lower

    def dense(t: float | Array) -> Array:
        """A2 dips 1e-4 rad below its limit around t = 0.43; nothing else moves."""
        s = np.asarray(t) - 0.43
        state = np.zeros((14, *np.shape(s)))
        state[1], state[7] = lower + s * s - 1e-4, 2.0 * s
        return state

    found = LimitWatch(data.joints).step(0.0, 1.0, dense)
    assert [(e.joint, e.kind) for e in found] == [("A2", "leave_lower"), ("A2", "return_lower")]
    assert [e.time for e in found] == pytest.approx([0.42, 0.44], abs=1e-6)


def test_start_beyond_a_limit_is_an_event(data: kr16cli.RobotData) -> None:
    beyond = replace(BENT, q=(0.0, 1.0, 1.0, 0.0, 0.5, 0.0), qd=(0.0,) * 6, duration=0.01)
    run = simulate(data, replace(beyond, torque=TorqueSpec("gravity")))
    assert run.events == (Event(0.0, "A2", "outside_upper", data.joints[1].upper),)
    at = replace(beyond, q=(data.joints[0].lower, -1.0, 1.0, 0.0, 0.5, 0.0))
    assert simulate(data, replace(at, torque=TorqueSpec("gravity"))).events == ()


class _Ending:
    """A torque that has no value after 0.3 s."""

    breaks = ()

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        return (math.sqrt(0.3 - t), 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("method", METHODS)
def test_failing_solver_leaves_a_marked_part(data: kr16cli.RobotData, method: str) -> None:
    scenario = replace(BENT, solver=SolverSpec(method=method, rtol=1e-6, max_steps=2000))
    run = simulate(data, scenario, torque=_Ending())
    assert run.failure is not None
    assert 0.25 < run.time[-1] <= 0.3
    assert all(np.isfinite(getattr(run, key)).all() for key in UNITS)
    assert len(run.time) == len(run.q) == len(run.tau) == len(run.pose)
    rows = list(csv.DictReader(StringIO(run.to_csv())))
    assert {row["status"] for row in rows} == {"partial"}
    assert envelope(run, data)["result"]["complete"] is False


def test_used_up_steps_end_the_run(data: kr16cli.RobotData) -> None:
    run = simulate(data, replace(BENT, solver=SolverSpec(max_steps=5)))
    assert run.failure == "the solver's 5 steps are used up"
    assert run.statistics.steps == 5
    assert run.time[-1] < BENT.duration


def test_fixed_step_that_is_too_long_is_found_out(data: kr16cli.RobotData) -> None:
    """Regularised friction is stiff: 50 ms are far beyond the stability of RK4."""
    torque = TorqueSpec("constant", TAU)
    scenario = replace(BENT, drives=True, torque=torque, solver=SolverSpec("RK4", step=0.05))
    run = simulate(data, scenario)
    assert run.failure == "the state is not finite"
    assert 0.0 <= run.time[-1] < BENT.duration
    assert all(np.isfinite(getattr(run, key)).all() for key in UNITS)


@pytest.mark.parametrize(("method", "bound"), [("RK4", 1e-6), ("SemiImplicitEuler", 2e-2)])
def test_fixed_steps_give_the_same_motion_between_odd_samples(
    data: kr16cli.RobotData, method: str, bound: float
) -> None:
    scenario = replace(BENT, duration=0.2, output_step=0.0037)
    exact = simulate(data, scenario)
    run = simulate(data, replace(scenario, solver=SolverSpec(method, step=0.004)))
    assert len(run.time) == len(exact.time)
    assert np.abs(run.q - exact.q).max() < bound
    assert np.abs(run.qd - exact.qd).max() < 100 * bound
    assert run.statistics.steps == 50
    assert run.statistics.evaluations == (200 if method == "RK4" else 50) + 1


def test_what_a_real_robot_would_not_do_is_said(data: kr16cli.RobotData) -> None:
    heavy = replace(BENT, duration=0.01, payload=kr16cli.Payload(20.0), qd=(3.0,) + (0.0,) * 5)
    torque = TorqueSpec("constant", (0.0, 0.0, 0.0, 0.0, 0.0, -107.0))
    texts = warnings(simulate(data, replace(heavy, torque=torque)), data)
    assert any("A1 reaches" in text and "more than its 156 deg/s" in text for text in texts)
    assert any("A6 is driven with 107 N m, more than its 106 N m" in text for text in texts)
    assert "payload 20 kg exceeds the rated 16 kg" in texts


def test_kinematics_only_robot_cannot_move() -> None:
    with pytest.raises(kr16cli.InputError, match="no inertial data"):
        simulate(kr16cli.load_data("kr16_l6"), BENT)


# The record and its files -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("duration", "step", "count"), [(1.0, 0.1, 11), (1.0, 0.3, 5), (0.3, 0.1, 4), (2.0, 2.0, 2)]
)
def test_samples_are_even_and_end_exactly(duration: float, step: float, count: int) -> None:
    times = sample_times(duration, step)
    assert (len(times), times[0], times[-1]) == (count, 0.0, duration)
    assert np.allclose(np.diff(times)[:-1], step)
    assert 0.0 < times[-1] - times[-2] <= step * (1 + 1e-9)


def test_npz_holds_the_run(data: kr16cli.RobotData, tmp_path: Path) -> None:
    scenario = replace(BENT, q=(0.0, 0.5, 1.0, 0.0, 0.5, 0.0), drives=True, payload=LOAD)
    run = simulate(data, scenario)
    assert run.events
    path = tmp_path / "run.npz"
    path.write_bytes(run.to_npz())
    with np.load(path, allow_pickle=False) as archive:
        names = ["time", "q", "qd", "qdd", "tau", "pose", "energy_kinetic", "energy_potential"]
        assert set(names) < set(archive.files)
        assert archive["q"].shape == archive["pose"].shape == (11, 6)
        assert archive["events"]["joint"].tolist() == [e.joint for e in run.events]
        assert archive["events"]["time"].tolist() == [e.time for e in run.events]
        about = json.loads(str(archive["metadata"]))
    assert about["model_sha256"] == data.sha256
    assert about["scenario"]["name"] == "bent"
    assert about["complete"] is True
    read = load_run(path)
    for name, value in vars(run).items():
        if isinstance(value, np.ndarray):
            assert np.array_equal(getattr(read, name), value)
        else:
            assert getattr(read, name) == value


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"text"])
def test_what_is_no_run_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.npz").write_bytes(content)
    with pytest.raises(FileError, match="holds no run"):
        load_run(tmp_path / "x.npz")
    with pytest.raises(FileError, match="cannot be read"):
        load_run(tmp_path / "none.npz")


def test_csv_names_every_unit_and_loses_no_digit(data: kr16cli.RobotData) -> None:
    run = simulate(data, BENT)
    header, *rows = csv.reader(StringIO(run.to_csv()))
    assert header[:2] == ["time [s]", "q1 [rad]"]
    assert {"qd6 [rad/s]", "qdd1 [rad/s2]", "tau6 [N m]", "x [m]", "c [rad]"} < set(header)
    assert header[-6:-4] == ["energy_kinetic [J]", "energy_potential [J]"]
    assert header[-2:] == ["work_wrench [J]", "work_contact [J]"]
    table = np.array(rows, dtype=float)
    assert np.array_equal(table[:, 0], run.time)
    assert np.array_equal(table[:, 1:7], run.q)
    assert np.array_equal(table[:, header.index("x [m]") :][:, :6], run.pose)


def test_summary_is_json_and_adds_up(data: kr16cli.RobotData) -> None:
    short = replace(BENT, duration=0.1, drives=True, torque=TorqueSpec("constant", TAU))
    run = simulate(data, short)
    answer = envelope(run, data)
    assert json.loads(json.dumps(answer, allow_nan=False)) == answer
    result, energy = answer["result"], answer["result"]["energy"]
    gain = sum(energy[f"{k}_final"] - energy[f"{k}_initial"] for k in ("kinetic", "potential"))
    assert gain == pytest.approx(energy["work_torque"] - energy["work_friction"], abs=1e-6)
    assert result["final"]["q"] == run.q[-1].tolist()
    assert result["extremes"]["qd_max"] == np.abs(run.qd).max(axis=0).tolist()
    assert set(result["final"]) <= set(answer["units"])
    assert answer["input"]["torque"] == {"kind": "constant", "tau": list(TAU)}
