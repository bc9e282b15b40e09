"""Rollouts on NumPy columns: the steps of native/rollout*.c where nothing was compiled."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from kr16cli.kernels.columns import ARRAYS
from kr16cli.kernels.parameters import Parameters, unpack
from kr16cli.kernels.quantities import QUANTITIES
from kr16cli.kernels.rollout import Array, Task
from kr16cli.kernels.straight import functions
from kr16cli.model.scalars import Scalar

Lanes = npt.NDArray[np.bool_]

FEW = 24
"""Up to so many trajectories, straight-line Python for each is quicker than NumPy for all."""


def run_columns(task: Task) -> None:
    """Fill a task's results."""
    # A diverging trajectory overflows; it is marked by NaN.
    with np.errstate(all="ignore"):
        (_fixed if task.method == "rk4" else _adaptive)(task)


class _Arms:
    """The right-hand side of the trajectories `who`, a column each."""

    def __init__(self, task: Task) -> None:
        self._task, self.who = task, np.arange(len(task.state))
        self._own = task.parameters.ndim == 2
        self.tau = self._torque(np.zeros(len(self.who), dtype=np.intp))
        self._choose()

    def _choose(self) -> None:
        task = self._task
        rows: list[Scalar] = (
            list(task.parameters[self.who].T) if self._own else task.parameters.tolist()
        )
        self._numbers: Parameters = unpack(rows, vertical=task.vertical, drives=task.drives)
        every = task.parameters[self.who].tolist() if self._own else [rows] * len(self.who)
        self._each: list[list[float]] | None = every if len(self.who) <= FEW else None
        self._wrench = None if task.wrench is None else self._of(task.wrench).T

    def _of(self, table: Array) -> Array:
        return table[self.who] if len(table) > 1 else table[:1]

    def _torque(self, sample: npt.NDArray[np.intp]) -> Array:
        table = self._task.torque
        return table[self.who if len(table) > 1 else np.zeros_like(self.who), sample].T.copy()

    def hold(self, sample: npt.NDArray[np.intp]) -> None:
        """Put the torques of these samples in force."""
        self.tau = self._torque(sample)

    def keep(self, lanes: Lanes) -> None:
        """Go on with these lanes only."""
        self.who, self.tau = self.who[lanes], self.tau[:, lanes]
        self._choose()

    def rates(self, x: Array) -> Array:
        """Time derivative of states (12, n)."""
        if self._each is not None:
            columns = zip(self._each, x.T.tolist(), self.tau.T.tolist(), strict=True)
            each = [self._rates_of_one(i, *column) for i, column in enumerate(columns)]
            return np.array(each).reshape(-1, 12).T.copy()
        q, qd = x[:6], x[6:]
        cs = list(zip(np.cos(q), np.sin(q), strict=True))
        tau = self.tau if self._wrench is None else self.tau + self._pushed(cs)
        k = self._numbers
        out = np.empty_like(x)
        out[:6] = qd
        results = QUANTITIES["forward_dynamics"].results(k, cs, list(qd), list(tau), ARRAYS)
        for row, value in zip(out[6:], results, strict=True):
            row[...] = value
        return out

    def _rates_of_one(
        self, i: int, p: list[float], x: list[float], tau: list[float]
    ) -> list[float]:
        """The same of trajectory i of few, on floats; NaNs beyond them."""
        ask, q, qd = functions(), x[:6], x[6:]
        try:
            if self._wrench is not None:
                w = self._wrench[:, i % self._wrench.shape[1]].tolist()
                if self._task.in_flange:
                    T = ask["fk"](p, q)
                    w = [
                        sum(T[4 * r + c] * part[c] for c in range(3))
                        for part in (w[:3], w[3:])
                        for r in range(3)
                    ]
                J = ask["jacobian"](p, q)
                tau = [t + sum(J[6 * r + c] * w[r] for r in range(6)) for c, t in enumerate(tau)]
            if self._task.drives:
                tau = [t - f for t, f in zip(tau, ask["friction"](p, qd), strict=True)]
            return [*qd, *ask["forward_dynamics"](p, q, qd, tau)]
        except (ArithmeticError, ValueError):
            return [np.nan] * 12

    def _pushed(self, cs: Any) -> Any:
        """J^T w."""
        w: list[Any] = list(self._wrench) if self._wrench is not None else []
        if self._task.in_flange:
            pose = list(QUANTITIES["fk"].results(self._numbers, cs, ARRAYS))
            w = [
                sum(pose[4 * i + j] * part[j] for j in range(3))
                for part in (w[:3], w[3:])
                for i in range(3)
            ]
        entries = list(QUANTITIES["jacobian"].results(self._numbers, cs, ARRAYS))
        return np.array(
            [sum(entries[6 * i + j] * w[i] for i in range(6)) + 0.0 * cs[0][0] for j in range(6)]
        )


