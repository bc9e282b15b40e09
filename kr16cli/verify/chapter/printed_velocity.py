"""Sections 3.3 and 3.4 of the chapter as printed: mass centres, Jacobians, singularities."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kr16cli.verify.chapter import model_side, motion
from kr16cli.verify.chapter.arm import (
    Matrix,
    Point,
    Vector,
    apply,
    cross,
    flat,
    minus,
    product,
    rates,
    rotation,
    spin,
    transpose,
)
from kr16cli.verify.chapter.records import Statement, Values, definition, element, formula
from kr16cli.verify.chapter.scalars import Scalar

CENTRES = (
    "p_c1 = [0; 0; r1]",
    "p_c2 = o_1 + R_2^b*[1; 0; 0]*r2",
    "p_c3 = o_5 + R_4^b*[0; 1; 0]*r3",
    "p_c4 = o_5 + R_4^b*[0; 1; 0]*r4",
    "p_c5 = o_5 + R_5^b*[0; 0; -1]*r5",
    "p_c6 = o_5 + R_5^b*[0; 0; -1]*r6",
)
"""The display before (3.29), executed by `motion.centres`."""

J2 = (
    ("c1*(a1 + r2*c2)", "-r2*s1*s2", "0", "0", "0", "0"),
    ("-s1*(a1 + r2*c2)", "-r2*c1*s2", "0", "0", "0", "0"),
    ("0", "-r2*c2", "0", "0", "0", "0"),
    ("0", "-c1", "0", "0", "0", "0"),
    ("0", "s1", "0", "0", "0", "0"),
    ("-1", "0", "0", "0", "0", "0"),
)
"""(3.36)."""


@model_side.remembered
def _model_centres(p: Point) -> list[Vector]:
    return model_side.mass_centres(p, model_side.bodies(p, motion.in_links(p)))


def _centre(k: int) -> Statement:
    return Statement(
        f"p_c{k}",
        None,
        CENTRES[k - 1],
        "holds",
        printed=lambda p: motion.centres(p)[k - 1],
        truth=lambda p: motion.carried(p, k),
        model=lambda p: _model_centres(p)[k - 1],
        note=f"Fixed to link {k}, at {motion.IN_LINK[k - 1]} of its frame, on the line between "
        "two joints" + "; here o_1 is on the A2 axis" * (k == 2),
        unit="m",
    )


def _axes(p: Point, *, reversed_notation: bool = False) -> Sequence[Scalar]:
    """R_1^b..R_6^b by the product of (3.29)."""
    result = rotation(p.steps[0])
    if reversed_notation:
        result = transpose(result)
    found = []
    for step in p.steps[1:]:
        factor = rotation(step)
        result = product(result, transpose(factor) if reversed_notation else factor)
        found += flat(result)
    return found


def _collinear(p: Point) -> Sequence[Scalar]:
    c, o = motion.centres(p), p.o(5)
    forearm = cross(minus(c[2], o), minus(c[3], o))
    return [*forearm, *cross(minus(c[4], o), minus(c[5], o))]


def _velocities(p: Point) -> Sequence[Scalar]:
    """Time derivatives of p_c1..p_c6."""
    return [v for k in range(1, 7) for v in rates(motion.carried(p.along, k))]


def _by_jacobian(p: Point) -> Sequence[Scalar]:
    return [v for k in range(1, 7) for v in apply(motion.linear(p, k), p.rates)]


def _by_model(p: Point) -> Sequence[Scalar]:
    rows = [_model_jacobian(p, k)[:3] for k in range(1, 7)]
    return [v for j in rows for v in apply(j, p.rates)]


def _last_link(p: Point) -> tuple[Vector, Vector]:
    """Velocity of p_c6 and angular velocity of link 6, by differentiation."""
    return rates(motion.carried(p.along, 6)), spin(p.along, p, 6)


def _columns(choice: Sequence[int], matrix: Callable[[Point], Matrix]) -> Values:
    """Some columns of a matrix, one after the other."""

    def run(p: Point) -> Sequence[Scalar]:
        columns = transpose(matrix(p))
        return [v for i in choice for v in columns[i]]

    return run


def _fixed_axis(p: Point) -> Matrix:
    """(3.32) as printed, for p = p_c6: z_0 in every column."""
    point = motion.centres(p)[5]
    return transpose([cross(p.z(0), minus(point, p.o(i))) for i in range(6)])


def _running_axis(p: Point) -> Matrix:
    return motion.linear_columns(p, motion.centres(p)[5], 6)


@model_side.remembered
def _model_jacobian(p: Point, k: int) -> Matrix:
    """The model's Jacobian (6x6) of mass centre k."""
    return model_side.jacobian_of(p, motion.centres(p)[k - 1], k)


