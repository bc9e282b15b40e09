"""Motions: a right-hand side in SciPy beside Pinocchio's, and the FMUs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.bench import fmus
from kr16cli.bench.rollouts import START, TOLERANCE, Figure, pinocchio_rates
from kr16cli.bench.timing import least

METHODS = ("RK45", "DOP853")


def measure(robot: Robot, rounds: int, duration: float = 10.0) -> list[Figure]:
    """Free swings in SciPy (s), and what the FMUs cost (s), if FMPy is here.

    Least time of `rounds`, the contenders taking turns.
    """
    return [*_swings(robot, rounds, duration), *fmus.measure(robot, rounds)]


def _swings(robot: Robot, rounds: int, duration: float) -> Iterator[Figure]:
    """The same method of SciPy around this library's accelerations, and around Pinocchio's."""
    for method in METHODS:
        calls = {
            name: _swing(rates, method, duration)
            for name, rates in {"": _own(robot), **_pinocchio(robot)}.items()
        }
        times = least(calls, rounds)
        what = f"{duration:g} s swing, SciPy {method}, tolerance {TOLERANCE:g}"
        yield Figure(what, times.pop(""), times)


Rates = Callable[[float, Any], Any]


def _swing(rates: Rates, method: str, duration: float) -> Callable[[], Any]:
    from scipy.integrate import solve_ivp

    start = np.array([*START, *(0.0,) * 6])
    return lambda: solve_ivp(rates, (0.0, duration), start, method, rtol=TOLERANCE, atol=TOLERANCE)


def _own(robot: Robot) -> Rates:
    accelerations, torque, rate = robot.forward_dynamics, np.zeros(6), np.empty(12)

    def rates(_: float, x: Any) -> Any:
        rate[:6] = x[6:]
        rate[6:] = accelerations(x[:6], x[6:], torque)
        return rate

    return rates


def _pinocchio(robot: Robot) -> dict[str, Rates]:
    rates = pinocchio_rates(robot)
    return {} if rates is None else {"Pinocchio's ABA": rates}


def lines(figures: Sequence[Mapping[str, Any]]) -> list[str]:
    """Figures as text, with the ratio of each peer's time to this library's."""
    found = []
    for f in figures:
        found.append(f"  {f['what']:<52}{_shown(f['seconds']):>12}")
        found += [
            f"    {name:<50}{_shown(seconds):>12}{seconds / f['seconds']:8.2f}"
            for name, seconds in f["peers"].items()
        ]
    return found


def _shown(seconds: float) -> str:
    return f"{seconds * 1e3:.1f} ms" if seconds >= 1e-3 else f"{seconds * 1e6:.1f} us"
