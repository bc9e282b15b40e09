"""Errors of the kernels in units in the last place, against the same model at 50 digits.

One unit (ulp) is 2^-52 of the largest number of a result. `python tests/test_kernels_precision.py`
prints the worst of each kernel by regime, on more samples than the tests take.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

import kr16cli
from kernel_cases import native
from kr16cli.kernels.parameters import Parameters, flatten, parameters, unpack
from kr16cli.kernels.quantities import ANGLES, QUANTITIES
from kr16cli.model import forward
from kr16cli.model.scalars import ZERO, Functions

ULP = 2.0**-52
ROBOT = kr16cli.load_robot(drives=True)
GEOMETRY = ROBOT.data.geometry

LIMITS = {
    **dict.fromkeys(QUANTITIES, 4.0),
    # The condition of M, up to 1e5, stands between torques and accelerations.
    **{"forward_dynamics": 1e3, "forward_dynamics_derivatives": 1e3},
}
"""Most ulps that a kernel may be off, in any regime."""

for _branched in ("ik", "branches"):  # judged by closure, and by their own tests
    del LIMITS[_branched]

CLOSURE = {"near singular": 2e5}
"""Ulps of 1 m between a pose and its solutions', where more than 200."""

PARTS = {
    "equation": (36, 72),
    "inverse_dynamics_derivatives": (36, 72),
    "forward_dynamics_derivatives": (36, 72),
}
"""Where a row of results is several results, each with its own largest number."""


# Regimes --------------------------------------------------------------------------------------


