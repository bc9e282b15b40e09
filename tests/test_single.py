"""One configuration on plain floats: the same numbers as the arrays, and no NumPy behind them."""

from __future__ import annotations

import math
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kr16cli
import oracles
import strategies as sg
from kr16cli import linear
from kr16cli.errors import InputError, NoAnswerError

DATA = kr16cli.load_data()
ARM = kr16cli.Arm(DATA)
ROBOT = kr16cli.Robot(DATA)


def plain(value: Any) -> bool:
    """Floats in lists, and nothing else."""
    if isinstance(value, list | tuple):
        return all(map(plain, value))
    return type(value) is float


@given(sg.everywhere, sg.rates, sg.rates)
def test_floats_equal_arrays(q: list[float], qd: list[float], qdd: list[float]) -> None:
    """Through a batch of one, which the engine runs."""
    pairs = [
        (ARM.fk(q), ROBOT.fk([q])),
        (ARM.mass_centres(q), ROBOT.mass_centres([q])),
        (ARM.jacobian(q), ROBOT.jacobian([q])),
        (ARM.jacobian_dot(q, qd), ROBOT.jacobian_dot([q], [qd])),
        (ARM.mass_matrix(q), ROBOT.mass_matrix([q])),
        (ARM.coriolis_matrix(q, qd), ROBOT.coriolis_matrix([q], [qd])),
        (ARM.christoffel(q), ROBOT.christoffel([q])),
        (ARM.gravity(q), ROBOT.gravity([q])),
        (ARM.inverse_dynamics(q, qd, qdd), ROBOT.inverse_dynamics([q], [qd], [qdd])),
        (ARM.base_wrench(q, qd, qdd), ROBOT.base_wrench([q], [qd], [qdd])),
    ]
    for one, many in pairs:
        assert plain(one)
        expected = np.array(many)[0]
        assert np.abs(np.array(one) - expected).max() <= 1e-12 * (1 + np.abs(expected).max())


@given(sg.everywhere)
def test_frames_are_named_and_in_either_base(q: list[float]) -> None:
    c, s = oracles.turns(q)
    table = oracles.dh_frames(DATA.geometry, c, s)
    chapter, robroot = ARM.frames(q, base="chapter"), ARM.frames(q)
    assert list(chapter) == [*(f"frame{i}" for i in range(7)), "flange"]
    for i, frame in enumerate(table):
        assert np.abs(np.array(chapter[f"frame{i}"]) - frame).max() <= 2e-15
        turned = oracles.ROBROOT_OF_BASE @ frame
        assert np.abs(np.array(robroot[f"frame{i}"]) - turned).max() <= 2e-15
    assert np.abs(np.array(robroot["flange"]) - np.array(ARM.fk(q))).max() <= 2e-15
    wrist = np.array(ARM.wrist_centre(q))
    assert np.abs(wrist - np.array(robroot["frame5"])[:3, 3]).max() <= 2e-15
    r36 = np.array(robroot["frame3"])[:3, :3].T @ np.array(robroot["frame6"])[:3, :3]
    assert np.abs(np.array(ARM.r36(q)) - r36).max() <= 2e-15


def test_exact_turns_give_exact_poses() -> None:
    """(cos, sin) pairs of quarter turns leave no rounding of pi/2 in the pose."""
    home = [(1.0, 0.0), (0.0, -1.0), (0.0, 1.0), (1.0, 0.0), (1.0, 0.0), (1.0, 0.0)]
    pose = ARM.fk([0, -math.pi / 2, math.pi / 2, 0, 0, 0], cs=home)
    assert [row[:3] for row in pose[:3]] == [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    assert [row[3] for row in pose[:3]] == pytest.approx([1.088, 0.0, 1.320], abs=3e-16)


@given(sg.everywhere)
def test_closure_is_small_for_its_own_pose_and_right_for_another(q: list[float]) -> None:
    pose = ARM.fk(q)
    assert ARM.closure(pose, q) == (0.0, 0.0)
    position, angle = ARM.closure(pose, [*q[:5], q[5] + 0.25])
    assert position <= 1e-15
    assert angle == pytest.approx(0.25, rel=1e-13)


@given(st.lists(st.lists(st.floats(-10, 10), min_size=6, max_size=6), min_size=6, max_size=6))
def test_singular_values_are_numpys(rows: list[list[float]]) -> None:
    expected = np.linalg.svd(np.array(rows), compute_uv=False)
    ours = linear.singular_values(rows)
    assert ours == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert ours == sorted(ours, reverse=True)


@given(st.lists(st.lists(st.floats(-10, 10), min_size=6, max_size=6), min_size=6, max_size=6))
def test_inverse_inverts(rows: list[list[float]]) -> None:
    a = np.array(rows) + 100 * np.eye(6)
    product = a @ np.array(linear.inverse(a.tolist()))
    assert np.abs(product - np.eye(6)).max() <= 1e-12


def test_inverse_of_a_permutation_needs_pivots_and_a_singular_matrix_has_none() -> None:
    assert linear.inverse([[0, 1], [1, 0]]) == [[0.0, 1.0], [1.0, 0.0]]
    with pytest.raises(NoAnswerError, match="singular"):
        linear.inverse([[1, 2], [2, 4]])


def test_arm_without_inertial_data_has_kinematics_only() -> None:
    other = kr16cli.Arm(kr16cli.load_data("kr16_l6"))
    assert other.fk([0.0] * 6)[0][3] == pytest.approx(2.025)
    with pytest.raises(InputError, match=r"no inertial data: 0 of 6 links"):
        other.gravity([0.0] * 6)


def test_every_query_of_an_arm_runs_without_numpy() -> None:
    """In a fresh interpreter, all of them; a heavy import anywhere would show."""
    script = """
import sys
import kr16cli
arm = kr16cli.Arm(kr16cli.load_data(), payload=kr16cli.Payload(5.0), drives=True)
q, qd = [0.1, -1.2, 1.3, 0.4, 0.9, 0.2], [0.3] * 6
arm.frames(q), arm.wrist_centre(q), arm.r36(q), arm.mass_centres(q), arm.singularities(q)
solution = arm.ik(arm.fk(q), q)
arm.closure(arm.fk(q), solution.angles[0])
arm.jacobian(q, link=3, point=[0, 0, 0.1], axes="flange"), arm.jacobian_dot(q, qd)
arm.determinant(q), arm.mass_matrix(q), arm.coriolis_matrix(q, qd), arm.christoffel(q)
arm.gravity(q), arm.friction(qd), arm.inverse_dynamics(q, qd, qd)
arm.forward_dynamics(q, qd, qd), arm.energy(q, qd), arm.base_wrench(q, qd, qd)
arm.task_space(q, qd)
print(sorted({"numpy", "scipy", "matplotlib"} & set(sys.modules)))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.stdout.strip(), done.stderr) == ("[]", "")
