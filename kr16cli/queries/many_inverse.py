"""The best solutions of many poses at once, by the rules of `inverse.InverseQuestion`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from kr16cli.kernels.columns import ARRAYS
from kr16cli.kuka import TURNING_JOINTS
from kr16cli.model.orientation import rotation_defect
from kr16cli.model.posture import status, turn
from kr16cli.model.task import product
from kr16cli.queries.many import (
    Array,
    Many,
    Mask,
    Rows,
    beyond_limits,
    columns_of,
    large,
    poses,
    shown_angles,
    stacked,
)
from kr16cli.tolerances import TOLERANCES

if TYPE_CHECKING:
    from kr16cli.queries.inverse import InverseQuestion

_POSTURE_BITS = 0b111
_TIE = 1e-9
"""Turns that differ by less (rad) are equally near; then the fewer decide."""

_JOINTS = ("a1", "a2", "a3", "a4", "a5", "a6")


def inverse_kinematics(question: InverseQuestion, values: Mapping[str, Array], same: float) -> Many:
    """The solution within limits that is nearest to `near`, for each pose.

    Poses without one, singular ones and those where branches coincide (within `same`, rad) are
    left to be asked one by one.
    """
    rows = poses(question, values)
    if question.base is not None:
        rows = product(question.base, rows)
    if question.from_tool is not None:
        rows = product(rows, question.from_tool)
    n = len(next(iter(values.values())))
    T = stacked(rows, n)
    care = large(values) | ~_rigid(T)
    T[care] = np.eye(4)
    near = question.near
    found = question.robot.ik(T, np.array(near))
    Q = list(np.ascontiguousarray(found.transpose(2, 1, 0)))  # an array (8, n) for each joint
    care |= _coincide(Q, same)
    for i in TURNING_JOINTS:
        Q[i] = _nearest_turns(Q[i], near[i], question.limits[i])
    kept = ~np.isnan(Q[0])
    if question.status is not None:
        kept &= (status(Q, question.data.geometry, ARRAYS) ^ question.status) & _POSTURE_BITS == 0
    inside = kept & ~beyond_limits(question, Q)
    care |= ~inside.any(axis=0)
    branch, at = _nearest(inside, Q, near), np.arange(n)
    joints = [np.where(care, 0.0, angle[branch, at]) for angle in Q]
    best = np.stack(joints, axis=-1)
    position, angle = question.robot.closure(T, best)
    residual = np.maximum(position, angle)
    s, t = status(joints, question.data.geometry, ARRAYS), turn(joints)
    q = shown_angles(question, best)
    columns: dict[str, npt.NDArray[Any]] = {
        **dict(zip(_JOINTS, columns_of(q), strict=True)),
        "s": s,
        "t": t,
        "solutions": kept.sum(axis=0),
        "residual": residual,
    }
    arrays = {
        "q": q,
        "Q": shown_angles(question, np.moveaxis(np.where(kept, Q, np.nan), (0, -1), (-1, 0))),
        "s": np.asarray(s, dtype=float),
        "t": np.asarray(t, dtype=float),
        "residual": residual,
    }
    return Many(columns, arrays, care, np.zeros(n, dtype=bool), lambda _: [])


def _rigid(T: Array) -> Mask:
    """Transforms (n, 4, 4) that are sound beyond doubt."""
    rows: Rows = [[T[:, i, j] for j in range(4)] for i in range(3)]
    limit = TOLERANCES.rotation
    size, rest = rotation_defect(rows)
    sound = (np.abs(size) < limit) & (np.abs(rest) < limit**2)
    return np.asarray(sound & (T[:, 3] == (0.0, 0.0, 0.0, 1.0)).all(axis=1))


def _coincide(Q: Sequence[Array], same: float) -> Mask:
    """Poses where two branches may be one, or a case is singular; Q as six arrays (8, n).

    Branches differ in A1 by the shoulder, else in A3 by the elbow, else in the sign of A5.
    """
    gaps = (
        Q[0][0] - Q[0][4],
        *(Q[2][i] - Q[2][i + 2] for i in (0, 4)),
        *(2 * Q[4][i] for i in (0, 2, 4, 6)),
    )
    found = np.zeros(gaps[0].shape, dtype=bool)
    for gap in gaps:
        found |= np.abs(gap - math.tau * np.rint(gap / math.tau)) < same
    return found


def _nearest_turns(angle: Array, near: float, limits: tuple[float, float]) -> Array:
    """Whole turns added to a joint's angles to come nearest to `near` within its limits.

    `kuka.full_turn_variants` and its choice, joint by joint: the largest move and the sum of
    moves are both least where each move is.
    """
    lower, upper = limits
    first = np.ceil((lower - TOLERANCES.limit - angle) / math.tau)
    last = np.floor((upper + TOLERANCES.limit - angle) / math.tau)
    exact = (near - angle) / math.tau
    low = np.floor(exact)
    turns = np.rint(exact)
    tie = np.abs(exact - low - 0.5) < _TIE / math.tau
    if tie.any():
        turns = np.where(tie, np.where(np.abs(low) <= np.abs(low + 1), low, low + 1), turns)
    turns = np.minimum(np.maximum(turns, first), last)
    return angle + np.where(first <= last, turns, 0.0) * math.tau


def _nearest(among: Mask, Q: Sequence[Array], near: Sequence[float]) -> npt.NDArray[np.intp]:
    """The branch with the least largest move from `near`, then the least sum; of those `among`.

    `InverseQuestion._distance`, for six arrays (8, n).
    """
    largest, total = np.zeros(among.shape), np.zeros(among.shape)
    for angle, start in zip(Q, near, strict=True):
        move = np.abs(angle - start)
        largest, total = np.maximum(largest, move), total + move
    largest = np.where(among, np.round(largest, 9), np.inf)
    tied = among & (largest == largest.min(axis=0))
    return np.asarray(np.where(tied, np.round(total, 9), np.inf).argmin(axis=0))
