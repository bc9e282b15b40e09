"""The configurations a statement is executed at: rational, 50-digit and float64."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache

from kr16cli.robot import RobotData
from kr16cli.robot_file import load_data
from kr16cli.verify.chapter.arm import Point
from kr16cli.verify.chapter.scalars import (
    ANGLES,
    FLOATS,
    Degree,
    Functions,
    Pair,
    Scalar,
    digits50,
)

CHOICES = 2**32
"""Values each rational variable is drawn from: so many that one point all but proves."""

_PATTERNS = (
    (1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1),
    (1, 1, -1), (1, -1, 1), (-1, 1, 1), (-1, -1, -1),
)  # fmt: skip
"""Signs of the three factors; already the first four hold every pair of signs."""

_NEAR = 0.05
"""Factors (m, m, 1) below this are too near a singularity to tell branches apart in float64."""

_RATES = (*(f"dq{i}" for i in range(1, 7)), "dphi", "dtheta", "dpsi")


def chapter_values(data: RobotData) -> dict[str, float]:
    """The numbers of a file in the chapter's form by their names in the chapter (SI)."""
    g = data.geometry
    c = [link.com for link in data.links]
    r = (g.d1 - c[0][1], c[1][0] + g.a2, c[2][2] + g.d4, c[3][1], -c[4][2], c[5][2] + g.d6)
    values = {**g._asdict(), "g": -data.gravity[2]}
    for i, link in enumerate(data.links, 1):
        values |= {f"r{i}": r[i - 1], f"m{i}": link.mass}
        names = ("xx", "yy", "zz", "xy", "xz", "yz")
        values |= {f"I{i}{n}": v for n, v in zip(names, link.inertia, strict=True)}
    return values


@dataclass(frozen=True)
class Bench:
    """Where statements are executed. `quick` draws fewer rational and float points."""

    seed: int
    quick: bool = False

    @cached_property
    def data(self) -> RobotData:
        """The shipped arm in the chapter's form."""
        return load_data("chapter3")

    @cached_property
    def values(self) -> dict[str, float]:
        """Its numbers by the chapter's names."""
        return chapter_values(self.data)

    @cached_property
    def exact(self) -> list[Point]:
        """Random rational points on the unit circle, all numbers of the arm random too."""
        draw = random.Random(self.seed)
        half = CHOICES // 2

        def turn() -> Pair:
            t = draw.randint(-half, half - 1)
            return Fraction(1 - t * t, 1 + t * t), Fraction(2 * t, 1 + t * t)

        return [
            Point(
                {name: turn() for name in ANGLES},
                {name: Fraction(draw.randint(1, CHOICES)) for name in (*self.values, *_RATES)},
            )
            for _ in range(1 if self.quick else 3)
        ]

    @cached_property
    def degree(self) -> Point:
        """The point that counts degrees."""
        n = len(ANGLES)
        turns = [Degree(tuple(int(i == k) for k in range(n))) for i in range(n)]
        one = Degree(rest=1)
        names = (*self.values, *_RATES)
        return Point(dict(zip(ANGLES, zip(turns, turns, strict=True), strict=True)),
                     dict.fromkeys(names, one))  # fmt: skip

    @cached_property
    def precise(self) -> list[Point]:
        """Configurations of the chapter's arm in 50 digits."""
        return self.configurations(digits50(), 4 if self.quick else 8, self.seed + 1)

    @cached_property
    def floats(self) -> list[Point]:
        """Configurations of the chapter's arm in float64."""
        return self.configurations(FLOATS, 4 if self.quick else 24, self.seed + 2)

    def configurations(self, f: Functions, count: int, seed: int) -> list[Point]:
        """Random angles (theta within +-90 deg) and rates of the chapter's arm.

        The signs of the shoulder, elbow and wrist factors of (3.37) go through all patterns,
        and none of the three is small.
        """
        draw = random.Random(seed)
        result: list[Point] = []
        while len(result) < count:
            angles = {name: draw.uniform(-3.1, 3.1) for name in ANGLES}
            signs = self.signs(angles)
            if signs == _PATTERNS[len(result) % len(_PATTERNS)]:
                result.append(self.point(f, angles, [draw.uniform(-2, 2) for _ in _RATES]))
        return result

    def signs(self, angles: Mapping[str, float]) -> tuple[int, int, int] | None:
        """Signs of the shoulder, elbow and wrist factors; None where one of them is small."""
        v, q2, q3 = self.values, angles["q2"], angles["q3"]
        reach = v["a1"] + v["a2"] * math.cos(q2) + v["d4"] * math.cos(q2 + q3)
        shoulder = reach - v["a3"] * math.sin(q2 + q3)
        elbow = v["a3"] * math.cos(q3) + v["d4"] * math.sin(q3)
        factors = (shoulder, elbow, math.sin(angles["q5"]))
        if min(map(abs, factors)) < _NEAR:
            return None
        return (_sign(factors[0]), _sign(factors[1]), _sign(factors[2]))

    def point(
        self, f: Functions, angles: Mapping[str, float], rates: Sequence[float] = (0.0,) * 9
    ) -> Point:
        """One configuration of the chapter's arm, rad and rad/s."""
        full = {**dict.fromkeys(ANGLES, 0.0), **angles, "theta": angles.get("theta", 0.0) / 2}
        values: dict[str, Scalar] = {name: f.number(repr(v)) for name, v in self.values.items()}
        values |= {name: f.number(v) for name, v in zip(_RATES, rates, strict=True)}
        angle = {name: f.number(v) for name, v in full.items()}
        values |= {f"{name}_true": v for name, v in angle.items()}
        return Point({name: f.pair(v) for name, v in angle.items()}, values, f)


@lru_cache(2)
def shared_bench(seed: int, quick: bool) -> Bench:
    """The bench of all sections with these choices: what is known of its points is kept."""
    return Bench(seed, quick)


def _sign(x: float) -> int:
    return 1 if x > 0 else -1
