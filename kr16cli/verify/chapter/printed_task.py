"""Section 3.6 of the chapter as printed: roll-pitch-yaw, its rates, the rate of the Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kr16cli.verify.chapter import model_side, motion
from kr16cli.verify.chapter.arm import (
    Matrix,
    Point,
    Vector,
    apply,
    cross,
    dot,
    flat,
    minus,
    once,
    plus,
    product,
    rates,
    transpose,
)
from kr16cli.verify.chapter.language import evaluate
from kr16cli.verify.chapter.printed_inverse import SINE_FIRST
from kr16cli.verify.chapter.recipe import turned
from kr16cli.verify.chapter.records import Statement, Values, element
from kr16cli.verify.chapter.scalars import Dual, Scalar

EXTRACTED = {
    "psi": "Atan2(R32, R33)",
    "phi": "Atan2(R21, R11)",
    "theta": "Atan2(-R31, cos(phi)*R11 + sin(phi)*R21)",
}
"""(3.45)."""

RATES = (
    ("0", "-sin(phi)", "cos(phi)*cos(theta)"),
    ("0", "cos(phi)", "sin(phi)*cos(theta)"),
    ("1", "0", "-sin(theta)"),
)
"""(3.46)."""

FROM_0 = "columns are counted from 0: column k is joint k+1"


def rpy_rotation(p: Point) -> Matrix:
    """R_z(phi) R_y(theta) R_x(psi), (3.44)."""
    (ca, sa), (cb, sb), (cc, sc) = (p.angles[name] for name in ("phi", "theta", "psi"))
    about_z = [[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]]
    about_y = [[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]]
    about_x = [[1, 0, 0], [0, cc, -sc], [0, sc, cc]]
    return product(product(about_z, about_y), about_x)


def _extracted(name: str, reading: str) -> Values:
    """One angle of (3.45) less the true one."""

    def run(p: Point) -> Sequence[Scalar]:
        r = rpy_rotation(p)
        known = {f"R{i + 1}{j + 1}": r[i][j] for i in range(3) for j in range(3)}
        value = evaluate(EXTRACTED[name], p, Atan2=getattr(p.functions, reading), **known)
        return turned(p, value - p.values[f"{name}_true"])

    return run


def _model_angle(name: str) -> Values:
    index = ("phi", "theta", "psi").index(name)

    def run(p: Point) -> Sequence[Scalar]:
        found = model_side.rpy_of(p, rpy_rotation(p))[index]
        return turned(p, found - p.values[f"{name}_true"])

    return run


@once
def _turning(p: Point) -> Matrix:
    """B by differentiation: column j is the axial vector of R' R^T for a unit rate of angle j."""
    columns = []
    for name in ("phi", "theta", "psi"):
        c, s = p.angles[name]
        moving = p.at(**{name: (Dual(c, -s), Dual(s, c))})
        r_dot = [rates(row) for row in rpy_rotation(moving)]
        w = product(r_dot, transpose(rpy_rotation(p)))
        columns.append([w[2][1], w[0][2], w[1][0]])
    return transpose(columns)


def _printed_rates(p: Point) -> Matrix:
    return [[evaluate(text, p) for text in row] for row in RATES]


def _determinant3(m: Matrix) -> Scalar:
    x, y, z = transpose(m)
    return dot(x, cross(y, z))


def _orthonormality(p: Point) -> Sequence[Scalar]:
    r = rpy_rotation(p)
    return [v for row in product(transpose(r), r) for v in row]


def _hand(p: Point) -> Vector:
    """A point fixed to the last link: p_c6."""
    return motion.carried(p, 6)


def _axis_rates(p: Point) -> Sequence[Scalar]:
    """z_0', ..., z_5' by differentiation."""
    return [v for i in range(6) for v in rates(p.along.z(i))]


def _axis_rates_printed(p: Point) -> Sequence[Scalar]:
    """(3.47): J_omegai qd x z_i."""
    return [v for i in range(6) for v in cross(_omega(p, i), p.z(i))]


def _omega(p: Point, i: int) -> Vector:
    return apply(motion.angular_columns(p, i), p.rates) if i else [0, 0, 0]


def _model_rates(first: int) -> Values:
    """Columns of the model's Jacobian rate, linear (0) or angular (3) rows."""

    def run(p: Point) -> Sequence[Scalar]:
        rows = model_side.jacobian_rate(p, _hand(p), 6)[first : first + 3]
        return flat(transpose(rows))

    return run


