"""Identities of the equations of motion, and the bound that proves M positive definite."""

from __future__ import annotations

import math

import numpy as np

from kr16cli import Robot
from kr16cli.verify import sampling
from kr16cli.verify.independent.lagrange import Lagrangian, bodies
from kr16cli.verify.independent.rotations import derivative
from kr16cli.verify.measure import finding, gap, largest, relative
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.dynamics.common import (
    FROM_ROUNDING,
    VARIANTS,
    Motion,
    motion,
    over_variants,
)


@case(
    "dynamics.sum-of-terms",
    title="The terms add up to the torques",
    statement="inverse_dynamics = M qdd + C qd + G; C qd = sum qd_i qd_j C_k(i, j)",
    regime=VARIANTS,
    method="composite bodies and Christoffel recursion against Newton-Euler",
    grade="C",
    tolerance=1e-12,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.38", "3.40", "3.41", "3.42"),
    functions=("kr16cli.Robot.inverse_dynamics", "kr16cli.Robot.coriolis_matrix"),
)
def sum_of_terms(setting: Setting) -> Finding:
    """Three recursions agree."""

    def compare(robot: Robot, _: Lagrangian, m: Motion) -> sampling.Array:
        tau = robot.inverse_dynamics(*m)
        swing = (robot.coriolis_matrix(m.q, m.qd) @ m.qd[..., None])[..., 0]
        terms = (robot.mass_matrix(m.q) @ m.qdd[..., None])[..., 0] + swing + robot.gravity(m.q)
        twice = np.einsum("nkij,ni,nj->nk", robot.christoffel(m.q), m.qd, m.qd)
        return largest(relative(terms, tau), relative(twice, swing))

    return over_variants(setting, "sum-of-terms", (10000, 300), compare, "six torques")


@case(
    "dynamics.skew",
    title="M' - 2 C is skew",
    statement="M' - 2 C + (M' - 2 C)^T = 0, with M' = dM/dt along qd",
    regime=VARIANTS,
    method="M' by complex step of the independent kinetic energy",
    grade="B",
    tolerance=1e-12,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.41",),
    functions=("kr16cli.Robot.coriolis_matrix",),
)
def skew(setting: Setting) -> Finding:
    """Passivity."""

    def compare(robot: Robot, other: Lagrangian, m: Motion) -> sampling.Array:
        M_dot = derivative(other.mass_matrix, (m.q, m.qd))
        C = robot.coriolis_matrix(m.q, m.qd)
        return relative(C + np.swapaxes(C, -1, -2), M_dot, 2)

    return over_variants(setting, "skew", (3000, 150), compare, "C + C^T - M'", "q qd")


@case(
    "dynamics.positive-definite",
    title="M is positive definite everywhere, by a bound",
    statement="lambda_min(M) >= min_i lambda_min(I_i) / 4, I_i about the mass centre of link i. "
    "Proof: 2 T >= sum lambda_i |w_i|^2, and qd_i z_i = w_i - w_(i-1) gives "
    "sum qd_i^2 <= sum 2 (|w_i|^2 + |w_(i-1)|^2) <= 4 sum |w_i|^2",
    regime=f"{VARIANTS}, and every singular family",
    method="the bound from the file's inertias; eigenvalues by LAPACK; M symmetric to the last bit",
    grade="C",
    tolerance=1.0,
    unit="bound / lambda_min",
    reason="proved for every q; a ratio above 1 or below 0 would contradict the proof",
    equations=("3.38",),
    functions=("kr16cli.Robot.mass_matrix",),
)
def positive_definite(setting: Setting) -> Finding:
    """A proof, and its check."""
    data = setting.robot.data
    sampling.need_links(data)
    rng, n = sampling.random(setting, "positive"), setting.samples(3000, 60)
    q = sampling.joined([draw(rng, n, data) for _, draw in sampling.REGIMES.values()])
    ratios, least = [], math.inf
    for load in (None, sampling.LOAD):
        inertias = [body.inertia for body in bodies(data, load)]
        bound = min(float(np.linalg.eigvalsh(tensor)[0]) for tensor in inertias) / 4
        M = Robot(data, payload=load).mass_matrix(q)
        symmetric = (np.swapaxes(M, -1, -2) == M).all(axis=(1, 2))
        smallest = np.linalg.eigvalsh(M)[:, 0]
        least = min(least, float(smallest.min()))
        good = symmetric & (smallest > 0) & (bound > 0)
        ratios.append(np.where(good, bound / smallest, np.inf))
    text = f"smallest eigenvalue {least:.3g} kg m2 over {len(q)} configurations, twice"
    return finding(largest(*ratios), text, q=q)


