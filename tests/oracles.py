"""A second model of the arm, for the tests: another method, another form, no code in common.

Nothing of `kr16cli` is imported. The chain is a product of exponentials about joint axes read
off the zero pose in robroot (x forward, y left, z up), or the literal matrix product of
Table 3.1; dynamics is Lagrange's, by summing over links (3.38) and differentiating by complex
step or dual numbers. All functions take (cos, sin) arrays of any dtype, fractions among them.

A geometry is anything with d1 a1 a2 a3 d4 d6; a link anything with mass, com, inertia, frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from duals import Array, Dual, dual_turns, eps, real

AXES = np.array([[0, 0, -1], [0, 1, 0], [0, 1, 0], [-1, 0, 0], [0, 1, 0], [-1, 0, 0]])
"""Joint axes A1 to A6 at the zero pose, robroot; positive turns are KUKA's."""


def turns(q: npt.ArrayLike) -> tuple[Array, Array]:
    """(cos, sin) arrays of angles."""
    return np.cos(q), np.sin(q)


def rational_turn(t: Any) -> tuple[Any, Any]:
    """The point of the unit circle with half-angle tangent t; rational for rational t."""
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


# Kinematics ---------------------------------------------------------------------------------


def points(g: Any) -> Array:
    """A point on each joint axis at the zero pose, m: A1 at height d1, A4 to A6 in the wrist."""
    wrist = [g.a1 + g.a2 + g.d4, 0, g.d1 - g.a3]
    return np.array([[0, 0, g.d1], [g.a1, 0, g.d1], [g.a1 + g.a2, 0, g.d1], wrist, wrist, wrist])


def zero_flange(g: Any) -> Array:
    """T_robroot_flange at the zero pose: d6 in front of the wrist, B = 90 degrees."""
    return np.array(
        [[0, 0, 1, g.a1 + g.a2 + g.d4 + g.d6], [0, 1, 0, 0], [-1, 0, 0, g.d1 - g.a3], [0, 0, 0, 1]]
    )


def skew(v: Array) -> Array:
    """[v]x: [v]x w = v x w."""
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def motions(g: Any, c: Array, s: Array) -> list[Array]:
    """Motions E_0 (none) to E_6 of the links from the zero pose, 4x4 in robroot.

    E_i = e^[xi_1] q_1 ... e^[xi_i] q_i, each factor by Rodrigues' formula. c and s are (..., 6).
    """
    dtype = np.result_type(c.dtype, points(g).dtype)
    total = np.broadcast_to(np.eye(4, dtype=dtype), (*c.shape[:-1], 4, 4))
    result = [total]
    for i, (axis, point) in enumerate(zip(AXES, points(g), strict=True)):
        ci, si = c[..., i, None, None], s[..., i, None, None]
        rotation = ci * np.eye(3, dtype=int) + si * skew(axis) + (1 - ci) * np.outer(axis, axis)
        step = np.zeros((*c.shape[:-1], 4, 4), dtype=dtype)
        step[..., :3, :3] = rotation
        step[..., :3, 3] = point - rotation @ point
        step[..., 3, 3] = 1
        total = total @ step
        result.append(total)
    return result


def flange(g: Any, c: Array, s: Array) -> Array:
    """T_robroot_flange by the product of exponentials."""
    return motions(g, c, s)[6] @ zero_flange(g)


def axes_and_points(g: Any, moves: Sequence[Array]) -> tuple[list[Array], list[Array]]:
    """Joint axes and a point on each, robroot, for the motions of a configuration."""
    z = [move[..., :3, :3] @ axis for move, axis in zip(moves, AXES, strict=False)]
    o = [
        move[..., :3, :3] @ p + move[..., :3, 3] for move, p in zip(moves, points(g), strict=False)
    ]
    return z, o


def cross(a: Array, b: Array) -> Array:
    """a x b along the last axis, for any dtype."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )


def jacobian(g: Any, c: Array, s: Array, point: Array | None = None, link: int = 6) -> Array:
    """Geometric Jacobian in robroot, linear rows first; `point` is where it is now, in robroot.

    None is the flange. Columns beyond `link` are zero.
    """
    moves = motions(g, c, s)
    if point is None:
        point = (moves[6] @ zero_flange(g))[..., :3, 3]
    z, o = axes_and_points(g, moves)
    columns = [np.concatenate([cross(z[i], point - o[i]), z[i]], axis=-1) for i in range(6)]
    table = np.stack(columns, axis=-1)
    return np.where(np.arange(6) < link, table, table * 0)


def dh_matrix(c: Any, s: Any, d: Any, a: Any, ca: int, sa: int) -> Array:
    """Rot_z Trans_z Trans_x Rot_x of (3.1) as one matrix; (ca, sa) are of alpha."""
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    )


def dh_frames(g: Any, c: Array, s: Array) -> list[Array]:
    """Frames 0 to 6 of Table 3.1 in the chapter's base b: the products of (3.2) as printed.

    cos and sin of alpha = pi, pi/2, 0, -pi/2, pi/2, -pi/2, pi and the printed additions of
    pi/2 and pi to q_0, q_3 and q_6 are exact.
    """
    rows = [
        (0, 1, 0, 0, -1, 0),
        (c[0], s[0], -g.d1, g.a1, 0, 1),
        (c[1], s[1], 0, g.a2, 1, 0),
        (-s[2], c[2], 0, g.a3, 0, -1),
        (c[3], s[3], -g.d4, 0, 0, 1),
        (c[4], s[4], 0, 0, 0, -1),
        (-c[5], -s[5], -g.d6, 0, -1, 0),
    ]
    frames = [dh_matrix(*rows[0])]
    for row in rows[1:]:
        frames.append(frames[-1] @ dh_matrix(*row))
    return frames


ROBROOT_OF_BASE = np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""Rz(-90 deg): the chapter's base b seen from robroot."""


