"""Section 3.2 of the chapter up to (3.20) as printed: the wrist centre and the first three joints.

The lines of the recipe that hold stand in `recipe.RECIPE`.
"""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.verify.chapter import model_side
from kr16cli.verify.chapter.arm import Point, minus
from kr16cli.verify.chapter.counting import arm_counts, branch_sets
from kr16cli.verify.chapter.language import evaluate
from kr16cli.verify.chapter.recipe import RECIPE, Recipe, turned
from kr16cli.verify.chapter.records import Statement, Values, definition, element, formula
from kr16cli.verify.chapter.scalars import Scalar

SINE_FIRST = "Atan2(s, c) takes the sine first; angles modulo 2 pi"

WRIST_CENTRE = (
    "s1*(a1 + a2*c2 + c23*d4 - a3*s23)",
    "c1*(a1 + a2*c2 + c23*d4 - a3*s23)",
    "d1 - a3*c23 - a2*s2 - d4*s23",
)
"""(3.9)."""

ROTATED = ("x_c*cos(q1) - y_c*sin(q1)", "y_c*cos(q1) + x_c*sin(q1)", "z_c")
"""o_c,rot of (3.12)."""

PLANE = ("a1 + d4*c23 - a3*s23 + a2*c2", "d1 - a3*c23 - d4*s23 - a2*s2")
"""(3.15)."""

DISTANCE = "a2^2 + a3^2 + d4^2 - 2*a2*a3*sin(q3) + 2*a2*d4*cos(q3)"
"""The right side of (3.13)."""


def centre(p: Point) -> dict[str, Scalar]:
    """x_c, y_c, z_c: the origin of frame 4 of Table 3.1."""
    return dict(zip(("x_c", "y_c", "z_c"), p.o(4), strict=True))


def _with_centre(text: str) -> Values:
    """A formula in x_c, y_c, z_c."""
    return lambda p: [evaluate(text, p, **centre(p))]


def _distance(power: str) -> Values:
    """||o_c - o||^power with o the point on the A2 axis, o_1 of Table 3.1."""

    def run(p: Point) -> Sequence[Scalar]:
        x, y, z = minus(p.o(4), p.o(1))
        return [evaluate(f"(x^2 + y^2 + z^2){power}", p, x=x, y=y, z=z)]

    return run


def _rotated(k: int) -> Values:
    """Origin of frame k after Rot_z(q1): in the y_b z_b-plane."""

    def run(p: Point) -> Sequence[Scalar]:
        c, s = p.angles["q1"]
        x, y, z = p.o(k)
        return [c * x - s * y, s * x + c * y, z]

    return run


def _front(p: Point) -> bool:
    return bool(p.o(4)[0] * p.angles["q1"][1] + p.o(4)[1] * p.angles["q1"][0] > 0)


def _elbow_index(p: Point) -> int:
    """1 where a3 c3 + d4 s3 < 0, else 2: which root of (3.14) the configuration is."""
    return 1 if evaluate("a3*c3 + d4*s3", p) < 0 else 2


def _first_joint(reading: str) -> Values:
    """(3.11): both roots bring o_c into the plane; the configuration's own is one of them."""

    def run(p: Point) -> Sequence[Scalar]:
        recipe = Recipe(p, Atan2=getattr(p.functions, reading))
        q1 = {i: recipe.line(f"q1{i}", centre(p)) for i in (1, 2)}
        own = turned(p, q1[1 if _front(p) else 2] - p.values["q1_true"])
        return [*own, *_in_plane(p, q1[1]), *_in_plane(p, q1[2])]

    return run


def _in_plane(p: Point, q1: Scalar) -> list[Scalar]:
    """[1, 0] where q1 satisfies (3.10)."""
    return [1, evaluate(ROTATED[0], p, q1=q1, **centre(p))]


def _third_joint(index: str) -> Values:
    """The root of (3.14) with D of the configuration: by the elbow, or as the text has it."""

    def run(p: Point) -> Sequence[Scalar]:
        o_c1, o_c2 = _rotated(4)(p)[1:]
        recipe = Recipe(p)
        known = recipe.lines_of({"o_c1": o_c1, "o_c2": o_c2}, "d", "D")
        k = _elbow_index(p) if index == "q3" else (1 if _front(p) else 2)
        return turned(p, recipe.line(f"q3{k}", known) - p.values["q3_true"])

    return run