@case(
    "dynamics.first-joint",
    title="Nothing depends on A1 where gravity is vertical",
    statement="M, C, G and tau are the same for every q1; G_1 = 0",
    regime="all of joint space, gravity along z",
    method="q1 changed at random",
    grade="C",
    tolerance=1e-12,
    unit="relative",
    reason="the recursions never use q1 where gravity is vertical",
    equations=("3.38", "3.41", "3.42"),
    functions=("kr16cli.Robot.mass_matrix", "kr16cli.Robot.coriolis_matrix"),
)
def first_joint(setting: Setting) -> Finding:
    """Symmetry about the vertical."""
    m = motion(setting, "first-joint", 3000, 200)
    robot = Robot(setting.robot.data.with_gravity((0.0, 0.0, -9.81)), payload=sampling.LOAD)
    turned = m._replace(q=sampling.with_joint(m.q, 1, m.q[::-1, 0]))
    error = largest(
        relative(robot.mass_matrix(turned.q), robot.mass_matrix(m.q), 2),
        relative(robot.coriolis_matrix(turned.q, m.qd), robot.coriolis_matrix(m.q, m.qd), 2),
        relative(robot.inverse_dynamics(*turned), robot.inverse_dynamics(*m)),
        gap(robot.gravity(turned.q), robot.gravity(m.q)) / 1e3,
        np.abs(robot.gravity(m.q)[:, 0]) / 1e3,
    )
    return finding(error, "M, C, G and tau at two values of q1", **m._asdict())


@case(
    "dynamics.power",
    title="Power of the torques is the rate of energy",
    statement="tau . qd = d/dt (T + P)",
    regime=VARIANTS,
    method="central difference of the energies along the motion, Richardson's extrapolation",
    grade="C",
    tolerance=1e-7,
    unit="relative",
    reason="fourth-order differences with h = 1e-3 s: 1e-12 truncation, 1e-13 / h rounding",
    equations=("3.38", "3.41", "3.42", "3.43"),
    functions=("kr16cli.Robot.energy", "kr16cli.Robot.inverse_dynamics"),
)
def power(setting: Setting) -> Finding:
    """Work and energy."""

    def compare(robot: Robot, _: Lagrangian, m: Motion) -> sampling.Array:
        def total(t: float) -> sampling.Array:
            q = m.q + m.qd * t + m.qdd * (t * t / 2)
            return np.asarray(sum(robot.energy(q, m.qd + m.qdd * t)))

        h = 1e-3
        rate = (8 * (total(h) - total(-h)) - (total(2 * h) - total(-2 * h))) / (12 * h)
        tau = robot.inverse_dynamics(*m)
        power = (tau * m.qd).sum(axis=1)
        size = np.maximum(np.abs(tau * m.qd).sum(axis=1), 1.0)
        return np.asarray(np.abs(rate - power) / size)

    return over_variants(setting, "power", (3000, 150), compare, "tau . qd")


@case(
    "dynamics.time-reversal",
    title="A film run backwards needs the same torques",
    statement="tau(q, -qd, qdd) = tau(q, qd, qdd) without friction; C(q, 2 qd) = 2 C(q, qd)",
    regime=VARIANTS,
    method="signs and factors of qd changed",
    grade="C",
    tolerance=1e-12,
    unit="relative",
    reason=FROM_ROUNDING,
    functions=("kr16cli.Robot.inverse_dynamics", "kr16cli.Robot.coriolis_matrix"),
)
def time_reversal(setting: Setting) -> Finding:
    """Even in the speeds."""

    def compare(robot: Robot, _: Lagrangian, m: Motion) -> sampling.Array:
        back = m._replace(qd=-m.qd)
        C = robot.coriolis_matrix(m.q, m.qd)
        return largest(
            relative(robot.inverse_dynamics(*back), robot.inverse_dynamics(*m)),
            relative(robot.coriolis_matrix(m.q, 2 * m.qd), 2 * C, 2),
        )

    return over_variants(setting, "time-reversal", (5000, 200), compare, "tau and C")


@case(
    "dynamics.base-statics",
    title="At rest the foundation carries the weight, and A1's torque is the base's moment",
    statement="force = -(sum m) g and moment = -sum p_c x m g at rest; tau_1 = -moment_z in motion",
    regime="all of joint space, gravity along no axis",
    method="masses and mass centres; torque of A1 from inverse dynamics",
    grade="C",
    tolerance=1e-12,
    unit="relative",
    reason=FROM_ROUNDING,
    functions=("kr16cli.Robot.base_wrench", "kr16cli.Robot.mass_centres"),
)
def base_statics(setting: Setting) -> Finding:
    """The wrench at rest and about A1."""
    m = motion(setting, "base-statics", 3000, 200)
    data = setting.robot.data.with_gravity(sampling.TILTED)
    robot, other = Robot(data, payload=sampling.LOAD), Lagrangian(data, sampling.LOAD)
    still = robot.base_wrench(m.q, 0 * m.q, 0 * m.q)
    masses = np.array([body.mass for body in other.bodies])
    push = -masses[:, None] * np.array(sampling.TILTED)
    moment = np.cross(robot.mass_centres(m.q), push).sum(axis=1)
    expected = np.concatenate([np.broadcast_to(push.sum(axis=0), moment.shape), moment], axis=1)
    moving, tau = robot.base_wrench(*m), robot.inverse_dynamics(*m)
    size = np.abs(moving).max(axis=1)
    error = largest(relative(still, expected), np.abs(moving[:, 5] + tau[:, 0]) / size)
    return finding(error, "weight, its moment, and the moment about A1", **m._asdict())
