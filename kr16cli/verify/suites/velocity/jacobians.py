"""Jacobians of points on any link, in any axes, and their rates."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np

from kr16cli import InputError, Robot
from kr16cli.model.scalars import FLOATS
from kr16cli.model.view import View
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, axial, derivative
from kr16cli.verify.measure import COUNT, finding, gap, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case

_J = ("kr16cli.Robot.jacobian", "kr16cli.model.jacobian.jacobian", "kr16cli.model.view.View")
_J_DOT = ("kr16cli.Robot.jacobian_dot", "kr16cli.model.jacobian.jacobian_dot")
_AXES: tuple[Literal["robroot", "flange", "chapter"], ...] = ("robroot", "flange", "chapter")


def _choices(rng: sampling.Random) -> list[tuple[int, Array | None]]:
    """Every link with its frame's origin, and with a point off it."""
    return [(i, p) for i in range(1, 7) for p in (None, rng.uniform(-0.4, 0.4, 3))]


def _at_zero(robot: Robot, link: int, point: Array | None) -> Array:
    """Where a point given in the link's frame is at the zero pose, robroot."""
    g, own = robot.data.geometry, np.zeros(3) if point is None else point
    if link == 6:
        place = poe.zero_flange(g)
    else:
        place = poe.ROBROOT_OF_BASE @ poe.dh_frames(g, np.zeros(6))[link]
    return poe.carried(place, own)


def _turned(robot: Robot, q: Array, rows: Array, axes: str) -> Array:
    """Both halves of a Jacobian in other axes."""
    if axes == "robroot":
        return rows
    R = poe.flange(robot.data.geometry, q) if axes == "flange" else poe.ROBROOT_OF_BASE
    back = np.swapaxes(R[..., :3, :3], -1, -2)
    return np.concatenate([back @ rows[..., :3, :], back @ rows[..., 3:, :]], axis=-2)


@case(
    "velocity.jacobian",
    title="Jacobian of any point on any link, in three sets of axes",
    statement="Column i = (z_i x (p - o_i), z_i) for i <= link, else 0; linear rows first",
    regime="all of joint space; twelve points on six links; axes robroot, flange, chapter",
    method="axes and points carried by the product of exponentials",
    grade="B",
    tolerance=2e-14,
    unit="m, 1",
    reason="products of lengths up to 2 m after six rounded matrices",
    equations=("3.30", "3.31", "3.32", "3.33", "3.34", "3.35", "3.36"),
    functions=_J,
)
def jacobian(setting: Setting) -> Finding:
    """Jacobians by another formula."""
    rng, robot = sampling.random(setting, "jacobian"), setting.robot.with_tool(None)
    q = sampling.generic(rng, setting.samples(2000, 100))
    errors = []
    for link, point in _choices(rng):
        rows = poe.jacobian(robot.data.geometry, q, _at_zero(robot, link, point), link)
        for axes in _AXES:
            own = robot.jacobian(q, link=link, point=point, axes=axes)
            errors.append(gap(own, _turned(robot, q, rows, axes), 2))
    return finding(largest(*errors), "36 Jacobians of every configuration", q=q)


@case(
    "velocity.derivative",
    title="The Jacobian is the derivative of the pose",
    statement="J qd = (p', omega) with omega from R' R^T",
    regime="all of joint space, random joint speeds",
    method="complex step through the product of exponentials",
    grade="B",
    tolerance=1e-13,
    unit="m/s, rad/s",
    reason="complex steps subtract nothing: rounding only, speeds up to 3 rad/s",
    equations=("3.30", "3.31"),
    functions=_J,
)
def pose_rate(setting: Setting) -> Finding:
    """J against the pose itself."""
    rng, robot = sampling.random(setting, "derivative"), setting.robot.with_tool(None)
    n = setting.samples(10000, 500)
    q, qd = sampling.generic(rng, n), sampling.rates(rng, n)
    T = poe.flange(robot.data.geometry, q)
    rate = derivative(lambda a: poe.flange(robot.data.geometry, a), (q, qd))
    omega = axial(rate[:, :3, :3] @ np.swapaxes(T[:, :3, :3], -1, -2))
    twist = (robot.jacobian(q) @ qd[..., None])[..., 0]
    error = gap(twist, np.concatenate([rate[:, :3, 3], omega], axis=-1))
    return finding(error, "flange twist", q=q, qd=qd)