def _lever_rates(p: Point) -> Sequence[Scalar]:
    """d/dt [z_i x (p - o_i)], i = 0..5, by differentiation of the product."""
    moving = p.along
    return [
        v for i in range(6) for v in rates(cross(moving.z(i), minus(_hand(moving), moving.o(i))))
    ]


def _levers(p: Point) -> Sequence[Scalar]:
    """z_i x (p - o_i) itself."""
    return [v for i in range(6) for v in cross(p.z(i), minus(_hand(p), p.o(i)))]


def _product_rule(p: Point) -> Sequence[Scalar]:
    """The right side of (3.48): z_i' x (p - o_i) + z_i x (p' - o_i')."""
    moving, hand = p.along, _hand(p)
    hand_rate = rates(_hand(moving))
    result: Vector = []
    for i in range(6):
        turning = cross(rates(moving.z(i)), minus(hand, p.o(i)))
        result += plus(turning, cross(p.z(i), minus(hand_rate, rates(moving.o(i)))))
    return result


def _origin_columns(p: Point, i: int) -> Matrix:
    """(3.51) with columns from 0: z_k x (o_i - o_k), zero for k > i."""
    columns = [cross(p.z(k), minus(p.o(i), p.o(k))) if k <= i else [0, 0, 0] for k in range(6)]
    return transpose(columns)


def _column_rates(cut: bool) -> Values:
    """(3.49); `cut` also takes the columns k > i of J_vp as zero, as the text after (3.51) does."""

    def run(p: Point) -> Sequence[Scalar]:
        hand = _hand(p)
        full = transpose(motion.linear_columns(p, hand, 6))
        result: Vector = []
        for i in range(6):
            j_vp = [[0, 0, 0] if cut and k > i else column for k, column in enumerate(full)]
            speed = minus(apply(transpose(j_vp), p.rates), apply(_origin_columns(p, i), p.rates))
            turning = cross(cross(_omega(p, i), p.z(i)), minus(hand, p.o(i)))
            result += plus(turning, cross(p.z(i), speed))
        return result

    return run


def _columns_of(column: Callable[[Point, int], Vector]) -> Values:
    """Columns of joints 1 to 6 one after the other."""
    return lambda p: [v for joint in range(1, 7) for v in column(p, joint)]


def _true_columns(p: Point) -> Sequence[Scalar]:
    return flat(transpose(motion.linear(p, 6)))


def _true_origins(p: Point) -> Sequence[Scalar]:
    """do_i/dq_k, i = 0..5, by differentiation."""
    return [v for i in range(6) for moving in p.partials for v in rates(moving.o(i))]


def _printed_origins(p: Point) -> Sequence[Scalar]:
    return [v for i in range(6) for v in flat(transpose(_origin_columns(p, i)))]


def _origins_from_1(p: Point) -> Sequence[Scalar]:
    """(3.51) with column k for joint k."""
    return [
        v
        for i in range(6)
        for k in range(1, 7)
        for v in (cross(p.z(k), minus(p.o(i), p.o(k))) if k <= i else [0, 0, 0])
    ]


def _later_origins(p: Point) -> Sequence[Scalar]:
    """Columns k > i of J_oi, counted from 0."""
    return [v for i in range(6) for k in range(i + 1, 6) for v in rates(p.partials[k].o(i))]


