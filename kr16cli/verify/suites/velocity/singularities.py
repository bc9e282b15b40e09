"""The determinant, its three factors, and the small-matrix routines that single queries use."""

from __future__ import annotations

import math
import random

import numpy as np

from kr16cli import linear
from kr16cli.model import forward
from kr16cli.model import jacobian as model
from kr16cli.robot import Geometry
from kr16cli.verify import exact, sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.measure import COUNT, finding, gap, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case

_DET = ("kr16cli.Robot.singularity", "kr16cli.model.jacobian.determinant")


@case(
    "velocity.determinant",
    title="det J is the product of three singular families",
    statement="det J = a2 s5 (a3 c3 + d4 s3) (a1 + a2 c2 + d4 c23 - a3 s23), (3.37)",
    regime="all of joint space",
    method="LU determinant of the product of exponentials' Jacobian; factors as distances",
    grade="B",
    tolerance=1e-14,
    unit="m3, m",
    reason="6x6 elimination of entries up to 2",
    equations=("3.37",),
    functions=_DET,
)
def determinant(setting: Setting) -> Finding:
    """The factors and their product."""
    rng, robot = sampling.random(setting, "determinant"), setting.robot
    g = robot.data.geometry
    q = sampling.generic(rng, setting.samples(20000, 1000))
    tip = poe.zero_flange(g)[:3, 3]
    found = robot.singularity(q)
    error = largest(
        np.abs(found.determinant - np.linalg.det(poe.jacobian(g, q, tip))),
        np.abs(found.shoulder - poe.forward_of_column(g, q)),
        np.abs(found.elbow - poe.elbow_side(g, q)),
        np.abs(found.wrist - np.sin(q[:, 4])),
    )
    return finding(error, "determinant and its three factors", q=q)


@case(
    "velocity.determinant-exact",
    title="The factorised determinant is exact",
    statement="det J - a2 s5 (a3 c3 + d4 s3) (a1 + a2 c2 + d4 c23 - a3 s23) = 0",
    regime="rational points of the unit circle, random rational lengths",
    method="fraction elimination; a false identity survives one point with a chance below 1e-2",
    grade="C",
    tolerance=COUNT,
    unit="points that differ",
    reason="exact arithmetic: none may differ",
    equations=("3.37",),
    functions=_DET,
)
def determinant_exact(setting: Setting) -> Finding:
    """An identity proved at random points."""
    source, n, wrong = random.Random(setting.seed), setting.samples(40, 5), 0
    for _ in range(n):
        g = Geometry(*(abs(exact.number(source, 100)) for _ in range(6)))  # type: ignore[arg-type]
        cs = exact.turns(source)
        a = forward.arm(cs, g)
        rows = model.jacobian(a, a.flange_p)
        wrong += exact.determinant(rows) != model.determinant(cs, g)
    return Finding(float(wrong), n, {}, f"{n} points, each with other lengths")


@case(
    "velocity.rates-exact",
    title="The Jacobian is the pose's derivative and J' is its own, exactly",
    statement="J_v e_i = dp/dq_i; J' = dJ/dt along qd",
    regime="rational points of the unit circle, random rational lengths",
    method="dual numbers over fractions through the model's flange and Jacobian",
    grade="C",
    tolerance=COUNT,
    unit="entries that differ",
    reason="exact arithmetic: none may differ",
    equations=("3.30", "3.47", "3.48", "3.49"),
    functions=("kr16cli.model.jacobian.jacobian", "kr16cli.model.jacobian.jacobian_dot"),
)
def rates_exact(setting: Setting) -> Finding:
    """Derivatives without rounding."""
    source, n, wrong = random.Random(setting.seed), setting.samples(20, 3), 0
    for _ in range(n):
        g = Geometry(*(abs(exact.number(source, 100)) for _ in range(6)))  # type: ignore[arg-type]
        cs, qd = exact.turns(source), [exact.number(source, 20) for _ in range(6)]
        a, moving = forward.arm(cs, g), forward.arm(exact.dual_turns(cs, qd), g)
        J, changed = model.jacobian(a, a.flange_p), model.jacobian(moving, moving.flange_p)
        rate = [[exact.derivative(v) for v in row] for row in changed]
        wrong += exact.unequal(model.jacobian_dot(a, a.flange_p, qd), rate)
        velocity = [sum(v * s for v, s in zip(row, qd, strict=True)) for row in J[:3]]
        wrong += exact.unequal([velocity], [[exact.derivative(v) for v in moving.flange_p]])
    return Finding(float(wrong), n, {}, f"39 entries at each of {n} points")


