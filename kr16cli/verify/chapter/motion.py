"""What printed and true forms of sections 3.3 to 3.6 are built from, on any kind of number.

Mass centres as printed, Jacobians by differentiation and by the (corrected) column formulas,
M, its derivatives and C from them. Independent of `kr16cli.model`.
"""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.verify.chapter.arm import (
    Matrix,
    Point,
    Vector,
    apply,
    cross,
    dot,
    minus,
    once,
    plus,
    product,
    rate,
    rates,
    spin,
    times,
    total,
    transpose,
)
from kr16cli.verify.chapter.language import evaluate
from kr16cli.verify.chapter.scalars import Scalar

IN_LINK = (
    "[-a1, d1 - r1, 0]",
    "[r2 - a2, 0, 0]",
    "[0, 0, r3 - d4]",
    "[0, r4, 0]",
    "[0, 0, -r5]",
    "[0, 0, r6 - d6]",
)
"""The mass centres of (3.29) in frames 1 to 6: constants, as the parameter file has them."""


@once
def centres(p: Point) -> list[Vector]:
    """p_c1..p_c6 in b as printed before (3.29)."""
    r = [p.values[f"r{i}"] for i in range(1, 7)]
    e1, e2, minus_e3 = [1, 0, 0], [0, 1, 0], [0, 0, -1]
    return [
        [0, 0, r[0]],
        plus(p.o(1), times(r[1], apply(p.R(2), e1))),
        plus(p.o(5), times(r[2], apply(p.R(4), e2))),
        plus(p.o(5), times(r[3], apply(p.R(4), e2))),
        plus(p.o(5), times(r[4], apply(p.R(5), minus_e3))),
        plus(p.o(5), times(r[5], apply(p.R(5), minus_e3))),
    ]


def in_links(p: Point) -> list[Vector]:
    """`IN_LINK` on the point's numbers."""
    return [evaluate(text, p) for text in IN_LINK]


def carried(p: Point, k: int) -> Vector:
    """Mass centre k in b as a point fixed to frame k."""
    return plus(p.o(k), apply(p.R(k), evaluate(IN_LINK[k - 1], p)))


@once
def linear(p: Point, k: int) -> Matrix:
    """J_vk = dp_ck/dq by exact differentiation (3.31), 3x6."""
    return transpose([rates(carried(moving, k)) for moving in p.partials])


@once
def angular(p: Point, k: int) -> Matrix:
    """J_wk by differentiation: column i is the spin of frame k along q_i, 3x6."""
    return transpose([spin(moving, p, k) for moving in p.partials])


def linear_columns(p: Point, point: Sequence[Scalar], link: int) -> Matrix:
    """(3.32) corrected: column i is z_(i-1) x (p - o_(i-1)), zero beyond the link; 3x6."""
    columns = [cross(p.z(i), minus(point, p.o(i))) if i < link else [0, 0, 0] for i in range(6)]
    return transpose(columns)


def angular_columns(p: Point, link: int) -> Matrix:
    """(3.33) corrected: column i is z_(i-1) u(link - i), 3x6."""
    return transpose([p.z(i) if i < link else [0, 0, 0] for i in range(6)])


def mass_matrix_of(p: Point, parts: Sequence[tuple[Matrix, Matrix]]) -> Matrix:
    """The sum (3.38) for given pairs (J_vi, J_wi)."""
    result: Matrix = [[0] * 6 for _ in range(6)]
    for k, (j_v, j_w) in enumerate(parts, 1):
        r = p.R(k)
        turning = product(transpose(r), j_w)
        weighted = product(p.inertia(k), turning)
        v, w, iw = transpose(j_v), transpose(turning), transpose(weighted)
        m = p.values[f"m{k}"]
        for i in range(6):
            for j in range(i, 6):
                terms = (m * dot(v[i], v[j]), dot(w[i], iw[j]))
                result[i][j] = result[j][i] = total([result[i][j], *terms])
    return result


@once
def mass_matrix(p: Point) -> Matrix:
    """M by (3.38) with the column formulas of the Jacobians."""
    c = centres(p)
    parts = [(linear_columns(p, c[k - 1], k), angular_columns(p, k)) for k in range(1, 7)]
    return mass_matrix_of(p, parts)


@once
def mass_derivatives(p: Point) -> list[Matrix]:
    """dM/dq_k, k first, by exact differentiation."""
    return [[[rate(x) for x in row] for row in mass_matrix(moving)] for moving in p.partials]


@once
def christoffel(p: Point, *, printed: bool = False) -> list[Matrix]:
    """C_k(i,j) of (3.41), k first; `printed` has dM(k,i)/dq_k for dM(i,j)/dq_k."""
    d = mass_derivatives(p)
    n = range(6)
    return [
        [
            [(d[i][k][j] + d[j][k][i] - (d[k][k][i] if printed else d[k][i][j])) / 2 for j in n]
            for i in n
        ]
        for k in n
    ]


def coriolis(p: Point, symbols: Sequence[Matrix]) -> Matrix:
    """C by (3.40): row k is qd^T C_k."""
    return [apply(transpose(c), p.rates) for c in symbols]


def heights(p: Point) -> Vector:
    """The heights of the mass centres, m."""
    return [c[2] for c in centres(p)]


def potential(p: Point) -> Scalar:
    """P = sum m_i g p_ciz."""
    return total([p.values[f"m{k}"] * p.values["g"] * carried(p, k)[2] for k in range(1, 7)])
