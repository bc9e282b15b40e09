"""Simulations: conservation laws, other people's dynamics, torques, events, files, bad input."""

from __future__ import annotations

import copy
import csv
import json
import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import kr16cli
from kr16cli.errors import FileError, ParameterError
from kr16cli.export.urdf import urdf
from kr16cli.simulate.events import Event, LimitWatch
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.integrate import sample_times
from kr16cli.simulate.loop import Sampling
from kr16cli.simulate.motion_spec import ControllerSpec
from kr16cli.simulate.plant import Limits, Wrench
from kr16cli.simulate.run import UNITS, Run, load_run
from kr16cli.simulate.scenario import (
    Scenario,
    SolverSpec,
    TorqueSpec,
    load_scenario,
    parse_scenario,
    with_options,
)
from kr16cli.simulate.scenario_check import METHODS, problems_in
from kr16cli.simulate.summary import envelope, summarise, warnings
from kr16cli.simulate.torque import Table, read_torque_csv

Array = npt.NDArray[np.float64]

_DATA = Path(__file__).resolve().parent.parent / "data"
_SHIPPED = sorted(path.stem for path in (_DATA / "scenarios").glob("*.toml"))
_SCHEMA = json.loads((_DATA / "schemas" / "scenario.json").read_text(encoding="utf-8"))

BENT = Scenario(
    name="bent",
    q=(0.1, -1.0, 1.1, 0.3, 0.6, -0.2),
    qd=(0.3, -0.2, 0.4, 0.5, -0.6, 0.7),
    duration=0.5,
    output_step=0.05,
)
LOAD = kr16cli.Payload(16.0, (0.02, -0.03, 0.12), (0.4, 0.36, 0.3, 0.01, -0.02, 0.015))
TAU = (120.0, -300.0, -90.0, 6.0, -4.0, 0.02)


@pytest.fixture(scope="module")
def shipped(data: kr16cli.RobotData) -> Callable[[str], Run]:
    """The run of a shipped scenario, simulated once."""
    runs: dict[str, Run] = {}

    def run(name: str) -> Run:
        if name not in runs:
            runs[name] = simulate(data, load_scenario(name))
        return runs[name]

    return run


# The shipped scenarios ----------------------------------------------------------------------


def test_there_are_scenarios_to_start_from() -> None:
    assert {"free_swing", "drop_gravity_compensated", "payload_16kg"} <= set(_SHIPPED)


@pytest.mark.parametrize("name", _SHIPPED)
def test_shipped_scenario_runs_to_its_end(
    name: str, shipped: Callable[[str], Run], data: kr16cli.RobotData
) -> None:
    run, duration = shipped(name), load_scenario(name).duration
    assert run.failure is None
    assert run.time[0] == 0.0
    assert run.time[-1] == duration
    assert all(np.isfinite(getattr(run, key)).all() for key in UNITS)
    # Every joule is accounted for, as exactly as the solver was asked to work.
    scale = run.energy_kinetic.max() + np.ptp(run.energy_potential) + run.work_friction[-1]
    assert np.abs(run.drift).max() <= max(1e-8, 5.0 * run.statistics.rtol) * scale
    assert summarise(run, data)["complete"] is True


_FOLLOWING = {
    "ptp_16kg": (1e-6, 1e-6),
    "lin_near_wrist_singularity": (1e-6, 1e-6),
    "circle_task_space": (2e-3, 5e-3),
    "step_disturbance": (0.02, 0.03),
}


@pytest.mark.parametrize("name", _FOLLOWING)
def test_shipped_controller_follows_its_reference(name: str, shipped: Callable[[str], Run]) -> None:
    run = shipped(name)
    assert run.error is not None and run.q_ref is not None
    largest, last = run.error.max(axis=0), run.error[-1]
    assert (largest <= _FOLLOWING[name]).all()
    assert (last <= 0.2 * np.array(_FOLLOWING[name])).all()
    moved = np.abs(run.q_ref - run.q_ref[0]).max()
    assert moved == 0.0 if name == "step_disturbance" else moved > 0.1
    arrived = [event.kind for event in run.events] == ["target_reached"]
    assert arrived is (name != "step_disturbance")


def test_line_passes_near_the_wrist_singularity(shipped: Callable[[str], Run]) -> None:
    run = shipped("lin_near_wrist_singularity")
    assert np.degrees(np.abs(run.q[:, 4]).min()) == pytest.approx(4.0, abs=0.01)
    assert np.degrees(np.ptp(run.q[:, 3])) > 130.0


