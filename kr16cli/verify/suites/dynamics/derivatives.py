"""Exact derivatives of inverse and forward dynamics."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from kr16cli import Robot
from kr16cli.model import derivatives, dynamics, inertia
from kr16cli.verify import exact, sampling
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.independent.rotations import Array
from kr16cli.verify.measure import COUNT, finding, largest, relative
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.dynamics.common import (
    FROM_ROUNDING,
    VARIANTS,
    Motion,
    motion,
    other_arms,
    variants,
)

_MODEL = (
    "kr16cli.model.derivatives.inverse_dynamics_derivatives",
    "kr16cli.model.derivatives.forward_dynamics_derivatives",
)


def _by_angle(torque: Callable[[Array], Array], q: Array) -> Array:
    """d torque / d q, the angle last.

    Along one angle a torque is a trigonometric polynomial of degree 2, whose derivative is a
    weighted sum of its values an eighth and three eighths of a turn away: no small step at all.
    """
    turns = np.array([np.pi / 4, -np.pi / 4, 3 * np.pi / 4, -3 * np.pi / 4])
    weights = np.array([1.0, -1.0, -1.0, 1.0]) / (8 * np.sin(turns / 2) ** 2)
    moves = turns[:, None, None] * np.eye(6)  # (turn, joint, 6)
    values = torque(q + moves[:, :, None, :])  # all in one call
    return np.asarray(np.einsum("t,tjnk->nkj", weights, values))


def _by_rate(torque: Callable[[Array], Array], qd: Array) -> Array:
    """d torque / d qd: torques are quadratic in qd, so central differences are exact."""
    steps = np.stack([np.eye(6), -np.eye(6)])[:, :, None, :]
    faster, slower = torque(qd + steps)
    return np.asarray(np.moveaxis(faster - slower, 0, -1) / 2)


def _first(m: Motion, n: int) -> Motion:
    return Motion(*(v[:n] for v in m))


def _torque_gap(robot: Robot, other: Lagrangian, m: Motion) -> Array:
    found = robot.inverse_dynamics_derivatives(*m)
    return largest(
        relative(found[0], _by_angle(lambda a: other.inverse_dynamics(a, m.qd, m.qdd), m.q), 2),
        relative(found[1], _by_rate(lambda v: other.inverse_dynamics(m.q, v, m.qdd), m.qd), 2),
        relative(found[2], other.mass_matrix(m.q), 2),
    )


@case(
    "dynamics.torque-derivatives",
    title="Derivatives of inverse dynamics",
    statement="d tau / d q, d tau / d qd, d tau / d qdd of tau = M qdd + C qd + G",
    regime=f"{VARIANTS}; other arms",
    method="Lagrange's torques along one angle (degree 2: four values give the slope), along one "
    "speed (degree 2: two values), and Lagrange's M",
    grade="B",
    tolerance=1e-12,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.38", "3.40", "3.42"),
    functions=("kr16cli.Robot.inverse_dynamics_derivatives", _MODEL[0]),
)
def torque_derivatives(setting: Setting) -> Finding:
    """Against Lagrange, without small steps."""
    m = motion(setting, "torque-derivatives", 100, 4)
    errors = [_torque_gap(robot, other, m) for robot, other in variants(setting)]
    arms = other_arms(setting, "torque-derivatives-arms")
    others = [
        _torque_gap(arm, other, _first(moving, setting.samples(10, 4)))
        for arm, other, moving in arms
    ]
    worst = max(float(v.max()) for v in others)
    text = f"108 derivatives of three robots; {len(others)} other arms within {worst:.1e}"
    return finding(np.maximum(largest(*errors), worst), text, **m._asdict())


@case(
    "dynamics.acceleration-derivatives",
    title="Derivatives of forward dynamics",
    statement="M d qdd / d q = -d tau / d q and M d qdd / d qd = -d tau / d qd at qdd = "
    "M^-1 (tau - C qd - G); M d qdd / d tau = 1; with drives, friction and its slope counted",
    regime="all of joint space, with a payload on a slope; rigid and with drives",
    method="Lagrange's torques along one angle and one speed; general linear solver",
    grade="B",
    tolerance=1e-9,
    unit="relative",
    reason="rounding of qdd, with the condition of M, up to 1e5",
    equations=("3.38", "3.40", "3.42"),
    functions=("kr16cli.Robot.forward_dynamics_derivatives", *_MODEL),
)
def acceleration_derivatives(setting: Setting) -> Finding:
    """Against Lagrange and NumPy's solver."""
    m = motion(setting, "acceleration-derivatives", 100, 4)
    data = setting.robot.data.with_gravity(sampling.TILTED)
    other, v = Lagrangian(data, sampling.LOAD), 0.01
    joints = [(j.coulomb or 0.0, j.viscous or 0.0, j.reflected_inertia) for j in data.joints]
    tau, errors = 100.0 * m.qdd, []
    m.qd[::2] *= 1e-3  # where the friction's slope is steep
    for drives in (False, True):
        coulomb, viscous, rotors = np.array(joints).T * drives
        rub = viscous * m.qd + coulomb * np.sin(np.arctan2(m.qd, v))
        slope = viscous + coulomb * np.cos(np.arctan2(m.qd, v)) ** 3 / v
        M = other.mass_matrix(m.q) + np.diag(rotors)
        rest = tau - rub - other.inverse_dynamics(m.q, m.qd, 0 * m.qd)
        qdd = np.linalg.solve(M, rest[..., None])[..., 0]
        own = Motion(m.q, m.qd, qdd)
        by_q = _by_angle(lambda a, o=own: other.inverse_dynamics(a, o.qd, o.qdd), m.q)  # type: ignore[misc]
        by_qd = _by_rate(lambda a, o=own: other.inverse_dynamics(o.q, a, o.qdd), m.qd)  # type: ignore[misc]
        by_qd = by_qd + slope[:, None, :] * np.eye(6)
        robot = Robot(data, payload=sampling.LOAD, drives=drives)
        found = robot.forward_dynamics_derivatives(m.q, m.qd, tau)
        torques = robot.inverse_dynamics_derivatives(m.q, m.qd, qdd)
        expected = (-by_q, -by_qd, np.broadcast_to(np.eye(6), M.shape))
        errors += [relative(M @ a, b, 2) for a, b in zip(found, expected, strict=True)]
        errors += [relative(a, b, 2) for a, b in zip(torques, (by_q, by_qd, M), strict=True)]
    return finding(largest(*errors), "216 derivatives of two robots", q=m.q, qd=m.qd, tau=tau)


