"""The chapter's arm from Table 3.1 alone: every frame a literal product of (3.1), any number.

Independent of `kr16cli.model`, which is judged beside the chapter. Frames 0 to 6 in the
chapter's base b; lengths in m, angles as (cos, sin) pairs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import combinations
from typing import NamedTuple, ParamSpec, TypeVar

from kr16cli.verify.chapter.language import angle, evaluate
from kr16cli.verify.chapter.scalars import Dual, Functions, Pair, Scalar

_Arguments = ParamSpec("_Arguments")
_Answer = TypeVar("_Answer")
Vector = list[Scalar]
Matrix = list[list[Scalar]]


class Row(NamedTuple):
    """A row of Table 3.1 as printed; the alpha of row 2 is set as an O with a bar, read as 0."""

    q: str
    d: str
    a: str
    alpha: str


TABLE_3_1 = (
    Row("pi/2", "0", "0", "pi"),
    Row("q1", "-d1", "a1", "pi/2"),
    Row("q2", "0", "a2", "0"),
    Row("q3 + pi/2", "0", "a3", "-pi/2"),
    Row("q4", "-d4", "0", "pi/2"),
    Row("q5", "0", "0", "-pi/2"),
    Row("q6 + pi", "-d6", "0", "pi"),
)


_MANY = 512


def once(f: Callable[_Arguments, _Answer]) -> Callable[_Arguments, _Answer]:
    """Keep what a function finds of a point: many statements ask for the same."""
    return lru_cache(_MANY)(f)  # type: ignore[return-value]  # lru_cache loses the arguments


def _no(x: Scalar) -> bool:
    return x.__class__ is int and not x


def total(terms: Sequence[Scalar]) -> Scalar:
    """Sum; the integer 0 if there is nothing to add."""
    result: Scalar = 0
    for term in terms:
        result = term if _no(result) else result + term
    return result


def product(a: Matrix, b: Matrix) -> Matrix:
    """Matrix product; structural zeros and ones (the integers 0 and 1) cost nothing."""
    return [[dot(row, column) for column in zip(*b, strict=True)] for row in a]


def apply(a: Matrix, v: Sequence[Scalar]) -> Vector:
    """Matrix times vector."""
    return [row[0] for row in product(a, [[x] for x in v])]


def transpose(a: Matrix) -> Matrix:
    """Transposed matrix."""
    return [list(column) for column in zip(*a, strict=True)]


def flat(a: Matrix) -> Vector:
    """Elements row by row."""
    return [x for row in a for x in row]


def plus(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    """a + b."""
    return [x + y for x, y in zip(a, b, strict=True)]


def minus(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    """a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def times(k: Scalar, a: Sequence[Scalar]) -> Vector:
    """k a."""
    return [k * x for x in a]


def dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    """a . b; structural zeros and ones cost nothing."""
    result: Scalar = 0
    started = False
    for x, y in zip(a, b, strict=True):
        if x.__class__ is int:
            if not x:
                continue
            term = y if x == 1 else x * y
        elif y.__class__ is int:
            if not y:
                continue
            term = x if y == 1 else x * y
        else:
            term = x * y
        result = result + term if started else term
        started = True
    return result


def cross(a: Sequence[Scalar], b: Sequence[Scalar]) -> Vector:
    """a x b."""
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def rotation(t: Matrix) -> Matrix:
    """R of a homogeneous transform."""
    return [row[:3] for row in t[:3]]


def origin(t: Matrix) -> Vector:
    """Its origin."""
    return [row[3] for row in t[:3]]


def turn(row: Row, p: Point) -> Matrix:
    """Rot_z,q of (3.1)."""
    c, s = angle(row.q, p)
    return [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


def link(row: Row, p: Point) -> Matrix:
    """Trans_z,d Trans_x,a Rot_x,alpha of (3.1): what does not move."""
    ca, sa = angle(row.alpha, p)
    d, a = evaluate(row.d, p), evaluate(row.a, p)
    trans_z = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]]
    trans_x = [[1, 0, 0, a], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    rot_x = [[1, 0, 0, 0], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]]
    return product(product(trans_z, trans_x), rot_x)


