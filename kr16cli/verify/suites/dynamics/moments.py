"""Moments of bodies seen from elsewhere, against sums over point masses."""

from __future__ import annotations

import math

import numpy as np

from kr16cli.model.coriolis import Flow, flow_out
from kr16cli.model.dynamics import shifted
from kr16cli.model.inertia import Body
from kr16cli.model.scalars import quarter_turn
from kr16cli.verify import sampling
from kr16cli.verify.independent.rotations import about_axis
from kr16cli.verify.measure import Array, finding, gap
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case


def _body(masses: Array, points: Array) -> Body:
    """Point masses as a body about the origin."""
    h = masses @ points
    second = np.einsum("k,ki,kj->ij", masses, points, points)
    J = np.trace(second) * np.eye(3) - second
    six = (float(J[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    return Body(float(masses.sum()), (float(h[0]), float(h[1]), float(h[2])), *six)


def _numbers(body: Body) -> list[float]:
    return [body.m, *body.h, *body[2:]]


@case(
    "dynamics.moments",
    title="Bodies and their motion seen from another origin",
    statement="sum m, sum m r, inertia, sum m r' and sum m r' r^T about a shifted origin",
    regime="random point masses, shifts and turns in all directions, not only those of this arm",
    method="sums over the point masses",
    grade="B",
    tolerance=1e-12,
    unit="kg m2 and its parts",
    reason="sums of tens of products of numbers up to 10",
    functions=("kr16cli.model.dynamics.shifted", "kr16cli.model.coriolis.flow_out"),
)
def moments(setting: Setting) -> Finding:
    """What the recursions pass from link to link."""
    rng, errors = sampling.random(setting, "moments"), []
    for k in range(setting.samples(200, 30)):
        masses = rng.uniform(0.5, 2.0, 8)
        points, speeds = rng.normal(size=(2, 8, 3))
        d, d_rate = rng.normal(size=(2, 3))
        errors.append(
            gap(
                _numbers(shifted(_body(masses, points), (d[0], d[1], d[2]))),
                _numbers(_body(masses, points + d)),
            )
        )
        alpha, theta = k % 3 - 1, float(rng.uniform(-math.pi, math.pi))
        c, s = math.cos(theta), math.sin(theta)
        tilt = np.array(quarter_turn((1.0, 0.0), alpha))
        R = np.array([[1, 0, 0], [0, tilt[0], -tilt[1]], [0, tilt[1], tilt[0]]]) @ about_axis(
            np.array([0.0, 0.0, 1.0]), np.array(theta)
        )
        moving = np.einsum("k,ki,kj->ij", masses, speeds, points)
        rows = tuple(tuple(row) for row in moving.tolist())
        flow = Flow(tuple((masses @ speeds).tolist()), rows)  # type: ignore[arg-type]
        h = R @ (masses @ points)
        out = flow_out(
            flow, tuple(h), tuple(d), tuple(d_rate), float(masses.sum()), (alpha, c, s)
        )  # fmt: skip
        there, carried = points @ R.T + d, speeds @ R.T + d_rate
        expected = np.einsum("k,ki,kj->ij", masses, carried, there)
        errors.append(np.maximum(gap(out.n, expected, 2), gap(out.p, masses @ carried)))
    return finding(errors, "bodies of eight points")
