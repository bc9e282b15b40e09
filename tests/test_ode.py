"""The Runge-Kutta solvers in C: orders, dense output, step control, and giving up."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable
from ctypes import CFUNCTYPE, POINTER, byref, c_double, c_int, c_longlong, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import RK45

NATIVE = Path(__file__).resolve().parent.parent / "kr16cli" / "kernels" / "native"
STATES, FINE, TOO_SMALL = 32, 0, -1
COMPILER = next((c for c in ("cc", "gcc", "clang") if shutil.which(c)), None)
RATES = CFUNCTYPE(c_int, c_void_p, c_double, POINTER(c_double), POINTER(c_double))

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


class Solver(ctypes.Structure):
    """kr16_dp54 of ode.h."""

    _fields_ = (
        ("n", c_int),
        ("rtol", c_double),
        ("atol", c_double * STATES),
        ("h_max", c_double),
        ("t", c_double),
        ("h", c_double),
        ("x", c_double * STATES),
        ("dx", c_double * STATES),
        ("t_old", c_double),
        ("dense", (c_double * STATES) * 5),
        ("steps", c_longlong),
        ("rejected", c_longlong),
        ("evaluations", c_longlong),
    )


@pytest.fixture(scope="module")
def ode(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The solvers, compiled strictly."""
    library = tmp_path_factory.mktemp("ode") / "ode.so"
    strict = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-shared", "-fPIC"]
    subprocess.run(
        [str(COMPILER), *strict, str(NATIVE / "ode.c"), "-o", str(library), "-lm"], check=True
    )
    found = ctypes.CDLL(str(library))
    found.kr16_rk4_step.argtypes = (RATES, c_void_p, c_int, c_double, c_double, POINTER(c_double))
    found.kr16_dp54_start.argtypes = (
        POINTER(Solver),
        RATES,
        c_void_p,
        c_double,
        POINTER(c_double),
    )
    found.kr16_dp54_step.argtypes = (POINTER(Solver), RATES, c_void_p, c_double)
    found.kr16_dp54_at.argtypes = (POINTER(Solver), c_double, POINTER(c_double))
    found.kr16_dp54_at.restype = None
    return found


def callback(rates: Callable[[float, list[float]], list[float] | int]) -> Any:
    """C calls rates(t, x): slopes, or a number to give up with. Two states."""

    def call(_: Any, t: float, x: Any, dx: Any) -> int:
        answer = rates(t, x[:2])
        if isinstance(answer, int):
            return answer
        dx[0], dx[1] = answer
        return 0

    return RATES(call)


def bell(t: float, x: list[float]) -> list[float]:
    """x' = -2 t x and y' = cos t: exp(-t^2) and sin t from (1, 0)."""
    return [-2.0 * t * x[0], math.cos(t)]


BELL = (1.0, 0.0)


def exact(t: float) -> tuple[float, float]:
    return math.exp(-t * t), math.sin(t)


def solver(rtol: float, h_max: float = 0.0) -> Solver:
    s = Solver(n=2, rtol=rtol, h_max=h_max)
    s.atol[:2] = [rtol, rtol]
    return s


def start(ode: Any, s: Solver, rates: Any, x: tuple[float, float] = BELL, t: float = 0.0) -> int:
    return int(ode.kr16_dp54_start(byref(s), rates, None, t, (c_double * STATES)(*x)))


def at(ode: Any, s: Solver, t: float) -> list[float]:
    x = (c_double * STATES)()
    ode.kr16_dp54_at(byref(s), t, x)
    return x[:2]


def order(errors: list[float]) -> float:
    """Mean order of the errors of halved steps."""
    return math.log2(errors[0] / errors[-1]) / (len(errors) - 1)


def test_classical_step_has_order_four(ode: Any) -> None:
    rates, errors = callback(bell), []
    for count in (20, 40, 80, 160):
        x = (c_double * STATES)(*BELL)
        for i in range(count):
            h = 2.0 / count
            assert ode.kr16_rk4_step(rates, None, 2, i * h, h, x) == FINE
        errors.append(abs(x[0] - exact(2.0)[0]))
    assert 3.9 < order(errors) < 4.4


def test_step_has_order_five_and_its_interpolant_four(ode: Any) -> None:
    """Between steps the error of one interpolant is of order 5 in h: of order 4 as a method."""
    rates, ends, within = callback(bell), [], []
    for count in (20, 40, 80):
        s = solver(1e-12)
        start(ode, s, rates)
        s.rtol, s.h_max = 1e300, 2.0 / count  # every step is accepted
        s.h, worst = s.h_max, 0.0
        while s.t < 2.0:
            x = s.x[:2]
            assert ode.kr16_dp54_step(byref(s), rates, None, 2.0) == FINE
            # the interpolant's own error: from the step's start as it was
            free = at(ode, s, 0.5 * (s.t + s.t_old))
            middle = exact(0.5 * (s.t + s.t_old))[0] * x[0] / exact(s.t_old)[0]
            worst = max(worst, abs(free[0] - middle))
        assert s.steps == count
        ends.append(abs(s.x[0] - exact(2.0)[0]))
        within.append(worst)
    assert 4.8 < order(ends) < 5.8
    assert 4.8 < order(within) < 5.5