@case(
    "velocity.difference",
    title="Central differences of the pose approach the Jacobian",
    statement="(p(q + h e_i) - p(q - h e_i)) / 2h = J e_i + O(h^2)",
    regime="all of joint space; h from 1e-1 to 1e-9",
    method="the model's own fk, differenced; the best step's error is judged",
    grade="C",
    tolerance=1e-9,
    unit="m",
    reason="h^2 truncation and 1e-16 / h rounding meet near h = 1e-5 at about 1e-11",
    equations=("3.30",),
    functions=(*_J, "kr16cli.Robot.fk"),
)
def difference(setting: Setting) -> Finding:
    """The V-shaped error: truncation, then rounding."""
    rng, robot = sampling.random(setting, "difference"), setting.robot.with_tool(None)
    q = sampling.generic(rng, setting.samples(200, 40))
    J = robot.jacobian(q)[:, :3]
    steps = 10.0 ** -np.arange(1.0, 9.5, 0.5)
    errors = []
    for h in steps:
        columns = [
            (robot.fk(q + h * e)[:, :3, 3] - robot.fk(q - h * e)[:, :3, 3]) / (2 * h)
            for e in np.eye(6)
        ]
        errors.append(gap(np.stack(columns, axis=-1), J, 2))
    curve = np.max(errors, axis=1)
    best = int(np.argmin(curve))
    figures = {"step": steps.tolist(), "error": curve.tolist()}
    return finding(errors[best], f"smallest at h = {steps[best]:.0e} rad", figures=figures, q=q)


@case(
    "velocity.jacobian-dot",
    title="Rate of the Jacobian of any point on any link",
    statement="J' = dJ/dt along qd (3.47)-(3.51); given axes stand still",
    regime="all of joint space, random joint speeds; twelve points, three sets of axes",
    method="complex step through the Jacobian of the product of exponentials",
    grade="B",
    tolerance=1e-13,
    unit="m/s, rad/s",
    reason="complex steps subtract nothing; speeds up to 3 rad/s on six joints",
    equations=("3.47", "3.48", "3.49", "3.50", "3.51"),
    functions=_J_DOT,
)
def jacobian_dot(setting: Setting) -> Finding:
    """J-dot by another method."""
    rng, robot = sampling.random(setting, "jacobian-dot"), setting.robot.with_tool(None)
    n, g = setting.samples(2000, 100), setting.robot.data.geometry
    q, qd = sampling.generic(rng, n), sampling.rates(rng, n)
    errors = []
    for link, point in _choices(rng):
        at_zero = _at_zero(robot, link, point)
        rows = derivative(lambda a, p=at_zero, k=link: poe.jacobian(g, a, p, k), (q, qd))
        for axes in _AXES:
            own = robot.jacobian_dot(q, qd, link=link, point=point, axes=axes)
            errors.append(gap(own, _turned(robot, q, rows, axes), 2))
    return finding(largest(*errors), "36 rates of every configuration", q=q, qd=qd)