def _model_linear(p: Point) -> Matrix:
    return _model_jacobian(p, 6)[:3]


def _all_angular(p: Point, last: int | None) -> Matrix:
    """J_w1 to J_w6 below each other, by (3.33) with z_last in the last column."""
    rows: Matrix = []
    for link in range(1, 7):
        j = transpose(motion.angular_columns(p, link))
        if last is not None and link == 6:
            j[5] = p.z(last)
        rows += transpose(j)
    return rows


def _true_angular(p: Point) -> Matrix:
    return [row for link in range(1, 7) for row in motion.angular(p, link)]


def _model_angular(p: Point) -> Matrix:
    return [row for k in range(1, 7) for row in _model_jacobian(p, k)[3:]]


def _jacobian(k: int) -> Callable[[Point], Matrix]:
    """[J_vk; J_wk] by differentiation."""
    return lambda p: [*motion.linear(p, k), *motion.angular(p, k)]


def _column_statements(
    id: str,
    texts: dict[int, str],
    wrong: dict[int, str],
    forms: Sequence[Callable[[Point], Matrix]],
) -> list[Statement]:
    """The printed columns of (3.32) or (3.33); `forms`: printed, truth, corrected, model."""
    printed, truth, corrected, model = forms
    return [
        Statement(
            id,
            (i,),
            f"column {i}: {text}",
            "misprint" if i in wrong else "holds",
            printed=_columns([i - 1], printed),
            truth=_columns([i - 1], truth),
            corrected=_columns([i - 1], corrected) if i in wrong else None,
            correction=wrong.get(i),
            model=_columns([i - 1], model),
            unit="m" if id == "3.32" else "1",
        )
        for i, text in texts.items()
    ]


def _zero(p: Point) -> Sequence[Scalar]:
    return [0]


