"""Identities of the recursions proved with fractions and dual numbers: no rounding at all."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

from kr16cli.model import coriolis, dynamics, inertia
from kr16cli.verify import exact, sampling
from kr16cli.verify.measure import COUNT
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case


def _vectors(source: random.Random) -> tuple[list[Any], list[Any]]:
    """Small random fractions as joint speeds and accelerations."""
    one, other = ([exact.number(source, 20) for _ in range(6)] for _ in range(2))
    return one, other


@case(
    "dynamics.exact",
    title="Identities of the equations of motion hold exactly",
    statement="tau = M qdd + C qd + G; C + C^T = M'; C qd = sum qd_i qd_j C_k(i, j); "
    "columns of M = tau(0, e_j) - G; regrouped = full set; M (M^-1 b) = b",
    regime="rational points of the unit circle; random links and a payload as fractions",
    method="fractions and dual numbers through the model; a false identity survives one point "
    "with a chance below 1e-2",
    grade="C",
    tolerance=COUNT,
    unit="entries that differ",
    reason="exact arithmetic: none may differ",
    equations=("3.38", "3.40", "3.41", "3.42"),
    functions=(
        "kr16cli.model.dynamics.newton_euler",
        "kr16cli.model.dynamics.mass_matrix",
        "kr16cli.model.coriolis.coriolis_matrix",
        "kr16cli.model.inertia.regroup",
        "kr16cli.model.dynamics.solve_symmetric",
    ),
)
def exactly(setting: Setting) -> Finding:
    """Proof at random points."""
    sampling.need_links(setting.robot.data)
    source, n, wrong = random.Random(setting.seed), setting.samples(12, 1), 0
    rng = sampling.random(setting, "exact")
    for k in range(n):
        other = sampling.random_robot(rng, setting.robot.data)
        data = exact.robot(setting.robot.data if k % 2 else exact.rounded(other))
        g, gravity = data.geometry, data.gravity
        full = inertia.robot_bodies(data.links, exact.payload(sampling.LOAD), g)
        bodies = inertia.regroup(full, g)
        cs, (qd, qdd) = exact.turns(source), _vectors(source)

        def tau(speed: Any, acceleration: Any, of: Any = bodies, at: Any = cs) -> list[Any]:
            return dynamics.inverse_dynamics(at, speed, acceleration, of, g, gravity)  # noqa: B023

        rest: list[Any] = [Fraction(0)] * 6
        M = dynamics.mass_matrix(cs, bodies, g)
        C = coriolis.coriolis_matrix(cs, qd, bodies, g)
        G = dynamics.gravity_torque(cs, bodies, g, gravity)
        terms = [a + b + c for a, b, c in zip(_times(M, qdd), _times(C, qd), G, strict=True)]
        wrong += exact.unequal([tau(qd, qdd)], [terms])
        wrong += exact.unequal([tau(qd, qdd, full)], [terms])
        wrong += exact.unequal(dynamics.mass_matrix(cs, full, g), M)
        wrong += exact.unequal(coriolis.coriolis_matrix(cs, qd, full, g), C)
        columns = [[Fraction(i == j) for i in range(6)] for j in range(6)]
        by_column = [[t - b for t, b in zip(tau(rest, e), G, strict=True)] for e in columns]
        wrong += exact.unequal(by_column, M)
        moving = dynamics.mass_matrix(exact.dual_turns(cs, qd), bodies, g)
        M_dot = [[exact.derivative(v) for v in row] for row in moving]
        both = [[C[i][j] + C[j][i] for j in range(6)] for i in range(6)]
        wrong += exact.unequal(both, M_dot)
        symbols = coriolis.christoffel(cs, bodies, g)
        summed = [[sum(qd[i] * ck[i][j] for i in range(6)) for j in range(6)] for ck in symbols]
        wrong += exact.unequal(summed, C)
        solved = dynamics.solve_symmetric(M, qdd)
        wrong += exact.unequal([_times(M, solved)], [qdd])
    text = f"about 200 entries at each of {n} points; random links, in a full run this robot's too"
    return Finding(float(wrong), n, {}, text)


def _times(matrix: list[list[Any]], vector: list[Any]) -> list[Any]:
    return [sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix]