@case(
    "velocity.mass-centres",
    title="Jacobians of the mass centres",
    statement="The velocity of mass centre i is J_ci qd (3.31)-(3.36)",
    regime="all of joint space, random joint speeds",
    method="complex step through independent mass centres; points handed over in link frames too",
    grade="B",
    tolerance=1e-13,
    unit="m/s",
    reason="rounding only",
    equations=("3.31", "3.32", "3.33", "3.34", "3.35", "3.36"),
    functions=(*_J, "kr16cli.Robot.mass_centres", "kr16cli.Robot.mass_centre_jacobians"),
)
def mass_centres(setting: Setting) -> Finding:
    """Points that a user would ask for."""
    from kr16cli.verify.independent.lagrange import Lagrangian

    robot = setting.robot.with_tool(None)
    sampling.need_links(robot.data)
    rng, n = sampling.random(setting, "mass-centres"), setting.samples(2000, 100)
    q, qd = sampling.generic(rng, n), sampling.rates(rng, n)
    other = Lagrangian(robot.data, robot.payload)
    velocity = derivative(other.mass_centres, (q, qd))
    frames, tables = robot.frames(q[:1]), robot.mass_centre_jacobians(q)
    errors = [gap((tables @ qd[:, None, :, None])[:, :, :3, 0], velocity, 2)]
    for i, centre in enumerate(robot.mass_centres(q[:1])[0], 1):
        frame = frames.flange[0] if i == 6 else frames.dh[0, i]
        point = frame[:3, :3].T @ (centre - frame[:3, 3])
        twist = (robot.jacobian(q, link=i, point=point) @ qd[..., None])[..., 0]
        errors.append(gap(twist[:, :3], velocity[:, i - 1]))
    return finding(largest(*errors), "six velocities", q=q, qd=qd)


@case(
    "velocity.links",
    title="Links are 1 to 6; without a link it is the flange's",
    statement="links 0, 7 and -1 are refused; a view without link, point and axes is the flange's "
    "Jacobian in robroot axes",
    regime="links beside the range",
    method="errors caught; the default view against the flange's Jacobian",
    grade="C",
    tolerance=COUNT,
    unit="wrong answers",
    reason="an answer is right or wrong",
    functions=("kr16cli.Robot.jacobian", "kr16cli.model.view.View"),
)
def links(setting: Setting) -> Finding:
    """The edge of the argument."""
    robot, rest = setting.robot.with_tool(None), [0.1, -0.9, 0.8, 0.3, 0.5, -0.2]
    accepted = 0
    for link in (0, 7, -1):
        for ask in (robot.jacobian, robot.arm.jacobian):
            try:
                ask(rest, link=link)
            except InputError:
                continue
            accepted += 1
    view = View(robot.data.geometry).jacobian(FLOATS.trig(rest))
    own = np.array([[float(v) for v in row] for row in view])
    off = float(gap(own, robot.jacobian(rest), 2)) > 1e-15
    return Finding(float(accepted + off), 7, {}, f"{accepted} wrong links accepted")


@case(
    "velocity.single",
    title="One configuration on floats",
    statement="Arm.jacobian, jacobian_dot and determinant equal the arrays'",
    regime="all of joint space",
    method="single queries against a batch, for all links, points and axes",
    grade="D",
    tolerance=1e-14,
    unit="m, 1",
    reason="the same formulas; only the functions of sine and cosine differ",
    functions=("kr16cli.Arm.jacobian", "kr16cli.Arm.jacobian_dot", "kr16cli.Arm.determinant"),
)
def single(setting: Setting) -> Finding:
    """The float path."""
    rng, robot = sampling.random(setting, "single-J"), setting.robot.with_tool(None)
    n, arm = setting.samples(60, 5), setting.robot.arm
    q, qd = sampling.generic(rng, n), sampling.rates(rng, n)
    factors = robot.singularity(q)
    error = np.abs([arm.determinant(row) for row in q.tolist()] - factors.determinant)
    for k, (link, point) in enumerate(_choices(rng)):
        view: dict[str, Any] = {"link": link, "point": None if point is None else point.tolist()}
        axes = _AXES[k % 3]
        J, J_dot = (
            robot.jacobian(q, axes=axes, **view),
            robot.jacobian_dot(q, qd, axes=axes, **view),
        )
        for i, (row, rate) in enumerate(zip(q.tolist(), qd.tolist(), strict=True)):
            own = gap(arm.jacobian(row, axes=axes, **view), J[i], 2)
            own_dot = gap(arm.jacobian_dot(row, rate, axes=axes, **view), J_dot[i], 2)
            error[i] = max(error[i], float(own), float(own_dot) / math.tau)
    return finding(error, "twelve points in turn in three sets of axes", q=q, qd=qd)
