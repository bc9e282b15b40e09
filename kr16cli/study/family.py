"""Many robots at once: the scalar-generic model run with arrays in the place of its numbers.

A family of n robots that differ in their parameters answers for k configurations in one pass,
(n, k, ...). Formulas are the model's own; here is only who is told which numbers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kr16cli.arrays import Array
from kr16cli.kernels.columns import ARRAYS
from kr16cli.kernels.parameters import Parameters, parameters
from kr16cli.kernels.quantities import ANGLES, QUANTITIES
from kr16cli.robot import Payload, RobotData
from kr16cli.single import Arm
from kr16cli.study.spread import Uncertain, moved

_NUMBERS_AT_ONCE = 1 << 16
"""Robots times configurations of one pass; more would leave the cache."""


class Family:
    """Robots around one robot.

    Args:
        data: the robot in the middle.
        sources: what differs.
        deviations: (n, d) of each robot, in the sources' units.
        payload: on every flange.
        drives: count rotor inertia and friction.
    """

    def __init__(
        self,
        data: RobotData,
        sources: Sequence[Uncertain],
        deviations: Array,
        *,
        payload: Payload | None = None,
        drives: bool = False,
    ) -> None:
        self.data, self.sources, self.deviations = data, list(sources), deviations
        self.payload, self.drives = payload, drives

    def __len__(self) -> int:
        return len(self.deviations)

    def parameters(self, rows: slice, *, beside: bool) -> Parameters:
        """The numbers of some robots as arrays (n,), or (n, 1) with `beside`."""
        columns = self.deviations[rows].T
        columns = columns[..., None] if beside else columns
        data = moved(self.data, self.sources, list(columns))
        return parameters(Arm(data, payload=self.payload, drives=self.drives))

    def ask(self, name: str, *inputs: Array) -> Array:
        """A quantity of `kernels.quantities` for every robot and configuration.

        Args:
            name: of the quantity.
            inputs: (k, width) each.

        Returns:
            (n, k, *shape).
        """
        quantity = QUANTITIES[name]
        count = len(inputs[0])
        out = np.empty((len(self), count, int(np.prod(quantity.shape, dtype=int))))
        step = max(1, _NUMBERS_AT_ONCE // max(1, count))
        columns = [
            list(zip(np.cos(v.T), np.sin(v.T), strict=True)) if n in ANGLES else list(v.T)
            for n, v in zip(quantity.inputs, inputs, strict=True)
        ]
        for low in range(0, len(self), step):
            rows = slice(low, min(low + step, len(self)))
            numbers = self.parameters(rows, beside=True)
            for i, result in enumerate(quantity.results(numbers, *columns, ARRAYS)):
                out[rows, :, i] = result
        return out.reshape(len(self), count, *quantity.shape)

    def each(self, name: str, *inputs: Array) -> Array:
        """A quantity where robot i is asked about configuration i alone, inputs (n, width)."""
        quantity = QUANTITIES[name]
        numbers = self.parameters(slice(None), beside=False)
        return self.each_with(numbers, name, *inputs).reshape(len(self), *quantity.shape)

    @staticmethod
    def each_with(numbers: Parameters, name: str, *inputs: Array) -> Array:
        """As `each`, with the robots' numbers at hand; (n, m)."""
        quantity = QUANTITIES[name]
        columns = [
            list(zip(np.cos(v.T), np.sin(v.T), strict=True)) if n in ANGLES else list(v.T)
            for n, v in zip(quantity.inputs, inputs, strict=True)
        ]
        results = list(quantity.results(numbers, *columns, ARRAYS))
        out = np.empty((len(inputs[0]), len(results)))
        for i, result in enumerate(results):
            out[:, i] = result
        return out


def slopes(
    data: RobotData,
    sources: Sequence[Uncertain],
    name: str,
    *inputs: Array,
    payload: Payload | None = None,
    drives: bool = False,
) -> Array:
    """Derivative of a quantity with respect to each source, (d, k, *shape).

    Torques, M and G are polynomials of degree two in every mass, length and coordinate, for
    which the central difference over the half width is the derivative itself.
    """
    half = np.diag([source.half for source in sources])
    both = Family(data, sources, np.vstack([half, -half]), payload=payload, drives=drives)
    found = both.ask(name, *inputs)
    count = len(sources)
    width = np.array([2.0 * source.half for source in sources])
    made: Array = (found[:count] - found[count:]) / width.reshape(-1, *[1] * (found.ndim - 1))
    return made