def _second_joint(first: str, second: str) -> Values:
    """(3.16) with either Atan2 read sine first or cosine first."""

    def run(p: Point) -> Sequence[Scalar]:
        f = p.functions
        text = RECIPE["q2"].replace("Atan2", "first", 1).replace("Atan2", "second", 1)
        o_c1, o_c2 = _rotated(4)(p)[1:]
        known = {"q3": p.values["q3_true"], "o_c1": o_c1, "o_c2": o_c2}
        Recipe(p).lines_of(known, "delta", "q3p")
        q2 = evaluate(text, p, first=getattr(f, first), second=getattr(f, second), **known)
        return turned(p, q2 - p.values["q2_true"])

    return run


def _same_angle(count: int = 1) -> Values:
    return lambda p: [1, 0] * count


def _between(p: Point, k: int, power: int) -> Sequence[Scalar]:
    """||o_c - o_k|| to the power 2 or 4, o_k of Table 3.1."""
    gap = minus(p.o(4), p.o(k))
    square = evaluate("x^2 + y^2 + z^2", p, x=gap[0], y=gap[1], z=gap[2])
    return [square if power == 1 else square * square]


STATEMENTS: list[Statement] = [
    definition("3.7", "q = T^-1(o, R)", "Executed from end to end under 'text after 3.26'"),
    Statement(
        "wrist centre, text after 3.7",
        None,
        "the coordinate axes (4,5) have the same origin, called the wrist centre o_c",
        "holds",
        printed=lambda p: p.o(5),
        truth=lambda p: p.o(4),
        unit="m",
    ),
    Statement(
        "3.8",
        None,
        "o_c = o - d6*R*[0; 0; 1]",
        "holds",
        printed=lambda p: [o - p.values["d6"] * z for o, z in zip(p.o(6), p.z(6), strict=True)],
        truth=lambda p: p.o(4),
        model=model_side.wrist,
        unit="m",
    ),
    *[
        element(
            "3.9",
            (i + 1,),
            f"o_c[{i + 1}]",
            text,
            lambda p, i=i: [p.o(4)[i]],  # type: ignore[misc]
            model=lambda p, i=i: [model_side.wrist(p)[k] for k in (i, i + 3)],  # type: ignore[misc]
            unit="m",
            note="c_23d_4 is set with the subscript cut short; it has one reading" * (i == 1),
        )
        for i, text in enumerate(WRIST_CENTRE)
    ],
    Statement(
        "3.10",
        None,
        "x_c/y_c = tan(q1)",
        "holds",
        printed=_with_centre("x_c*cos(q1)"),
        truth=_with_centre("y_c*sin(q1)"),
        note="Cross-multiplied: it says nothing where o_c is on the z_b axis",
        unit="m",
    ),
    Statement(
        "3.11",
        None,
        "{q11, q12} = {Atan2(x_c, y_c), Atan2(x_c, y_c) + pi}",
        "holds-under-convention",
        printed=_first_joint("sine_first"),
        truth=_same_angle(3),
        convention=SINE_FIRST,
        otherwise=(_first_joint("cosine_first"),),
        exact=False,
        unit="(cos, sin)",
    ),
    definition("Atan2, text after 3.11", "Atan2 in [0, 2 pi) is the four quadrant arctangent"),
    Statement(
        "3.12",
        None,
        "o_2,rot = [0; a1; d1]",
        "holds-under-convention",
        printed=formula("[0, a1, d1]"),
        truth=_rotated(1),
        convention="o_2 is the point on the A2 axis (origins numbered with the axes, from 1); "
        "Table 3.1 and p_c2 of (3.29) number the frames and call it o_1",
        otherwise=(_rotated(2),),
        unit="m",
    ),
    *[
        Statement(
            "3.12",
            (i + 1,),
            f"(Rot_z,q1 o_c)[{i + 1}] = {text} = {right}",
            "holds",
            printed=lambda p, i=i, text=text: [  # type: ignore[misc]
                evaluate(text, p, **centre(p)),
                _rotated(4)(p)[i],
            ],
            truth=formula(("0", *PLANE)[i]),
            unit="m",
        )
        for i, (text, right) in enumerate(zip(ROTATED, ("0", "o_c1", "o_c2"), strict=True))
    ],
    Statement(
        "3.13",
        None,
        f"d = ||o_c - o_2||^4 = {DISTANCE}",
        "misprint",
        printed=_distance("^2"),
        truth=formula(DISTANCE),
        corrected=_distance(""),
        correction=f"d = ||o_c - o_2||^2 = {DISTANCE}",
        otherwise=(lambda p: _between(p, 2, 1), lambda p: _between(p, 2, 2)),
        note="The other readings take o_2 as the frame of Table 3.1, with power 2 and 4",
        unit="m^2",
    ),
    Statement(
        "text after 3.13",
        None,
        "the fourth power of the distance is used",
        "misprint",
        printed=_distance("^2"),
        truth=formula(DISTANCE),
        corrected=_distance(""),
        correction="the second power of the distance is used",
        unit="m^2",
    ),
    Statement(
        "3.14",
        None,
        f"{{q31, q32}} = {{{RECIPE['q31']}, {RECIPE['q32']}}}",
        "holds",
        printed=_third_joint("q3"),
        truth=_same_angle(),
        exact=False,
        note="Both roots, at configurations with either sign of a3*c3 + d4*s3; 0/0 at q3 = pi",
        unit="(cos, sin)",
    ),
    Statement(
        "D, text after 3.14",
        None,
        f"D = {RECIPE['D']}",
        "holds",
        printed=lambda p: [evaluate("d - a2^2 - a3^2 - d4^2", p, d=_distance("")(p)[0])],
        truth=formula("2*a2*(d4*cos(q3) - a3*sin(q3))"),
        note="With the squared distance of the corrected (3.13); multiplied by 2*a2",
        unit="m^2",
    ),
    Statement(
        "text after 3.14",
        None,
        "if the plus sign is chosen we get the q3 angle corresponding to q_{1,1}",
        "misprint",
        printed=_third_joint("q1"),
        truth=_same_angle(),
        corrected=_third_joint("q3"),
        correction="if the plus sign is chosen we get q_{3,1}; each q_{1,i} has both signs",
        exact=False,
        unit="(cos, sin)",
    ),
    Statement(
        "Delta, text after 3.14",
        None,
        "if Delta_i = a3^2 + d4^2 - D_i^2 < 0 there is no solution for the given q_1i",
        "holds",
        printed=lambda p: [
            evaluate("a3^2 + d4^2 - D^2", p, D=evaluate("d4*cos(q3) - a3*sin(q3)", p))
        ],
        truth=formula("(a3*c3 + d4*s3)^2"),
        note="At every configuration Delta is the square of a3*c3 + d4*s3, so never negative",
        unit="m^2",
    ),
    *[
        element(
            "3.15",
            (i + 1,),
            f"o_c{i + 1}",
            text,
            lambda p, i=i: [_rotated(4)(p)[i + 1]],  # type: ignore[misc]
            unit="m",
        )
        for i, text in enumerate(PLANE)
    ],
    Statement(
        "3.16",
        None,
        f"q_2k = {RECIPE['q2']}",
        "holds-under-convention",
        printed=_second_joint("sine_first", "sine_first"),
        truth=_same_angle(),
        convention=SINE_FIRST,
        otherwise=(
            _second_joint("cosine_first", "cosine_first"),
            _second_joint("sine_first", "cosine_first"),
            _second_joint("cosine_first", "sine_first"),
        ),
        exact=False,
        note="With the cosine first it gives -q_2k",
        unit="(cos, sin)",
    ),
    definition(
        "delta, text after 3.16",
        "delta = sqrt(a3^2 + d4^2), q3'_k = q_3k + atan(a3/d4)",
        "Executed in (3.16); d4 > 0",
    ),
    *branch_sets(),
    definition("3.20", "{q11, q21, q31} stands for {q11, q21(q11, q31), q31(q11)}"),
    arm_counts(),
]