# Dynamics -----------------------------------------------------------------------------------


class Body(NamedTuple):
    """A link at the zero pose, in robroot: mass, mass centre, inertia about the mass centre."""

    mass: Any
    centre: Array
    inertia: Array


def tensor(six: Sequence[Any]) -> Array:
    """(Ixx, Iyy, Izz, Ixy, Ixz, Iyz) as a matrix."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def bodies(g: Any, links: Sequence[Any], payload: Any = None) -> list[Body]:
    """The six links at the zero pose; a payload (in flange axes) is merged into the last."""
    zero = np.array([0] * 6), np.array([0] * 6)
    frames = [ROBROOT_OF_BASE @ frame for frame in dh_frames(g, zero[0] + 1, zero[1])]
    origins = points(g)
    result = []
    for i, link in enumerate(links, 1):
        if link.frame == "dh":
            place = frames[i]
        else:
            place = np.eye(4, dtype=origins.dtype)
            place[:3, 3] = origins[i - 1]
        result.append(_placed(place, link))
    if payload is not None:
        result[5] = merged(result[5], _placed(zero_flange(g), payload))
    return result


def _placed(place: Array, body: Any) -> Body:
    rotation = place[:3, :3]
    centre = rotation @ np.array(body.com) + place[:3, 3]
    return Body(body.mass, centre, rotation @ tensor(body.inertia) @ rotation.T)


def merged(a: Body, b: Body) -> Body:
    """Two bodies as one: common mass centre, inertias by Steiner's theorem."""
    mass = a.mass + b.mass
    centre = (a.mass * a.centre + b.mass * b.centre) / mass
    inertia = sum(
        x.inertia + x.mass * (skew(x.centre - centre) @ skew(x.centre - centre).T) for x in (a, b)
    )
    return Body(mass, centre, inertia)


class Moment(NamedTuple):
    """A link in a configuration: mass centre, inertia in robroot, Jacobians of its centre."""

    mass: Any
    centre: Array
    inertia: Array
    linear: Array
    angular: Array


def moments(g: Any, links: Sequence[Body], c: Array, s: Array) -> list[Moment]:
    """Every link in a configuration; c and s are (..., 6)."""
    moves = motions(g, c, s)
    result = []
    for i, body in enumerate(links, 1):
        rotation = moves[i][..., :3, :3]
        centre = rotation @ body.centre + moves[i][..., :3, 3]
        table = jacobian(g, c, s, centre, link=i)
        inertia = rotation @ body.inertia @ _transposed(rotation)
        result.append(Moment(body.mass, centre, inertia, table[..., :3, :], table[..., 3:, :]))
    return result


def _transposed(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)


def mass_matrix(g: Any, links: Sequence[Body], c: Array, s: Array) -> Array:
    """M by the sum over links (3.38)."""
    return sum(
        m.mass * (_transposed(m.linear) @ m.linear) + _transposed(m.angular) @ m.inertia @ m.angular
        for m in moments(g, links, c, s)
    )


def potential(g: Any, links: Sequence[Body], gravity: Sequence[Any], c: Array, s: Array) -> Any:
    """-sum m g . p, J."""
    moves = motions(g, c, s)
    field = np.array(gravity)
    return -sum(
        body.mass * ((move[..., :3, :3] @ body.centre + move[..., :3, 3]) @ field)
        for body, move in zip(links, moves[1:], strict=True)
    )


def slope(function: Callable[[Array, Array], Any], c: Array, s: Array, direction: Array) -> Array:
    """Derivative of a function of (c, s) along a joint-space direction (..., 6), to rounding.

    Complex step on floats, dual numbers on anything else (one direction only).
    """
    if c.dtype == object:
        return eps(function(*dual_turns(c, s, direction)))
    h = 1e-20j * direction
    return np.imag(function(c - h * s, s + h * c)) / 1e-20


def _gradient(function: Callable[[Array, Array], Any], c: Array, s: Array) -> Array:
    """Derivatives with respect to each joint, joint first."""
    units = np.eye(6, dtype=int)
    if c.dtype == object:
        return np.array([slope(function, c, s, unit) for unit in units])
    return slope(function, c, s, units)


