"""Two root finders for inverse kinematics that share nothing with the closed form.

`quartic`: Pieper's elimination (1968). One quartic in tan(q3 / 2) holds every arm posture, and
every posture has two wrists, so that no solution can be missed. `newton`: damped Newton from
many starts; knows only the joint axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kr16cli.robot import Geometry
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import (
    Array,
    angle_gap,
    axial,
    pose_gap,
)

_REAL = 1e-7
"""A root this near the real axis counts as real: the square root of rounding, for near pairs."""


class Roots(NamedTuple):
    """All solutions of poses (n, 4, 4): angles (n, 8, 6), NaN where a root is complex."""

    angles: Array
    number: Array


def quartic(g: Geometry, poses: Array) -> Roots:
    """Every solution for poses off the singularities; needs a1 > 0.

    With r the signed distance of the wrist centre in front of the A1 axis, N(q3) its squared
    distance from the A2 axis and K = r^2 + (z - d1)^2 + a1^2:
    2 a1 r = K - N(q3), squared: (K - N(q3))^2 = 4 a1^2 (x^2 + y^2).
    """
    wrist = poses[:, :3, 3] - g.d6 * poses[:, :3, 2]
    ground = wrist[:, 0] ** 2 + wrist[:, 1] ** 2
    height = wrist[:, 2] - g.d1
    known = ground + height**2 + g.a1**2
    mean, even, odd = _reach_squared(g)
    # (K - mean)(1 + u^2) - even (1 - u^2) - 2 odd u, squared, less 4 a1^2 ground (1 + u^2)^2
    p2, p1, p0 = known - mean + even, -2 * odd * np.ones_like(known), known - mean - even
    k = 4 * g.a1**2 * ground
    coefficients = (
        p2 * p2 - k,
        2 * p2 * p1,
        p1 * p1 + 2 * p2 * p0 - 2 * k,
        2 * p1 * p0,
        p0 * p0 - k,
    )
    companion = np.zeros((len(poses), 4, 4))
    companion[:, 1:, :3] = np.eye(3)
    for i in range(4):
        companion[:, i, 3] = -coefficients[4 - i] / coefficients[0]
    u = np.linalg.eigvals(companion)
    real = np.abs(u.imag) < _REAL * (1.0 + np.abs(u))
    q3 = np.where(real, 2 * np.arctan(u.real), np.nan)
    square = mean + even * np.cos(q3) + odd * np.sin(q3)
    r = (known[:, None] - square) / (2 * g.a1)
    q1 = np.arctan2(-wrist[:, None, 1] / r, wrist[:, None, 0] / r)
    straight = _arm_plane(g, q3)
    there = np.arctan2(-height[:, None] + 0.0 * r, r - g.a1)
    q2 = there - np.arctan2(straight[..., 1], straight[..., 0])
    arms = np.stack([q1, q2, q3], axis=-1)
    angles = _wrists(g, poses, arms).reshape(len(poses), 8, 6)
    angles = np.pi - np.remainder(np.pi - angles, 2 * np.pi)
    return Roots(angles, 2 * real.sum(axis=1))


def _arm_plane(g: Geometry, q3: Array) -> Array:
    """Wrist centre from the A2 axis at q2 = 0: forward and down, (..., 2)."""
    q = np.zeros((*q3.shape, 6))
    q[..., 2] = q3
    offset = poe.wrist_centre(g, q) - poe.points(g)[1]
    return np.stack([offset[..., 0], -offset[..., 2]], axis=-1)


def _reach_squared(g: Geometry) -> tuple[float, float, float]:
    """(mean, even, odd) of the squared distance mean + even cos q3 + odd sin q3."""
    at_0, at_90, at_180 = (_arm_plane(g, np.array([0.0, np.pi / 2, np.pi])) ** 2).sum(axis=-1)
    mean = (at_0 + at_180) / 2
    return float(mean), float(at_0 - mean), float(at_90 - mean)


def _wrists(g: Geometry, poses: Array, arms: Array) -> Array:
    """Both wrists of each arm posture (n, 4, 3): Rx(-q4) Ry(q5) Rx(-q6) is what is left."""
    q = np.concatenate([arms, np.zeros_like(arms)], axis=-1)
    before = poe.motions(g, q)[3][..., :3, :3]
    rest = np.swapaxes(before, -1, -2) @ (poses[:, :3, :3] @ poe.zero_flange(g)[:3, :3].T)[:, None]
    q5 = np.arctan2(np.hypot(rest[..., 1, 0], rest[..., 2, 0]), rest[..., 0, 0])
    q4 = -np.arctan2(rest[..., 1, 0], -rest[..., 2, 0])
    q6 = -np.arctan2(rest[..., 0, 1], rest[..., 0, 2])
    one, other = np.stack([q4, q5, q6], -1), np.stack([q4 + np.pi, -q5, q6 + np.pi], -1)
    both = [np.concatenate([arms, wrist], axis=-1) for wrist in (one, other)]
    return np.stack(both, axis=-2)


def newton(g: Geometry, pose: Array, starts: Array, steps: int = 60) -> Array:
    """Distinct joint vectors that reach a pose (4, 4), from starts (n, 6): (k, 6)."""
    q = np.array(starts, dtype=float)
    tip = poe.zero_flange(g)[:3, 3]
    for _ in range(steps):
        now = poe.flange(g, q)
        turn = pose[:3, :3] @ np.swapaxes(now[..., :3, :3], -1, -2)
        axis = axial(turn)
        sine = np.linalg.norm(axis, axis=-1)
        angle = np.arctan2(sine, (np.trace(turn, axis1=-2, axis2=-1) - 1.0) / 2)
        axis = axis * (angle / np.maximum(sine, 1e-300))[..., None]
        error = np.concatenate([pose[:3, 3] - now[..., :3, 3], axis], axis=-1)
        table = poe.jacobian(g, q, tip)
        table_t = np.swapaxes(table, -1, -2)
        damping = 1e-3 * np.square(error).sum(-1)[..., None, None] * np.eye(6) + 1e-15 * np.eye(6)
        move = np.linalg.solve(table_t @ table + damping, table_t @ error[..., None])
        q = q + np.clip(move[..., 0], -0.5, 0.5)
    distance, angle = pose_gap(poe.flange(g, q), pose)
    found: list[Array] = []
    for row in q[(distance < 1e-10) & (angle < 1e-10)]:
        if all(angle_gap(row, other) > 1e-6 for other in found):
            found.append(row)
    return np.array(found).reshape(-1, 6)
