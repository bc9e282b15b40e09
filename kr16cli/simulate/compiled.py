"""The compiled solvers behind the interface of SciPy's, for stretches of held torque."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.simulate.fixed import STEPS, equal_parts
from kr16cli.simulate.plant import SIZE, Plant
from kr16cli.simulate.scenario import SolverSpec

METHODS = ("RK4", "RK45")
"""The solvers that are compiled: the classical order 4, and Dormand and Prince's order 5(4)."""


class CompiledSolver:
    """Makes a stepper for each stretch that the compiled solvers can do; others are left.

    They can where torques and wrench stay as they are to the end of the stretch, and neither
    friction nor stops nor limits of speed ask for more than the kernels of the arm know.

    Args:
        robot: the arm that moves, its kernels compiled.
        plant: the same arm with its torques, wrench and limits.
        solver: method and tolerances.
        atol: (16,) absolute tolerance of each number of the state.
    """

    def __init__(self, robot: Robot, plant: Plant, solver: SolverSpec, atol: Array) -> None:
        self._plant, self._solver = plant, solver
        held = solver.method in METHODS and plant.holds
        kernels = robot.compiled("forward_dynamics", "jacobian", "fk") if held else None
        self._stretch = None
        if kernels is not None:
            from kr16cli.kernels import _native

            dynamics, jacobian, pose = kernels
            fixed = solver.method in STEPS
            self._stretch = _native.Stretch(dynamics, jacobian, pose, fixed, solver.rtol, atol)

    def stepper(self, t: float, y: Array, stop: float) -> CompiledStepper | None:
        """From state y at t to `stop` (s), or None."""
        if self._stretch is None:
            return None
        q, qd = y[:6].tolist(), y[6:12].tolist()
        tau = self._plant.applied(self._plant.torque(t, q, qd), qd)
        wrench = self._plant.pushing(t)
        load = None if wrench is None else np.array([*wrench.force, *wrench.moment], dtype=float)
        in_flange = wrench is not None and wrench.axes == "flange"
        self._stretch.start(t, y, np.array(tau, dtype=float), load, in_flange)
        step = self._solver.step if self._solver.method in STEPS else None
        return CompiledStepper(self._stretch, y, stop, step)


class CompiledStepper:
    """Steps of a stretch that has been started, to `stop` exactly.

    Args:
        stretch: where it begins.
        y: the state there.
        stop: end, s.
        step: greatest step of RK4, s; None for steps by tolerance.
    """

    def __init__(self, stretch: Any, y: Array, stop: float, step: float | None) -> None:
        self._stretch, self._begin, self._stop = stretch, float(stretch.t), stop
        self._count = 0 if step is None else equal_parts(stop - self._begin, step)
        self._done = 0
        self.t, self.t_old, self.y = self._begin, self._begin, y
        self.status = "running"

    @property
    def nfev(self) -> int:
        """Evaluations of the rates."""
        count: int = self._stretch.evaluations
        return count

    def step(self) -> str | None:
        """One step; why it could not be made."""
        self._done += 1
        part = self._done / self._count if self._count else 1.0
        end = self._stop if part == 1.0 else self._begin + (self._stop - self._begin) * part
        if not self._stretch.step(end):
            self.status = "failed"
            return "required step size is less than spacing between numbers"
        self.t, self.t_old = self._stretch.t, self._stretch.t_old
        self.y = np.empty(SIZE)
        self._stretch.state(self.y)
        if self.t == self._stop:
            self.status = "finished"
        return None

    def dense_output(self) -> Callable[[Any], Array]:
        """States within the last step: (16,) at a time, (16, n) at n of them."""

        def dense(t: Any) -> Array:
            times = np.asarray(t, dtype=np.float64)
            states = np.empty((SIZE, times.size))
            self._stretch.at(np.ascontiguousarray(times), states)
            return states.reshape(SIZE, *times.shape)

        return dense