def test_interpolant_is_that_of_scipy(ode: Any) -> None:
    rates, s = callback(bell), solver(1e-8)
    start(ode, s, rates)
    peer = RK45(bell, 0.0, np.array(BELL), 2.0, rtol=1e-8, atol=1e-8, first_step=s.h)
    while peer.status == "running":
        peer.step()
        assert ode.kr16_dp54_step(byref(s), rates, None, 2.0) == FINE
        if s.t == 2.0:
            break  # the last step is stretched, so as to leave no tiny one
        assert s.t == pytest.approx(peer.t, rel=1e-9)
        t = 0.3 * s.t + 0.7 * s.t_old
        assert at(ode, s, t) == pytest.approx(peer.dense_output()(t), abs=1e-14)
        assert at(ode, s, s.t) == pytest.approx(s.x[:2], abs=1e-15)
    assert s.steps > 10


@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10, 1e-13])
def test_error_obeys_the_tolerance(ode: Any, rtol: float) -> None:
    rates, s = callback(bell), solver(rtol)
    start(ode, s, rates)
    while s.t < 2.0:
        assert ode.kr16_dp54_step(byref(s), rates, None, 2.0) == FINE
    assert s.t == 2.0
    assert s.x[:2] == pytest.approx(exact(2.0), abs=100.0 * rtol)
    assert s.evaluations == 2 + 6 * (s.steps + s.rejected)


def test_no_step_is_longer_than_allowed_or_passes_the_end(ode: Any) -> None:
    rates, s = callback(lambda t, x: [1.0, 0.0]), solver(1e-3, h_max=0.25)
    start(ode, s, rates)
    ends = []
    while s.t < 0.9:
        ode.kr16_dp54_step(byref(s), rates, None, 0.9)
        ends.append(s.t)
    assert np.diff([0.0, *ends]).max() <= 0.2501  # 1 % more spares a tiny last step
    assert ends[-1] == 0.9
    assert ode.kr16_dp54_step(byref(s), rates, None, 0.5) == FINE
    assert s.t == 0.9


def test_short_communication_steps_do_not_shorten_the_solvers(ode: Any) -> None:
    rates, s = callback(bell), solver(1e-6)
    start(ode, s, rates)
    ode.kr16_dp54_step(byref(s), rates, None, 2.0)
    next_step = s.h
    ode.kr16_dp54_step(byref(s), rates, None, s.t + 1e-6)
    assert s.h >= next_step


def test_a_copy_is_the_whole_solver(ode: Any) -> None:
    rates, s = callback(bell), solver(1e-9)
    start(ode, s, rates)
    ode.kr16_dp54_step(byref(s), rates, None, 2.0)
    kept = Solver.from_buffer_copy(s)
    for one in (s, kept):
        while one.t < 2.0:
            ode.kr16_dp54_step(byref(one), rates, None, 2.0)
    assert bytes(s) == bytes(kept)


def test_reason_to_give_up_comes_through(ode: Any) -> None:
    def refuse(t: float, x: list[float]) -> list[float] | int:
        return 7 if t > 0.5 else bell(t, x)

    rates, s = callback(refuse), solver(1e-6)
    assert start(ode, s, rates) == FINE
    status = FINE
    while status == FINE:
        before = (s.t, s.x[0])
        status = ode.kr16_dp54_step(byref(s), rates, None, 2.0)
    assert status == 7
    assert (s.t, s.x[0]) == before
    x = (c_double * STATES)(*BELL)
    assert ode.kr16_rk4_step(rates, None, 2, 0.45, 0.1, x) == 7
    assert x[:2] == list(BELL)
    assert start(ode, s, rates, t=1.0) == 7


def test_solution_that_ends_is_given_up(ode: Any) -> None:
    """x' = x^2 from 1 is 1 / (1 - t); and slopes that are no numbers from the start."""

    def pole(t: float, x: list[float]) -> list[float]:
        return [x[0] * x[0] if abs(x[0]) < 1e150 else math.inf, 0.0]

    rates, s = callback(pole), solver(1e-6)
    start(ode, s, rates)
    status, tries = FINE, 0
    while status == FINE:
        status = ode.kr16_dp54_step(byref(s), rates, None, 2.0)
        tries += 1
        assert tries < 2000
    assert status == TOO_SMALL
    assert s.t == pytest.approx(1.0, abs=1e-5)
    assert math.isfinite(s.x[0])

    nowhere = callback(lambda t, x: [math.nan, math.nan])
    s = solver(1e-6)
    start(ode, s, nowhere)
    assert ode.kr16_dp54_step(byref(s), nowhere, None, 2.0) == TOO_SMALL
    assert s.t == 0.0


def test_states_at_rest_take_long_steps(ode: Any) -> None:
    rates, s = callback(lambda t, x: [0.0, 0.0]), solver(1e-9)
    start(ode, s, rates, x=(0.0, 0.0))
    while s.t < 1e6:
        assert ode.kr16_dp54_step(byref(s), rates, None, 1e6) == FINE
    assert s.steps < 20
    assert s.x[:2] == [0.0, 0.0]


def test_zero_tolerated_error_is_no_division_by_zero(ode: Any) -> None:
    s, rates = Solver(n=2, rtol=1e-6), callback(lambda t, x: [x[1], 0.0])
    start(ode, s, rates, x=(0.0, 0.0))
    assert ode.kr16_dp54_step(byref(s), rates, None, 1.0) == FINE
    assert s.x[:2] == [0.0, 0.0]