def christoffel(g: Any, links: Sequence[Body], c: Array, s: Array) -> Array:
    """C_k(i, j) of (3.41), k first, with the index of the last term corrected."""
    d = _gradient(partial(mass_matrix, g, links), c, s)  # d[i, k, j] = dM_kj / dq_i
    return (d.transpose(1, 0, 2) + d.transpose(1, 2, 0) - d) / 2


def gravity_torque(
    g: Any, links: Sequence[Body], field: Sequence[Any], c: Array, s: Array
) -> Array:
    """G = dP/dq (3.42)."""
    return _gradient(partial(potential, g, links, field), c, s)


def inverse_dynamics(
    g: Any,
    links: Sequence[Body],
    field: Sequence[Any],
    c: Array,
    s: Array,
    motion: tuple[Sequence[Any], Sequence[Any]],
) -> Array:
    """Lagrange: tau = M qdd + sum_ij C_k(i, j) qd_i qd_j + dP/dq; `motion` is (qd, qdd)."""
    qd, qdd = (np.array(v) for v in motion)
    symbols = christoffel(g, links, c, s)
    return (
        mass_matrix(g, links, c, s) @ qdd
        + (symbols @ qd) @ qd
        + gravity_torque(g, links, field, c, s)
    )


def base_wrench(
    g: Any,
    links: Sequence[Body],
    field: Sequence[Any],
    c: Array,
    s: Array,
    motion: tuple[Sequence[Any], Sequence[Any]],
) -> Array:
    """Force and moment about robroot's origin that the foundation exerts, (6,).

    Rates of total momentum and angular momentum, by dual numbers in time, less the weight.
    """
    qd, qdd = motion
    speeds = np.array([Dual(v, a) for v, a in zip(qd, qdd, strict=True)], dtype=object)
    gravity = np.array(field)
    momentum, spin, weight, turning = 0, 0, 0, 0
    for m in moments(g, links, *dual_turns(c, s, qd)):
        velocity, omega = m.linear @ speeds, m.angular @ speeds
        momentum = momentum + m.mass * velocity
        spin = spin + m.mass * cross(m.centre, velocity) + m.inertia @ omega
        weight = weight + m.mass * gravity
        turning = turning + m.mass * cross(real(m.centre), gravity)
    return np.concatenate([eps(momentum) - weight, eps(spin) - turning])


# Rotations ----------------------------------------------------------------------------------


def rotation(axis: int, angle: float) -> Array:
    """Rotation about coordinate axis 0, 1 or 2, 3x3."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    r = np.eye(3)
    r[i, i] = r[j, j] = c
    r[j, i], r[i, j] = s, -s
    return r


def gap(a: npt.ArrayLike, b: npt.ArrayLike) -> tuple[Array, Array]:
    """Distance (m) and angle (rad) between poses (..., 4, 4); accurate for small angles."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    distance = np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1)
    chord = np.linalg.norm(a[..., :3, :3] - b[..., :3, :3], axis=(-2, -1))
    return distance, 2 * np.arcsin(np.minimum(chord / np.sqrt(8), 1))


def angle_gap(a: npt.ArrayLike, b: npt.ArrayLike) -> Array:
    """Largest difference of joint angles along the last axis, whole turns aside."""
    difference = np.asarray(a, dtype=float) - np.asarray(b, dtype=float)
    return np.abs(np.remainder(difference + np.pi, 2 * np.pi) - np.pi).max(axis=-1)


def roots(g: Any, pose: Array, starts: Array, steps: int = 60) -> Array:
    """Distinct joint vectors that reach a pose: damped Newton from many starts, (k, 6).

    Knows nothing of the arm's structure but its axes. Only roots that close to 1e-10 count.
    """
    q = np.array(starts, dtype=float)
    for _ in range(steps):
        now = flange(g, *turns(q))
        turn = np.swapaxes(now[..., :3, :3], -1, -2) @ pose[:3, :3]
        odd = turn - np.swapaxes(turn, -1, -2)
        axis = np.stack([odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1) / 2
        trace = np.trace(turn, axis1=-2, axis2=-1)
        sine = np.linalg.norm(axis, axis=-1)
        angle = np.arctan2(sine, (trace - 1) / 2)
        axis = axis * (angle / np.maximum(sine, 1e-300))[..., None]
        error = np.concatenate(
            [pose[:3, 3] - now[..., :3, 3], np.einsum("...ij,...j", now[..., :3, :3], axis)], -1
        )
        table = jacobian(g, *turns(q))
        damping = 1e-3 * np.square(error).sum(axis=-1)[..., None, None] * np.eye(6)
        table_t = np.swapaxes(table, -1, -2)
        step = np.linalg.solve(
            table_t @ table + damping + 1e-15 * np.eye(6), table_t @ error[..., None]
        )
        q = q + np.clip(step[..., 0], -0.5, 0.5)
    distance, angle = gap(flange(g, *turns(q)), pose)
    found: list[Array] = []
    for row in q[(distance < 1e-10) & (angle < 1e-10)]:
        if all(angle_gap(row, other) > 1e-6 for other in found):
            found.append(row)
    return np.array(found).reshape(-1, 6)