def _held_until(task: Task, sample: npt.NDArray[np.intp]) -> Array:
    """When the torques of samples end."""
    end = (sample + 1) * task.hold
    more = (sample + 1 < task.torque.shape[1]) & (end < task.duration * (1.0 - 1e-12))
    held: Array = np.where(more, end, task.duration)
    return held


def _fixed(task: Task) -> None:
    """Classical steps of one length; samples between their ends by cubics."""
    arms, n = _Arms(task), len(task.state)
    x, alive = task.state.T.copy(), np.ones(n, dtype=bool)
    near = 1e-15 * task.duration
    task.tally[...] = 0
    task.out[:, task.times <= 0.0] = task.state[:, None]
    m, t, sample = int((task.times <= 0.0).sum()), 0.0, 0
    while t < task.duration:
        arms.hold(np.full(n, sample))
        begin, stop = t, float(_held_until(task, np.array(sample)))
        count = max(1, int(np.ceil((stop - begin) / task.step * (1.0 - 1e-12))))
        for s in range(1, count + 1):
            t0, t = t, stop if s == count else begin + (stop - begin) * (s / count)
            h, before = t - t0, x
            k1 = arms.rates(x)
            k2 = arms.rates(x + 0.5 * h * k1)
            k3 = arms.rates(x + 0.5 * h * k2)
            x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + arms.rates(x + h * k3))
            task.tally[alive, 2] += 4
            odd = ~np.isfinite(x).all(axis=0)
            task.reached[alive & odd] = t0
            alive &= ~odd
            x[:, odd] = task.state[odd].T  # rests at the start, for nobody
            task.tally[alive, 0] += 1
            due = int(np.searchsorted(task.times, t - near, side="left"))
            if due > m:
                f1 = arms.rates(x)
                task.tally[alive, 2] += 1
                for i in range(m, due):
                    value = _cubic((task.times[i] - t0) / h, h, before, k1, x, f1)
                    task.out[:, i] = np.where(alive, value, np.nan).T
            m = int(np.searchsorted(task.times, t + near, side="right"))
            task.out[:, due:m] = np.where(alive, x, np.nan).T[:, None]
        sample += 1
    task.reached[alive] = t


def _cubic(u: float, h: float, x0: Array, f0: Array, x1: Array, f1: Array) -> Array:
    """Through values and slopes at both ends of a step h, at the part u of it."""
    v = 1.0 - u
    first = v * v * ((1.0 + 2.0 * u) * x0 + u * h * f0)
    return first + u * u * ((1.0 + 2.0 * v) * x1 - v * h * f1)


def _size(v: Array, scale: Array) -> Array:
    """Root mean square of the columns of v over the tolerated errors."""
    size: Array = np.sqrt(np.mean(np.square(v / np.maximum(scale, np.finfo(float).tiny)), axis=0))
    return size


