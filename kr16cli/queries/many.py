"""Answers to many rows at once, on arrays: what a batch asks where no row needs care of its own.

The columns and arrays are those that `Question.columns` and `Question.arrays` give row by row;
numbers differ by rounding. Rows that need words (a reason, a singular case) or that a double can
hardly hold are marked, for the caller to ask one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli import kuka, units
from kr16cli.kernels.columns import ARRAYS
from kr16cli.model import forward, orientation
from kr16cli.model.posture import status, turn
from kr16cli.model.task import product
from kr16cli.tolerances import TOLERANCES

if TYPE_CHECKING:
    from kr16cli.queries.common import Question
    from kr16cli.queries.forward import ForwardQuestion

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Rows = list[list[Any]]

_LARGE = 1e6
"""Typed numbers beyond this are asked one by one: their results may overflow."""

_COSINE = np.array([1.0, 0.0, -1.0, 0.0])


class Many(NamedTuple):
    """Answers to n rows.

    `columns` (n,) each, NaN where a cell is empty, and `arrays` (n, ...), by name; `care` marks
    the rows that must be asked one by one, whose numbers here mean nothing; `warned` those with
    warnings, which `warnings` gives for a row.
    """

    columns: Mapping[str, npt.NDArray[Any]]
    arrays: Mapping[str, npt.NDArray[Any]]
    care: Mask
    warned: Mask
    warnings: Callable[[int], list[str]]


def large(values: Mapping[str, Array]) -> Mask:
    """Rows with a number so large that its powers may overflow."""
    rows = next(iter(values.values()))
    found = np.zeros(len(rows), dtype=bool)
    for array in values.values():
        found |= np.abs(array.reshape(len(array), -1)).max(axis=1, initial=0.0) > _LARGE
    return found


def columns_of(array: Array) -> list[Array]:
    """The columns of (n, k), each in one piece."""
    return list(np.ascontiguousarray(array.T))


def stacked(rows: Sequence[Sequence[Any]], count: int) -> Array:
    """Rows of columns, numbers among them, as (n, i, j) without -0."""
    out = np.empty((len(rows), len(rows[0]), count))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            out[i, j] = value
    out += 0.0
    return np.ascontiguousarray(np.moveaxis(out, -1, 0))


def radians(question: Question, angles: Array) -> Array:
    """Typed angles in rad."""
    return angles if question.si else angles * units.RAD_PER_DEG


def shown_angles(question: Question, angles: Array) -> Array:
    """Angles (rad) in the unit of the result."""
    return (angles if question.si else angles / units.RAD_PER_DEG) + 0.0


def shown_lengths(question: Question, lengths: Array) -> Array:
    """Lengths (m) in the unit of the result."""
    return (lengths if question.si else lengths * units.MM_PER_M) + 0.0


def exact_trig(angle_deg: Array) -> tuple[Array, Array]:
    """Cosines and sines of degrees, exact at whole quarter turns; `units.cos_sin_deg`."""
    angle = angle_deg * units.RAD_PER_DEG
    c, s = np.cos(angle), np.sin(angle)
    turns, rest = np.divmod(angle_deg, 90.0)
    at = np.flatnonzero(rest == 0.0)
    if len(at):
        quarter = turns[at].astype(np.int64) % 4
        c[at], s[at] = _COSINE[quarter], _COSINE[quarter - 1]
    return c, s


def beyond_limits(question: Question, q: Sequence[Array]) -> Mask:
    """Configurations, as six columns (rad) of any shape, with a joint outside its limits."""
    outside = np.zeros(q[0].shape, dtype=bool)
    for angle, joint in zip(q, question.data.joints, strict=True):
        low, high = angle < joint.lower, angle > joint.upper
        outside |= low & (joint.lower - angle > TOLERANCES.limit)
        outside |= high & (angle - joint.upper > TOLERANCES.limit)
    return outside


def named(name: str, array: Array) -> dict[str, Array]:
    """Vectors (n, k) or matrices (n, i, j) as columns name_1 or name_11; `common.flat`."""
    if array.ndim == 2:
        return {f"{name}_{i}": column for i, column in enumerate(columns_of(array), 1)}
    count, height, width = array.shape
    every = columns_of(array.reshape(count, -1))
    return {
        f"{name}_{i + 1}{j + 1}": every[width * i + j] for i in range(height) for j in range(width)
    }


def poses(question: Question, values: Mapping[str, Array]) -> Rows:
    """Typed poses (n, 6) or transforms (n, 4, 4) as rows of columns, m."""
    if "T" in values:
        T = values["T"]
        return [[T[:, i, j] for j in range(4)] for i in range(4)]
    x, y, z, a, b, c = columns_of(values["pose"])
    if question.si:
        trig = ARRAYS.trig((a, b, c))
    else:
        trig = [exact_trig(angle) for angle in (a, b, c)]
        x, y, z = (length / units.MM_PER_M for length in (x, y, z))
    R = orientation.rotation_from_rpy(trig)
    return [*([*row, p] for row, p in zip(R, (x, y, z), strict=True)), [0.0, 0.0, 0.0, 1.0]]


def _pose_numbers(question: Question, T: Rows) -> list[Array]:
    """X, Y, Z, A, B, C of poses in the units of the result; `kuka.pose_from_matrix`."""
    rotation = [[v + 0.0 for v in row[:3]] for row in T[:3]]
    a, b, c = orientation.rpy_from_rotation(rotation, ARRAYS)
    c = np.where(c == -np.pi, np.pi, c)
    return [
        *(shown_lengths(question, row[3]) for row in T[:3]),
        *(shown_angles(question, np.asarray(angle)) for angle in (a, b, c)),
    ]


def forward_kinematics(question: ForwardQuestion, values: Mapping[str, Array]) -> Many:
    """The poses of flange or tool."""
    typed = values["q"]
    q = radians(question, typed)
    T = question.robot.fk(q)
    g = question.data.geometry
    if not question.si:
        # Quarter turns must give exact poses, as they do for one configuration.
        turns = typed / 90.0
        at = np.flatnonzero((turns == np.rint(turns)).any(axis=1))
        if len(at):
            trig = [exact_trig(angle) for angle in columns_of(typed[at])]
            T[at] = stacked(forward.flange(trig, g).rows(), len(at))
    rows: Rows = [[T[:, i, j] for j in range(4)] for i in range(4)]
    if question.to_base is not None:
        rows = product(question.to_base, rows)
    if question.tool is not None:
        rows = product(rows, question.tool)
    joints = columns_of(q)
    numbers = _pose_numbers(question, rows)
    s, t = status(joints, g, ARRAYS), turn(joints)
    columns = dict(zip("xyzabcst", [*numbers, s, t], strict=True))
    arrays: dict[str, Any] = {
        "T": stacked(rows, len(q)),
        "pose": np.stack(numbers, axis=-1),
        "s": np.asarray(s, dtype=float),
        "t": np.asarray(t, dtype=float),
    }
    if question.mass_centres:
        centres = shown_lengths(question, question.robot.mass_centres(q))
        arrays["mass_centres"] = centres
        for i in range(6):
            columns |= {f"{axis}_com{i + 1}": centres[:, i, k] for k, axis in enumerate("xyz")}
    switch = np.zeros(len(q), dtype=bool)
    for i in kuka.TURNING_JOINTS:
        turning = np.abs(joints[i])
        switch |= (TOLERANCES.sign < turning) & (turning < TOLERANCES.turn_switch)
    return Many(
        columns,
        arrays,
        large(values),
        beyond_limits(question, joints) | switch,
        lambda i: question.warnings(q[i].tolist()),
    )