STATEMENTS: list[Statement] = [
    Statement(
        "constraints, text before 3.44",
        None,
        "a rotation matrix is subject to three normality and three orthogonality constraints",
        "holds",
        printed=_orthonormality,
        truth=lambda p: [1, 0, 0, 0, 1, 0, 0, 0, 1],
        note="R^T R = 1 is symmetric: six equations for nine elements leave three freedoms",
    ),
    Statement(
        "representation, text before 3.44",
        None,
        "the singularity of roll-pitch-yaw is 90 deg away from theta = 0",
        "holds",
        printed=lambda p: [_determinant3(_turning(p))],
        truth=lambda p: [-p.angles["theta"][0]],
        note="det B = -cos(theta)",
    ),
    Statement(
        "3.44",
        None,
        "R = R_z(phi) R_y(theta) R_x(psi)",
        "definition",
        truth=lambda p: flat(rpy_rotation(p)),
        model=lambda p: flat(model_side.rpy_rotation(p)),
    ),
    *[
        Statement(
            "3.45",
            (i,),
            f"{name} = {text}",
            "holds-under-convention",
            printed=_extracted(name, "sine_first"),
            truth=lambda p: [1, 0],
            convention=SINE_FIRST + "; cos(theta) > 0",
            otherwise=(_extracted(name, "cosine_first"),),
            model=_model_angle(name),
            exact=False,
            unit="(cos, sin)",
        )
        for i, (name, text) in enumerate(EXTRACTED.items(), 1)
    ],
    *[
        element(
            "3.46", (i + 1, j + 1), f"B[{i + 1},{j + 1}]", text,
            lambda p, i=i, j=j: [_turning(p)[i][j]],  # type: ignore[misc]
            model=lambda p, i=i, j=j: [model_side.rate_matrix(p)[i][j]],  # type: ignore[misc]
        )
        for i, row in enumerate(RATES) for j, text in enumerate(row)
    ],
    Statement(
        "text after 3.46",
        None,
        "the i'th column of J_vp is z_i x (p - o_i) or zero, of J_omega z_i or zero",
        "holds-under-convention",
        printed=_columns_of(lambda p, k: [*cross(p.z(k - 1), minus(_hand(p), p.o(k - 1))),
                                          *p.z(k - 1)]),
        truth=lambda p: [
            v for k in range(6)
            for m in (motion.linear(p, 6), motion.angular(p, 6)) for v in transpose(m)[k]
        ],
        convention=FROM_0,
        otherwise=(_columns_of(lambda p, k: [*cross(p.z(k), minus(_hand(p), p.o(k))), *p.z(k)]),),
        unit="m, 1",
    ),
    Statement(
        "3.47",
        None,
        "dz_i/dt = omega_i x z_i = J_omegai q' x z_i",
        "holds",
        printed=_axis_rates_printed,
        truth=_axis_rates,
        model=_model_rates(3),
        note="i is the frame: z_i is fixed to link i",
        unit="1/s",
    ),
    Statement(
        "3.48",
        None,
        "[z_i x (p - o_i)] = dz_i/dt x (p - o_i) + z_i x d(p - o_i)/dt",
        "misprint",
        printed=_levers,
        truth=_product_rule,
        corrected=_lever_rates,
        correction="d/dt [z_i x (p - o_i)] = dz_i/dt x (p - o_i) + z_i x d(p - o_i)/dt",
        note="The left side lacks d/dt, which (3.49) has",
        unit="m/s",
    ),
    Statement(
        "text after 3.48",
        None,
        "substituting dz_i/dt, q' = J_vq q' and do_i/dt = J_voi q'",
        "misprint",
        printed=lambda p: p.rates,
        truth=lambda p: rates(_hand(p.along)),
        corrected=lambda p: apply(motion.linear_columns(p, _hand(p), 6), p.rates),
        correction="substituting dz_i/dt, p' = J_vp q' and do_i/dt = J_voi q'",
        note="(3.48) holds p', not q', which has six components; compared with p' by threes",
        unit="m/s",
    ),
    Statement(
        "3.49",
        None,
        "d/dt [z_i x (p - o_i)] = [(J_omegai q') x z_i] x (p - o_i) + z_i x [(J_vp - J_oi) q']",
        "holds",
        printed=_column_rates(False),
        truth=_lever_rates,
        model=_model_rates(0),
        unit="m/s",
    ),
    Statement(
        "3.50",
        None,
        "Col_k{J_vp} = z_k x (p - o_k)",
        "holds-under-convention",
        printed=_columns_of(lambda p, k: cross(p.z(k - 1), minus(_hand(p), p.o(k - 1)))),
        truth=_true_columns,
        convention=FROM_0,
        otherwise=(_columns_of(lambda p, k: cross(p.z(k), minus(_hand(p), p.o(k)))),),
        unit="m",
    ),
    Statement(
        "3.51",
        None,
        "Col_k{J_oi} = z_k x (o_i - o_k)",
        "holds-under-convention",
        printed=_printed_origins,
        truth=_true_origins,
        convention=FROM_0,
        otherwise=(_origins_from_1,),
        unit="m",
    ),
    Statement(
        "J_oi, text after 3.51",
        None,
        "the columns of J_oi are zero for k > i",
        "holds",
        printed=_later_origins,
        truth=lambda p: [0],
        unit="m",
    ),
    Statement(
        "text after 3.51",
        None,
        "the columns of J_vp are zero for k > i",
        "misprint",
        printed=_column_rates(True),
        truth=_lever_rates,
        corrected=_column_rates(False),
        correction="the columns of J_oi are zero for k > i, those of J_vp beyond the joints that "
        "move p",
        note="i is the column of (3.49): with p on the last link no column of J_vp vanishes. "
        "Compared: (3.49) with J_vp cut and in full",
        unit="m/s",
    ),
]  # fmt: skip