@pytest.mark.parametrize("name", _SHIPPED)
def test_shipped_scenario_obeys_the_schema(name: str) -> None:
    table = tomllib.loads((_DATA / "scenarios" / f"{name}.toml").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(_SCHEMA).validate(table)


def test_free_swing_keeps_its_energy(shipped: Callable[[str], Run]) -> None:
    run = shipped("free_swing")
    energy = run.energy_kinetic + run.energy_potential
    assert run.energy_kinetic.max() > 100.0
    assert np.ptp(energy) < 1e-6
    assert not run.work_torque.any() and not run.work_friction.any()


def test_gravity_compensation_keeps_still(shipped: Callable[[str], Run]) -> None:
    run = shipped("drop_gravity_compensated")
    assert np.abs(run.q - run.q[0]).max() < 1e-12
    assert np.abs(run.qd).max() < 1e-12
    assert np.abs(run.tau[0]).max() > 100.0


def test_friction_takes_what_the_torques_give(shipped: Callable[[str], Run]) -> None:
    run = shipped("constant_torque")
    assert run.work_torque[-1] > run.work_friction[-1] > 100.0
    assert (np.diff(run.work_friction) >= 0.0).all()
    assert run.work_torque[-1] == pytest.approx(
        float(np.dot(run.tau[0], run.q[-1] - run.q[0])), rel=1e-9
    )


# Against others -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("payload", "torques"), [(None, (0.0,) * 6), (LOAD, TAU)], ids=["free", "driven"]
)
def test_motion_is_that_of_pinocchio(
    data: kr16cli.RobotData, payload: kr16cli.Payload | None, torques: Any
) -> None:
    """Pinocchio's ABA on the exported URDF, in another solver at other tolerances."""
    model = pin.buildModelFromXML(urdf(data, payload))
    state = model.createData()
    tau = np.array(torques)

    def rates(t: float, y: Array) -> Array:
        return np.concatenate([y[6:], pin.aba(model, state, y[:6], y[6:], tau)])

    scenario = replace(BENT, duration=2.0, payload=payload, torque=TorqueSpec("constant", torques))
    run = simulate(data, scenario)
    start = np.array([*scenario.q, *scenario.qd])
    other = solve_ivp(rates, (0.0, 2.0), start, "RK45", t_eval=run.time, rtol=1e-11, atol=1e-12)
    early = run.time <= 1.0  # the motion is chaotic: errors grow about a thousandfold a second
    assert np.abs(run.q - other.y[:6].T)[early].max() < 1e-7
    assert np.abs(run.q - other.y[:6].T).max() < 1e-5
    assert np.abs(run.q - run.q[0]).max() > 1.0


@pytest.mark.parametrize("drives", [False, True], ids=["rigid", "drives"])
def test_solvers_agree(data: kr16cli.RobotData, drives: bool) -> None:
    duration = 0.03 if drives else 0.2  # friction near rest is stiff
    scenario = replace(BENT, duration=duration, output_step=0.01, drives=drives)
    scenario = replace(scenario, torque=TorqueSpec("constant", TAU))
    runs = {m: simulate(data, replace(scenario, solver=SolverSpec(method=m))) for m in METHODS}
    for method, run in runs.items():
        assert np.abs(run.q - runs["Radau"].q).max() < 1e-7
        assert run.statistics.evaluations > run.statistics.steps > 0
        assert method in (run.statistics.method, "auto")
    assert runs["auto"].statistics.method == ("LSODA" if drives else "DOP853")


def test_motion_runs_backward_to_its_start(data: kr16cli.RobotData) -> None:
    forth = simulate(data, BENT)
    turned = replace(BENT, q=tuple(forth.q[-1]), qd=tuple(-forth.qd[-1]))
    back = simulate(data, turned)
    assert np.abs(back.q[::-1] - forth.q).max() < 1e-8
    assert np.abs(back.qd[::-1] + forth.qd).max() < 1e-7


def test_record_says_what_the_model_says(data: kr16cli.RobotData) -> None:
    scenario = replace(BENT, payload=LOAD, drives=True, gravity=(1.0, -2.0, -9.0))
    run = simulate(data, replace(scenario, torque=TorqueSpec("gravity")))
    robot = kr16cli.Robot(data, payload=LOAD, drives=True).with_gravity((1.0, -2.0, -9.0))
    assert np.allclose(run.tau, robot.gravity(run.q), rtol=0, atol=1e-9)
    tau = robot.inverse_dynamics(run.q, run.qd, run.qdd)
    assert np.allclose(run.tau, tau, rtol=0, atol=1e-9)
    T = robot.fk(run.q)
    assert np.array_equal(run.pose[:, :3], T[:, :3, 3])
    assert np.array_equal(run.pose[:, 3:], robot.rpy(T))
    kinetic, potential = robot.energy(run.q, run.qd)
    assert np.array_equal(run.energy_kinetic, kinetic)
    assert np.array_equal(run.energy_potential, potential)
    # The qd that is integrated is the rate of the q that is sampled.
    fine = simulate(data, replace(scenario, duration=0.02, output_step=0.001))
    rate = (fine.q[2:] - fine.q[:-2]) / 0.002
    assert np.abs(rate - fine.qd[1:-1]).max() < 1e-4


# Torques ------------------------------------------------------------------------------------


