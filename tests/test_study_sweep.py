"""Sweeps: paths, designs, and rows that equal single simulations."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from kr16cli.errors import InputError
from kr16cli.robot_file import load_data
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.scenario import load_scenario, with_options
from kr16cli.study import sweep_facts, tables
from kr16cli.study.design import Design, design, variable
from kr16cli.study.engine import Local
from kr16cli.study.paths import changed, find, known, unit_of
from kr16cli.study.session import finished
from kr16cli.study.sweep import FIGURES, figures, sweep_of

FILE = load_data().path
SHORT = "duration_s=0.1,0.2"


def a_sweep(*vary, scenario="free_swing", latin=None, monte_carlo=None, seed=1, simulator=False):
    plan = design(vary, latin=latin, monte_carlo=monte_carlo, seed=seed)
    return sweep_of(FILE, scenario, plan, simulator=simulator)


def whole(work, **options):
    with finished(work, **options) as store:
        return sweep_facts.whole(work, store)


def test_a_row_is_the_simulation_with_those_numbers():
    work = a_sweep("payload.mass=0,10", "duration_s=0.1,0.2", "link[2].mass=x1.1", simulator=True)
    rows = whole(work)
    assert set(rows["engine"]) == {"simulator"}
    assert rows["payload.mass"].tolist() == [0.0, 0.0, 10.0, 10.0]
    assert rows["duration_s"].tolist() == [0.1, 0.2, 0.1, 0.2]
    assert set(rows["status"]) == {"ok"}
    loaded = with_options("free_swing", {"duration_s": 0.2, "payload": {"mass": 10.0}})
    data = load_data()
    heavier = work.one([10.0, 0.2, 1.1])[0]
    assert heavier.links[1].mass == pytest.approx(1.1 * data.links[1].mass)
    expected = figures(simulate(heavier, loaded), heavier)
    assert rows["q_end_3"][3] == expected["q_end"][2]
    assert rows["energy_kinetic_max"][3] == expected["energy_kinetic_max"]


def test_an_unvaried_row_is_the_scenario_itself():
    rows = whole(a_sweep("link[1].mass=x1", simulator=True))
    told = figures(simulate(load_data(), load_scenario("free_swing")), load_data())
    for name, column in FIGURES.items():
        for i in range(column.shape[0] if column.shape else 1):
            label = f"{name}_{i + 1}" if column.shape else name
            value = told[name][i] if column.shape else told[name]
            assert rows[label][0] == pytest.approx(value, nan_ok=True)


def test_processes_give_the_same_table():
    work = a_sweep("initial.q_deg[2]=-60:60:9", "duration_s=0.05", simulator=True)
    here, there = whole(work), whole(work, runner=Local(2))
    for name, values in here.items():
        assert values.tobytes() == there[name].tobytes()


def test_paths_reach_both_files():
    work = a_sweep("gains.natural_frequency=10,20", "joint[6].viscous_nms=x2", "gravity[3]=-1.6",
                   "controller.damping_ratio=0.7", scenario="ptp_16kg")  # fmt: skip
    values = [20.0, 2.0, -1.6, 0.7]
    new = [20.0, 2.0 * 3.92, -1.6, 0.7]
    made = changed(work.tables, work.places, new)
    assert made.scenario["controller"]["natural_frequency"] == 20.0
    assert made.scenario["controller"]["damping_ratio"] == 0.7
    assert made.scenario["gravity"] == [0.0, 0.0, -1.6]
    assert made.robot["joint"][5]["viscous_nms"] == 7.84
    assert work.tables.scenario["controller"]["natural_frequency"] == 15
    assert work.places[0].value == 15
    data, _ = work.one(values)
    assert data.joints[5].viscous == 7.84


def test_a_path_to_a_list_moves_all_of_it():
    work = a_sweep("controller.kp=x0.5,x2", scenario="step_disturbance")
    place = work.places[0]
    assert place.value == [20000, 20000, 10000, 2000, 2000, 100]
    assert known(work.tables).count("controller.kp[6]") == 1


def test_a_number_that_sources_disagree_on_can_be_varied():
    work = a_sweep("geometry.d6=0.115,0.2", "duration_s=0.02")
    assert work.case([0.2, 0.02]).data.conflicts == ()
    assert "0.158" in work.base.data.conflicts[0]
    assert set(whole(work)["status"]) == {"ok"}


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("payload.mass", "kg"),
        ("initial.q_deg[3]", "deg"),
        ("initial.qd_deg_s", "deg/s"),
        ("gravity[2]", "m/s2"),
        ("link[2].com[1]", "m"),
        ("joint[4].viscous_nms", "N m s/rad"),
        ("solver.rtol", ""),
        ("duration_s", "s"),
    ],
)
def test_a_varied_number_has_its_unit(path, unit):
    assert unit_of(a_sweep("duration_s=0.1").tables, path) == unit
    assert a_sweep(f"{path}=x1").columns()[path].unit == "factor"


def test_no_payload_is_a_payload_of_no_mass():
    work = a_sweep("payload.mass=0,5", scenario="ptp_16kg")
    assert "payload" not in changed(work.tables, work.places, [0.0]).scenario
    kept = changed(work.tables, work.places, [5.0]).scenario["payload"]
    assert (kept["mass"], kept["com"]) == (5.0, [0.0, 0.0, 0.12])


@pytest.mark.parametrize(
    ("path", "near"),
    [
        ("payload.mas", "payload.mass"),
        ("link[2].mas", "link[2].mass"),
        ("link[7].mass", "link[6].mass"),
        ("link[0].mass", "].mass"),
        ("initial.q_deg[7]", "initial.q_deg"),
        ("joint[1].viscous", "joint[1].viscous_nms"),
        ("link[2]", "link[2].mass"),
        ("name", "such as"),
        ("drives", "near: duration_s"),
        ("a..b", "such as"),
        ("", "such as"),
    ],
)
def test_an_unknown_path_lists_near_ones(path, near):
    tables_ = a_sweep("duration_s=0.1").tables
    with pytest.raises(InputError, match="no number of the scenario or the robot") as told:
        find(tables_, path)
    assert near in str(told.value)


def test_every_known_path_can_be_found_and_put_back():
    work = a_sweep("duration_s=0.1", scenario="ptp_16kg")
    paths = known(work.tables)
    assert len(paths) == len(set(paths)) > 150
    for path in paths:
        place = find(work.tables, path)
        made = changed(work.tables, [place], [place.value])
        if path.startswith(("link", "joint", "geometry")):
            assert made.robot == work.tables.robot


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a=0:16:5", (0.0, 4.0, 8.0, 12.0, 16.0)),
        ("a=1,2,5", (1.0, 2.0, 5.0)),
        ("a=x0.5:x2:4", (0.5, 1.0, 1.5, 2.0)),
        ("a=x0.5:2:4", (0.5, 1.0, 1.5, 2.0)),
        (" a = 3 ", (3.0,)),
    ],
)
def test_levels_are_read(text, values):
    v = variable(text)
    assert (v.path, v.values, v.factor) == ("a", values, "x" in text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a", "write PATH="),
        ("a=", "write PATH="),
        ("=1", "write PATH="),
        ("a=5:1:3", "the range is empty"),
        ("a=1:1:3", "the range is empty"),
        ("a=1:2:1", "whole number of 2 or more"),
        ("a=1:2:x", "whole number of 2 or more"),
        ("a=1:2:3:4", "LOW:HIGH or LOW:HIGH:COUNT"),
        ("a=1,,2", "no finite number"),
        ("a=1:inf:3", "no finite number"),
        ("a=5+-0", "sigma is 0"),
        ("a=1_0", "no finite number"),
    ],
)
def test_senseless_values_are_told(text, words):
    with pytest.raises(InputError, match=words):
        variable(text)


def test_designs_are_told_what_they_lack():
    v = variable("a=1:2")
    for make, words in (
        (lambda: Design(()), "needs something to vary"),
        (lambda: Design((v,)), "has no count"),
        (lambda: Design((v, v), "latin", 3), "is given twice"),
        (lambda: Design((v,), "monte-carlo", 0), "must be 1 or more"),
        (lambda: Design(tuple(variable(f"a{i}=0:1:1000") for i in range(3))), "at most"),
        (lambda: design(["a=1:2"], latin=3, monte_carlo=3, seed=1), "exclude each other"),
    ):
        with pytest.raises(InputError, match=words):
            make()


def test_a_factorial_takes_every_combination_once():
    rows = Design((variable("a=1,2,3"), variable("b=0:1:4"))).rows(0, 12)
    assert len(np.unique(rows, axis=0)) == 12
    assert rows[:5, 0].tolist() == [1, 1, 1, 1, 2]


def test_a_latin_hypercube_has_one_run_in_every_slice():
    plan = design(["a=0:10", "b=-1:1"], latin=40, monte_carlo=None, seed=5)
    rows = plan.rows(0, 40)
    for column, low, high in ((rows[:, 0], 0, 10), (rows[:, 1], -1, 1)):
        assert sorted(((column - low) / (high - low) * 40).astype(int)) == list(range(40))
    assert (plan.rows(7, 19) == rows[7:19]).all()


def test_random_draws_have_the_moments_asked_for():
    plan = design(["a=8+-3", "b=0:1", "c=1,2"], latin=None, monte_carlo=20_000, seed=2)
    rows = plan.rows(0, 20_000)
    assert rows.mean(axis=0) == pytest.approx([8.0, 0.5, 1.5], abs=0.08)
    assert rows.std(axis=0) == pytest.approx([3.0, 12**-0.5, 0.5], rel=0.02)
    assert (plan.rows(4000, 4100) == rows[4000:4100]).all()
    assert set(rows[:, 2]) == {1.0, 2.0}


def test_a_bad_run_is_marked_and_others_go_on():
    rows = whole(a_sweep("duration_s=0.05,-1", "link[6].mass=0.83"))
    assert rows["status"][0] == "ok"
    assert "must be > 0" in rows["status"][1]
    assert np.isnan(rows["q_end_1"][1])
    assert rows["limits_passed"][1] == -1
    assert rows["engine"].tolist() == ["rollout", ""]


def test_tables_hold_the_same_numbers_in_every_format(tmp_path):
    work = a_sweep("payload.mass=0:16:3", "duration_s=0.05")
    parquet = pytest.importorskip("pyarrow.parquet")
    with finished(work) as store:
        columns = sweep_facts.whole(work, store)
        answer = sweep_facts.answer(work, columns)
        for suffix in tables.SUFFIXES:
            tables.write(tmp_path / f"t{suffix}", work, store, answer)
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = parquet.read_table(tmp_path / "t.parquet")
    assert json.loads(table.schema.metadata[b"metadata"]) == answer
    with np.load(tmp_path / "t.npz") as archive:
        assert archive["q_end"].shape == (3, 6)
        for i in range(3):
            value = archive["q_end"][i, 1]
            assert float(rows[i]["q_end_2 [rad]"]) == value
            assert table["q_end_2"][i].as_py() == value
            assert rows[i]["error_position [m]"] == ""
            assert table["error_position"][i].as_py() is None
    assert rows[2]["payload.mass [kg]"] == "16.0"


def test_rank_correlations_tell_what_matters():
    work = a_sweep("payload.mass=0:16:5", "duration_s=0.05")
    told = sweep_facts.answer(work, whole(work))["result"]
    assert told["failed"] == 0
    ranks = told["figures"]["energy_kinetic_max"]["rank_correlation"]
    assert ranks["payload.mass"] == pytest.approx(1.0)
    assert ranks["duration_s"] is None
    assert told["figures"]["tau_max_1"]["varies"] is False
    assert told["figures"]["error_position"] is None
