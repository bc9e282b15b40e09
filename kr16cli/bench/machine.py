"""What this machine can do at most, and how near to it a kernel comes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kr16cli.bench.timing import least
from kr16cli.kernels import _native
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, WIDTH

TRIG_FLOPS = 38
"""Multiplications and additions of one angle's sine and cosine (native/kr16_math.h)."""

_NUMBERS = 4_000_000
_ROUNDS = 100_000


class Limits(NamedTuple):
    """One core's most: operations in registers (1/s), reading and streaming memory (B/s)."""

    flops: float
    read: float
    write: float


def limits(rounds: int = 10) -> Limits:
    """Measured now, the best of `rounds`."""
    numbers = np.ones(_NUMBERS)
    done = _native.multiply_adds(1)[0] * _ROUNDS
    spent = least(
        {
            "flops": lambda: _native.multiply_adds(_ROUNDS),
            "read": lambda: _native.touch(numbers, False),
            "write": lambda: _native.touch(numbers, True),
        },
        rounds,
    )
    size = numbers.nbytes
    return Limits(done / spent["flops"], size / spent["read"], size / spent["write"])


class Cost(NamedTuple):
    """What one configuration of a quantity takes: operations, bytes read, bytes written."""

    flops: int
    read: int
    write: int

    def bound(self, most: Limits) -> float:
        """Seconds below which no program gets on this machine: the arithmetic or the memory."""
        return max(self.flops / most.flops, self.read / most.read + self.write / most.write)


def cost(name: str, given: tuple[str, ...]) -> Cost:
    """Of a quantity whose inputs `given` are arrays, the others left out; vertical gravity."""
    quantity = QUANTITIES[name]
    operations = _native.operations()[f"{name}_vertical" if quantity.gravity else name]
    angles = sum(6 for i in quantity.inputs if i in ANGLES and i in given)
    read = sum(8 * WIDTH.get(i, 6) for i in given)
    return Cost(operations + TRIG_FLOPS * angles, read, 8 * int(np.prod(quantity.shape)))
