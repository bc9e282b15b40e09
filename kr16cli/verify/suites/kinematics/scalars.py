"""The few operations all formulas are made of, and the zero that costs nothing."""

from __future__ import annotations

import math

import numpy as np

from kr16cli.model import scalars as model
from kr16cli.verify import sampling
from kr16cli.verify.measure import COUNT, Array, finding, gap
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case


@case(
    "kinematics.vectors",
    title="Vector operations and quarter turns",
    statement="a + b, a - b, -a, k a, k a + m b, a . b, a x b, A v, sums; "
    "(cos, sin) of a + b and of a + k 90 deg, k from -5 to 5",
    regime="random vectors and angles",
    method="NumPy",
    grade="A",
    tolerance=1e-14,
    unit="1",
    reason="one or two rounded operations on numbers up to 10",
    functions=("kr16cli.model.scalars",),
)
def vectors(setting: Setting) -> Finding:
    """What nobody should get wrong."""
    rng = sampling.random(setting, "vectors")
    errors = []
    for _ in range(setting.samples(200, 30)):
        a, b = rng.normal(size=(2, 3))
        k, m = rng.normal(size=2)
        A, v = rng.normal(size=(4, 5)), rng.normal(size=5)
        one, other = (a[0], a[1], a[2]), (b[0], b[1], b[2])
        errors.append(
            max(
                _vector_gap(one, other, k, m),
                float(gap(model.matvec(A.tolist(), v.tolist()), A @ v)),
            )
        )
        x, y = rng.uniform(-4, 4, 2)
        pair = (math.cos(x), math.sin(x))
        both = model.angle_sum(pair, (math.cos(y), math.sin(y)))
        errors.append(float(gap(both, (math.cos(x + y), math.sin(x + y)))))
        for turns in range(-5, 6):
            angle = x + turns * math.pi / 2
            exact = (math.cos(angle), math.sin(angle))
            errors.append(float(gap(model.quarter_turn(pair, turns), exact)) / 2)
    return finding(errors, "eleven operations")


def _vector_gap(one: model.Vector, other: model.Vector, k: float, m: float) -> float:
    a, b = np.array(one), np.array(other)
    found: list[tuple[model.Scalar, Array]] = [
        (model.add(one, other), a + b),
        (model.sub(one, other), a - b),
        (model.neg(one), -a),
        (model.scale(k, one), k * a),
        (model.combine(k, one, m, other), k * a + m * b),
        (model.cross(one, other), np.cross(a, b)),
        ((model.dot(one, other),), np.array([a @ b])),
        ((model.sum_of(one),), np.array([a.sum()])),
    ]
    return max(float(gap(own, expected)) for own, expected in found)


@case(
    "kinematics.structural-zero",
    title="The structural zero behaves as 0",
    statement="x + 0 = 0 + x = x - 0 = x, 0 - x = -x, x 0 = 0 x = 0 / x = -0 = 0, on floats and "
    "arrays; only an exact float 0 becomes one",
    regime="random numbers and arrays",
    method="every operation once",
    grade="C",
    tolerance=COUNT,
    unit="wrong results",
    reason="exact",
    functions=("kr16cli.model.scalars.structural",),
)
def structural_zero(setting: Setting) -> Finding:
    """A zero without operations."""
    rng, zero, wrong = sampling.random(setting, "zero"), model.ZERO, 0
    for x in (1.5, -2.0, rng.normal(size=4)):
        sums = (x + zero, zero + x, x - zero, -(zero - x))
        wrong += sum(not np.array_equal(value, x) for value in sums)
        wrong += sum(value is not zero for value in (x * zero, zero * x, zero / x))
    wrong += (-zero is not zero) + (float(zero) != 0.0) + (zero + zero is not zero)
    kept = (1.0, -1.0, 1e-300, 1, -2.5)
    wrong += sum(model.structural(value) is not value for value in kept)
    wrong += sum(model.structural(value) is not zero for value in (0.0, -0.0))
    return Finding(float(wrong), 33, {}, "sums, products, quotients and what becomes one")
