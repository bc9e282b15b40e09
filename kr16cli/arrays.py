"""Checks of array arguments and results, shared by every method of `api.Robot`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from kr16cli.errors import InputError, NonFiniteError, ShapeError
from kr16cli.tolerances import TOLERANCES

Array = npt.NDArray[np.float64]


def checked(name: str, value: npt.ArrayLike, *trailing: int) -> Array:
    """`value` as finite float64 whose last axes are `trailing`.

    Raises:
        InputError: not numbers. ShapeError: other trailing axes. NonFiniteError: NaN, infinity.
    """
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            array = _as_numbers(name, array)
        array = array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name} is no array of numbers: {error}") from None
    k = len(trailing)
    if array.ndim < k or array.shape[array.ndim - k :] != trailing:
        raise ShapeError(name, array.shape, f"(..., {', '.join(map(str, trailing))})")
    finite = np.isfinite(array)
    if not finite.all():
        index = tuple(int(i) for i in np.argwhere(~finite)[0])
        raise NonFiniteError(name, index, float(array[index]))
    return array


def _as_numbers(name: str, array: npt.NDArray[np.generic]) -> Array:
    if array.dtype.kind == "O":
        return array.astype(np.float64)
    raise InputError(f"{name} has dtype {array.dtype}; expected real numbers (float64)")


def reject_bad_poses(name: str, poses: Array, defects: Array) -> None:
    """Raise InputError for the first matrix (4, 4) that is no rigid pose.

    `defects` (n, 2) are `orientation.rotation_defect` of the flattened poses.
    """
    limit = TOLERANCES.rotation
    rotation = (np.abs(defects[:, 0]) <= 6 * limit) & (np.abs(defects[:, 1]) <= 6 * limit**2)
    flat_poses = poses.reshape(-1, 4, 4)
    rigid = (flat_poses[:, 3] == (0.0, 0.0, 0.0, 1.0)).all(axis=1)
    bad = np.flatnonzero(~(rotation & rigid))
    if not len(bad):
        return
    first = int(bad[0])
    index = [int(i) for i in np.unravel_index(first, poses.shape[:-2])]
    label = f"{name}{index}" if index else name
    pose = flat_poses[first]
    if not rigid[first]:
        raise InputError(f"{label} has last row {pose[3].tolist()}; expected 0 0 0 1")
    r = pose[:3, :3]
    error = np.abs(r.T @ r - np.eye(3)).max()
    raise InputError(
        f"{label} holds no rotation: |R^T R - 1| is {error:.1e} (limit {limit:.0e}), det "
        f"{np.linalg.det(r):+.3f}; columns must be orthonormal and right-handed"
    )


def batch(names: Sequence[str], arrays: Sequence[Array], ranks: Sequence[int]) -> tuple[int, ...]:
    """The leading shape that the arguments broadcast to; `ranks` are their trailing axes."""
    leads = [a.shape[: a.ndim - k] for a, k in zip(arrays, ranks, strict=True)]
    try:
        return np.broadcast_shapes(*leads)
    except ValueError:
        shown = ", ".join(f"{n} {lead}" for n, lead in zip(names, leads, strict=True))
        raise InputError(f"leading shapes do not broadcast: {shown}") from None


def flat(array: Array, lead: tuple[int, ...], rank: int) -> Array:
    """The array broadcast to `lead` and flattened to (n, k)."""
    trailing = array.shape[array.ndim - rank :]
    width = int(np.prod(trailing, dtype=int))
    return np.broadcast_to(array, lead + trailing).reshape(-1, width)


def result(out: Array | None, shape: tuple[int, ...]) -> Array:
    """`out` checked, or a fresh array."""
    if out is None:
        return np.empty(shape)
    if not isinstance(out, np.ndarray) or out.dtype != np.float64:
        raise InputError(f"out is {getattr(out, 'dtype', type(out).__name__)}; expected float64")
    if out.shape != shape:
        raise ShapeError("out", out.shape, str(shape))
    if not out.flags.writeable:
        raise InputError("out is read-only; pass a writable array")
    return out


def checked_threads(threads: object) -> int:
    """A whole number of threads, 1 or more."""
    if not isinstance(threads, (int, np.integer)) or isinstance(threads, bool) or threads < 1:
        raise InputError(f"threads is {threads!r}; expected a whole number of 1 or more")
    return int(threads)


def ranges(ends: Sequence[tuple[float, float]]) -> Array:
    """Middles in [-pi, pi], then half widths, of angular ranges (lower, upper) in rad: (2 n,)."""
    table = np.array(ends)
    middle = np.remainder(table.mean(axis=1) + np.pi, 2 * np.pi) - np.pi
    return np.concatenate([middle, (table[:, 1] - table[:, 0]) / 2])
