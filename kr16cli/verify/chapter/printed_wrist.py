"""Section 3.2 of the chapter from (3.21) as printed: the last three joints, and singularities."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kr16cli.verify.chapter import model_side
from kr16cli.verify.chapter.arm import Matrix, Point, cross, flat, product, transpose
from kr16cli.verify.chapter.counting import all_counts
from kr16cli.verify.chapter.language import evaluate, sum_of_angles
from kr16cli.verify.chapter.printed_inverse import SINE_FIRST, WRIST_CENTRE
from kr16cli.verify.chapter.recipe import PAIRS, RECIPE, Recipe, placed, turned
from kr16cli.verify.chapter.records import Statement, Values, element, formula
from kr16cli.verify.chapter.scalars import Pair, Scalar

R36 = (
    ("s4*s6 - c4*c5*c6", "-c6*s4 - c4*c5*s6", "c4*s5"),
    ("-c4*s6 - c5*c6*s4", "c4*c6 - c5*s4*s6", "s4*s5"),
    ("-c6*s5", "-s5*s6", "-c5"),
)
"""(3.22)."""

R36_SINGULAR = (("-c46", "-s46", "0"), ("-s46", "c46", "0"), ("0", "0", "-1"))
"""(3.27), q5 = 0."""

HALF_TURN: Pair = (-1, 0)


def r36(p: Point) -> Matrix:
    """Frame 6 seen from frame 3, from Table 3.1."""
    return product(transpose(p.R(3)), p.R(6))


def _entry(i: int, j: int, matrix: Callable[[Point], Matrix]) -> Values:
    return lambda p: [matrix(p)[i][j]]


def _straight(p: Point) -> Matrix:
    return r36(p.straight)


def _straight_model(p: Point) -> Matrix:
    return model_side.r36(p.straight)


def _as_printed(p: Point) -> Sequence[Scalar]:
    """(3.22), row by row."""
    return [evaluate(text, p) for row in R36 for text in row]


def _seen(k: int, i: int, p: Point) -> Matrix:
    """Frame k seen from frame i."""
    return product(transpose(p.R(i)), p.R(k))


def _outer_joint(joint: int, changes: dict[str, str] | None = None, **other: str) -> Values:
    """Angle `joint` by its pair of lines (3.23) to (3.25); the sign of s5 tells which."""

    def run(p: Point) -> Sequence[Scalar]:
        reading = {name: getattr(p.functions, how) for name, how in other.items()}
        recipe = Recipe(p, changes, **reading)
        matrix = r36(p)
        known = {f"r{i + 1}{j + 1}": matrix[i][j] for i in range(3) for j in range(3)}
        k = 1 if p.angles["q5"][1] > 0 else 2
        return turned(p, recipe.line(f"q{joint}{k}", known) - p.values[f"q{joint}_true"])

    return run


def _wrists(pairs: Sequence[tuple[str, str, str]]) -> Values:
    """Rotation from frame 3 to 6 of each {q4, q5, q6}."""

    def run(p: Point) -> Sequence[Scalar]:
        found = Recipe(p).wrists(r36(p), pairs)
        return [v for q in found for v in flat(r36(placed(p, [0, 0, 0, *q])))]

    return run


def _last_joint(corrected: bool) -> Values:
    """(3.28) at q5 = 0 with q4 the last known value."""

    def run(p: Point) -> Sequence[Scalar]:
        f = p.functions
        if f is None:
            raise ValueError("Atan2 needs more than + - * /")
        matrix = _straight(p)
        right = f.sine_first(-matrix[0][1], -matrix[0][0])
        q4, q6 = p.values["q4_true"], p.values["q6_true"]
        return turned(p, right - q4 - q6 if corrected else right - q4)

    return run


def _on_axis(p: Point) -> Sequence[Scalar]:
    """x_c, y_c at a q1 of its own where the bracket of (3.9) is made zero by a1."""
    radius = formula("a2*c2 + c23*d4 - a3*s23")(p)[0]
    here = Point(p.angles, {**p.values, "a1": -radius}, p.functions)
    return [v for text in WRIST_CENTRE[:2] for v in formula(text)(here)]


def _shifted(p: Point) -> Sequence[Scalar]:
    """R at q5 = 0 with q4 turned on and q6 turned back by the angle phi."""
    c, s = p.angles["phi"]
    q4 = sum_of_angles(p.angles["q4"], (c, s))
    q6 = sum_of_angles(p.angles["q6"], (c, -s))
    return flat(r36(p.straight.at(q4=q4, q6=q6)))


def _flipped(p: Point) -> Sequence[Scalar]:
    c5, s5 = p.angles["q5"]
    q4, q6 = (sum_of_angles(p.angles[q], HALF_TURN) for q in ("q4", "q6"))
    return flat(r36(p.at(q4=q4, q5=(c5, -s5), q6=q6)))


def _same_angle(p: Point) -> Sequence[Scalar]:
    return [1, 0]


def _set(*names: str) -> str:
    return ", ".join(RECIPE[name] for name in names)


STATEMENTS: list[Statement] = [
    Statement(
        "3.21",
        None,
        "R_6^3 = R_3^0 R = r_ij",
        "misprint",
        printed=lambda p: flat(product(_seen(3, 0, p), p.R(6))),
        truth=_as_printed,
        corrected=lambda p: flat(product(transpose(p.R(3)), p.R(6))),
        correction="R_6^3 = (R_3^b)^T R (subscript and superscript as in (3.29) and (3.22))",
        otherwise=(
            lambda p: flat(product(p.R(3), p.R(6))),
            lambda p: flat(product(_seen(0, 3, p), p.R(6))),
        ),
        note="Transposed, and R is given in b, which is not frame 0. The other readings: R_3^b, "
        "and R_3^0 as in (3.2); there the left side would be R_6^3 transposed",
    ),
    *[
        element(
            "3.22", (i + 1, j + 1), f"R_6^3[{i + 1},{j + 1}]", R36[i][j],
            _entry(i, j, r36), model=_entry(i, j, model_side.r36),
        )
        for i in range(3) for j in range(3)
    ],
    Statement(
        "3.23",
        None,
        f"{{q41, q42}} = {{{_set('q41', 'q42')}}}",
        "holds-under-convention",
        printed=_outer_joint(4),
        truth=_same_angle,
        convention=SINE_FIRST,
        otherwise=(_outer_joint(4, Atan2="cosine_first"),),
        exact=False,
        unit="(cos, sin)",
    ),
    Statement(
        "3.24",
        None,
        "{q51, q52} = {acos(r33), -acos(r33)}",
        "misprint",
        printed=_outer_joint(5, {"q51": "acos(r33)", "q52": "-acos(r33)"}),
        truth=_same_angle,
        corrected=_outer_joint(5),
        correction="{q51, q52} = {acos(-r33), -acos(-r33)}",
        exact=False,
        note="r33 = -c5 in (3.22): the printed form gives pi - q5",
        unit="(cos, sin)",
    ),
    Statement(
        "3.25",
        None,
        f"{{q61, q62}} = {{{_set('q61', 'q62')}}}",
        "holds-under-convention",
        printed=_outer_joint(6),
        truth=_same_angle,
        convention=SINE_FIRST,
        otherwise=(_outer_joint(6, Atan2="cosine_first"),),
        exact=False,
        unit="(cos, sin)",
    ),
    Statement(
        "3.26",
        None,
        "{q4, q5, q6} in {{q41, q51, q61}, {q42, q52, q62}}",
        "holds",
        printed=_wrists(PAIRS),
        truth=lambda p: flat(r36(p)),
        otherwise=(_wrists((("q41", "q52", "q61"), ("q42", "q51", "q62"))),),
        exact=False,
        note="With the corrected (3.24); crossed pairs do not close",
    ),
    Statement(
        "two wrists, text after 3.26",
        None,
        "there are two solutions given a triplet q1, q2, q3 and a nonsingular configuration: "
        "(q4, q5, q6) and (q4 + pi, -q5, q6 + pi)",
        "holds",
        printed=_flipped,
        truth=lambda p: flat(r36(p)),
        note="No third: r33 fixes cos(q5), and with the sign of q5 the last row and column "
        "fix q4 and q6",
    ),
    all_counts(),
    Statement(
        "shoulder singularity, text before 3.27",
        None,
        "when o_c = [0; 0; o_cz] the joint angle q1 becomes a free variable",
        "holds",
        printed=_on_axis,
        truth=lambda p: [0, 0],
        unit="m",
    ),
    Statement(
        "wrist singularity, text before 3.27",
        None,
        "the spherical joint is singular when q5 = 0: axes A4 and A6 in line",
        "holds",
        printed=lambda p: cross(p.z(3), p.straight.z(5)),
        truth=lambda p: [0, 0, 0],
    ),
    *[
        element(
            "3.27", (i + 1, j + 1), f"R_6^3[{i + 1},{j + 1}]", R36_SINGULAR[i][j],
            _entry(i, j, _straight), model=_entry(i, j, _straight_model),
        )
        for i in range(3) for j in range(3)
    ],
    Statement(
        "free angle, text after 3.27",
        None,
        "either q4 or q6 is a free variable",
        "holds",
        printed=_shifted,
        truth=lambda p: flat(_straight(p)),
        note="R_6^3 does not change when q4 is turned on and q6 back by the same angle",
    ),
    Statement(
        "3.28",
        None,
        "q4 = Atan2(-r12, -r11)",
        "misprint",
        printed=_last_joint(False),
        truth=_same_angle,
        corrected=_last_joint(True),
        correction="q6 = Atan2(-r12, -r11) - q4",
        exact=False,
        note="By (3.27) the right side is q4 + q6; the text asks for q6 with q4 known",
        unit="(cos, sin)",
    ),
]  # fmt: skip