def torque_csv(path: Path, rows: Sequence[Sequence[float]], header: str = "") -> Path:
    names = header or "time,tau1,tau2,tau3,tau4,tau5,tau6"
    lines = [names, *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_table_draws_straight_lines_and_holds_its_ends() -> None:
    table = Table([1.0, 2.0, 4.0, 5.0], [(0.0,) * 6, TAU, TAU, (1.0,) * 6])
    q = (0.0,) * 6
    assert list(table(0.0, q, q)) == [0.0] * 6
    assert list(table(1.25, q, q)) == pytest.approx([v / 4 for v in TAU])
    assert list(table(3.0, q, q)) == list(TAU)
    assert list(table(4.5, q, q)) == pytest.approx([(v + 1.0) / 2 for v in TAU])
    assert list(table(9.0, q, q)) == [1.0] * 6
    assert table.breaks == [1.0, 2.0, 4.0, 5.0]


def test_table_has_no_kink_where_rows_lie_on_a_line() -> None:
    line = Table([0.0, 0.5, 1.0, 3.0], [(3.0 * t,) * 6 for t in (0.0, 0.5, 1.0, 3.0)])
    assert line.breaks == [0.0, 3.0]
    assert Table([0.0, 1.0], [TAU, TAU]).breaks == []


def test_torques_of_a_file_do_what_the_numbers_say(data: kr16cli.RobotData, tmp_path: Path) -> None:
    rows = [[0.0, *TAU], [0.1, *(0.0,) * 6], [0.3, *(-v for v in TAU)]]
    torque_csv(tmp_path / "tau.csv", rows)
    spec = TorqueSpec("csv", file="tau.csv")
    run = simulate(data, replace(BENT, torque=spec, folder=tmp_path))
    for i in range(6):
        expected = np.interp(run.time, [0.0, 0.1, 0.3], [row[i + 1] for row in rows])
        assert np.abs(run.tau[:, i] - expected).max() < 1e-12

    def rates(t: float, y: Array) -> Array:
        now = [np.interp(t, [0.0, 0.1, 0.3], [row[i + 1] for row in rows]) for i in range(6)]
        return np.concatenate([y[6:], robot.forward_dynamics(y[:6], y[6:], np.array(now))])

    robot = kr16cli.Robot(data)
    start = np.array([*BENT.q, *BENT.qd])
    other = solve_ivp(rates, (0.0, 0.5), start, "RK45", rtol=1e-10, atol=1e-11, max_step=0.01)
    assert np.abs(run.q[-1] - other.y[:6, -1]).max() < 1e-7
    assert np.abs(run.drift).max() < 1e-7


def test_a_run_can_be_driven_again_by_its_own_csv(data: kr16cli.RobotData, tmp_path: Path) -> None:
    first = simulate(data, replace(BENT, torque=TorqueSpec("constant", TAU)))
    (tmp_path / "run.csv").write_text(first.to_csv(), encoding="utf-8")
    spec = TorqueSpec("csv", file=str(tmp_path / "run.csv"))
    again = simulate(data, replace(BENT, torque=spec))
    assert np.abs(again.q - first.q).max() < 1e-9


def test_csv_with_decimal_commas_and_units_is_read(tmp_path: Path) -> None:
    header = ";".join(["Time [s]", *(f"tau{i} [N m]" for i in range(1, 7)), "remark"])
    text = f"\ufeff{header}\r\n0,0;1,5;2;3;4;5;6;start\r\n\r\n0,5;-1,5;2;3;4;5;6;\r\n"
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    table = read_torque_csv(tmp_path / "t.csv")
    assert table.times == [0.0, 0.5]
    assert table.rows == [(1.5, 2, 3, 4, 5, 6), (-1.5, 2, 3, 4, 5, 6)]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "is empty"),
        ("time,tau1,tau2,tau3,tau4,tau5,tau6\n", "has a header and no row"),
        ("time,tau1,tau2,tau3,tau4,tau5\n0,1,2,3,4,5\n", "the header lacks tau6"),
        ("time,tau1,tau1,tau2,tau3,tau4,tau5,tau6\n", "names tau1 twice"),
        ("time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,x,4,5,6\n", "line 2: tau3 is 'x'"),
        ("time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,,4,5,6\n", "line 2: tau3 is empty"),
        ("time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,3,4,5\n", "line 2: 6 cells"),
        ("time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,3,4,5,nan\n", "tau6 is nan; every number"),
        ("time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,3,4,5,1e7\n", "tau6 is 1e7: torques are in"),
        (
            "time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,3,4,5,6\n0,1,2,3,4,5,6\n",
            "line 3: time 0 s does not exceed",
        ),
        ('time,tau1,tau2,tau3,tau4,tau5,tau6\n0,1,2,"3,4,5,6\n', "line 2"),
    ],
)
def test_bad_torque_file_is_refused_with_its_place(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=r"bad\.csv") as caught:
        read_torque_csv(tmp_path / "bad.csv")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_unreadable_torque_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "latin.csv").write_bytes(b"time\xff")
    for name, reason in (("none.csv", "No such file"), ("", "directory"), ("latin.csv", "byte 4")):
        with pytest.raises(FileError, match=reason):
            read_torque_csv(tmp_path / name)


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
