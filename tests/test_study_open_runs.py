"""Sweeps on the compiled solvers: the simulator's figures, row for row, and who serves what."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kr16cli.errors import InputError
from kr16cli.robot_file import load_data
from kr16cli.simulate.scenario import load_scenario, with_options
from kr16cli.study import open_runs, sweep, sweep_facts
from kr16cli.study.design import design
from kr16cli.study.engine import Local
from kr16cli.study.open_runs import Case, passages
from kr16cli.study.session import finished

DATA = load_data()

# Both solvers keep to a tolerance of 1e-9 a step, which the arm's own motion makes larger; the
# balance of energy holds a sum over samples, not an integral.
AGREES = {"energy_drift": 1e-3, "energy_kinetic_max": 1e-3, "work_torque": 1e-3}
_ANGLES = 5e-5


def rows_of(scenario: str, *vary: str, simulator: bool = False, **options) -> dict[str, np.ndarray]:
    plan = design(vary, latin=None, monte_carlo=options.pop("monte_carlo", None), seed=1)
    work = sweep.sweep_of(DATA.path, scenario, plan, simulator=simulator)
    with finished(work, **options) as store:
        return sweep_facts.whole(work, store)


def agree(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> None:
    assert list(a) == list(b)
    for name, values in a.items():
        if name != "engine" and values.dtype.kind != "f":
            assert (values == b[name]).all(), name
        elif name != "engine":
            close = AGREES.get(name, _ANGLES)
            assert values == pytest.approx(b[name], abs=close, rel=0, nan_ok=True), name


@pytest.mark.parametrize(
    ("scenario", "vary"),
    [
        ("free_swing", ("payload.mass=0,3,16", "link[2].mass=x0.9,x1.1", "duration_s=0.5,1.2")),
        ("free_swing", ("gravity[1]=0,2", "geometry.d4=0.67,0.7", "output_step_s=0.01,0.007")),
        ("payload_16kg", ("payload.mass=0,16", "joint[3].viscous_nms=x0.5,x2",
                          "initial.q_deg[4]=0,70")),
        ("constant_torque", ("torque.tau_nm[2]=-150,-400", "joint[2].coulomb_nm=0,62.5",
                             "joint[1].torque_nm=1844,100")),
    ],
)  # fmt: skip
def test_figures_are_those_of_the_simulator(scenario, vary):
    fast = rows_of(scenario, *vary)
    slow = rows_of(scenario, *vary, simulator=True)
    assert set(fast["engine"]) == {"rollout"}
    assert set(slow["engine"]) == {"simulator"}
    agree(fast, slow)
    assert np.ptp(fast["q_end_2"]) > 0.01


@pytest.mark.parametrize("method", ["RK4", "RK45"])
def test_a_solver_by_its_name_takes_the_simulator_s_very_steps(method, tmp_path):
    scene = tmp_path / "swing.toml"
    scene.write_text(
        'schema = "kr16.scenario/1"\nname = "swing"\nduration_s = 0.5\n'
        "[initial]\nq_deg = [0, -60, 60, 0, 30, 0]\n"
        f'[solver]\nmethod = "{method}"\n'
        + ("step_s = 0.003\n" if method == "RK4" else "rtol = 1e-6\n")
    )
    fast = rows_of(str(scene), "payload.mass=0,16")
    slow = rows_of(str(scene), "payload.mass=0,16", simulator=True)
    assert set(fast["engine"]) == {"rollout"}
    # RK45's steps are chosen by 12 numbers here and by 16 there.
    close = 1e-12 if method == "RK4" else 1e-5
    for name in ("q_end_1", "q_end_2", "q_end_3", "q_end_5"):
        assert fast[name] == pytest.approx(slow[name], abs=close)


def test_joints_that_leave_their_ranges_are_counted_as_events_are():
    words = ("initial.q_deg[2]=-60:30:7", "initial.q_deg[3]=0:150:4", "duration_s=1")
    fast, slow = rows_of("free_swing", *words), rows_of("free_swing", *words, simulator=True)
    assert fast["limits_passed"].tolist() == slow["limits_passed"].tolist()
    assert len(set(fast["limits_passed"])) == 3


def test_a_joint_that_only_looks_out_between_samples_is_seen():
    joint = dataclasses.replace(DATA.joints[0], lower=-0.5, upper=1.0)
    six = [dataclasses.replace(j, lower=-9.0, upper=9.0) for j in DATA.joints]
    times = np.array([0.0, 1.0, 1.5])
    q, qd = np.zeros((3, 3, 6)), np.zeros((3, 3, 6))
    # q = 4 u (1 - u) b rises to b within the first second; b is above, at and below the limit.
    for k, top in enumerate((1.001, 0.999, 1.001)):
        qd[k, 0, 0], qd[k, 1, 0] = 4 * top, -4 * top
        qd[k, 2, 0] = 4 * top  # and comes back from below
    q[2, :, 0] = 0.02  # the last then also looks out below
    qd[2, 1, 0], qd[2, 2, 0] = -4.4, 4.4
    found = passages([[joint, *six[1:]]] * 3, times, q, qd)
    below = [0.5 * 4 * 1.001 / 4 > 0.5, 0.5 * 4 * 0.999 / 4 > 0.5, True]
    assert found.tolist() == [1 + below[0], 0 + below[1], 2]


@pytest.mark.parametrize(
    ("scenario", "options", "reason"),
    [
        ("ptp_16kg", {}, "a controller answers the motion"),
        ("drop_gravity_compensated", {}, "the torque is of kind gravity"),
        ("free_swing", {"wrench": {"force_n": [0, 0, 1]}}, "a wrench pushes the flange"),
        ("free_swing", {"limits": {"joint": "stop"}}, "the limits act"),
        ("free_swing", {"limits": {"torque": True}}, "the limits act"),
        ("free_swing", {"solver": {"method": "LSODA"}}, "asks for LSODA"),
        ("circle_task_space", {}, "a controller answers the motion"),
        ("constant_torque", {}, None),
    ],
)
def test_what_answers_the_motion_is_named(scenario, options, reason):
    found = open_runs.unserved(with_options(scenario, options))
    assert found is None if reason is None else reason in found


def test_what_the_compiled_solvers_cannot_finish_goes_to_the_simulator(tmp_path):
    scene = tmp_path / "short.toml"
    scene.write_text(
        'schema = "kr16.scenario/1"\nname = "short"\nduration_s = 0.5\n'
        "[initial]\nq_deg = [0, -60, 60, 0, 30, 0]\n[solver]\nmax_steps = 40\n"
    )
    words = ("duration_s=0.02,0.5,2", "payload.mass=0,5")
    rows, slow = rows_of(str(scene), *words), rows_of(str(scene), *words, simulator=True)
    assert rows["engine"].tolist() == ["rollout"] * 2 + ["simulator"] * 4
    assert rows["status"].tolist()[:4] == ["ok"] * 4  # one step of the simulator goes further
    assert "steps are used up" in rows["status"][4]
    for name in ("status", "time_end", "q_end_2"):
        assert rows[name][2:].tolist() == slow[name][2:].tolist()


def test_a_robot_without_inertias_is_refused_before_any_run():
    bare = str(load_data("kr16_l6").path)
    asked = design(["duration_s=0.1"], latin=None, monte_carlo=None, seed=1)
    with pytest.raises(InputError, match="no inertial data"):
        sweep.sweep_of(bare, "free_swing", asked)


def test_neighbours_move_a_run_by_rounding_alone(monkeypatch):
    vary = ("payload.mass=0:16", "link[3].mass=x0.8:x1.2", "initial.q_deg[2]=-80:-40",
            "duration_s=0.1:0.1001")  # fmt: skip
    rows = rows_of("free_swing", *vary, monte_carlo=7)
    monkeypatch.setitem(sweep._CHUNK, True, 3)
    again = rows_of("free_swing", *vary, monte_carlo=7)
    assert (rows["payload.mass"] == again["payload.mass"]).all()
    assert np.abs(rows["q_end_3"] - again["q_end_3"]).max() < 1e-12


def test_processes_make_the_same_bits():
    vary = ("payload.mass=0:16:300", "duration_s=0.02")
    here, there = rows_of("free_swing", *vary), rows_of("free_swing", *vary, runner=Local(2))
    for name, values in here.items():
        assert values.tobytes() == there[name].tobytes(), name


def test_much_memory_is_not_taken_for_many_samples(monkeypatch):
    scenario = dataclasses.replace(load_scenario("free_swing"), duration=0.2, output_step=0.01)
    cases = [Case(DATA, dataclasses.replace(scenario, q=(0.1 * i,) * 6)) for i in range(5)]
    whole = open_runs.figures(cases)
    calls = []
    rollout = open_runs.rollout
    monkeypatch.setattr(
        open_runs, "rollout", lambda *a, **k: calls.append(len(a[1])) or rollout(*a, **k)
    )
    monkeypatch.setattr(open_runs, "_STATES_AT_ONCE", 50)
    parts = open_runs.figures(cases)
    assert calls == [2, 2, 1]
    for name, values in whole.columns.items():
        assert values == pytest.approx(parts.columns[name], abs=1e-9, nan_ok=True), name
