"""Section 3.2 run from end to end: pose in, joint angles out, every line a printed text.

`RECIPE` holds the lines that stand (corrected where the chapter misprints); a statement swaps
its own line in, so that each misprint is judged with all others corrected.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from kr16cli.verify.chapter.arm import Matrix, Point, product, rotation, transpose
from kr16cli.verify.chapter.language import evaluate
from kr16cli.verify.chapter.scalars import Scalar

RECIPE: dict[str, str] = {
    "q11": "Atan2(x_c, y_c)",  # (3.11)
    "q12": "Atan2(x_c, y_c) + pi",
    "o_c1": "y_c*cos(q1) + x_c*sin(q1)",  # (3.12)
    "o_c2": "z_c",
    "d": "(o_c1 - a1)^2 + (o_c2 - d1)^2",  # (3.13), the square in place of the fourth power
    "D": "(d - a2^2 - a3^2 - d4^2)/(2*a2)",  # text after (3.14)
    "Delta": "a3^2 + d4^2 - D^2",
    "q31": "-2*atan((a3 + sqrt(a3^2 + d4^2 - D^2))/(d4 + D))",  # (3.14)
    "q32": "-2*atan((a3 - sqrt(a3^2 + d4^2 - D^2))/(d4 + D))",
    "delta": "sqrt(a3^2 + d4^2)",  # text after (3.16)
    "q3p": "q3 + atan(a3/d4)",
    "q2": "Atan2(o_c1 - a1, o_c2 - d1) - Atan2(a2 + delta*cos(q3p), -delta*sin(q3p))",  # (3.16)
    "q41": "Atan2(r23, r13)",  # (3.23)
    "q42": "Atan2(r23, r13) + pi",
    "q51": "acos(-r33)",  # (3.24), with the sign that (3.22) asks for
    "q52": "-acos(-r33)",
    "q61": "Atan2(-r32, -r31)",  # (3.25)
    "q62": "Atan2(-r32, -r31) + pi",
}

PAIRS = (("q41", "q51", "q61"), ("q42", "q52", "q62"))
"""The solution set (3.26)."""

Angles = list[Scalar]


class Recipe:
    """The recipe on one point's numbers, with some lines exchanged or Atan2 read otherwise."""

    def __init__(self, p: Point, changes: Mapping[str, str] | None = None, **reading: Any) -> None:
        self.p, self.reading = p, reading
        self.lines = {**RECIPE, **(changes or {})}

    def line(self, name: str, known: Mapping[str, Scalar]) -> Scalar:
        """The value of one line, given what it uses."""
        return evaluate(self.lines[name], self.p, **self.reading, **known)

    def lines_of(self, known: dict[str, Scalar], *names: str) -> dict[str, Scalar]:
        """Several lines after each other, each using those before."""
        for name in names:
            known[name] = self.line(name, known)
        return known

    def discriminants(self, o_c: Sequence[Scalar]) -> list[Scalar]:
        """Delta_1 and Delta_2."""
        return [self._elbow(o_c, i)["Delta"] for i in (1, 2)]

    def _elbow(self, o_c: Sequence[Scalar], i: int) -> dict[str, Scalar]:
        known = dict(zip(("x_c", "y_c", "z_c"), o_c, strict=True))
        known["q1"] = self.line(f"q1{i}", known)
        return self.lines_of(known, "o_c1", "o_c2", "d", "D", "Delta")

    def arms(self, o_c: Sequence[Scalar]) -> dict[tuple[int, int], Angles]:
        """{q1i, q2k, q3k} by (i, k), for each q1i whose discriminant is not negative."""
        found = {}
        for i in (1, 2):
            known = self._elbow(o_c, i)
            if known["Delta"] < 0:
                continue
            for k in (1, 2):
                here = {**known, "q3": self.line(f"q3{k}", known)}
                self.lines_of(here, "delta", "q3p", "q2")
                found[i, k] = [here["q1"], here["q2"], here["q3"]]
        return found

    def wrists(
        self, r36: Matrix, pairs: Sequence[tuple[str, str, str]] = PAIRS
    ) -> Iterator[Angles]:
        """{q4, q5, q6} of a rotation from frame 3 to frame 6, by (3.23) to (3.26)."""
        known = {f"r{i + 1}{j + 1}": r36[i][j] for i in range(3) for j in range(3)}
        for names in pairs:
            yield [self.line(name, known) for name in names]

    def solutions(self, pose: Matrix) -> list[Angles]:
        """All solutions for a pose of frame 6 in b."""
        r = rotation(pose)
        o_c = evaluate(
            "[x - d6*r13, y - d6*r23, z - d6*r33]", self.p,
            x=pose[0][3], y=pose[1][3], z=pose[2][3], r13=r[0][2], r23=r[1][2], r33=r[2][2],
        )  # fmt: skip
        found = []
        for arm in self.arms(o_c).values():
            r3 = placed(self.p, [*arm, 0, 0, 0]).R(3)
            r36 = product(transpose(r3), r)  # (3.21), corrected
            found += [[*arm, *wrist] for wrist in self.wrists(r36)]
        return found


def placed(p: Point, q: Sequence[Scalar]) -> Point:
    """The arm at joint angles given as numbers, rad."""
    if p.functions is None:
        raise ValueError("angles need more than + - * /")
    return p.at(**{f"q{i}": p.functions.pair(v) for i, v in enumerate(q, 1)})


def turned(p: Point, difference: Scalar) -> list[Scalar]:
    """(cos, sin) of an angle: [1, 0] says it is zero but for whole turns."""
    if p.functions is None:
        raise ValueError("angles need more than + - * /")
    return list(p.functions.pair(difference))