@case(
    "dynamics.derivatives-exact",
    title="Derivatives hold exactly",
    statement="(d tau / d q) u + (d tau / d qd) v + (d tau / d qdd) w = change of tau along "
    "(u, v, w), and the like for qdd and tau",
    regime="rational points of the unit circle; random links and a payload as fractions",
    method="dual numbers over fractions through the recursions",
    grade="C",
    tolerance=COUNT,
    unit="entries that differ",
    reason="exact arithmetic: none may differ",
    equations=("3.38", "3.40", "3.42"),
    functions=(*_MODEL, "kr16cli.model.dynamics.inverse_dynamics"),
)
def derivatives_exact(setting: Setting) -> Finding:
    """Proof at random points."""
    sampling.need_links(setting.robot.data)
    source, n, wrong = random.Random(setting.seed + 7), setting.samples(12, 2), 0
    rng = sampling.random(setting, "derivatives-exact")
    for k in range(n):
        other = sampling.random_robot(rng, setting.robot.data)
        data = exact.robot(setting.robot.data if k % 2 == 0 else exact.rounded(other))
        g, gravity = data.geometry, (*map(Fraction, (17, -23)), Fraction(-91, 10))
        full = inertia.robot_bodies(data.links, exact.payload(sampling.LOAD), g)
        bodies = full if k % 2 else inertia.regroup(full, g)
        cs = exact.turns(source)
        qd, qdd, u, v, w, rotors = ([exact.number(source, 20) for _ in range(6)] for _ in range(6))
        fixed: Any = (bodies, g, gravity, rotors)
        moved = exact.dual_turns(cs, u)
        rates = [exact.Dual(a, b) for a, b in zip(qd, v, strict=True)]
        pushes = [exact.Dual(a, b) for a, b in zip(qdd, w, strict=True)]
        change = [
            exact.derivative(t) for t in dynamics.inverse_dynamics(moved, rates, pushes, *fixed)
        ]
        found = derivatives.inverse_dynamics_derivatives(cs, qd, qdd, *fixed)
        wrong += exact.unequal([_along(found, (u, v, w))], [change])
        tau = dynamics.inverse_dynamics(cs, qd, qdd, *fixed)
        answer = derivatives.forward_dynamics_derivatives(cs, qd, tau, *fixed)
        wrong += exact.unequal([_along(answer, (u, v, change))], [w])
    return Finding(float(wrong), n, {}, f"12 entries at each of {n} points, two kinds of robot")


def _along(found: derivatives.Derivatives, directions: tuple[list[Any], ...]) -> list[Any]:
    """The derivatives applied to a direction."""
    rows = zip(*found, strict=True)
    return [
        sum(
            a * b
            for row, d in zip(parts, directions, strict=True)
            for a, b in zip(row, d, strict=True)
        )
        for parts in rows
    ]
