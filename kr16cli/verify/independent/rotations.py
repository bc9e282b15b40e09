"""Rotations, distances and exact derivatives, on arrays with any leading axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

STEP = 1e-40
"""The complex step: nothing is subtracted, so it may be far below rounding."""


def derivative(function: Callable[..., Array], *pairs: tuple[Array, Array]) -> Array:
    """Derivative of a real analytic function along a direction, exact to rounding.

    Im f(x + i h v) / h (Squire and Trapp 1998). Each pair is (argument, its rate).
    """
    value = function(*(x + 1j * STEP * v for x, v in pairs))
    return np.asarray(value.imag / STEP)


def gradient(function: Callable[[Array], Array], q: Array) -> Array:
    """Derivatives along each of the six joints; the new axis follows q's leading axes.

    The function is called once, for configurations (..., 6, 6) that each carry one step.
    """
    return derivative(function, (q[..., None, :], np.eye(6)))


def skew(v: Array) -> Array:
    """[v]x: [v]x w = v x w, for v (..., 3)."""
    out = np.zeros((*v.shape, 3), dtype=v.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i, k], out[..., k, i] = v[..., j], -v[..., j]
    return out


def cross(a: Array, b: Array) -> Array:
    """a x b along the last axis, for (..., 3); several times as quick as NumPy's."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def about_axis(axis: Array, angle: Array) -> Array:
    """Rotations about unit axes (..., 3) by angles (...), Rodrigues' formula, (..., 3, 3)."""
    c, s = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    outer = axis[..., :, None] * axis[..., None, :]
    return np.asarray(c * np.eye(3) + s * skew(axis) + (1 - c) * outer)


def from_abc(abc: Array) -> Array:
    """Rz(A) Ry(B) Rx(C) as a product of three elementary rotations; abc (..., 3) in rad."""
    z, y, x = np.eye(3)[::-1]
    turns = (about_axis(axis, abc[..., i]) for i, axis in enumerate((z, y, x)))
    first, second, third = turns
    return np.asarray(first @ second @ third)


def axial(matrix: Array) -> Array:
    """w of the skew part of (..., 3, 3): the angular velocity where the matrix is R' R^T."""
    odd = (matrix - np.swapaxes(matrix, -1, -2)) / 2
    return np.stack([odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1)


def pose_gap(a: Array, b: Array) -> tuple[Array, Array]:
    """Distance (m) and angle (rad) between poses (..., 4, 4); accurate for small angles."""
    distance = np.linalg.norm(a[..., :3, 3] - b[..., :3, 3], axis=-1)
    chord = np.linalg.norm(a[..., :3, :3] - b[..., :3, :3], axis=(-2, -1))
    return distance, 2 * np.arcsin(np.minimum(chord / np.sqrt(8.0), 1.0))


def angle_gap(a: Array, b: Array) -> Array:
    """Largest difference of joint angles along the last axis, whole turns aside."""
    off = np.remainder(a - b + np.pi, 2 * np.pi) - np.pi
    return np.asarray(np.abs(off).max(axis=-1))
