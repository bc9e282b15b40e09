"""Motions under torques held between samples, on the compiled kernels or on NumPy columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from kr16cli.kernels.quantities import variant

Array = npt.NDArray[np.float64]
Method = Literal["rk4", "dopri5"]
METHODS: tuple[Method, ...] = ("rk4", "dopri5")

BLOCK = 1000
"""Trajectories per thread and call of an engine: seconds at most, so that Ctrl-C is heard."""


@dataclass(frozen=True)
class Task:
    """What a rollout of n trajectories asks for, and where its results go. SI units.

    Attributes:
        method: fixed step of the classical order 4, or Dormand and Prince's order 5(4).
        vertical, drives: gravity along z alone; friction counts.
        parameters: flat vector (COUNT,) of `parameters.pack`, or one per trajectory (n, COUNT).
        state: (n, 12) angles and speeds at the start.
        torque: (1 or n, samples, 6), each held for `hold` s, the last to the end.
        wrench: (1 or n, 6) force and moment on the flange, or None.
        in_flange: the wrench has the flange's axes, not robroot's.
        duration: end, s; it begins at 0.
        step: greatest step, s; 0 leaves it to dopri5.
        rtol, atol: tolerances of dopri5.
        max_steps: steps that dopri5 may try in a trajectory.
        times: (m,) rising from 0 to duration at most.
        out: (n, m, 12) states at `times`; NaN beyond what was reached.
        reached: (n,) time reached.
        tally: (n, 3) steps made, steps refused, evaluations of the right-hand side.
    """

    method: Method
    vertical: bool
    drives: bool
    parameters: Array
    state: Array
    torque: Array
    hold: float
    wrench: Array | None
    in_flange: bool
    duration: float
    step: float
    rtol: float
    atol: float
    max_steps: int
    times: Array
    out: Array
    reached: Array
    tally: npt.NDArray[np.int64]

    def blocks(self, size: int) -> Iterator[Task]:
        """The same for `size` trajectories at a time."""
        n = len(self.state)
        for lo in range(0, n, size):
            part = slice(lo, lo + size)

            def mine(table: Any, rank: int, part: slice = part) -> Any:
                each = table is not None and table.ndim == rank and len(table) == n
                return table[part] if each else table

            yield replace(
                self,
                parameters=mine(self.parameters, 2),
                state=self.state[part],
                torque=mine(self.torque, 3),
                wrench=mine(self.wrench, 2),
                out=self.out[part],
                reached=self.reached[part],
                tally=self.tally[part],
            )


def run(task: Task, *, native: bool, threads: int = 1) -> None:
    """Fill the task's results; NumPy takes no threads."""
    if native:
        for block in task.blocks(BLOCK * threads):
            _compiled(block, threads)
        return
    from kr16cli.kernels.rollout_columns import run_columns

    for block in task.blocks(BLOCK):
        run_columns(block)


def _compiled(task: Task, threads: int) -> None:
    from kr16cli.kernels import _native

    name = "forward_dynamics"
    _native.rollout(
        METHODS.index(task.method),
        variant(name, vertical=task.vertical, drives=task.drives),
        variant(name, vertical=False, drives=task.drives),
        (task.parameters, task.state, task.torque, task.wrench, task.times),
        (task.out, task.reached, task.tally),
        task.in_flange,
        task.torque.shape[1],
        (task.hold, task.duration, task.step, task.rtol, task.atol),
        task.max_steps,
        threads,
    )
