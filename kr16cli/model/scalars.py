"""Scalars of the model: what they must offer, the structural zero, and quarter turns.

A scalar is anything with + - * / : float, NumPy array (one array is one scalar of a batch),
`fractions.Fraction`, mpmath number, symbol. Equal code runs on all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

Scalar = Any
Vector = tuple[Scalar, Scalar, Scalar]
Trig = Sequence[tuple[Scalar, Scalar]]
"""Six pairs (cos q_i, sin q_i)."""


class _Zero:
    """A zero known when the code is written: arithmetic with it costs no operation.

    Recursions can so be written in full generality, and a term with a structural zero (the
    base at rest, a regrouped mass, a coordinate of a length) drops out by itself.
    """

    __slots__ = ()
    __array_ufunc__ = None  # NumPy arrays then defer to the methods below

    def __add__(self, other: Scalar) -> Scalar:
        return other

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        return -other

    def __rsub__(self, other: Scalar) -> Scalar:
        return other

    def __mul__(self, other: Scalar) -> _Zero:
        return self

    __rmul__ = __truediv__ = __mul__

    def __neg__(self) -> _Zero:
        return self

    def __float__(self) -> float:
        return 0.0

    def __repr__(self) -> str:
        return "ZERO"


ZERO = _Zero()


def structural(value: Scalar) -> Scalar:
    """`ZERO` for a plain float that is exactly 0, else the value: data zeros cost nothing."""
    return ZERO if isinstance(value, float) and value == 0.0 else value


@dataclass(frozen=True)
class Functions:
    """The functions that inverse kinematics and friction take from the caller's numbers.

    `where(condition, a, b)` evaluates both sides; guard before `sqrt` and `/`.
    `pi` is of the caller's precision.
    """

    sqrt: Callable[[Scalar], Scalar]
    sin: Callable[[Scalar], Scalar]
    cos: Callable[[Scalar], Scalar]
    atan2: Callable[[Scalar, Scalar], Scalar]
    where: Callable[[Scalar, Scalar, Scalar], Scalar]
    pi: Scalar

    def trig(self, angles: Sequence[Scalar]) -> list[tuple[Scalar, Scalar]]:
        """Pairs (cos, sin) of the angles."""
        return [(self.cos(angle), self.sin(angle)) for angle in angles]


FLOATS = Functions(
    sqrt=math.sqrt,
    sin=math.sin,
    cos=math.cos,
    atan2=math.atan2,
    where=lambda condition, a, b: a if condition else b,
    pi=math.pi,
)
"""The functions of plain floats."""


def quarter_turn(pair: tuple[Scalar, Scalar], turns: int) -> tuple[Scalar, Scalar]:
    """(cos, sin) of an angle plus `turns` quarter turns, exactly."""
    c, s = pair
    return ((c, s), (-s, c), (-c, -s), (s, -c))[turns % 4]


def angle_sum(a: tuple[Scalar, Scalar], b: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
    """(cos, sin) of the sum of two angles."""
    return a[0] * b[0] - a[1] * b[1], a[1] * b[0] + a[0] * b[1]


def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def sub(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def neg(a: Vector) -> Vector:
    """-a."""
    return -a[0], -a[1], -a[2]


def scale(k: Scalar, a: Vector) -> Vector:
    """k a."""
    return k * a[0], k * a[1], k * a[2]


def combine(k: Scalar, a: Vector, m: Scalar, b: Vector) -> Vector:
    """k a + m b."""
    return k * a[0] + m * b[0], k * a[1] + m * b[1], k * a[2] + m * b[2]


def dot(a: Vector, b: Vector) -> Scalar:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def matvec(rows: Sequence[Sequence[Scalar]], v: Sequence[Scalar]) -> list[Scalar]:
    """Matrix (row lists) times vector, any size."""
    return [sum_of(a * b for a, b in zip(row, v, strict=True)) for row in rows]


def sum_of(terms: Any) -> Scalar:
    """Sum without the integer 0 that `sum` starts from."""
    total: Scalar = ZERO
    for term in terms:
        total = total + term
    return total
