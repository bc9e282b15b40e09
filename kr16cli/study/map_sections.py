"""Plane cuts through a map and the outline of the arm, for drawing: plain arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.study.maps import MAIN, MapWork
from kr16cli.study.store import Store
from kr16cli.verify.drawings import workspace
from kr16cli.verify.records import Setting

_AXES = "xyz"


class Section(NamedTuple):
    """One layer of a map.

    Attributes:
        normal: the axis it is cut across, "x", "y" or "z"; `at` its coordinate, m.
        across, up: names of the axes in the plane, with their coordinates `u`, `v`, m.
        values: (len(v), len(u)) of the map's main column; NaN where nothing is reached.
        orientation: which of a list of orientations.
    """

    normal: str
    at: float
    across: str
    up: str
    u: Array
    v: Array
    values: Array
    orientation: int


def sections(work: MapWork, store: Store) -> list[Section]:
    """The layers worth a look: the plane of a flat map, else three through the middle.

    With a list of orientations, the first orientation's.
    """
    sizes = [len(axis) for axis in work.axes().values()]
    flat = [i for i, size in enumerate(sizes) if size == 1]
    if len(flat) > 1:
        return []
    g = work.grid
    centre = (0.0, 0.0, work.data.geometry.d1)
    cuts = [(i, _nearest(work.axes()[_AXES[i]], centre[i])) for i in flat or (1, 2, 0)]
    each = len(g.rotations) if g.kind == "list" else 1
    indices = [_rows(sizes, normal, at) * each for normal, at in cuts]
    values = _gathered(store, MAIN[work.quantity], indices)
    branches = _gathered(store, "branches", indices)
    made = []
    for (normal, at), found, count in zip(cuts, values, branches, strict=True):
        across, up = (i for i in range(3) if i != normal)
        shape = (sizes[across], sizes[up])
        shown = np.where(count == 0, np.nan, found.astype(np.float64)).reshape(shape).T
        u, v = (work.axes()[_AXES[i]] for i in (across, up))
        cut = float(work.axes()[_AXES[normal]][at])
        made.append(Section(_AXES[normal], cut, _AXES[across], _AXES[up], u, v, shown, 0))
    return made


def _nearest(axis: Array, value: float) -> int:
    return int(np.abs(axis - value).argmin())


def _rows(sizes: list[int], normal: int, at: int) -> npt.NDArray[np.int64]:
    """Numbers of the points of a layer, the first of its two axes slowest."""
    steps = (sizes[1] * sizes[2], sizes[2], 1)
    first, second = (i for i in range(3) if i != normal)
    base = at * steps[normal]
    table = (
        base + np.arange(sizes[first])[:, None] * steps[first]
        + np.arange(sizes[second]) * steps[second]
    )  # fmt: skip
    return table.reshape(-1)


def _gathered(
    store: Store, name: str, indices: list[npt.NDArray[np.int64]]
) -> list[npt.NDArray[Any]]:
    """Entries of a column by row, chunk by chunk; the rows ascend."""
    made: list[npt.NDArray[Any]] = [
        np.empty(len(rows), dtype=store.work.columns()[name].dtype) for rows in indices
    ]
    start = 0
    for part in store.column(name):
        for rows, values in zip(indices, made, strict=True):
            low, high = np.searchsorted(rows, (start, start + len(part)))
            values[low:high] = part[rows[low:high] - start]
        start += len(part)
    return made


class Outline(NamedTuple):
    """Edges of the working envelope in the plane y = 0 by name, (n, 2) x and z in m.

    Attributes:
        front: with the arm to the front, A1 = 0.
        behind: with A1 turned by half a turn; empty where its limits do not let it.
        moved: whether they are the mapped point's; else they are the wrist centre's.
    """

    front: dict[str, Array]
    behind: dict[str, Array]
    moved: bool


def outline(work: MapWork) -> Outline:
    """The envelope, moved to the mapped point where that is at a fixed place from the wrist centre.

    With a fixed orientation the way from the wrist to the point is the same in every posture; it
    must lie in the plane.
    """
    front = dict(workspace(Setting(Robot(work.data), quick=True))["edges"])
    first = work.data.joints[0]
    turns = max(-first.lower, first.upper) >= np.pi
    behind = {name: points * [-1.0, 1.0] for name, points in front.items()} if turns else {}
    if work.point == "wrist":
        return Outline(front, behind, moved=True)
    offset = -work.wrist_offsets()[0]
    if work.grid.kind == "free" or abs(offset[1]) > 1e-9:
        return Outline(front, behind, moved=False)
    front, behind = (
        {name: points + offset[[0, 2]] for name, points in edges.items()}
        for edges in (front, behind)
    )
    return Outline(front, behind, moved=True)