@case(
    "velocity.singular-families",
    title="On each family the Jacobian loses rank, and the factor says so",
    statement="factor = 0 and smallest singular value = 0 on the family; `sine` is the factor over "
    "its largest value; `near` means |sine| < 1e-3",
    regime="on each family, and within 1e-3 .. 1e-12 of it",
    method="singular values by LAPACK of the product of exponentials' Jacobian",
    grade="B",
    tolerance=1e-13,
    unit="1",
    reason="rounding of a distance over the reach",
    equations=("3.37",),
    functions=("kr16cli.Arm.singularities", "kr16cli.model.jacobian.singular_families"),
)
def families(setting: Setting) -> Finding:
    """Which family is near, and by how much."""
    rng, robot = sampling.random(setting, "families"), setting.robot
    g, n = robot.data.geometry, setting.samples(100, 20)
    forearm = math.hypot(g.a3, g.d4)
    largest_value = (g.a1 + g.a2 + forearm, forearm, 1.0)
    errors, angles = [], []
    for name, (_, draw) in sampling.REGIMES.items():
        q = draw(rng, n, robot.data)
        sigma = np.linalg.svd(poe.jacobian(g, q, poe.zero_flange(g)[:3, 3]), compute_uv=False)
        lost = sigma[:, -1] > 1e-12 if name.startswith("on-") else np.zeros(n, dtype=bool)
        truth = (poe.forward_of_column(g, q), poe.elbow_side(g, q), np.sin(q[:, 4]))
        for i, row in enumerate(q.tolist()):
            said = robot.arm.singularities(row)
            off = [
                max(
                    abs(s.factor - t[i]),
                    abs(s.sine - t[i] / top),
                    np.inf if s.near != (abs(s.sine) < 1e-3) else 0.0,
                )
                for s, t, top in zip(said, truth, largest_value, strict=True)
            ]
            named = [s.family for s in said] == ["shoulder", "elbow", "wrist"]
            errors.append(np.inf if lost[i] or not named else max(off))
        angles.append(q)
    return finding(errors, "factors, sines and warnings", q=np.concatenate(angles))


@case(
    "velocity.linear",
    title="Singular values and inverse without NumPy",
    statement="singular_values(A), inverse(A) of 6x6 matrices",
    regime="Jacobians all over joint space, singular ones among them",
    method="LAPACK",
    grade="A",
    tolerance=1e-13,
    unit="relative",
    reason="both are backward stable; errors are measured against the largest singular value",
    functions=("kr16cli.linear.singular_values", "kr16cli.linear.inverse"),
)
def small_matrices(setting: Setting) -> Finding:
    """What single queries compute with."""
    rng, robot = sampling.random(setting, "linear"), setting.robot
    n = setting.samples(200, 20)
    regular = sampling.regular(rng, n, robot.data, 0.1)
    q = np.concatenate([regular, sampling.on_wrist(rng, n, robot.data)])
    errors = []
    for i, J in enumerate(robot.jacobian(q)):
        sigma = np.linalg.svd(J, compute_uv=False)
        error = gap(linear.singular_values(J.tolist()), sigma) / sigma[0]
        if i < n:
            residual = np.array(linear.inverse(J.tolist())) @ J - np.eye(6)
            error = max(error, np.abs(residual).max() * sigma[-1] / sigma[0])
        errors.append(float(error))
    return finding(errors, "singular values, and inverses of the regular half", q=q)
