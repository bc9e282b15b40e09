"""The compiled kernels: equal to the NumPy engine, safe with any input, exact enough alone."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
import tracemalloc
from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kr16cli
from kr16cli.kernels import cprint, generate, has_native
from kr16cli.kernels.parameters import COUNT, pack, parameters, unpack
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, variant
from kr16cli.kernels.trace import Graph

native = pytest.mark.skipif(not has_native(), reason="no compiler at install: NumPy serves")

ROBOTS = {
    "bare": {},
    "loaded": {"payload": kr16cli.Payload(16.0, (0.1, -0.05, 0.12), (0.3, 0.2, 0.25, 0.01, 0, 0))},
    "drives": {"drives": True},
}


def _inputs(name: str, n: int, robot: kr16cli.Robot, seed: int = 5) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    made = {k: rng.uniform(-3.1, 3.1, (n, 6)) for k in ("q", "qd", "qdd", "near")}
    made["tau"] = rng.uniform(-500.0, 500.0, (n, 6))
    made["T"] = robot.fk(rng.uniform(-3.1, 3.1, (n, 6)))
    return [made[k] for k in QUANTITIES[name].inputs]


def _numpy_engine(robot: kr16cli.Robot) -> kr16cli.Robot:
    other = kr16cli.Robot(robot.data, payload=robot.payload, drives=robot.drives)
    other._native = None
    return other


@native
@pytest.mark.parametrize("kind", ROBOTS)
@pytest.mark.parametrize("name", QUANTITIES)
def test_engines_agree(name: str, kind: str) -> None:
    """To 1e-13 of the largest element; inverse kinematics by closure, for angles may differ."""
    robot = kr16cli.load_robot(**ROBOTS[kind])
    inputs = _inputs(name, 1000, robot)
    fast = robot._ask(name, tuple(inputs), None, 1)
    slow = _numpy_engine(robot)._ask(name, tuple(inputs), None, 1)
    if name == "ik":
        assert (np.isnan(fast) == np.isnan(slow)).all()
        position, angle = robot.closure(inputs[0][:, None], fast)
        assert np.nanmax(position) < 1e-12
        assert np.nanmax(angle) < 1e-12
    else:
        assert np.abs(fast - slow).max() <= 1e-13 * np.abs(slow).max()


@native
@pytest.mark.parametrize("name", QUANTITIES)
def test_one_configuration_equals_its_row(name: str) -> None:
    robot = kr16cli.load_robot()
    inputs = _inputs(name, 70, robot)
    batch = robot._ask(name, tuple(inputs), None, 1)
    for i in (0, 63, 64, 69):
        one = robot._ask(name, tuple(v[i] for v in inputs), None, 1)
        scale = np.nanmax(np.abs(batch))
        assert np.nanmax(np.abs(one - batch[i])) <= 1e-13 * scale or name == "ik"


@native
def test_general_gravity_has_its_own_kernels() -> None:
    tilted = kr16cli.load_robot().with_gravity((1.0, -2.0, -9.0))
    q = _inputs("gravity", 200, tilted)[0]
    assert np.abs(tilted.gravity(q) - _numpy_engine(tilted).gravity(q)).max() < 1e-11
    assert variant("gravity", vertical=False, drives=False) == "gravity"


@native
def test_angles_of_any_size() -> None:
    """Beyond the range of the vector sine the C library serves, lane by lane."""
    robot = kr16cli.load_robot()
    q = np.array([[0.1, 1e5, -1e7, 3e15, 2.0**60, -7.0]] * 70)
    assert np.abs(robot.fk(q) - _numpy_engine(robot).fk(q)).max() < 1e-12


@native
@given(
    shape=st.lists(st.integers(0, 5), max_size=3).map(tuple),
    layout=st.sampled_from(["C", "F", "strided", "readonly", "float32", "int", "list"]),
    threads=st.integers(1, 3),
)
def test_any_layout_gives_the_same(shape: tuple[int, ...], layout: str, threads: int) -> None:
    robot = kr16cli.load_robot()
    q = np.linspace(-3, 3, int(np.prod(shape)) * 6).reshape(*shape, 6).round(1)
    if layout == "int":
        q = q.astype(int)
    given_: object = {
        "F": np.asfortranarray(q),
        "strided": np.repeat(q, 2, axis=-1)[..., ::2],
        "float32": q.astype(np.float32),
        "list": q.tolist(),
    }.get(layout, q)
    if layout == "list" and 0 in shape:
        given_ = q
    if layout == "readonly":
        q.setflags(write=False)
    expected = np.array(np.asarray(given_, dtype=float))
    result = robot.mass_matrix(given_, threads=threads)
    assert result.shape == (*shape, 6, 6)
    assert np.allclose(result, _numpy_engine(robot).mass_matrix(expected), atol=1e-11)


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


@native
def test_threads_of_the_caller_do_not_disturb_each_other() -> None:
    robot = kr16cli.load_robot()
    q, qd, tau = _inputs("forward_dynamics", 5000, robot)
    expected = robot.forward_dynamics(q, qd, tau)
    wrong: list[int] = []

    def work(number: int) -> None:
        for _ in range(5):
            if not (robot.forward_dynamics(q, qd, tau, threads=2) == expected).all():
                wrong.append(number)

    workers = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not wrong


@native
def test_memory_does_not_grow() -> None:
    robot = kr16cli.load_robot()
    q, out = np.zeros(6), np.empty((4, 4))
    bad = np.full(6, np.nan)

    def calls(count: int) -> None:
        for _ in range(count):
            robot.fk(q)
            robot.fk(q, out=out)
            robot._native["fk"](bad, None, 1)

    calls(100)
    gc.collect()
    tracemalloc.start()
    calls(20_000)
    gc.collect()
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 20_000


def _ulp(value: np.ndarray, exact: list[mpmath.mpf]) -> float:
    return max(
        float(abs(mpmath.mpf(float(v)) - e) / mpmath.mpf(float(np.spacing(abs(float(e))))))
        for v, e in zip(value, exact, strict=True)
        if e != 0
    )


@native
def test_elementary_functions_in_ulp() -> None:
    from kr16cli.kernels import _native

    rng = np.random.default_rng(3)
    quarter = np.arange(-8, 9) * np.pi / 4
    x = np.concatenate(
        [rng.uniform(-7, 7, 4000), quarter, rng.uniform(-1e5, 1e5, 500), [0.0, 1e-300]]
    )
    sine, cosine = np.empty_like(x), np.empty_like(x)
    _native.sincos(x, sine, cosine)
    y, z = rng.normal(size=(2, 4000)) * 10.0 ** rng.integers(-8, 8, (2, 4000))
    angle = np.empty_like(y)
    _native.atan2(y, z, angle)
    with mpmath.workdps(40):
        # Near a zero of sine the error is measured against its neighbours of size 1e-5.
        exact_s = [mpmath.sin(mpmath.mpf(float(v))) for v in x]
        exact_c = [mpmath.cos(mpmath.mpf(float(v))) for v in x]
        assert _ulp(sine, exact_s) < 2.0
        assert _ulp(cosine, exact_c) < 2.0
        exact = [mpmath.atan2(float(a), float(b)) for a, b in zip(y, z, strict=True)]
        assert _ulp(angle, exact) < 4.0
    special = np.array([0.0, 0.0, 1.0, -1.0, np.inf, -np.inf, np.inf, 1.0, np.nan, 1.0])
    other = np.array([1.0, -1.0, 0.0, 0.0, np.inf, np.inf, -np.inf, -np.inf, 1.0, np.nan])
    angle = np.empty_like(special)
    _native.atan2(special, other, angle)
    assert np.allclose(angle, np.arctan2(special, other), rtol=1e-15, atol=0, equal_nan=True)


def test_parameters_survive_packing() -> None:
    k = parameters(kr16cli.load_robot(drives=True).arm)
    values = pack(k)
    assert len(values) == COUNT
    again = unpack(values, vertical=False, drives=True)
    assert pack(again) == values
    assert tuple(map(float, again.gravity)) == (0.0, 0.0, -9.81)


def test_tracer_folds_only_what_is_exact() -> None:
    graph = Graph()
    a, b = graph.vector("input", 2)
    assert a + b is b + a
    assert a * 1 is a
    assert graph.negative(-a) is a
    assert (a - (-b)) is (a + b)
    assert (-a) * b is -(a * b)
    assert (a * 0).op == "mul"  # NaN times 0 is NaN
    assert graph.lift(2.0) * 3.0 is graph.constant(6.0)


def test_generated_code_keeps_to_its_budget() -> None:
    """Operations per configuration: a change that costs more must be meant."""
    budget = {"fk": 80, "jacobian": 103, "mass_matrix": 268, "coriolis_matrix": 1101}
    for name, most in budget.items():
        results, _ = generate.traced(QUANTITIES[name], vertical=True, drives=False)
        assert cprint.operations(results) <= most


def test_every_kernel_has_room_and_a_name() -> None:
    names = [name for name, *_ in generate.kernels()]
    assert len(names) == len(set(names))
    for quantity in QUANTITIES.values():
        rows = sum(12 if n in ANGLES else 16 if n == "T" else 6 for n in quantity.inputs)
        assert rows <= 32
        assert int(np.prod(quantity.shape)) + 1 <= 224


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