STATEMENTS: list[Statement] = [
    *[_centre(k) for k in range(1, 7)],
    Statement(
        "3.29",
        None,
        "R_k^b = R_0^b R_1^0 ... R_k^(k-1), T_k^b = [R_k^b, o_k^b; 0, 1]",
        "holds-under-convention",
        printed=_axes,
        truth=lambda p: [v for k in range(1, 7) for v in flat(p.R(k))],
        convention="R_k^b are the axes of frame k in b; (3.2) puts the two the other way round",
        otherwise=(lambda p: _axes(p, reversed_notation=True),),
        model=lambda p: [v for t in model_side.frames(p)[1:] for row in t for v in row[:3]],
    ),
    Statement(
        "same line, text after 3.29",
        None,
        "the mass centres p_3, p_4 and p_5, p_6 are located on the same line",
        "holds",
        printed=_collinear,
        truth=_zero,
        note="p_3 and p_4 on the A4 axis, p_5 and p_6 on the A6 axis, both lines through o_5",
        unit="m^2",
    ),
    definition("3.30", "v_i^b = J_vi q', omega_i^b = J_omegai q'"),
    Statement(
        "text after 3.30",
        None,
        "omega, v are respectively the linear and angular velocities",
        "misprint",
        printed=lambda p: [v for part in reversed(_last_link(p)) for v in part],
        truth=lambda p: [*rates(motion.carried(p.along, 6)), *spin(p.along, p, 6)],
        corrected=lambda p: [
            *apply(motion.linear(p, 6), p.rates), *apply(motion.angular(p, 6), p.rates)
        ],
        correction="v, omega are respectively the linear and angular velocities",
        note="Order exchanged: v is the linear velocity in (3.31), omega the angular in (3.33)",
        unit="m/s, rad/s",
    ),
    Statement(
        "3.31",
        None,
        "v_i^b = dp_ci/dt = J_vi q'  =>  J_vi = dp_ci/dq",
        "holds",
        printed=_by_jacobian,
        truth=_velocities,
        model=_by_model,
        unit="m/s",
    ),
    Statement(
        "3.32",
        None,
        "J_p(q) = [z_0 x (p - o_0), z_0 x (p - o_1), ..., z_0 x (p - o_5)]",
        "misprint",
        printed=_columns(range(6), _fixed_axis),
        truth=_columns(range(6), lambda p: motion.linear(p, 6)),
        corrected=_columns(range(6), _running_axis),
        correction="J_p(q) = [z_0 x (p - o_0), z_1 x (p - o_1), ..., z_5 x (p - o_5)]",
        model=_columns(range(6), _model_linear),
        note="The axis has to run with the origin; column 1 alone is right",
        unit="m",
    ),
    *_column_statements(
        "3.32",
        {1: "z_0 x (p - o_0)", 2: "z_0 x (p - o_1)", 6: "z_0 x (p - o_5)"},
        {2: "z_1 x (p - o_1)", 6: "z_5 x (p - o_5)"},
        (_fixed_axis, lambda p: motion.linear(p, 6), _running_axis, _model_linear),
    ),
    Statement(
        "text after 3.32",
        None,
        "row i of J_p is the zero vector if p is not a function of q_i",
        "misprint",
        printed=lambda p: motion.linear(p, 2)[2],
        truth=_zero,
        corrected=lambda p: [v for row in motion.linear(p, 2) for v in row[2:]],
        correction="column i of J_p is the zero vector if p is not a function of q_i",
        note="p_c2 is no function of q_3 to q_6: columns 3 to 6 are zero, row 3 is not",
        unit="m",
    ),
    Statement(
        "3.33",
        None,
        "J_omegai = [z_0 u(i-1), z_1 u(i-2), z_2 u(i-3), ..., z_6 u(i-6)]",
        "misprint",
        printed=_columns(range(6), lambda p: _all_angular(p, 6)),
        truth=_columns(range(6), _true_angular),
        corrected=_columns(range(6), lambda p: _all_angular(p, None)),
        correction="J_omegai = [z_0 u(i-1), z_1 u(i-2), z_2 u(i-3), ..., z_5 u(i-6)]",
        model=_columns(range(6), _model_angular),
        note="z_6 = -z_5: joint 6 would turn the hand backwards",
    ),
    *_column_statements(
        "3.33",
        {1: "z_0 u(i-1)", 2: "z_1 u(i-2)", 3: "z_2 u(i-3)", 6: "z_6 u(i-6)"},
        {6: "z_5 u(i-6)"},
        (
            lambda p: _all_angular(p, 6),
            _true_angular,
            lambda p: _all_angular(p, None),
            _model_angular,
        ),
    ),
    definition("u, text after 3.33", "u(x) = 1 for x >= 0, u(x) = 0 for x < 0"),
    *[
        Statement(
            "3.34",
            (i + 1,),
            f"J_omega3 column {i + 1}: z_{i}^b = R_{i}^b*[0; 0; 1]" if i < 3 else
            f"J_omega3 column {i + 1}: 0",
            "holds",
            printed=lambda p, i=i: apply(p.R(i), [0, 0, 1]) if i < 3 else [0, 0, 0],  # type: ignore[misc]
            truth=lambda p, i=i: [row[i] for row in motion.angular(p, 3)],  # type: ignore[misc]
        )
        for i in range(6)
    ],
    Statement(
        "3.35",
        None,
        "the Jacobian J_1 of the first mass centre is announced and not printed",
        "missing",
        truth=lambda p: flat(_jacobian(1)(p)),
        corrected=lambda p: [0] * 30 + [-1] + [0] * 5,
        correction="J_1 = [J_v1; J_omega1] is zero but for element [6,1] = -1",
        model=lambda p: flat(_model_jacobian(p, 1)),
        note="The number is skipped: (3.34) is followed by (3.36)",
    ),
    *[
        element(
            "3.36", (i + 1, j + 1), f"J_2[{i + 1},{j + 1}]", text,
            lambda p, i=i, j=j: [_jacobian(2)(p)[i][j]],  # type: ignore[misc]
            model=lambda p, i=i, j=j: [_model_jacobian(p, 2)[i][j]],  # type: ignore[misc]
            unit="m" if i < 3 else "1",
        )
        for i, row in enumerate(J2) for j, text in enumerate(row)
    ],
    Statement(
        "v_1, text after 3.36",
        None,
        "the linear velocity of the first mass centre is zero",
        "holds",
        printed=lambda p: rates(motion.carried(p.along, 1)),
        truth=_zero,
        unit="m/s",
    ),
    Statement(
        "omega_1, text after 3.36",
        None,
        "omega_1 = -q1'",
        "holds",
        printed=formula("[0, 0, -dq1]"),
        truth=lambda p: spin(p.along, p, 1),
        note="About z_b",
        unit="rad/s",
    ),
]  # fmt: skip
