"""Forward kinematics and Jacobian by a product of exponentials; Table 3.1 as literal matrices.

A configuration is q (..., 6) in rad, KUKA's sign and zero; frames are robroot (x forward, y
left, z up). Everything also takes complex q, for `rotations.derivative`.
"""

from __future__ import annotations

import numpy as np

from kr16cli.robot import Geometry
from kr16cli.verify.independent.rotations import Array, about_axis, cross

AXES = np.array([[0, 0, -1], [0, 1, 0], [0, 1, 0], [-1, 0, 0], [0, 1, 0], [-1, 0, 0]], dtype=float)
"""Joint axes A1 to A6 at the zero pose, robroot; positive turns are KUKA's."""

ROBROOT_OF_BASE = np.array([[0.0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
"""Rz(-90 deg): the chapter's base b seen from robroot."""


def points(g: Geometry) -> Array:
    """A point on each joint axis at the zero pose, m: A1 at height d1, A4 to A6 in the wrist."""
    wrist = [g.a1 + g.a2 + g.d4, 0.0, g.d1 - g.a3]
    shoulder, elbow = [g.a1, 0.0, g.d1], [g.a1 + g.a2, 0.0, g.d1]
    return np.array([[0.0, 0.0, g.d1], shoulder, elbow, wrist, wrist, wrist])


def zero_flange(g: Geometry) -> Array:
    """T_robroot_flange at the zero pose: d6 in front of the wrist, B = 90 degrees."""
    x, z = g.a1 + g.a2 + g.d4 + g.d6, g.d1 - g.a3
    return np.array([[0.0, 0, 1, x], [0, 1, 0, 0], [-1, 0, 0, z], [0, 0, 0, 1]])


def motions(g: Geometry, q: Array) -> list[Array]:
    """Motions E_0 (none) to E_6 of the links from the zero pose, (..., 4, 4) in robroot.

    E_i = e^([xi_1] q_1) ... e^([xi_i] q_i) (Brockett 1984).
    """
    rotations, on_axes = about_axis(AXES, q), points(g)
    steps = np.zeros((*q.shape, 4, 4), dtype=q.dtype)
    steps[..., :3, :3] = rotations
    steps[..., :3, 3] = on_axes - (rotations @ on_axes[:, :, None])[..., 0]
    steps[..., 3, 3] = 1.0
    total = steps[..., 0, :, :]
    result = [np.broadcast_to(np.eye(4, dtype=q.dtype), total.shape), total]
    for i in range(1, 6):
        total = total @ steps[..., i, :, :]
        result.append(total)
    return result


def flange(g: Geometry, q: Array) -> Array:
    """T_robroot_flange, (..., 4, 4)."""
    return np.asarray(motions(g, q)[6] @ zero_flange(g))


def wrist_centre(g: Geometry, q: Array) -> Array:
    """Where the axes A4, A5 and A6 meet, (..., 3)."""
    return carried(motions(g, q)[3], points(g)[3])


def carried(motion: Array, point: Array) -> Array:
    """A point of the zero pose after a motion."""
    return np.asarray(motion[..., :3, :3] @ point + motion[..., :3, 3])


def jacobian(g: Geometry, q: Array, point: Array, link: int = 6) -> Array:
    """Geometric Jacobian in robroot axes, linear rows first, (..., 6, 6).

    `point` (3,) is fixed to `link` and given where it is at the zero pose.
    """
    moves = motions(g, q)
    place = carried(moves[link], point)
    table = np.zeros((*q.shape[:-1], 6, 6), dtype=q.dtype)
    for i, (axis, on_axis) in enumerate(zip(AXES[:link], points(g)[:link], strict=True)):
        z = moves[i][..., :3, :3] @ axis
        table[..., :3, i] = cross(z, place - carried(moves[i], on_axis))
        table[..., 3:, i] = z
    return table


def dh_frames(g: Geometry, q: Array) -> list[Array]:
    """Frames 0 to 6 of Table 3.1 in the chapter's base b: the products of (3.2) as printed."""
    half = np.pi / 2
    rows = [
        (half + 0.0 * q[..., 0], 0.0, 0.0, np.pi),
        (q[..., 0], -g.d1, g.a1, half),
        (q[..., 1], 0.0, g.a2, 0.0),
        (q[..., 2] + half, 0.0, g.a3, -half),
        (q[..., 3], -g.d4, 0.0, half),
        (q[..., 4], 0.0, 0.0, -half),
        (q[..., 5] + np.pi, -g.d6, 0.0, np.pi),
    ]
    frames = [_dh_matrix(*rows[0])]
    for row in rows[1:]:
        frames.append(frames[-1] @ _dh_matrix(*row))
    return frames


def _dh_matrix(theta: Array, d: float, a: float, alpha: float) -> Array:
    """Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha), equation (3.1), as four matrices."""
    z, x = np.eye(3)[2], np.eye(3)[0]
    turn, twist = np.zeros((*theta.shape, 4, 4), dtype=theta.dtype), np.eye(4)
    turn[..., :3, :3] = about_axis(z, theta)
    turn[..., 3, 3] = 1.0
    twist[:3, :3] = about_axis(x, np.array(alpha))
    shift = np.eye(4)
    shift[:3, 3] = (a, 0.0, d)  # both translations are along axes that the first leaves alone
    return np.asarray(turn @ shift @ twist)


def elbow_side(g: Geometry, q: Array) -> Array:
    """How far the wrist centre lies below the line through A2 and A3 continued, m.

    Signed distance from that line in the arm's plane, seen from the A2 side; positive where A3
    has bent the forearm down (KUKA's positive turn).
    """
    moves = motions(g, q)
    shoulder, elbow, wrist = (carried(moves[k], points(g)[p]) for k, p in ((1, 1), (2, 2), (3, 3)))
    along, beyond = elbow - shoulder, wrist - elbow
    axis = moves[1][..., :3, :3] @ AXES[1]
    return np.asarray((cross(along, beyond) * axis).sum(axis=-1) / g.a2)


def forward_of_column(g: Geometry, q: Array) -> Array:
    """Wrist centre's distance in front of the A1 axis in the frame that turns with A1, m."""
    moves = motions(g, q)
    forward = moves[1][..., :3, 0]
    return np.asarray((carried(moves[3], points(g)[3]) * forward).sum(axis=-1))
