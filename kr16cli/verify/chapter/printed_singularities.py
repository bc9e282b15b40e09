"""Section 3.4 of the chapter as printed: the singularities of the Jacobian, (3.37)."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.verify.chapter import model_side
from kr16cli.verify.chapter.arm import Point, determinant, flat, once, rates, spin, transpose
from kr16cli.verify.chapter.language import sum_of_angles
from kr16cli.verify.chapter.printed_wrist import HALF_TURN
from kr16cli.verify.chapter.records import Statement, Values, element, formula
from kr16cli.verify.chapter.scalars import Scalar

DETERMINANT = "a2*s5*(a3*c3 + d4*s3)*(a1 + d4*c23 - a3*s23 + a2*c2)"
"""(3.37)."""

SHOULDER = "(a1 + d4*c23 - a3*s23 + a2*c2)"


@once
def _elbow_point(p: Point) -> Point:
    """The configuration with a3, d4 such that a3 c3 + d4 s3 = 0: arm stretched or folded."""
    c3, s3 = p.angles["q3"]
    length = p.values["d4"]
    return Point(p.angles, {**p.values, "a3": -s3 * length, "d4": c3 * length}, p.functions)


@once
def _true_determinant(p: Point) -> Sequence[Scalar]:
    columns = [[*rates(moving.o(6)), *spin(moving, p, 6)] for moving in p.partials]
    return [determinant(transpose(columns))]


def _at_elbow_and_elsewhere(form: Values) -> Values:
    return lambda p: [*form(_elbow_point(p)), *form(p)]


def _wrist_flip(p: Point) -> Sequence[Scalar]:
    """Frame 6 at (q4 + pi, -q5, q6 + pi)."""
    c5, s5 = p.angles["q5"]
    q4, q6 = (sum_of_angles(p.angles[q], HALF_TURN) for q in ("q4", "q6"))
    return flat(p.at(q4=q4, q5=(c5, -s5), q6=q6).frames[6][:3])


STATEMENTS: list[Statement] = [
    Statement(
        "text after 3.36",
        None,
        "the singularities of the Jacobian are the same as for the inverse kinematics",
        "misprint",
        printed=_at_elbow_and_elsewhere(formula(f"a2*s5*{SHOULDER}")),
        truth=_at_elbow_and_elsewhere(_true_determinant),
        corrected=_at_elbow_and_elsewhere(formula(DETERMINANT)),
        correction="the Jacobian is singular where the inverse kinematics of section 3.2.3 is "
        "(s5 = 0 or o_c on z_b) and also where a3*c3 + d4*s3 = 0",
        note="Section 3.2.3 calls singular what has infinitely many solutions: s5 = 0 or o_c on "
        "z_b. With the arm stretched or folded det J = 0 too, but there Delta = 0: two solutions "
        "merge and their number stays finite. Compared with det J, at such points and elsewhere: "
        "the product that has to vanish with it",
        unit="m^3",
    ),
    Statement(
        "diffeomorphism, text after 3.36",
        None,
        "nonsingularity of the Jacobian is necessary and sufficient for the forward kinematics "
        "to be a diffeomorphism",
        "holds-under-convention",
        printed=_wrist_flip,
        truth=lambda p: flat(p.frames[6][:3]),
        convention="locally (inverse function theorem)",
        note="Globally it has no inverse: shown is that (q4 + pi, -q5, q6 + pi) has the same T",
    ),
    Statement(
        "stretched arm, text after 3.36",
        None,
        "the robot is singular when it is stretched out fully",
        "holds",
        printed=lambda p: _true_determinant(_elbow_point(p)),
        truth=lambda p: [0],
        unit="m^3",
    ),
    element(
        "3.37", None, "det(J)", DETERMINANT, _true_determinant,
        model=model_side.determinant, unit="m^3",
        note="Linear rows first as in (3.36); angular rows first change the sign",
    ),
]  # fmt: skip