class Point:
    """One configuration with everything the chapter's equations speak of.

    `angles`: q1..q6 and phi, theta, psi. `values`: lengths d1 a1 a2 a3 d4 d6, mass centres
    r1..r6, masses m1..m6, inertias I1xx..I6zz, gravity g, rates dq1..dq6, dphi, dtheta, dpsi.
    """

    def __init__(
        self,
        angles: Mapping[str, Pair],
        values: Mapping[str, Scalar],
        functions: Functions | None = None,
        near: Point | None = None,
    ) -> None:
        """`near` is a point with the same values, whose joints may be the same in part."""
        self.angles, self.values, self.functions = angles, values, functions
        self._near = near

    @cached_property
    def links(self) -> list[Matrix]:
        """What does not move in the rows of Table 3.1."""
        return self._near.links if self._near else [link(row, self) for row in TABLE_3_1]

    @cached_property
    def steps(self) -> list[Matrix]:
        """T_i^(i+1) of (3.1) for each row of Table 3.1; of joints that stand as in `near`, its."""
        near = self._near
        return [
            near.steps[k]
            if near and (k == 0 or self.angles[f"q{k}"] is near.angles[f"q{k}"])
            else product(turn(row, self), self.links[k])
            for k, row in enumerate(TABLE_3_1)
        ]

    @cached_property
    def frames(self) -> list[Matrix]:
        """T of frames 0 to 6 in b, by multiplying the rows of Table 3.1 in order."""
        near, result = self._near, self.steps[:1]
        for k, own in enumerate(self.steps[1:], 1):
            same = near and own is near.steps[k] and result[-1] is near.frames[k - 1]
            result.append(near.frames[k] if near and same else product(result[-1], own))
        return result

    def R(self, k: int) -> Matrix:
        """Axes of frame k in b."""
        return rotation(self.frames[k])

    def o(self, k: int) -> Vector:
        """Origin of frame k in b, m."""
        return origin(self.frames[k])

    def z(self, k: int) -> Vector:
        """z axis of frame k in b."""
        return [row[2] for row in self.frames[k][:3]]

    @property
    def rates(self) -> Vector:
        """The joint rates dq1..dq6."""
        return [self.values[f"dq{i}"] for i in range(1, 7)]

    def inertia(self, k: int) -> Matrix:
        """I_k about the mass centre in the axes of frame k; diagonal for k = 4, 5, 6 (3.39)."""
        v = self.values
        xx, yy, zz = (v[f"I{k}{e}"] for e in ("xx", "yy", "zz"))
        if k > 3:
            return [[xx, 0, 0], [0, yy, 0], [0, 0, zz]]
        xy, xz, yz = (v[f"I{k}{e}"] for e in ("xy", "xz", "yz"))
        return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]

    def moving(self, rates: Sequence[Scalar]) -> Point:
        """The same configuration on dual numbers: every quantity with its rate along `rates`."""
        turned = dict(self.angles)
        for i, rate in enumerate(rates, 1):
            c, s = self.angles[f"q{i}"]
            if not _no(rate):
                turned[f"q{i}"] = (Dual(c, -(s * rate)), Dual(s, c * rate))
        return Point(turned, self.values, near=self)

    @cached_property
    def along(self) -> Point:
        """Moving with the joint rates: derivatives are time derivatives."""
        return self.moving(self.rates)

    @cached_property
    def partials(self) -> list[Point]:
        """Moving along q1, ..., q6 at unit rate: derivatives are partial derivatives."""
        return [self.moving([int(i == k) for i in range(6)]) for k in range(6)]

    @cached_property
    def straight(self) -> Point:
        """The same configuration with q5 = 0."""
        return self.at(q5=(1, 0))

    def at(self, **angles: Pair) -> Point:
        """The same numbers at other angles."""
        return Point({**self.angles, **angles}, self.values, self.functions, near=self)


def rate(x: Scalar) -> Scalar:
    """Derivative of what was computed on dual numbers (0 of a constant)."""
    return x.derivative if isinstance(x, Dual) else 0


def rates(v: Sequence[Scalar]) -> Vector:
    """Derivatives of a vector."""
    return [rate(x) for x in v]


def spin(moving: Point, still: Point, k: int) -> Vector:
    """Angular velocity of frame k from R' R^T."""
    turning = [rates(row) for row in moving.R(k)]
    w = product(turning, transpose(still.R(k)))
    return [w[2][1], w[0][2], w[1][0]]


def determinant(a: Matrix) -> Scalar:
    """Determinant of a 6x6 matrix by minors of its upper and lower half: no division."""
    terms = []
    for chosen in combinations(range(6), 3):
        rest = [j for j in range(6) if j not in chosen]
        pair = _minor(a[:3], chosen) * _minor(a[3:], rest)
        terms.append(-pair if sum(chosen) % 2 == 0 else pair)
    return total(terms)


def _minor(rows: Matrix, columns: Sequence[int]) -> Scalar:
    x, y, z = ([row[j] for row in rows] for j in columns)
    return dot(x, cross(y, z))