class _Adaptive:
    """Dormand and Prince's method: each column has its own time and step."""

    def __init__(self, task: Task) -> None:
        from scipy.integrate import RK45

        self.task, self.arms = task, _Arms(task)
        n = len(task.state)
        self.x, self.t, self.h = task.state.T.copy(), np.zeros(n), np.zeros(n)
        self.sample, self.m = np.zeros(n, dtype=np.intp), np.zeros(n, dtype=np.intp)
        self.m[:] = (task.times <= 0.0).sum()
        self.stop, self.refused = _held_until(task, self.sample), np.zeros(n, dtype=bool)
        self.k = np.zeros((7, 12, n))
        self._stage = [*(RK45.A[j, :j] for j in range(1, 6)), RK45.B]
        self._defect, self._dense = RK45.E, RK45.P
        task.tally[...] = 0
        task.out[...] = np.nan
        task.out[:, task.times <= 0.0] = task.state[:, None]

    def begin(self) -> None:
        """Choose the first steps (Hairer, Norsett, Wanner 1993, section II.4)."""
        scale = self._scale(self.x)
        self.k[0] = slope = self.arms.rates(self.x)
        size, steep = _size(self.x, scale), _size(slope, scale)
        probe = np.where((size < 1e-5) | (steep < 1e-5), 1e-6, 0.01 * size / steep)
        probe = self._bound(probe)
        bend = (self.arms.rates(self.x + probe * slope) - slope) / probe
        steepest = np.fmax(steep, _size(bend, scale))
        first = np.where(
            steepest <= 1e-15, np.maximum(1e-6, 1e-3 * probe), (0.01 / steepest) ** 0.2
        )
        self.h = np.where(first > 0.0, np.fmin(first, 100.0 * probe), probe)
        self.task.tally[:, 2] = 2

    def _bound(self, h: Array) -> Array:
        return np.fmin(h, self.task.step) if self.task.step > 0.0 else h

    def _scale(self, x: Array, y: Array | None = None) -> Array:
        most = np.abs(x) if y is None else np.fmax(np.abs(x), np.abs(y))
        return self.task.atol + self.task.rtol * most

    def step(self) -> None:
        """Try a step of every column."""
        task, k, who = self.task, self.k, self.arms.who
        self.h = self._bound(self.h)
        last = self.t + 1.01 * self.h >= self.stop  # no tiny last step
        h = np.where(last, self.stop - self.t, self.h)
        y = self.x
        for j, weights in enumerate(self._stage, 1):
            y = self.x + h * np.tensordot(weights, k[:j], 1)
            k[j] = self.arms.rates(y)
        error = _size(h * np.tensordot(self._defect, k, 1), self._scale(self.x, y))
        done = error <= 1.0
        factor = np.where(
            error < np.inf, np.clip(0.9 * np.maximum(error, 1e-300) ** -0.2, 0.2, 10.0), 0.2
        )
        factor[done & self.refused] = np.minimum(factor[done & self.refused], 1.0)
        longer = np.where(done & last & ~self.refused, np.fmax(self.h, h * factor), h * factor)
        t = np.where(done, np.where(last, self.stop, self.t + h), self.t)
        for i in np.flatnonzero(done):
            self._give(int(i), h[i], float(t[i]))
        task.tally[who, 0] += done
        task.tally[who, 1] += ~done
        task.tally[who, 2] += 6
        self.x, self.t, self.h = np.where(done, y, self.x), t, longer
        k[0] = np.where(done, k[6], k[0])
        self.refused = ~done
        self._turn()

    def _give(self, i: int, h: float, t: float) -> None:
        """The samples of column i within the step to t."""
        times = self.task.times
        due = int(np.searchsorted(times, t, side="right"))
        if due <= self.m[i]:
            return
        u = (times[self.m[i] : due] - self.t[i]) / h
        powers = np.array([u, u**2, u**3, u**4])
        rise = h * (self.k[:, :, i].T @ self._dense @ powers)
        self.task.out[self.arms.who[i], self.m[i] : due] = (self.x[:, i, None] + rise).T
        self.m[i] = due

    def _turn(self) -> None:
        """The next torque where one is over; leave what has ended, or cannot go on."""
        task, who = self.task, self.arms.who
        tried = task.tally[who, 0] + task.tally[who, 1]
        small = ~(self.h > 10.0 * np.finfo(float).eps * np.abs(self.t))
        over = (self.t >= task.duration) | (tried >= task.max_steps) | small
        task.reached[who] = self.t
        if over.any():
            on = ~over
            self.arms.keep(on)
            self.x, self.k = self.x[:, on], np.ascontiguousarray(self.k[:, :, on])
            for name in ("t", "h", "sample", "m", "stop", "refused"):
                setattr(self, name, getattr(self, name)[on])
        turned = self.t >= self.stop
        if turned.any():
            self.sample = self.sample + turned
            self.stop = _held_until(task, self.sample)
            self.arms.hold(self.sample)
            self.k[0] = np.where(turned, self.arms.rates(self.x), self.k[0])
            task.tally[self.arms.who, 2] += turned


def _adaptive(task: Task) -> None:
    solver = _Adaptive(task)
    solver.begin()
    while len(solver.arms.who):
        solver.step()
