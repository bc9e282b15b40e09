"""The compiled kernels: equal to the NumPy engine, safe with any input."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kr16cli
from kernel_cases import ROBOTS, inputs, native, numpy_engine
from kr16cli.kernels import has_native
from kr16cli.kernels.parameters import COUNT
from kr16cli.kernels.quantities import QUANTITIES, variant


@native
@pytest.mark.parametrize("kind", ROBOTS)
@pytest.mark.parametrize("name", QUANTITIES)
def test_engines_agree(name: str, kind: str) -> None:
    """To 1e-13 of the largest element; inverse kinematics by closure, for angles may differ."""
    robot = kr16cli.load_robot(**ROBOTS[kind])
    given = inputs(name, 1000, robot)
    fast = robot._ask(name, tuple(given), None, 1)
    slow = numpy_engine(robot)._ask(name, tuple(given), None, 1)
    if name == "ik":
        assert (np.isnan(fast) == np.isnan(slow)).all()
        position, angle = robot.closure(given[0][:, None], fast)
        assert np.nanmax(position) < 1e-12
        assert np.nanmax(angle) < 1e-12
    elif name.startswith("forward_dynamics"):  # the condition of M, up to 1e5, is between
        each = np.abs(slow).reshape(len(slow), -1).max(axis=1)
        gap = np.abs(fast - slow).reshape(len(slow), -1).max(axis=1)
        assert (gap <= 1e-10 * each).all()
        assert gap.max() <= 1e-13 * each.max()
    else:
        assert np.abs(fast - slow).max() <= 1e-13 * np.abs(slow).max()


@native
@pytest.mark.parametrize("name", QUANTITIES)
def test_one_configuration_equals_its_row(name: str) -> None:
    robot = kr16cli.load_robot()
    given = inputs(name, 90, robot)
    batch = robot._ask(name, tuple(given), None, 1)
    for i in (0, 39, 40, 79, 80, 89):
        one = robot._ask(name, tuple(v[i] for v in given), None, 1)
        scale = np.nanmax(np.abs(batch))
        assert np.nanmax(np.abs(one - batch[i])) <= 1e-13 * scale or name == "ik"


@native
def test_general_gravity_has_its_own_kernels() -> None:
    tilted = kr16cli.load_robot().with_gravity((1.0, -2.0, -9.0))
    q = inputs("gravity", 200, tilted)[0]
    assert np.abs(tilted.gravity(q) - numpy_engine(tilted).gravity(q)).max() < 1e-11
    assert variant("gravity", vertical=False, drives=False) == "gravity"


@native
def test_angles_of_any_size() -> None:
    """Beyond the range of the vector sine the C library serves, lane by lane."""
    robot = kr16cli.load_robot()
    q = np.array([[0.1, 1e5, -1e7, 3e15, 2.0**60, -7.0]] * 70)
    assert np.abs(robot.fk(q) - numpy_engine(robot).fk(q)).max() < 1e-12


@native
@pytest.mark.parametrize("index", [0, 63, 64, 1000])
def test_non_finite_input_is_found_wherever_it_stands(index: int) -> None:
    robot = kr16cli.load_robot()
    q = np.zeros((1001, 6))
    q[index, 3] = np.inf
    with pytest.raises(kr16cli.InputError, match=rf"q\[{index}, 3\] is inf"):
        robot.fk(q)
    with pytest.raises(kr16cli.InputError, match=rf"q\[{index}, 3\] is inf"):
        robot.fk(q, threads=2)


@native
def test_a_matrix_that_is_no_pose_is_refused() -> None:
    robot = kr16cli.load_robot()
    T = robot.fk(np.zeros((100, 6)))
    for change in ((0, 0, 1.001), (3, 1, 0.1), (2, 0, 1.0)):
        bad = T.copy()
        bad[77][change[0], change[1]] = change[2]
        with pytest.raises(kr16cli.InputError, match=r"T\[77\]"):
            robot.ik(bad)


@native
def test_kernels_refuse_what_needs_care_and_do_not_crash() -> None:
    robot = kr16cli.load_robot()
    fk = robot._native["fk"]
    q = np.zeros((3, 6))
    careless = [
        (None, None, 1),
        (q[:, :5], None, 1),
        (q.astype(np.float32), None, 1),
        (q, np.zeros((2, 4, 4)), 1),
        (q, q, 1),
        (q, None, 0),
        (q, None, 10**30),
        ([0] * 6, None, 1),
    ]
    assert [fk(*arguments) for arguments in careless] == [None] * len(careless)
    for wrong in ((q,), (q, None), (q, None, 1, 2)):
        with pytest.raises(TypeError):
            fk(*wrong)
    kernel = type(fk)
    for arguments in (
        ("no", [0.0] * COUNT, (4, 4)),
        ("fk", [0.0], (4, 4)),
        ("fk", [0.0] * COUNT, (5,)),
    ):
        with pytest.raises(ValueError):
            kernel(*arguments)


@pytest.mark.parametrize(
    ("engine", "code"), [("numpy", 0), ("native", 0 if has_native() else 4), ("abacus", 2)]
)
def test_environment_forces_an_engine(engine: str, code: int, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "kr16cli", "info", "--json"],
        env={
            **os.environ,
            "KR16_ENGINE": engine,
            "PYTHONPATH": str(Path(kr16cli.__file__).parents[1]),
        },
        cwd=tmp_path,  # a checkout here would hide the installed package and its kernels
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stderr
    assert f'"arrays": "{engine}"' in done.stdout or code != 0
