"""A finished map in a few numbers, and beside the published envelope of the robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.study.maps import MapWork
from kr16cli.study.store import Store
from kr16cli.units import mm
from kr16cli.verify.records import Setting, SkipCase
from kr16cli.verify.suites.datasheet import envelope, reference

_POINTS_AT_ONCE = 1 << 18


SCHEMA = "kr16.map/1"


def answer(work: MapWork, store: Store) -> dict[str, Any]:
    """The JSON answer of `kr16 map`."""
    told = facts(work, store)
    nothing = (
        "nothing is reached within the joint limits: the whole grid lies beyond the arm, or the "
        "orientation is impossible there; look at --x, --y, --z and --abc"
    )
    return {
        "schema": SCHEMA,
        "robot": work.data.name,
        "model_sha256": work.data.sha256,
        "units": {name: column.unit or "1" for name, column in work.columns().items()},
        "input": work.describe(),
        "result": told,
        "warnings": [] if told["reached"] else [nothing],
    }


def facts(work: MapWork, store: Store) -> dict[str, Any]:
    """Share reached, extremes of the measures with where they are, and the envelope.

    Args:
        work: the map.
        store: complete; its chunks are read one at a time.

    Returns:
        JSON-ready, SI units: `rows`, `reached`, `share`, `branches` (how many rows have how
        many), `measures` (least, mean, largest, and where; of condition numbers the geometric
        mean), `volume` (m3, None for a section) and `envelope` (see `_envelope`).
    """
    names = [n for n, c in work.columns().items() if c.dtype == "f4"]
    measured = {name: _Extremes(ratio=name.startswith("condition")) for name in names}
    counts = np.zeros(9, dtype=np.int64)
    wrist = _Wrist(work)
    start = reached = 0
    for chunk in store.chunks():
        branches = chunk["branches"]
        counts += np.bincount(branches, minlength=9)
        index = np.flatnonzero(branches)
        reached += len(index)
        for name in names:
            measured[name].add(chunk[name], start)
        wrist.add(index + start)
        start += len(branches)
    volume = _volume(work, reached)
    return {
        "rows": work.rows,
        "poses": work.grid.poses,
        "reached": reached,
        "share": reached / work.rows,
        "branches": {str(n): int(count) for n, count in enumerate(counts) if count},
        "measures": {name: measured[name].told(work) for name in names},
        "volume": volume,
        "envelope": _envelope(work, wrist, volume),
    }


def point_of(work: MapWork, row: int) -> dict[str, Any]:
    """Where a row of the map is: x, y, z in m, and which orientation."""
    each = len(work.grid.rotations) if work.grid.kind == "list" else 1
    at = work.grid.positions(row // each, row // each + 1, np.empty((1, 3)))[0]
    place: dict[str, Any] = dict(zip("xyz", at.tolist(), strict=True))
    return place | ({"orientation": row % each} if each > 1 else {})


class _Extremes:
    """Least, largest and mean of a column, with the rows of the first two.

    Of a `ratio` the mean is the geometric one: a single singular posture would decide the other.
    """

    def __init__(self, *, ratio: bool) -> None:
        self.ratio = ratio
        self.least: tuple[float, int] | None = None
        self.most: tuple[float, int] | None = None
        self.total, self.count = 0.0, 0

    def add(self, values: Any, start: int) -> None:
        there = np.flatnonzero(~np.isnan(values))
        if not len(there):
            return
        known = values[there]
        low, high = int(known.argmin()), int(known.argmax())
        if self.least is None or known[low] < self.least[0]:
            self.least = float(known[low]), start + int(there[low])
        if self.most is None or known[high] > self.most[0]:
            self.most = float(known[high]), start + int(there[high])
        shown = np.log(known, dtype=np.float64) if self.ratio else known
        self.total += float(shown.sum(dtype=np.float64))
        self.count += len(known)

    def told(self, work: MapWork) -> dict[str, Any] | None:
        if self.least is None or self.most is None:
            return None
        mean = self.total / self.count
        return {
            "least": self.least[0],
            "least_at": point_of(work, self.least[1]),
            "mean": float(np.exp(mean)) if self.ratio else mean,
            "largest": self.most[0],
            "largest_at": point_of(work, self.most[1]),
        }


class _Wrist:
    """Extremes of the wrist centre over the rows reached, where each row has one."""

    def __init__(self, work: MapWork) -> None:
        self.work = work
        self.known = work.grid.kind != "free" or work.point == "wrist"
        self.each = len(work.grid.rotations) if work.grid.kind == "list" else 1
        self.offsets = work.wrist_offsets()
        self.radius, self.low, self.high = 0.0, np.inf, -np.inf

    def add(self, rows: Any) -> None:
        """Take rows that are reached."""
        if not self.known or not len(rows):
            return
        for low in range(0, len(rows), _POINTS_AT_ONCE):
            part = rows[low : low + _POINTS_AT_ONCE]
            at = _places(self.work, part // self.each) + self.offsets[part % self.each]
            self.radius = max(self.radius, float(np.hypot(at[:, 0], at[:, 1]).max()))
            self.low = min(self.low, float(at[:, 2].min()))
            self.high = max(self.high, float(at[:, 2].max()))


def _places(work: MapWork, index: Any) -> Array:
    """Points of the grid by number, (n, 3)."""
    g = work.grid
    rest, iz = np.divmod(index, len(g.z))
    ix, iy = np.divmod(rest, len(g.y))
    return np.stack([g.x[ix], g.y[iy], g.z[iz]], axis=-1)


def _volume(work: MapWork, reached: int) -> float | None:
    """Volume of the cells reached, m3; None where the map is no volume or has many layers."""
    g = work.grid
    if g.kind == "list" or min(len(g.x), len(g.y), len(g.z)) < 2:
        return None
    return float(reached * g.step**3)


def _envelope(work: MapWork, wrist: _Wrist, volume: float | None) -> list[dict[str, Any]]:
    """Figures of the data sheet beside the map's, mm (m3): {figure, published, map, reason}.

    The map's stay below the published ones by up to a cell of the grid, more where the
    orientation, or a range, keeps the arm from its farthest points; never above.
    """
    if not wrist.known or wrist.radius == 0.0:
        return []
    try:
        envelope(Setting(Robot(work.data), quick=True))
    except SkipCase:
        return []
    found = {
        "reach": mm(wrist.radius),
        "wrist_height": mm(wrist.high),
        "total_height": mm(wrist.high - wrist.low),
    }
    whole = work.grid.kind == "free" and work.point == "wrist" and volume is not None
    rows = []
    for row in reference("envelope"):
        name, published = row["figure"], float(row["value"])
        value = found.get(name)
        if name == "working_volume" and whole:
            value = volume
        if value is not None:
            slack = float(row["tolerance"])
            rows.append(
                {
                    "figure": name,
                    "published": published,
                    "map": value,
                    "unit": row["unit"],
                    "within": bool(value <= published + slack),
                    "status": row["status"],
                    "source": row["source"],
                }
            )
    return rows
