"""Motions from Python: a right-hand side in SciPy beside Pinocchio's, and steps of the FMU."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.bench.rollouts import START, STEP, TOLERANCE, Figure, pinocchio_rates
from kr16cli.bench.timing import least
from kr16cli.errors import MissingPartError

METHODS = ("RK45", "DOP853")

_MODES = {"torques": 1, "computed torque": 4, "task space": 5}
"""What the FMU's drives do: control.mode."""


def measure(robot: Robot, rounds: int, duration: float = 10.0) -> list[Figure]:
    """Free swings in SciPy (s), and what the FMU costs (s), if FMPy and pythonfmu are here.

    Least time of `rounds`, the contenders taking turns.
    """
    return [*_swings(robot, rounds, duration), *_fmu(robot, rounds)]


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


def _fmu(robot: Robot, rounds: int) -> Iterator[Figure]:
    """A step of 1 ms through FMPy, and opening with instantiating, NumPy imported before."""
    from kr16cli.fmi import build, choices, compiling, play
    from kr16cli.fmi.variables import Part

    compiler = compiling.find_compiler()
    options, _ = choices.options(robot.data, None, Part.ROBOT, compiler)
    with tempfile.TemporaryDirectory(prefix="kr16_bench_") as folder:
        path = Path(folder) / "KR16.fmu"
        opened = []
        try:
            path.write_bytes(build.build(robot.data, options))
            for name, mode in _MODES.items():
                values = {"control.mode": mode}
                answer = play.ask(
                    "times", fmu=str(path), step=STEP, rounds=rounds, start_values=values
                )
                opened.append(answer["open"])
                yield Figure(f"FMU (pythonfmu), doStep of 1 ms, {name}", answer["step"], {})
        except MissingPartError:
            return
        yield Figure("FMU (pythonfmu), open and instantiate", min(opened), {})


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
