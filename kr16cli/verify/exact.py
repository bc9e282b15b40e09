"""Exact arithmetic for identities: rational points of the unit circle, and dual numbers.

An identity that is polynomial in sines and cosines and fails anywhere fails almost everywhere:
at random rational points of numerators and denominators up to N a false one of degree d holds
with a probability of at most about d / N (Schwartz and Zippel). Nothing is rounded, so the
difference must be 0.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, TypeVar

from kr16cli.robot import Geometry, LinkData, Payload, RobotData

SIZE = 10**4
"""Largest numerator and denominator of the half-angle tangents."""

Pair = tuple[Any, Any]
_Body = TypeVar("_Body", LinkData, Payload)


def turn(t: Fraction) -> Pair:
    """The point (cos, sin) of the unit circle with half-angle tangent t."""
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


def number(source: random.Random, size: int = SIZE) -> Fraction:
    """A random fraction, of either sign."""
    return Fraction(source.randint(-size, size), source.randint(1, size))


def turns(source: random.Random, count: int = 6) -> list[Pair]:
    """Random rational points of the unit circle."""
    return [turn(number(source)) for _ in range(count)]


def geometry(g: Geometry) -> Geometry:
    """The lengths as the decimal fractions they are written as."""
    return Geometry(*(Fraction(repr(v)) for v in g))  # type: ignore[arg-type]  # exact scalars


def robot(data: RobotData) -> RobotData:
    """The robot with lengths, inertias and gravity as decimal fractions."""
    links = tuple(_with(link, _fraction) for link in data.links)
    gravity: Any = tuple(map(_fraction, data.gravity))
    return replace(data, geometry=geometry(data.geometry), links=links, gravity=gravity)


def payload(load: Payload) -> Payload:
    """A payload as decimal fractions."""
    return _with(load, _fraction)


def rounded(data: RobotData, digits: int = 4) -> RobotData:
    """The robot with few digits, so that fractions stay short."""

    def short(value: float) -> float:
        return round(value, digits)

    links = tuple(_with(link, short) for link in data.links)
    return replace(data, geometry=Geometry(*map(short, data.geometry)), links=links)


def _fraction(value: float) -> Fraction:
    return Fraction(repr(value))


def _with(body: _Body, change: Callable[[float], Any]) -> _Body:
    """A body with each of its ten numbers changed; of any scalar type."""
    numbers: dict[str, Any] = {
        "mass": change(body.mass),
        "com": tuple(map(change, body.com)),
        "inertia": tuple(map(change, body.inertia)),
    }
    return replace(body, **numbers)


class Dual:
    """a + b eps with eps^2 = 0: the exact derivative of anything made of + - * /."""

    __slots__ = ("eps", "real")

    def __init__(self, real: Any, eps: Any = 0) -> None:
        self.real, self.eps = real, eps

    @staticmethod
    def _parts(other: Any) -> tuple[Any, Any] | None:
        if isinstance(other, Dual):
            return other.real, other.eps
        return (other, 0) if isinstance(other, (int, Fraction)) else None

    def __add__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if not parts:
            return NotImplemented
        return Dual(self.real + parts[0], self.eps + parts[1])

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.real, -self.eps)

    def __sub__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if not parts:
            return NotImplemented
        return Dual(self.real - parts[0], self.eps - parts[1])

    def __rsub__(self, other: Any) -> Dual:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if not parts:
            return NotImplemented
        return Dual(self.real * parts[0], self.real * parts[1] + self.eps * parts[0])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if not parts:
            return NotImplemented
        value = self.real / parts[0]
        return Dual(value, (self.eps - value * parts[1]) / parts[0])


def dual_turns(pairs: Sequence[Pair], direction: Sequence[Any]) -> list[Pair]:
    """The points carrying the derivative along joint speeds `direction`."""
    return [(Dual(c, -s * v), Dual(s, c * v)) for (c, s), v in zip(pairs, direction, strict=True)]


def derivative(value: Any) -> Any:
    """The dual part; numbers and structural zeros have none."""
    return value.eps if isinstance(value, Dual) else 0


def determinant(rows: Sequence[Sequence[Any]]) -> Fraction:
    """Determinant by elimination in fractions."""
    work = [[_plain(v) for v in row] for row in rows]
    result = Fraction(1)
    for i in range(len(work)):
        pivot = next((k for k in range(i, len(work)) if work[k][i] != 0), None)
        if pivot is None:
            return Fraction(0)
        if pivot != i:
            work[i], work[pivot] = work[pivot], work[i]
            result = -result
        result *= work[i][i]
        for k in range(i + 1, len(work)):
            factor = Fraction(work[k][i]) / work[i][i]
            work[k] = [a - factor * b for a, b in zip(work[k], work[i], strict=True)]
    return result


def unequal(a: Iterable[Iterable[Any]], b: Iterable[Iterable[Any]]) -> int:
    """How many entries of two matrices differ; structural zeros count as 0."""
    pairs = [(x, y) for r, s in zip(a, b, strict=True) for x, y in zip(r, s, strict=True)]
    return sum(_plain(x) != _plain(y) for x, y in pairs)


def _plain(value: Any) -> Any:
    return value if isinstance(value, (int, Fraction)) else Fraction(float(value))  # ZERO
