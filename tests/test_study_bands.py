"""Bands of a run's torque: where they apply, how wide they are, and when they are left out."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from kr16cli.api import Robot
from kr16cli.robot import Payload
from kr16cli.robot_file import load_data
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.run import Run, load_run
from kr16cli.simulate.scenario import load_scenario
from kr16cli.study.bands import of_motion, of_run
from kr16cli.study.spread import drawn, moved, uncertain
from kr16cli.study.streams import uniforms

DATA = load_data()


@pytest.fixture(scope="module")
def run() -> Run:
    scenario = load_scenario("ptp_16kg")
    return simulate(DATA, dataclasses.replace(scenario, duration=0.6, gravity=(1.0, 0.0, -9.0)))


def test_the_band_of_a_controlled_run_holds_drawn_robots(run: Run, tmp_path: Any) -> None:
    file = tmp_path / "run.npz"
    file.write_bytes(run.to_npz())
    bands = of_run(DATA, load_run(file))
    assert bands.half is not None and bands.half.shape == run.tau.shape
    assert "95 % of the torque" in bands.words and "exact" not in bands.words
    placed = DATA.with_gravity((1.0, 0.0, -9.0))
    sources = uncertain(placed, drives=True)
    load = Payload(16.0, (0.0, 0.0, 0.12), (0.36, 0.36, 0.36, 0.0, 0.0, 0.0))
    pick = slice(None, None, 10)
    motion = run.q[pick], run.qd[pick], run.qdd[pick]
    middle = Robot(placed, payload=load, drives=True).inverse_dynamics(*motion)
    deviations = drawn(sources, uniforms(9, 0, 0, 300, len(sources)), "normal")
    torques = np.array(
        [
            Robot(moved(placed, sources, row), payload=load, drives=True).inverse_dynamics(*motion)
            for row in deviations
        ]
    )
    within = np.abs(torques - middle) <= bands.half[pick] + 1e-9
    wide = bands.half[pick] > 1e-6
    assert wide.any(axis=0).all()
    share = within.mean(axis=0)[wide]
    assert share.min() > 0.9 and share.max() < 0.99


def test_where_the_torque_is_given_no_band_is_drawn() -> None:
    scenario = dataclasses.replace(load_scenario("free_swing"), duration=0.05)
    bands = of_run(DATA, simulate(DATA, scenario))
    assert bands.half is None
    assert "it is given" in bands.words


def test_long_motions_are_banded_at_some_samples(run: Run) -> None:
    n = 1501
    s = np.linspace(0.0, 1.0, n)[:, None]
    q, qd, qdd = s * np.ones(6), np.ones((n, 6)), np.zeros((n, 6))
    long = of_motion(DATA, q, qd, qdd).half
    pick = [0, 7, 700, 1500]
    few = of_motion(DATA, q[pick], qd[pick], qdd[pick]).half
    assert long is not None and few is not None
    assert long[pick] == pytest.approx(few, rel=1e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("robot", "words"), [("chapter3", "states no tolerance"), ("kr16_l6", "no inertial data")]
)
def test_robots_without_tolerances_have_none(robot: str, words: str) -> None:
    still = np.zeros((2, 6))
    bands = of_motion(load_data(robot), still, still, still)
    assert bands.half is None
    assert words in bands.words
