"""Step a solver through a system, sampling its own interpolation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.integrate

from kr16cli.arrays import Array
from kr16cli.simulate.events import Event, Watch
from kr16cli.simulate.fixed import STEPS, FixedStepper
from kr16cli.simulate.scenario import SolverSpec


class System(Protocol):
    """What is integrated: a state's rate of change."""

    def rates(self, t: float, state: Any) -> list[float]:
        """Time derivative of the state."""


class Statistics(NamedTuple):
    """What the solver was asked and what it did; `evaluations` of the right-hand side.

    A method of fixed `step` (s) has no tolerances: rtol and atol are 0.
    """

    method: str
    rtol: float
    atol: float
    steps: int
    evaluations: int
    step: float | None = None


@dataclass(frozen=True)
class Solution:
    """States (n, size) at times (n,) s; `failure` says why the last is not at the end.

    `stopped` is the event that ended the integration, as it was asked to.
    """

    time: Array
    state: Array
    events: list[Event]
    statistics: Statistics
    failure: str | None
    stopped: Event | None = None


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
        system: its right-hand side; its attribute `trouble`, where it has one, explains NaNs.
        solver: method and tolerances; `weights` times atol is each component's own.
        watch: finds the events of each step.
        on_step: told the time (s) after each step.
        on_break: told time and state at the start and at each break.
        ends: whether an event ends the integration.
        quick: a quicker solver's stepper from a state at a time (s) to another, if it has one.
    """

    def __init__(
        self,
        system: System,
        solver: SolverSpec,
        weights: Array,
        watch: Watch,
        on_step: Callable[[float], None] = lambda t: None,
        *,
        on_break: Callable[[float, Array], None] = lambda t, y: None,
        ends: Callable[[Event], bool] = lambda event: False,
        quick: Callable[[float, Array, float], Any] = lambda t, y, stop: None,
    ) -> None:
        self._quick = quick
        self._system, self._solver, self._watch, self._on_step = system, solver, watch, on_step
        self._on_break, self._ends = on_break, ends
        self._atol = solver.atol * weights
        self._steps = self._evaluations = 0
        self._events: list[Event] = []
        self._stopped: Event | None = None

    def run(self, start: Array, times: Array, breaks: Sequence[float]) -> Solution:
        """Integrate; the solver starts afresh at `breaks` (s), where the system has kinks."""
        end = float(times[-1])
        samples = [start]
        self._events = self._watch.start(0.0, start[:6])
        self._stopped = next((e for e in self._events if self._ends(e)), None)
        failure: str | None = None
        t, y = 0.0, start
        stops = [] if self._stopped else _spaced([*(b for b in breaks if 0.0 < b < end), end])
        for stop in stops:
            try:
                self._on_break(t, y)
            except (ArithmeticError, ValueError) as error:
                failure = _line(error)
                break
            if not self._starts(t, y):
                failure = self._explained("the acceleration is not finite")
                break
            t, y, failure = self._stretch(t, y, stop, times, samples)
            if failure or self._stopped:
                break
        reached = times[: len(samples)]
        if t > reached[-1]:
            reached, samples = np.append(reached, t), [*samples, y]
        state = np.array(samples)
        return Solution(reached, state, self._events, self._statistics(), failure, self._stopped)

    def _starts(self, t: float, y: Array) -> bool:
        """Whether the system has finite rates; a fixed step finds that out by itself."""
        if self._solver.method in STEPS:
            return True
        return bool(np.isfinite(self._system.rates(t, y)).all())

    def _statistics(self) -> Statistics:
        spec, done = self._solver, (self._steps, self._evaluations)
        if spec.method in STEPS:
            return Statistics(spec.method, 0.0, 0.0, *done, spec.step)
        return Statistics(spec.method, spec.rtol, spec.atol, *done)

    def _explained(self, failure: str) -> str:
        trouble = getattr(self._system, "trouble", None)
        return f"{failure}: {trouble}" if trouble else failure

    def _stepper(self, t: float, y: Array, stop: float) -> Any:
        """A solver from t to stop; at stop it sees what the system was until then."""
        quick = self._quick(t, y, stop)
        if quick is not None:
            return quick
        spec, before = self._solver, float(np.nextafter(stop, 0.0))

        def rates(time: float, state: Any) -> list[float]:
            return self._system.rates(min(time, before), state)

        if spec.method in STEPS:
            return FixedStepper(spec.method, rates, t, y, stop, spec.step or stop - t)
        method = getattr(scipy.integrate, spec.method)
        return method(rates, t, y, stop, rtol=spec.rtol, atol=self._atol)

    def _stretch(
        self, t: float, y: Array, stop: float, times: Array, samples: list[Array]
    ) -> tuple[float, Array, str | None]:
        """Integrate over one smooth stretch; the time and state reached, and why no further."""
        spec = self._solver
        # A trial step may overflow; the solver then takes a shorter one.
        with np.errstate(all="ignore"):
            stepper = self._stepper(t, y, stop)
            failure: str | None = None
            while stepper.status == "running" and failure is None and self._stopped is None:
                if self._steps >= spec.max_steps:
                    failure = f"the solver's {spec.max_steps} steps are used up"
                    break
                if hasattr(self._system, "trouble"):
                    self._system.trouble = None
                failure = _advance(stepper)
                if failure is None:
                    t, y = self._record(stepper, times, samples)
                    self._steps += 1
                    self._on_step(t)
                else:
                    failure = self._explained(failure)
        self._evaluations += int(stepper.nfev)
        return t, y, failure

    def _record(self, stepper: Any, times: Array, samples: list[Array]) -> tuple[float, Array]:
        """Samples and events of the step just made; the time and state it leads to."""
        t, y, dense = float(stepper.t), stepper.y.copy(), stepper.dense_output()
        events = self._watch.step(float(stepper.t_old), t, dense)
        self._stopped = next((event for event in events if self._ends(event)), None)
        if self._stopped is not None:
            t = self._stopped.time
            y, events = dense(t), [event for event in events if event.time <= t]
        due = times[len(samples) : np.searchsorted(times, t, side="right")]
        if len(due):
            samples += list(dense(due).T)
        self._events += events
        return t, y


def _spaced(stops: Sequence[float]) -> list[float]:
    """Times in order, without those that rounding alone holds apart; the last always."""
    kept = [float(stops[-1])]
    for stop in sorted(stops[:-1], reverse=True):
        if kept[-1] - stop > 1e-12 * max(1.0, kept[-1]) and stop > 1e-12:
            kept.append(float(stop))
    return kept[::-1]


def _advance(stepper: Any) -> str | None:
    """One step of the solver; why it could not be made."""
    try:
        message = stepper.step()
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        return _line(error)
    if stepper.status == "failed":
        return str(message or "the solver gave up").rstrip(".").lower()
    return None if np.isfinite(stepper.y).all() else "the state is not finite"


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
