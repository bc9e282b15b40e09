"""Step a solver of SciPy through a system, sampling its own interpolation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.integrate

from kr16cli.arrays import Array
from kr16cli.simulate.events import Event, LimitWatch
from kr16cli.simulate.scenario import SolverSpec


class System(Protocol):
    """What is integrated: a state's rate of change."""

    def rates(self, t: float, state: Any) -> list[float]:
        """Time derivative of the state."""


class Statistics(NamedTuple):
    """What the solver was asked and what it did; `evaluations` of the right-hand side."""

    method: str
    rtol: float
    atol: float
    steps: int
    evaluations: int


@dataclass(frozen=True)
class Solution:
    """States (n, size) at times (n,) s; `failure` says why the last is not at the end."""

    time: Array
    state: Array
    events: list[Event]
    statistics: Statistics
    failure: str | None


def sample_times(duration: float, step: float) -> Array:
    """Multiples of `step` (s) from 0, and the duration (s) itself, exactly, as the last."""
    count = int(np.floor(duration / step * (1.0 + 1e-12)))
    times: Array = np.arange(count + 1, dtype=np.float64) * step
    if duration - times[-1] > 1e-9 * step:
        return np.append(times, duration)
    times[-1] = duration
    return times


class Integration:
    """One integration from a first state to the last of `times`.

    Args:
        system: its right-hand side.
        solver: method and tolerances; `weights` times atol is each component's own.
        watch: finds the events of each step.
        on_step: told the time (s) after each step.
    """

    def __init__(
        self,
        system: System,
        solver: SolverSpec,
        weights: Array,
        watch: LimitWatch,
        on_step: Callable[[float], None] = lambda t: None,
    ) -> None:
        self._system, self._solver, self._watch, self._on_step = system, solver, watch, on_step
        self._atol = solver.atol * weights
        self._steps = self._evaluations = 0
        self._events: list[Event] = []

    def run(self, start: Array, times: Array, breaks: Sequence[float]) -> Solution:
        """Integrate; the solver starts afresh at `breaks` (s), where the system has kinks."""
        end = float(times[-1])
        samples = [start]
        self._events = self._watch.start(0.0, start[:6])
        failure: str | None = None
        t, y = 0.0, start
        if not np.isfinite(self._system.rates(t, y)).all():
            failure = "the acceleration is not finite"
        for stop in [*(b for b in breaks if 0.0 < b < end), end] if failure is None else ():
            t, y, failure = self._stretch(t, y, stop, times, samples)
            if failure:
                break
        reached = times[: len(samples)]
        if failure and t > reached[-1]:
            reached, samples = np.append(reached, t), [*samples, y]
        spec = self._solver
        done = Statistics(spec.method, spec.rtol, spec.atol, self._steps, self._evaluations)
        return Solution(reached, np.array(samples), self._events, done, failure)

    def _stretch(
        self, t: float, y: Array, stop: float, times: Array, samples: list[Array]
    ) -> tuple[float, Array, str | None]:
        """Integrate over one smooth stretch; the time and state reached, and why no further."""
        spec = self._solver
        method = getattr(scipy.integrate, spec.method)
        # A trial step may overflow; the solver then takes a shorter one.
        with np.errstate(all="ignore"):
            stepper = method(self._system.rates, t, y, stop, rtol=spec.rtol, atol=self._atol)
            failure: str | None = None
            while stepper.status == "running" and failure is None:
                if self._steps >= spec.max_steps:
                    failure = f"the solver's {spec.max_steps} steps are used up"
                    break
                failure = _advance(stepper)
                if failure is None:
                    t, y = float(stepper.t), stepper.y.copy()
                    self._steps += 1
                    self._record(stepper, times, samples)
                    self._on_step(t)
        self._evaluations += int(stepper.nfev)
        return t, y, failure

    def _record(self, stepper: Any, times: Array, samples: list[Array]) -> None:
        """Samples and events of the step just made."""
        dense = stepper.dense_output()
        due = times[len(samples) : np.searchsorted(times, stepper.t, side="right")]
        if len(due):
            samples += list(dense(due).T)
        self._events += self._watch.step(float(stepper.t_old), float(stepper.t), dense)


def _advance(stepper: Any) -> str | None:
    """One step of the solver; why it could not be made."""
    try:
        message = stepper.step()
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        return " ".join(str(error).split())
    if stepper.status == "failed":
        return str(message or "the solver gave up").rstrip(".").lower()
    return None if np.isfinite(stepper.y).all() else "the state is not finite"
