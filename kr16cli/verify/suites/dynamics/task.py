"""Task-space dynamics of section 3.6."""

from __future__ import annotations

import numpy as np

from kr16cli import Robot
from kr16cli.robot import Geometry
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.independent.rotations import Array, derivative
from kr16cli.verify.measure import finding, largest, relative
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case


def _state(g: Geometry, q: Array) -> Array:
    """x = (p, phi, theta, psi) of the flange; analytic, so that it takes complex steps."""
    T = poe.flange(g, q)
    c, s = T[..., 0, 0], T[..., 1, 0]
    level = np.sqrt(c * c + s * s)
    angles = [_atan2(s, c), _atan2(-T[..., 2, 0], level), _atan2(T[..., 2, 1], T[..., 2, 2])]
    return np.concatenate([T[..., :3, 3], np.stack(angles, axis=-1)], axis=-1)


def _atan2(y: Array, x: Array) -> Array:
    """atan2 whose complex step is right: the real angle, and its first derivative."""
    if not np.iscomplexobj(y):
        return np.asarray(np.arctan2(y, x))
    size = x.real**2 + y.real**2
    rate = (x.real * y.imag - y.real * x.imag) / size
    return np.asarray(np.arctan2(y.real, x.real) + 1j * rate)


@case(
    "dynamics.task-space",
    title="Task-space forms",
    statement="x' = Ja qd; Ja' = dJa/dt; Mx = Ja^-T M Ja^-1, Cx = (Ja^-T C - Mx Ja') Ja^-1, "
    "Gx = Ja^-T G, so that Mx x'' + Cx x' + Gx = Ja^-T tau",
    regime="0.1 away from all singular families, |theta| < 80 deg, random motions",
    method="x, x' and Ja by complex steps of the product of exponentials; terms by Lagrange",
    grade="B",
    tolerance=1e-9,
    unit="relative",
    reason="two inverses of Jacobians with condition up to 1e3 and 1 / cos(theta) up to 6",
    equations=("3.44", "3.45", "3.46"),
    functions=("kr16cli.Robot.task_space", "kr16cli.model.task.task_space"),
)
def task_space(setting: Setting) -> Finding:
    """The operational forms and what they mean."""
    sampling.need_links(setting.robot.data)
    rng, n = sampling.random(setting, "task"), setting.samples(2000, 50)
    data = setting.robot.data.with_gravity(sampling.TILTED)
    g, robot, other = data.geometry, Robot(data), Lagrangian(data)
    q = sampling.regular(rng, 2 * n, data, 0.1)
    q = q[np.hypot(*np.moveaxis(poe.flange(g, q)[:, :2, 0], -1, 0)) > 0.17]
    qd, qdd = sampling.rates(rng, len(q)), sampling.rates(rng, len(q))
    found = robot.task_space(q, qd)
    units = np.eye(6)

    def analytic(a: Array) -> Array:
        return np.stack([derivative(lambda b: _state(g, b), (a, e)) for e in units], axis=-1)

    Ja = analytic(q)
    h = 1e-5
    Ja_dot = (analytic(q + h * qd) - analytic(q - h * qd)) / (2 * h)
    back = np.linalg.inv(Ja)
    back_t = np.swapaxes(back, -1, -2)
    Mx = back_t @ other.mass_matrix(q) @ back
    Gx = (back_t @ other.gravity(q)[..., None])[..., 0]
    x_dot = derivative(lambda a: _state(g, a), (q, qd))
    x_dot_dot = (found.jacobian_dot @ qd[..., None] + Ja @ qdd[..., None])[..., 0]
    tau = other.inverse_dynamics(q, qd, qdd)
    push = (back_t @ tau[..., None])[..., 0]
    terms = (found.mass_matrix @ x_dot_dot[..., None] + found.coriolis_matrix @ x_dot[..., None])[
        ..., 0
    ] + found.gravity
    held = back_t @ other.coriolis_matrix(q, qd) @ back
    size = np.abs(held).max(axis=(-1, -2)) + np.abs(Mx @ Ja_dot @ back).max(axis=(-1, -2))
    Cx_gap = np.abs(found.coriolis_matrix - (held - Mx @ found.jacobian_dot @ back))
    error = largest(
        relative(found.jacobian, Ja, 2),
        relative(found.jacobian_dot, Ja_dot, 2) * 1e-3,  # a central difference: good to 1e-8
        relative(found.mass_matrix, Mx, 2),
        Cx_gap.max(axis=(-1, -2)) / size,
        relative(found.gravity, Gx),
        relative(terms, push),
    )
    return finding(error, "Ja, Ja', Mx, Cx, Gx and the equation of motion", q=q, qd=qd, qdd=qdd)
