"""Dual numbers for the oracles of the tests: derivatives to rounding, or exact on fractions."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Number
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


class Dual:
    """a + b eps with eps^2 = 0: exact derivatives of anything made of + - * /."""

    __slots__ = ("eps", "real")

    def __init__(self, real: Any, eps: Any = 0) -> None:
        self.real, self.eps = real, eps

    @staticmethod
    def _parts(other: Any) -> tuple[Any, Any] | None:
        if isinstance(other, Dual):
            return other.real, other.eps
        return (other, 0) if isinstance(other, Number) else None

    def __add__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Dual(self.real + parts[0], self.eps + parts[1])

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.real, -self.eps)

    def __sub__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Dual(self.real - parts[0], self.eps - parts[1])

    def __rsub__(self, other: Any) -> Dual:
        return -self + other

    def __mul__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Dual(self.real * parts[0], self.real * parts[1] + self.eps * parts[0])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        value = self.real / parts[0]
        return Dual(value, (self.eps - value * parts[1]) / parts[0])

    def __rtruediv__(self, other: Any) -> Dual:
        return Dual(other) / self


def real(values: Any) -> Array:
    """The real parts of an array of dual numbers (others are their own)."""
    return _each(values, lambda v: v.real if isinstance(v, Dual) else v)


def eps(values: Any) -> Array:
    """The dual parts: the derivative along the direction that was seeded."""
    return _each(values, lambda v: v.eps if isinstance(v, Dual) else 0)


def _each(values: Any, what: Any) -> Array:
    array = np.asarray(values, dtype=object)
    flat = np.array([what(v) for v in array.ravel()] + [None], dtype=object)[:-1]
    return flat.reshape(array.shape)


def dual_turns(c: Array, s: Array, direction: Sequence[Any]) -> tuple[Array, Array]:
    """(cos, sin) arrays that carry the derivative along a joint-space direction."""
    triples = list(zip(c, s, direction, strict=True))
    cosines = [Dual(ci, -si * v) for ci, si, v in triples]
    sines = [Dual(si, ci * v) for ci, si, v in triples]
    return np.array(cosines, dtype=object), np.array(sines, dtype=object)
