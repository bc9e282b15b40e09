"""Methods of fixed step behind the interface of SciPy's solvers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from kr16cli.arrays import Array
from kr16cli.simulate.core import Rates, euler_step, rk4_step

STEPS: dict[str, Callable[[Rates, float, Sequence[float], float], list[float]]] = {
    "RK4": rk4_step,
    "SemiImplicitEuler": euler_step,
}


def equal_parts(length: float, step: float) -> int:
    """Into how many equal steps a stretch falls, none longer than `step`."""
    return max(1, math.ceil(length / step * (1.0 - 1e-12)))


class FixedStepper:
    """Steps of one length from t to `stop`, both exactly.

    Args:
        method: a name of `STEPS`.
        rates: right-hand side.
        t: start, s.
        y: state at the start.
        stop: end, s.
        step: greatest step, s.
    """

    def __init__(
        self, method: str, rates: Rates, t: float, y: Array, stop: float, step: float
    ) -> None:
        self._method, self._rates = STEPS[method], rates
        self._begin, self._stop = t, stop
        self._count = equal_parts(stop - t, step)
        self._done = 0
        self._last: tuple[float, tuple[float, ...], list[float]] | None = None
        self.t, self.y, self.t_old = t, y, t
        self._y_old: Array = y
        self._f_old: list[float] = []
        self.status, self.nfev = "running", 0

    def _rate(self, t: float, y: Sequence[float]) -> list[float]:
        """The right-hand side; the value at the end of a step serves the next one."""
        last, key = self._last, tuple(y)
        if last is None or last[:2] != (t, key):
            self.nfev += 1
            self._last = last = (t, key, list(self._rates(t, y)))
        return last[2]

    def step(self) -> str | None:
        """One step; its message is None, as it cannot fail."""
        self._done += 1
        part = self._done / self._count
        end = self._stop if part == 1.0 else self._begin + (self._stop - self._begin) * part
        y = self.y.tolist()
        self._y_old, self._f_old = self.y, self._rate(self.t, y)
        self.t_old, self.t, self.y = self.t, end, np.array(self._advance(y, end))
        if part == 1.0:
            self.status = "finished"
        return None

    def _advance(self, y: list[float], end: float) -> list[float]:
        return self._method(self._rate, self.t, y, end - self.t)

    def dense_output(self) -> Callable[[Any], Array]:
        """Cubic through states and rates at both ends of the last step."""
        t0, h, y0, y1 = self.t_old, self.t - self.t_old, self._y_old, self.y
        f0, f1 = np.array(self._f_old), np.array(self._rate(self.t, y1.tolist()))

        def dense(t: Any) -> Array:
            u = (np.asarray(t, dtype=np.float64) - t0) / h
            v = 1.0 - u
            ends = np.multiply.outer(y0, v * v * (1.0 + 2.0 * u)) + np.multiply.outer(
                y1, u * u * (1.0 + 2.0 * v)
            )
            slopes = np.multiply.outer(f0, u * v * v) - np.multiply.outer(f1, u * u * v)
            result: Array = ends + h * slopes
            return result

        return dense
