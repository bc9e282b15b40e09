"""Numbers the audit computes with, beside floats, fractions and 50-digit numbers.

`Dual` carries an exact derivative; `Degree` bounds the degree of whatever is computed with it;
`Functions` are the transcendental functions of a kind of number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from operator import add
from typing import Any

Scalar = Any
Pair = tuple[Scalar, Scalar]
"""(cosine, sine) of an angle."""

ANGLES = ("q1", "q2", "q3", "q4", "q5", "q6", "phi", "theta", "psi")
DIGITS = 50


class Dual:
    """A value with its derivative along one direction; exact on exact numbers."""

    __slots__ = ("derivative", "value")

    def __init__(self, value: Scalar, derivative: Scalar) -> None:
        self.value, self.derivative = value, derivative

    def __add__(self, other: Scalar) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.derivative + other.derivative)
        return Dual(self.value + other, self.derivative)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.derivative)

    def __sub__(self, other: Scalar) -> Dual:
        return self.__add__(-other)

    def __rsub__(self, other: Scalar) -> Dual:
        return self.__neg__().__add__(other)

    def __mul__(self, other: Scalar) -> Dual:
        if isinstance(other, Dual):
            return Dual(
                self.value * other.value,
                self.value * other.derivative + self.derivative * other.value,
            )
        return Dual(self.value * other, self.derivative * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Dual:
        return Dual(self.value / other, self.derivative / other)


class Degree:
    """Upper bound of a polynomial's degree, found by running the code that computes it.

    `turns[i]` bounds the degree in (cos, sin) of angle i of `ANGLES`, `rest` the total degree
    in all other variables. A sum has the larger degree, a product the sum.
    """

    __slots__ = ("rest", "turns")

    def __init__(self, turns: tuple[int, ...] = (0,) * len(ANGLES), rest: int = 0) -> None:
        self.turns, self.rest = turns, rest

    @property
    def bound(self) -> int:
        """Total degree after c = (1 - t^2)/(1 + t^2), s = 2 t/(1 + t^2), denominators cleared."""
        return 2 * sum(self.turns) + self.rest

    def __add__(self, other: Scalar) -> Degree:
        if not isinstance(other, Degree):
            return self
        return Degree(tuple(map(max, self.turns, other.turns)), max(self.rest, other.rest))

    __radd__ = __sub__ = __rsub__ = __add__

    def __mul__(self, other: Scalar) -> Degree:
        if not isinstance(other, Degree):
            return self
        return Degree(tuple(map(add, self.turns, other.turns)), self.rest + other.rest)

    __rmul__ = __mul__

    def __neg__(self) -> Degree:
        return self

    def __truediv__(self, other: Scalar) -> Degree:
        if isinstance(other, Degree):
            return self * (1 / other)
        return self

    def __rtruediv__(self, other: Scalar) -> Degree:
        """1/m in a sum: clearing it multiplies all other terms by m."""
        return Degree(tuple(2 * n for n in self.turns), 2 * self.rest)


@dataclass(frozen=True)
class Functions:
    """Functions of one kind of number. `atan2(s, c)` takes the sine first, in (-pi, pi]."""

    number: Callable[[Any], Scalar]
    sqrt: Callable[[Scalar], Scalar]
    sin: Callable[[Scalar], Scalar]
    cos: Callable[[Scalar], Scalar]
    atan2: Callable[[Scalar, Scalar], Scalar]
    pi: Scalar

    def sine_first(self, a: Scalar, b: Scalar) -> Scalar:
        """The chapter's Atan2 in [0, 2 pi), read with the sine as first argument."""
        angle = self.atan2(a, b)
        return angle + 2 * self.pi if angle < 0 else angle

    def cosine_first(self, a: Scalar, b: Scalar) -> Scalar:
        """The same read with the cosine as first argument."""
        return self.sine_first(b, a)

    def pair(self, angle: Scalar) -> Pair:
        """(cos, sin) of an angle."""
        return self.cos(angle), self.sin(angle)


FLOATS = Functions(float, math.sqrt, math.sin, math.cos, math.atan2, math.pi)


@cache
def digits50() -> Functions:
    """50-digit numbers, in a context of their own."""
    import mpmath

    context = mpmath.mp.clone()
    context.dps = DIGITS
    return Functions(
        context.mpf, context.sqrt, context.sin, context.cos, context.atan2, +context.pi
    )
