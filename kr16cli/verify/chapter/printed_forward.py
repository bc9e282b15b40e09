"""Section 3.1 of the chapter as printed: Table 3.1, equations (3.1) to (3.6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kr16cli.verify.chapter import model_side
from kr16cli.verify.chapter.arm import (
    TABLE_3_1,
    Matrix,
    Point,
    Row,
    cross,
    dot,
    flat,
    minus,
    once,
    product,
    rotation,
    total,
    transpose,
)
from kr16cli.verify.chapter.language import evaluate
from kr16cli.verify.chapter.records import Statement, Values, element, formula
from kr16cli.verify.chapter.scalars import Scalar

# The columns of T, line by line as in (3.3) to (3.6); None is an element that is not printed.
COLUMNS: dict[str, tuple[str, list[str | None]]] = {
    "3.3": ("T_1", [
        "-c6*(c5*(c1*s4 - s23*c4*s1) - c23*s1*s5) - s6*(c1*c4 + s23*s1*s4)",
        "s6*(c4*s1 - s23*c1*s4) + c6*(c5*(s1*s4 + s23*c1*c4) + c23*c1*s5)",
        "-c6*(s23*s5 - c23*c4*c5) - c23*s4*s6",
        None,
    ]),
    "3.4": ("T_2", [
        "c6*(c1*c4 + s23*s1*s4) - s6*(c5*(c1*s4 - s23*c4*s1) - c23*s1*s5)",
        "s6*(c5*(s1*s4 + s23*c1*c4) + c23*c1*s5) - c6*(c4*s1 - s23*c1*s4)",
        "(s23*s5 - c23*c4*c5)",
        "0",
    ]),
    "3.5": ("T_3", [
        "s5*(c1*s4 - s23*c4*s1) + c23*c5*s1",
        "c23*c1*c5 - s5*(s1*s4 + s23*c1*c4)",
        "-s23*c5 - c23*c4*s5",
        "0",
    ]),
    "3.6": ("T_4", [
        "s1*(a1 + d4*c23 - a3*s23 + a2*c2) + d6*(s5*(c1*s4 - s23*c4*s1) + c23*c5*s1)",
        "c1*(a1 + d4*c23 - a3*s23 + a2*c2) - d6*(s5*(s1*s4 + s23*c1*c4) - c23*c1*c5)",
        "d1 - a3*c23 - d4*s23 - a2*s2 - d6*(s23*c5 + c23*c4*s5)",
        "1",
    ]),
}  # fmt: skip

# What has to stand there instead.
CORRECTIONS = {("3.4", 3): "c23*c6*s4 - s6*(s23*s5 - c23*c4*c5)"}


@once
def closed_form(p: Point) -> Matrix:
    """T by its printed columns, corrected and completed, 4x4."""
    columns = [
        [evaluate(CORRECTIONS.get((id, i), text or "0"), p) for i, text in enumerate(texts, 1)]
        for id, (_, texts) in COLUMNS.items()
    ]
    return transpose(columns)


def columns() -> list[Statement]:
    """(3.3) to (3.6), element by element, against the product of Table 3.1 and the model."""
    return [
        _element(id, name, i, j, text)
        for j, (id, (name, texts)) in enumerate(COLUMNS.items())
        for i, text in enumerate(texts)
    ]


def _element(id: str, name: str, i: int, j: int, text: str | None) -> Statement:
    def truth(p: Point) -> Sequence[Scalar]:
        return [p.frames[6][i][j]]

    def model(p: Point) -> Sequence[Scalar]:
        return [t[i][j] for t in model_side.pose(p)]

    unit = "m" if j == 3 and i < 3 else "1"
    label = f"{name}[{i + 1}]"
    if text is None:
        return Statement(
            id,
            (i + 1,),
            f"{label} is not printed: {name} has three elements",
            "missing",
            truth=truth,
            corrected=formula("0"),
            correction=f"{label} = 0",
        )
    return element(
        id,
        (i + 1,),
        label,
        text,
        truth,
        model=model if i < 3 else None,
        unit=unit,
        correction=CORRECTIONS.get((id, i + 1)),
        note="A factor s6 and the term c23*c6*s4 are lost; T_2 is minus the derivative of T_1 "
        "by q6" if (id, i) == ("3.4", 2) else "",
    )  # fmt: skip


def _rows(choose: Callable[[Point], Sequence[Matrix]]) -> Values:
    """T as the product of some transforms, flattened."""

    def run(p: Point) -> Sequence[Scalar]:
        matrices = choose(p)
        result = matrices[0]
        for m in matrices[1:]:
            result = product(result, m)
        return flat(result[:3])

    return run


def _all_rows(p: Point) -> list[Matrix]:
    return p.steps


def _inverse(t: Matrix) -> Matrix:
    r = transpose(rotation(t))
    o = [-total([r[i][j] * t[j][3] for j in range(3)]) for i in range(3)]
    return [*[[*r[i], o[i]] for i in range(3)], [0, 0, 0, 1]]


def _closed(p: Point) -> Sequence[Scalar]:
    return flat(closed_form(p)[:3])


def _model_pose(p: Point) -> Sequence[Scalar]:
    return [v for t in model_side.pose(p) for v in flat(t)]


def _table_row(k: int, row: Row) -> Statement:
    """Row k: with it T is (3.3) to (3.6), and the model's frame k is the table's."""

    def printed(p: Point) -> Sequence[Scalar]:
        return [*flat(p.frames[6][:3]), *flat(p.frames[k][:3])]

    def truth(p: Point) -> Sequence[Scalar]:
        return [*_closed(p), *flat(p.frames[k][:3])]

    def model(p: Point) -> Sequence[Scalar]:
        return [
            v for t in model_side.pose(p) for m in (t, model_side.frames(p)[k]) for v in flat(m)
        ]

    return Statement(
        "Table 3.1",
        (k,),
        f"row {k}: q = {row.q}, d = {row.d}, a = {row.a}, alpha = {row.alpha}",
        "holds",
        printed=printed,
        truth=truth,
        model=model,
        note="Alpha is set as an O with a bar; 0 is its one reading" if k == 2 else
        "Compared: T by the table with the corrected (3.3) to (3.6), and the model's frame",
        unit="m",
    )  # fmt: skip


def _axes_perpendicular(p: Point) -> Sequence[Scalar]:
    """x_i . z_i and x_i . z_(i-1), i = 1..6."""
    x = [transpose(p.R(i))[0] for i in range(7)]
    z = [p.z(i) for i in range(7)]
    return [dot(x[i], w) for i in range(1, 7) for w in (z[i], z[i - 1])]


def _wrist_axes_meet(p: Point) -> Sequence[Scalar]:
    """Distance vectors of o_4 from the axes z_3, z_4, z_5, as moments."""
    return [v for k in (3, 4, 5) for v in cross(p.z(k), minus(p.o(4), p.o(k)))]


def _elbow_manipulator(p: Point) -> Sequence[Scalar]:
    """z_0 . z_1 and z_1 x z_2."""
    return [dot(p.z(0), p.z(1)), *cross(p.z(1), p.z(2))]


def _zeros(count: int) -> Values:
    return lambda p: [0] * count


STATEMENTS: list[Statement] = [
    Statement(
        "elbow manipulator, text after figure 3.2",
        None,
        "the first three joints make up an elbow manipulator: z_0 . z_1 = 0, z_1 x z_2 = 0",
        "holds",
        printed=_elbow_manipulator,
        truth=_zeros(4),
    ),
    Statement(
        "spherical wrist, text after figure 3.2",
        None,
        "the last three joints are a spherical wrist: z_3, z_4, z_5 meet in one point",
        "holds",
        printed=_wrist_axes_meet,
        truth=_zeros(9),
        unit="m",
    ),
    Statement(
        "axes, text after figure 3.2",
        None,
        "x_i is perpendicular to z_i and z_(i-1)",
        "holds",
        printed=_axes_perpendicular,
        truth=_zeros(12),
    ),
    *[_table_row(k, row) for k, row in enumerate(TABLE_3_1)],
    Statement(
        "3.1",
        None,
        "T_i^(i+1) = Rot_z,q_i Trans_z,d_i Trans_x,a_i Rot_x,alpha_i",
        "holds-under-convention",
        printed=_rows(_all_rows),
        truth=_closed,
        convention="a row of Table 3.1 bears the number of the frame it leads to (from b: 0), so "
        "T_i^(i+1) takes row i+1",
        otherwise=(_rows(lambda p: _all_rows(p)[:6]),),
        model=_model_pose,
        note="Read with row i, T_b^0 has no row and q_6 never enters",
        unit="m",
    ),
    Statement(
        "3.2",
        None,
        "T = T_b^6 = T_b^0 T_0^1 ... T_5^6",
        "holds-under-convention",
        printed=_rows(_all_rows),
        truth=_closed,
        convention="T_a^b is the pose of frame b in frame a; (3.22) and (3.29) put the two the "
        "other way round",
        otherwise=(_rows(lambda p: [_inverse(t) for t in _all_rows(p)]),),
        model=_model_pose,
        unit="m",
    ),
    *columns(),
]
