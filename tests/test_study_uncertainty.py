"""Uncertainty: what is drawn, and that samples, first order and plain robots agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kr16cli
from kr16cli.errors import InputError
from kr16cli.robot import Tolerance
from kr16cli.robot_file import load_data
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.scenario import with_options
from kr16cli.study import rollouts, trust
from kr16cli.study.family import Family, slopes
from kr16cli.study.session import finished
from kr16cli.study.spread import drawn, moved, standard, uncertain
from kr16cli.study.streams import uniforms
from kr16cli.study.uncertainty import nominal_motion, shares, sobol, torque_bands, work_for

DATA = load_data()
POSES = np.radians([(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (10.0, -60.0, 70.0, 20.0, 40.0, -30.0)])


def everything(data=DATA):
    """The robot with a tolerance on lengths, inertias and drives, too."""
    geometry = replace(
        data.geometry_provenance,
        tolerances={"d4": Tolerance(0.01), "a2": Tolerance(None, 0.002)},
    )
    joint = replace(
        data.joints[1],
        provenance=replace(
            data.joints[1].provenance,
            tolerances={"coulomb_nm": Tolerance(0.3), "rotor_inertia": Tolerance(None, 1e-4)},
        ),
    )
    link = replace(
        data.links[1],
        provenance=replace(data.links[1].provenance, tolerances={"inertia": Tolerance(None, 0.05),
                                                                 "mass": Tolerance(None, 3.0)}),
    )  # fmt: skip
    return replace(
        data,
        geometry_provenance=geometry,
        joints=(data.joints[0], joint, *data.joints[2:]),
        links=(data.links[0], link, *data.links[2:]),
    )


def test_every_tolerance_of_the_file_is_a_source():
    found = {s.name: (s.half, s.unit) for s in uncertain(DATA)}
    assert found["link[1].mass"] == (0.1, "relative")
    assert found["link[1].com.y"] == (0.03, "m")
    assert found["link[3].com.z"] == (0.05, "m")
    assert found["link[2].com"] == (0.2, "relative")
    assert found["link[5].com.z"] == (0.02, "m")
    assert found["link[6].inertia"] == (0.2, "relative")
    assert len(found) == 28
    more = {s.name: (s.half, s.unit) for s in uncertain(everything(), drives=True)}
    assert more["geometry.d4"] == (pytest.approx(0.0067), "m")
    assert more["geometry.a2"] == (0.002, "m")
    assert more["joint[2].coulomb_nm"] == (pytest.approx(0.3), "relative")
    assert more["joint[2].rotor_inertia"] == (pytest.approx(1e-4 / 1.3e-3), "relative")
    assert more["joint[6].viscous_nms"] == (0.5, "relative")
    assert more["link[2].mass"] == (3.0, "kg")
    assert more["link[2].inertia.xy"] == (0.05, "kg m2")
    assert "joint[2].coulomb_nm" not in {s.name for s in uncertain(everything())}


def test_a_robot_without_tolerances_is_told():
    with pytest.raises(InputError, match=r"states no tolerance.*plus_minus"):
        uncertain(load_data("chapter3"))


@pytest.mark.parametrize("drives", [False, True])
def test_a_family_is_its_robots(drives):
    data = everything()
    sources = uncertain(data, drives=drives)
    deviations = drawn(sources, uniforms(3, 0, 0, 5, len(sources)), "normal")
    load = kr16cli.Payload(7.0, (0.05, 0.0, 0.1), (0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
    family = Family(data, sources, deviations, payload=load, drives=drives)
    rng = np.random.default_rng(1)
    q, qd, qdd = (rng.uniform(-2.0, 2.0, (3, 6)) for _ in range(3))
    found = {
        "gravity": family.ask("gravity", q),
        "mass_matrix": family.ask("mass_matrix", q),
        "inverse_dynamics": family.ask("inverse_dynamics", q, qd, qdd),
    }
    for i, row in enumerate(deviations.tolist()):
        robot = kr16cli.Robot(moved(data, sources, row), payload=load, drives=drives)
        for name, values in found.items():
            inputs = (q, qd, qdd) if name == "inverse_dynamics" else (q,)
            expected = getattr(robot, name)(*inputs)
            assert np.abs(values[i] - expected).max() < 1e-12 * np.abs(expected).max()


def test_draws_have_the_spread_of_the_tolerances():
    sources = uncertain(DATA)
    half = np.array([s.half for s in sources])
    unit = uniforms(5, 0, 0, 40_000, len(sources))
    for kind in ("normal", "uniform"):
        made = drawn(sources, unit, kind)
        assert made.std(axis=0) == pytest.approx(standard(sources, kind), rel=0.02)
        assert np.abs(made.mean(axis=0) / half).max() < 0.02
    assert (np.abs(drawn(sources, unit, "normal")) < half).mean() == pytest.approx(0.9545, abs=0.01)
    assert (np.abs(drawn(sources, unit, "uniform")) <= half).all()


def test_no_factor_makes_a_mass_negative():
    wide = replace(DATA.links[2], tolerance=1.0)
    data = replace(DATA, links=(*DATA.links[:2], wide, *DATA.links[3:]))
    sources = uncertain(data)
    made = drawn(sources, uniforms(1, 0, 0, 100_000, len(sources)), "normal")
    factor = [s.unit == "relative" for s in sources]
    assert (1.0 + made[:, factor]).min() >= 0.01


def test_slopes_are_exact():
    """Against differences a thousand times smaller, within their rounding."""
    data = everything()
    sources = uncertain(data, drives=True)
    q, qd, qdd = POSES, np.full((2, 6), 0.7), np.full((2, 6), -1.2)
    small = [s._replace(half=s.half * 1e-3) for s in sources]
    for drives in (False, True):
        known = [s for s in sources if drives or not s.name.startswith("joint")]
        fine = [s for s in small if drives or not s.name.startswith("joint")]
        exact = slopes(data, known, "inverse_dynamics", q, qd, qdd, drives=drives)
        close = slopes(data, fine, "inverse_dynamics", q, qd, qdd, drives=drives)
        scale = np.abs(exact).max(axis=(1, 2), keepdims=True)
        assert (np.abs(exact - close) <= 1e-7 * scale + 1e-8).all()


def test_first_order_and_samples_agree_where_tolerances_are_small():
    links = tuple(
        replace(
            link,
            tolerance=None if link.tolerance is None else link.tolerance / 20,
            provenance=replace(
                link.provenance,
                tolerances={k: Tolerance(None, (t.absolute or 0.0) / 20)
                            for k, t in link.provenance.tolerances.items()},
            ),
        )
        for link in DATA.links
    )  # fmt: skip
    scenario = with_options("free_swing", {"duration_s": 0.3})
    work = work_for(replace(DATA, links=links), POSES, 4000, scenario=scenario)
    told = trust.answer(work)["result"]
    for name in ("gravity", "mass_matrix", "torque", "motion"):
        assert told[name]["disagreement"] < 0.05, name
        low, high = np.array(told[name]["low"]), np.array(told[name]["high"])
        two = 2 * np.array(told[name]["sigma_first_order"])
        assert np.abs((high - low) / 2 - two * 0.98).max() < 0.08 * two.max()
    assert told["agree_until"] == pytest.approx(0.3)


def test_the_path_s_sensitivity_is_the_derivative_of_the_path():
    for torque, drives in (("zero", False), ("gravity", False), ("zero", True)):
        scenario = with_options(
            "free_swing",
            {"duration_s": 0.2, "torque": {"kind": torque}, "drives": drives,
             "solver": {"rtol": 1e-13, "atol": 1e-13}},
        )  # fmt: skip
        data = everything()
        work = work_for(data, POSES, 2, scenario=scenario)
        half = np.array([s.half for s in work.sources])
        step = np.diag(1e-4 * half)
        both = work.family(np.vstack([step, -step]))
        paths = rollouts.motions(both, scenario, work.steps)
        d = len(half)
        close = (paths[:d] - paths[d:]) / (2e-4 * half)[:, None, None]
        exact = work.slopes()["motion"]
        assert np.abs(close - exact).max() < 1e-5 * np.abs(exact).max()
        assert np.abs(exact).max() > 0.0


def test_compiled_rollouts_and_columns_make_the_same_paths():
    step = {"method": "RK4", "step": 0.004}
    scenario = with_options("free_swing", {"duration_s": 0.2})
    scenario = replace(scenario, solver=replace(scenario.solver, **step))
    work = work_for(DATA, POSES, 2, scenario=scenario)
    deviations = drawn(work.sources, uniforms(1, 0, 0, 6, len(work.sources)), "normal")
    family = work.family(deviations)
    fast = rollouts.motions(family, scenario, work.steps)
    slow = rollouts._columns(family, scenario, work.steps)
    assert fast.shape == (6, len(work.steps.time), 6)
    assert np.abs(fast - slow).max() < 1e-12
    assert np.ptp(fast[:, -1], axis=0).max() > 1e-4


@pytest.mark.parametrize("name", ["payload_16kg", "constant_torque", "free_swing"])
def test_the_robot_in_the_middle_moves_as_the_simulator_moves_it(name):
    """Friction at rest is stiff: steps of some milliseconds would chatter there."""
    scenario = with_options(name, {"duration_s": 0.5})
    work = work_for(DATA, POSES, 2, scenario=scenario)
    still = np.zeros((1, len(work.sources)))
    path = rollouts.motions(work.family(still), scenario, work.steps)[0]
    run = simulate(DATA, replace(scenario, output_step=float(work.steps.time[1])))
    assert np.abs(path - run.q).max() < 1e-6


@pytest.mark.parametrize("data", [DATA, everything()], ids=["file", "lengths, too"])
def test_drawn_robots_move_as_the_simulator_moves_them(data):
    scenario = with_options("payload_16kg", {"duration_s": 0.1})
    work = work_for(data, POSES, 2, scenario=scenario)
    rows = drawn(work.sources, uniforms(1, 0, 0, 3, len(work.sources)), "normal")
    paths = rollouts.motions(work.family(rows), scenario, work.steps)
    other = moved(data, work.sources, rows[2].tolist())
    run = simulate(other, replace(scenario, output_step=float(work.steps.time[1])))
    assert (other.geometry != DATA.geometry) == (data is not DATA)
    assert np.abs(paths[2] - run.q).max() < 1e-6
    assert np.abs(paths[2] - paths[0]).max() > 1e-4


def test_friction_under_a_torque_that_follows_the_angles_has_no_bands_of_the_path():
    scenario = with_options("drop_gravity_compensated", {"drives": True, "duration_s": 0.05})
    told = trust.answer(work_for(DATA, POSES, trust.FEW, scenario=scenario))
    assert "motion" not in told["result"]
    assert told["warnings"] == [
        "the torque is of kind gravity: its torque has bands, its path is taken as the nominal one"
    ]


def test_shares_add_up_and_sobol_sees_the_same_where_all_is_linear():
    work = work_for(DATA, POSES[:1], 2)
    sigma = standard(work.sources, "normal")
    first = shares(work.slopes()["gravity"][:, 0], sigma, ())
    assert first.sum(axis=0) == pytest.approx([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    found = sobol(work)
    assert np.abs(found["first"][1:] - first.T[1:]).max() < 0.03
    assert (found["total"] >= found["first"] - 0.02).all()
    assert (found["total"][0] == 0.0).all()  # gravity does not turn A1


def test_bands_of_a_motion_are_two_sigma_of_first_order():
    scenario = with_options("ptp_16kg", {"duration_s": 0.5})
    motion = nominal_motion(DATA, scenario)
    band = torque_bands(DATA, motion.q, motion.qd, motion.qdd, payload=scenario.payload,
                        drives=True)  # fmt: skip
    told = trust.answer(work_for(DATA, POSES, 50, scenario=scenario))["result"]
    assert band == pytest.approx(2 * np.array(told["torque"]["sigma_first_order"]))
    assert "motion" not in told
    assert (torque_bands(load_data("chapter3"), *[np.zeros((2, 6))] * 3) == 0.0).all()


def test_results_do_not_depend_on_chunks_and_come_back_from_the_file(tmp_path, monkeypatch):
    work = work_for(DATA, POSES, 40)
    first = trust.answer(work)
    monkeypatch.setattr("kr16cli.study.uncertainty._CHUNK", 7)
    with finished(work) as store:
        assert trust.answer(work, store) == first
        trust.write(tmp_path / "u.npz", work, store, first)
    with np.load(tmp_path / "u.npz") as archive:
        assert archive["gravity"].shape == (40, 2, 6)
        low = np.percentile(archive["gravity"], 2.5, axis=0)
        assert low == pytest.approx(np.array(first["result"]["gravity"]["low"]))


def test_a_record_for_reports_names_what_matters_most():
    told = trust.record(DATA, 200)["result"]
    assert told["leading_joint"] == "A2"
    assert told["parameters"][0]["name"] == "link[3].mass"
    assert told["gravity"]["nominal"][0][1] == pytest.approx(-543.73, abs=0.01)


def test_numbers_without_a_tolerance_are_said_to_be_taken_as_exact():
    assert trust.answer(work_for(DATA, POSES, trust.FEW, drives=True))["warnings"] == []

    def bare(part):
        return replace(part, provenance=replace(part.provenance, tolerances={}))

    data = replace(
        DATA,
        joints=(DATA.joints[0], *map(bare, DATA.joints[1:3]), *DATA.joints[3:]),
        links=(*DATA.links[:4], *map(bare, DATA.links[4:])),
    )
    known = "no tolerance is stated for link 5, link 6"
    assert trust.answer(work_for(data, POSES, trust.FEW))["warnings"] == [
        f"{known}; taken as exact"
    ]
    assert trust.answer(work_for(data, POSES, trust.FEW, drives=True))["warnings"] == [
        f"{known}, the drive of A2, the drive of A3; taken as exact"
    ]


def test_too_few_samples_are_refused():
    with pytest.raises(InputError, match="--samples is 1"):
        work_for(DATA, POSES, 1)
