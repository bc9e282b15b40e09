"""From compared arrays to a `Finding`: the worst sample, with inputs that can be pasted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from kr16cli import kuka, units
from kr16cli.verify.records import Finding

Array = npt.NDArray[np.float64]


def gap(a: Any, b: Any, axes: int = 1) -> Array:
    """Largest absolute difference over the last `axes` axes."""
    difference = np.abs(np.asarray(a) - np.asarray(b))
    return np.asarray(difference.max(axis=tuple(range(-axes, 0))))


def relative(a: Any, b: Any, axes: int = 1, floor: float = 1e-300) -> Array:
    """`gap` over the largest absolute value of b there, or over `floor` where that is larger."""
    size = np.abs(np.asarray(b)).max(axis=tuple(range(-axes, 0)))
    return np.asarray(gap(a, b, axes) / np.maximum(size, floor))


def largest(*errors: Array) -> Array:
    """The larger error sample by sample; NaN wins."""
    result = errors[0]
    for other in errors[1:]:
        result = np.maximum(result, other)
    return result


def known(rows: Array) -> npt.NDArray[np.bool_]:
    """Which rows of solutions (..., 6) are there: those out of reach are NaN."""
    return np.asarray(np.isfinite(rows).all(axis=-1))


def stacked(rows: Sequence[Sequence[Any]], n: int) -> Array:
    """A matrix of columns (n,), structural zeros among them, as (n, i, j)."""
    out = np.empty((n, len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            out[:, i, j] = value
    return out


def finding(
    errors: npt.ArrayLike,
    evidence: str,
    *,
    figures: Mapping[str, Any] | None = None,
    **inputs: Any,
) -> Finding:
    """A finding from one error per sample.

    Args:
        errors: (n,); a value that is not finite is the worst of all.
        evidence: what was compared, in words.
        figures: numbers a report draws.
        inputs: arrays (n, ...) of the samples: q, qd, qdd, tau (rad, N m) or T.
    """
    flat = np.asarray(errors, dtype=float).reshape(-1)
    if not len(flat):
        return Finding(math.nan, 0, {}, f"{evidence}; no sample was compared", figures or {})
    at = int(np.argmax(np.where(np.isfinite(flat), flat, np.inf)))
    worst: dict[str, Any] = {}
    for name, values in inputs.items():
        array = np.asarray(values)
        worst |= _described(name, array.reshape(len(flat), *array.shape[1:])[at])
    if not math.isfinite(flat[at]):
        evidence = f"{evidence}; sample {at} is not finite"
    return Finding(float(flat[at]), len(flat), worst, evidence, figures or {})


def _described(name: str, value: Array) -> dict[str, Any]:
    if name == "q":
        angles = [units.deg(v) for v in value.tolist()]
        return {"q_deg": angles, "command": f"kr16 fk {' '.join(map(repr, angles))}"}
    if name in ("qd", "qdd"):
        return {f"{name}_deg_s{'2' if name == 'qdd' else ''}": [units.deg(v) for v in value]}
    if name == "T":
        pose = kuka.pose_from_matrix(value.tolist())
        return {"pose_mm_deg": pose, "command": f"kr16 ik {' '.join(map(repr, pose))}"}
    return {name: value.tolist()}


def counted(wrong: npt.ArrayLike, evidence: str, **inputs: Any) -> Finding:
    """A finding whose error is how many samples are wrong; the worst is the first of them."""
    flags = np.asarray(wrong, dtype=bool).reshape(-1)
    first = finding(flags.astype(float), evidence, **inputs)
    return Finding(float(flags.sum()), flags.size, first.worst, evidence)


COUNT = 0.5
"""Tolerance of a case that counts what is wrong: none may be."""
