"""Simulations: shipped scenarios, conservation laws, other people's dynamics, torques."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import kr16cli
from kr16cli.errors import FileError
from kr16cli.export.mjcf import mjcf
from kr16cli.export.urdf import urdf
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.run import UNITS, Run
from kr16cli.simulate.scenario import (
    SolverSpec,
    TorqueSpec,
    load_scenario,
)
from kr16cli.simulate.scenario_check import METHODS
from kr16cli.simulate.summary import summarise
from kr16cli.simulate.torque import Table, read_torque_csv
from scenes import BENT, LOAD, TAU, torque_csv

Array = npt.NDArray[np.float64]

_DATA = Path(__file__).resolve().parent.parent / "data"
_SHIPPED = sorted(path.stem for path in (_DATA / "scenarios").glob("*.toml"))
_SCHEMA = json.loads((_DATA / "schemas" / "scenario.json").read_text(encoding="utf-8"))


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


@pytest.mark.parametrize("torques", [(0.0,) * 6, TAU], ids=["free", "driven"])
def test_motion_is_that_of_mujoco(data: kr16cli.RobotData, torques: Any) -> None:
    """MuJoCo's own Runge-Kutta steps of 0.2 ms on the exported MJCF."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(mjcf(data))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 2e-4
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    state = mujoco.MjData(model)
    state.qpos[:], state.qvel[:] = BENT.q, BENT.qd
    state.qfrc_applied[:] = torques
    scenario = replace(BENT, duration=2.0, torque=TorqueSpec("constant", torques))
    run = simulate(data, scenario)
    other = [np.array(state.qpos)]
    for _ in run.time[1:]:
        mujoco.mj_step(model, state, round(scenario.output_step / model.opt.timestep))
        other.append(np.array(state.qpos))
    off = np.abs(run.q - other)
    assert off[run.time <= 1.0].max() < 1e-6  # errors grow about a thousandfold a second
    assert off.max() < 1e-4
    assert np.ptp(run.q, axis=0).max() > 1.0


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