def _generic(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.uniform(-np.pi, np.pi, (n, 6))


def _limits(rng: np.random.Generator, n: int) -> np.ndarray:
    ends = np.array([(j.lower, j.upper) for j in ROBOT.data.joints])
    return np.where(rng.integers(0, 2, (n, 6)), ends[:, 0], ends[:, 1])


def _near_singular(rng: np.random.Generator, n: int) -> np.ndarray:
    """Wrist straight and arm stretched, each missed by 1e-3 to 1e-12 rad."""
    q, off = _generic(rng, n), rng.choice([-1, 1], (n, 2)) * 10.0 ** -rng.uniform(3, 12, (n, 2))
    q[:, 4] = rng.choice([0.0, np.pi], n) + off[:, 0]
    q[::2, 2] = -np.arctan2(GEOMETRY.a3, GEOMETRY.d4) + off[::2, 1]
    return q


def _many_turns(rng: np.random.Generator, n: int) -> np.ndarray:
    return rng.choice([-1, 1], (n, 6)) * 10.0 ** rng.uniform(3, 6, (n, 6))


def _round(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.radians(rng.choice([0.0, -45.0, -90.0, 90.0, 180.0], (n, 6)))


def _zero(rng: np.random.Generator, n: int) -> np.ndarray:
    return np.zeros((n, 6)) * rng.choice([-1.0, 1.0], (n, 6))


REGIMES = {
    "generic": _generic,
    "limits": _limits,
    "near singular": _near_singular,
    "1e3 to 1e6 rad": _many_turns,
    "round angles": _round,
    "zero": _zero,
}


# The model at 50 digits -----------------------------------------------------------------------


def _functions() -> Functions:
    return Functions(
        sqrt=mp.sqrt,
        sin=mp.sin,
        cos=mp.cos,
        atan2=mp.atan2,
        where=lambda condition, a, b: a if condition else b,
        pi=+mp.pi,
    )


def _numbers() -> Parameters:
    """The kernels' own parameters, digit by digit: what is measured is the kernels' error."""
    symbols = [v if v is ZERO else mpf(float(v)) for v in flatten(parameters(ROBOT.arm))]
    return unpack(symbols, vertical=True, drives=True)


def _exact(name: str, rows: Iterable[np.ndarray]) -> list[mpf]:
    ns = _functions()
    arguments = []
    for kind, row in zip(QUANTITIES[name].inputs, rows, strict=True):
        numbers = [mpf(v) for v in row.tolist()]
        arguments.append(ns.trig(numbers) if kind in ANGLES else numbers)
    results = QUANTITIES[name].results(_numbers(), *arguments, ns)
    return [mpf(0) if v is ZERO else mpf(v) for v in results]


def worst_ulps(name: str, regime: str, n: int) -> tuple[float, float]:
    """Largest error of the batch kernel and of the kernel for one configuration."""
    rng = np.random.default_rng(17)
    given: dict[str, np.ndarray] = {"q": REGIMES[regime](rng, n)}
    given["qd"], given["qdd"] = rng.uniform(-3, 3, (2, n, 6))
    given["tau"] = ROBOT.inverse_dynamics(given["q"], given["qd"], given["qdd"])
    inputs = [given[k] for k in QUANTITIES[name].inputs]
    batch = ROBOT._ask(name, tuple(inputs), None, 1).reshape(n, -1)
    single = np.array([ROBOT._ask(name, row, None, 1).ravel() for row in zip(*inputs, strict=True)])
    with mpmath.workdps(50):
        exact = [_exact(name, row) for row in zip(*inputs, strict=True)]
    return _gap(name, batch, exact), _gap(name, single, exact)


def _gap(name: str, ours: np.ndarray, exact: list[list[mpf]]) -> float:
    ends = [0, *PARTS.get(name, ()), ours.shape[1]]
    errors = []
    for lo, hi in itertools.pairwise(ends):
        expected = [v for row in exact for v in row[lo:hi]]
        found = ours[:, lo:hi].ravel().tolist()
        gap = max(abs(mpf(v) - e) for v, e in zip(found, expected, strict=True))
        errors.append(gap / max(map(abs, expected)))
    return float(max(errors)) / ULP


def closure_ulps(regime: str, n: int) -> float:
    """How far the pose of each solution is from the pose asked for; one ulp is that of 1 m."""
    T = ROBOT.fk(REGIMES[regime](np.random.default_rng(18), n))
    solutions = ROBOT.ik(T)
    gaps = []
    with mpmath.workdps(50):
        g = _numbers().geometry
        for pose, rows in zip(T.tolist(), solutions, strict=True):
            for q in rows[np.isfinite(rows).all(axis=1)].tolist():
                made = forward.flange(_functions().trig([mpf(v) for v in q]), g).rows()
                gaps += [
                    abs(a - b)
                    for r, s in zip(made, pose, strict=True)
                    for a, b in zip(r, s, strict=True)
                ]
        return float(max(gaps)) / ULP


# Tests ----------------------------------------------------------------------------------------


@native
@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("name", LIMITS)
def test_kernel_is_good_to_a_few_ulps(name: str, regime: str) -> None:
    assert max(worst_ulps(name, regime, 2)) <= LIMITS[name]


@native
@pytest.mark.parametrize("regime", REGIMES)
def test_solutions_lead_back_to_the_pose(regime: str) -> None:
    assert closure_ulps(regime, 5) <= CLOSURE.get(regime, 200)


def _ulp(value: np.ndarray, exact: list[mpf]) -> float:
    return max(
        float(abs(mpf(float(v)) - e) / mpf(float(np.spacing(abs(float(e))))))
        for v, e in zip(value, exact, strict=True)
        if e != 0
    )


@native
def test_sine_and_cosine_within_two_ulps() -> None:
    from kr16cli.kernels import _native

    rng = np.random.default_rng(3)
    quarter = np.arange(-8, 9) * np.pi / 4
    x = np.concatenate(
        [rng.uniform(-7, 7, 4000), quarter, rng.uniform(-1e5, 1e5, 2000), [0.0, -0.0, 1e-300, -1e5]]
    )
    sine, cosine = np.empty_like(x), np.empty_like(x)
    _native.sincos(x, sine, cosine)
    with mpmath.workdps(40):
        assert _ulp(sine, [mp.sin(mpf(v)) for v in x.tolist()]) < 2.0
        assert _ulp(cosine, [mp.cos(mpf(v)) for v in x.tolist()]) < 2.0
    for bad in (np.nan, np.inf, -np.inf):
        x = np.array([bad])
        sine, cosine = np.empty(1), np.empty(1)
        _native.sincos(x, sine, cosine)
        assert np.isnan([sine, cosine]).all()


@native
def test_arctangent_within_four_ulps() -> None:
    from kr16cli.kernels import _native

    rng = np.random.default_rng(4)
    y, x = rng.normal(size=(2, 4000)) * 10.0 ** rng.integers(-8, 8, (2, 4000))
    y[:500], x[500:1000] = y[:500] * 1e-150, x[500:1000] * 1e150
    angle = np.empty_like(y)
    _native.atan2(y, x, angle)
    with mpmath.workdps(40):
        exact = [mp.atan2(mpf(a), mpf(b)) for a, b in zip(y.tolist(), x.tolist(), strict=True)]
        assert _ulp(angle, exact) < 4.0


@native
def test_arctangent_of_zeros_infinities_and_nan() -> None:
    from kr16cli.kernels import _native

    kinds = [0.0, 1.0, -1.0, 1e-300, -1e-300, 8e307, -8e307, np.inf, -np.inf, np.nan]
    y, x = (np.array(v) for v in zip(*((a, b) for a in [*kinds, -0.0] for b in kinds), strict=True))
    angle = np.empty_like(y)
    _native.atan2(y, x, angle)
    expected = np.arctan2(y, x)
    assert np.allclose(angle, expected, rtol=1e-15, atol=0, equal_nan=True)
    same = (np.signbit(angle) == np.signbit(expected)) | np.isnan(expected)
    assert same.all(), list(zip(y[~same], x[~same], strict=True))


if __name__ == "__main__":
    print(f"worst error in ulp, batch / one configuration\n{'':30}", *(f"{r:>17}" for r in REGIMES))
    for kernel in LIMITS:
        pairs = [worst_ulps(kernel, regime, 25) for regime in REGIMES]
        print(f"{kernel:30}", *(f"{a:8.1f}/{b:8.1f}" for a, b in pairs), flush=True)
    print(f"{'ik, closure':30}", *(f"{closure_ulps(regime, 25):17.1f}" for regime in REGIMES))
