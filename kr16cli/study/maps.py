"""What the arm can do at each point of a grid: the closed-form branches of every pose, judged.

Five quantities: `reach`, `manipulability`, `condition`, `torque`, `payload`. Only branches within
the joint limits count; where there is none a measure is NaN. Measures are float32: seven digits,
a hundredth of the disk.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.errors import InputError
from kr16cli.robot import Payload, RobotData
from kr16cli.study.grid import Grid, Point
from kr16cli.study.work import Chunk, Column
from kr16cli.tolerances import TOLERANCES

Quantity = Literal["reach", "manipulability", "condition", "torque", "payload"]

MOST_PAYLOAD = 1000.0
"""A branch whose joints the load does not burden holds any mass; the map says this, kg."""

MOST_CONDITION = 1e12
"""The condition number of a singular Jacobian: beyond this, rounding decides."""

_POSES_AT_ONCE = 4096
"""Poses that go through the kernel together: their arrays stay in the core's cache."""
_CHUNK = {"reach": 1 << 20, "manipulability": 1 << 20}
_SLOW_CHUNK = 1 << 16

_COUNTS = {"solutions": Column("u1"), "branches": Column("u1")}
COLUMNS: Mapping[Quantity, Mapping[str, Column]] = {
    "reach": {**_COUNTS, "limit_margin": Column("f4", unit="rad")},
    "manipulability": {
        "branches": Column("u1"),
        "best": Column("f4", unit="m3"),
        "worst": Column("f4", unit="m3"),
        "singular_margin": Column("f4", unit="1"),
    },
    "condition": {
        "branches": Column("u1"),
        "smallest_best": Column("f4", unit="1"),
        "smallest_worst": Column("f4", unit="1"),
        "condition_best": Column("f4", unit="1"),
        "condition_worst": Column("f4", unit="1"),
    },
    "torque": {
        "branches": Column("u1"),
        "load_best": Column("f4", unit="1"),
        "load_worst": Column("f4", unit="1"),
        "joint": Column("u1"),
    },
    "payload": {
        "branches": Column("u1"),
        "mass_best": Column("f4", unit="kg"),
        "mass_worst": Column("f4", unit="kg"),
        "joint": Column("u1"),
    },
}
"""Columns of each map, before those of free orientation.

`solutions` counts closed-form branches, `branches` those within the limits. `limit_margin` is
the best branch's distance to its nearest limit. `best` and `worst` are |det J| (Yoshikawa's
manipulability of six joints); `singular_margin` is the best branch's least factor of (3.37) over
its largest value. `smallest` is the smallest singular value of J with linear rows divided by the
characteristic length, `condition` the largest over the smallest. `load` is the largest |static
torque| over the joint's torque, `mass` the payload that can just be held, `joint` (1 to 6) which
one decides in the best branch, 0 where there is none.
"""
_LEAST = frozenset({"worst", "smallest_worst", "condition_best", "load_best", "mass_worst"})
"""Columns of which the smallest counts when orientations are merged; of others the largest."""

MAIN: Mapping[Quantity, str] = {
    "reach": "branches",
    "manipulability": "best",
    "condition": "condition_best",
    "torque": "load_best",
    "payload": "mass_best",
}
"""The column a plot of the map shows."""


@dataclass(frozen=True)
class MapWork:
    """A map, cut into rows: a point, or with a list of orientations a pose.

    Attributes:
        data: the robot.
        quantity: what is mapped.
        grid: where.
        point: which point of the arm stands on the grid, with its orientation.
        tool: T_flange_tool (4, 4) as nested tuples, for the point "tool".
        payload: on the flange; of the map `payload` only its mass centre counts.
        length: characteristic length of `condition`, m.
    """

    data: RobotData
    quantity: Quantity
    grid: Grid
    point: Point = "flange"
    tool: tuple[tuple[float, ...], ...] | None = None
    payload: Payload | None = None
    length: float = 1.0

    prefers: Literal["threads", "processes"] = field(default="threads", init=False)

    def __post_init__(self) -> None:
        if self.quantity in ("torque", "payload"):
            Robot(self.data).arm.require_inertia()
            missing = [j.name for j in self.data.joints if j.torque is None]
            if missing:
                raise InputError(
                    f"{self.data.name} gives no torque_nm of {', '.join(missing)}; a map of "
                    f"{self.quantity} needs the torque of every joint"
                )
        if not self.length > 0.0:
            raise InputError(f"--length is {self.length:g} m; it must be more than 0")
        if self.point == "tool" and self.tool is None:
            raise InputError("--point tool needs --tool X Y Z A B C")

    @property
    def rows(self) -> int:
        """See `work.Work`."""
        return self.grid.poses if self.grid.kind == "list" else self.grid.points

    @property
    def chunk_rows(self) -> int:
        """See `work.Work`; about a second of work."""
        poses = 1 if self.grid.kind == "list" else len(self.grid.rotations)
        return max(1, _CHUNK.get(self.quantity, _SLOW_CHUNK) // poses)

    def columns(self) -> dict[str, Column]:
        """See `work.Work`."""
        free = {"orientations": Column("u4")} if self.grid.kind == "free" else {}
        return {**COLUMNS[self.quantity], **free}

    def describe(self) -> dict[str, Any]:
        """See `work.Work`."""
        g = self.grid
        return {
            "study": "map",
            "quantity": self.quantity,
            "robot": self.data.name,
            "model_sha256": self.data.sha256,
            "point": self.point,
            "tool": self.tool,
            "payload": vars(self.payload) if self.payload else None,
            "length": self.length,
            "orientation": g.kind,
            "rotations": hashlib.sha256(np.ascontiguousarray(g.rotations).tobytes()).hexdigest(),
            "grid": {n: [float(a[0]), float(a[-1]), len(a)] for n, a in self.axes().items()},
            "step": g.step,
        }

    def axes(self) -> dict[str, Array]:
        """The coordinates by name, m."""
        return {"x": self.grid.x, "y": self.grid.y, "z": self.grid.z}

    @cached_property
    def flange(self) -> tuple[Array, Array]:
        """R_robroot_flange (k, 3, 3) per orientation; from the point to the flange (k, 3), m."""
        rotations = self.grid.rotations
        if self.point == "wrist":
            return rotations, self.data.geometry.d6 * rotations[:, :, 2]
        if self.tool is None or self.point == "flange":
            return rotations, np.zeros((len(rotations), 3))
        tool = np.array(self.tool)
        turned = rotations @ tool[:3, :3].T
        return turned, -turned @ tool[:3, 3]

    def wrist_offsets(self) -> Array:
        """From the point to the wrist centre in robroot for each orientation, (k, 3), m."""
        rotations, offsets = self.flange
        return offsets - self.data.geometry.d6 * rotations[:, :, 2]

    def compute(self, start: int, stop: int) -> Chunk:
        """See `work.Work`."""
        made = {n: np.empty(stop - start, dtype=c.dtype) for n, c in self.columns().items()}
        judge = _Judge(self)
        each = len(self.grid.rotations) if self.grid.kind == "list" else 1
        position = np.empty((3, _POSES_AT_ONCE)).T  # a coordinate after the other
        first, last = start // each, -(-stop // each)
        for low in range(first, last, _POSES_AT_ONCE):
            high = min(low + _POSES_AT_ONCE, last)
            at = self.grid.positions(low, high, position[: high - low])
            if self.grid.kind == "list":
                self._listed(made, judge, at, (low, start, stop))
            else:
                rows = slice(low - start, high - start)
                self._merged(made, judge, at, rows)
        return made

    def _listed(self, made: Chunk, judge: _Judge, at: Array, place: tuple[int, int, int]) -> None:
        """A row for each orientation; those of the first and last point may be another chunk's."""
        low, start, stop = place
        each = len(self.grid.rotations)
        for k in range(each):
            rows = (low + np.arange(len(at))) * each + k - start
            mine = (rows >= 0) & (rows < stop - start)
            for name, values in judge.judged(k, at).items():
                made[name][rows[mine]] = values[mine]

    def _merged(self, made: Chunk, judge: _Judge, at: Array, rows: slice) -> None:
        """The best and the worst over all orientations."""
        for k in range(len(self.grid.rotations)):
            found = judge.judged(k, at)
            if self.grid.kind == "free":
                found["orientations"] = (found["branches"] > 0).astype("u4")
            for name, values in found.items():
                column = made[name][rows]
                if k == 0:
                    column[...] = values
                elif name == "orientations":
                    column += values
                elif name == "joint":  # goes with the column before it
                    continue
                else:
                    if "joint" in found and name == MAIN[self.quantity]:
                        better = _better(name, values, column)
                        made["joint"][rows][better] = found["joint"][better]
                    pick = np.fmin if name in _LEAST else np.fmax
                    pick(column, values, out=column)


def _better(name: str, new: npt.NDArray[Any], old: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Where a new measure takes the place of the old one; NaN is no measure."""
    ahead = new < old if name in _LEAST else new > old
    return np.asarray(ahead | (np.isnan(old) & ~np.isnan(new)))


class _Judge:
    """Judges poses of one orientation at many points, with arrays that are used again."""

    def __init__(self, work: MapWork) -> None:
        self.work = work
        self.robot = Robot(work.data)
        self.loaded = Robot(work.data, payload=work.payload)
        self.rotations, self.offsets = work.flange
        self.pose = np.zeros((_POSES_AT_ONCE, 4, 4))
        self.pose[:, 3, 3] = 1.0
        self.known, self.x = -1, np.nan
        self.measures = np.empty((_POSES_AT_ONCE, 6))
        self.angles = np.empty((_POSES_AT_ONCE, 8, 6))
        self.torques = np.array([j.torque or np.nan for j in work.data.joints])

    def judged(self, orientation: int, at: Array) -> Chunk:
        """Columns of the map for points (n, 3) under one orientation."""
        n = len(at)
        if orientation != self.known:
            self.pose[:, :3, :3] = self.rotations[orientation]
            self.known = orientation
        pose = self.pose[:n]
        # By coordinate: NumPy's loops over three numbers cost more than the sums.
        x, *others = self.offsets[orientation]
        self._place_x(at[:, 0], float(x), pose)
        for i, offset in enumerate(others, 1):
            np.add(at[:, i], offset, out=pose[:, i, 3])
        quantity = self.work.quantity
        if quantity in ("reach", "manipulability"):
            return self._closed(pose, self.measures[:n])
        q = self.robot.ik(pose, out=self.angles[:n])
        if quantity == "condition":
            return self._condition(q)
        return self._torque(q)

    def _place_x(self, x: Array, offset: float, pose: Array) -> None:
        """Write x, which ascends and mostly is the block's before, where it stands already."""
        if x[0] != x[-1]:
            self.x = np.nan
            np.add(x, offset, out=pose[:, 0, 3])
        elif self.x != x[0] + offset:
            self.x = float(x[0] + offset)
            self.pose[:, 0, 3] = self.x

    def _closed(self, pose: Array, measures: Array) -> Chunk:
        self.robot.judge_branches(pose, out=measures)
        solutions, within, best, worst, limits, singular = measures.T
        none = within == 0.0
        branches = within.astype("u1")
        if self.work.quantity == "reach":
            margin = limits.astype("f4")
            margin[none] = np.nan
            return {"solutions": solutions.astype("u1"), "branches": branches,
                    "limit_margin": margin}  # fmt: skip
        made: Chunk = {"branches": branches}
        for name, values in (("best", best), ("worst", worst), ("singular_margin", singular)):
            made[name] = values.astype("f4")
            made[name][none] = np.nan
        return made

    def _condition(self, q: Array) -> Chunk:
        within = self._within(q)
        # The two wrists of an arm posture have one Jacobian but for the sign of a column.
        arms = within.reshape(-1, 4, 2)
        which = np.where(arms[..., 0], 0, 1)
        angles = np.take_along_axis(q.reshape(-1, 4, 2, 6), which[..., None, None], axis=2)
        there = arms.any(axis=2)
        jacobian = self.robot.jacobian(np.ascontiguousarray(angles[:, :, 0][there]))
        jacobian[:, :3] /= self.work.length
        sigma = np.linalg.svd(jacobian, compute_uv=False)
        smallest = np.full(there.shape, np.nan)
        ratio = smallest.copy()
        smallest[there] = sigma[:, -1]
        with np.errstate(divide="ignore"):
            ratio[there] = np.minimum(sigma[:, 0] / sigma[:, -1], MOST_CONDITION)
        return {
            "branches": within.sum(axis=1).astype("u1"),
            "smallest_best": _largest(smallest),
            "smallest_worst": _smallest(smallest),
            "condition_best": _smallest(ratio),
            "condition_worst": _largest(ratio),
        }

    def _torque(self, q: Array) -> Chunk:
        within = self._within(q)
        angles = np.ascontiguousarray(q[within])
        if self.work.quantity == "torque":
            share = np.abs(self.loaded.gravity(angles)) / self.torques
            value, joint = share.max(axis=1), share.argmax(axis=1)
        else:
            mass = self._masses(angles)
            value, joint = mass.min(axis=1), mass.argmin(axis=1)
        table = np.full(within.shape, np.nan)
        table[within] = value
        joints = np.zeros(within.shape, dtype="u1")
        joints[within] = joint + 1
        least, most = _smallest(table), _largest(table)
        best_first = table if self.work.quantity == "torque" else -table
        chosen = np.where(within, best_first, np.inf).argmin(axis=1)
        deciding = np.take_along_axis(joints, chosen[:, None], axis=1)[:, 0]
        count = within.sum(axis=1).astype("u1")
        if self.work.quantity == "torque":
            return {"branches": count, "load_best": least, "load_worst": most, "joint": deciding}
        return {"branches": count, "mass_best": most, "mass_worst": least, "joint": deciding}

    def _masses(self, angles: Array) -> Array:
        """The mass at which each joint's static torque reaches its limit, (n, 6), kg.

        Static torque is G0 + m G1, linear in the mass m at a given mass centre.
        """
        com = self.work.payload.com if self.work.payload else (0.0, 0.0, 0.0)
        empty = self.robot.gravity(angles)
        each = self.robot.with_payload(1.0, com).gravity(angles) - empty
        room = self.torques - np.copysign(1.0, each) * empty
        with np.errstate(divide="ignore", invalid="ignore"):
            mass = np.where(np.abs(each) > 1e-12, room / np.abs(each), MOST_PAYLOAD)
        mass[np.abs(empty) > self.torques] = 0.0
        return np.clip(mass, 0.0, MOST_PAYLOAD)

    def _within(self, q: Array) -> npt.NDArray[np.bool_]:
        """Which branches (n, 8) are within the limits, whole turns added where that helps."""
        inside = np.ones(q.shape[:2], dtype=bool)
        for i, joint in enumerate(self.work.data.joints):
            away = np.remainder(q[..., i] - joint.lower + TOLERANCES.limit, 2 * np.pi)
            inside &= away <= joint.upper - joint.lower + 2 * TOLERANCES.limit
        return inside


def _smallest(table: Array) -> npt.NDArray[np.float32]:
    least: Array = np.fmin.reduce(table, axis=1)
    return least.astype(np.float32)


def _largest(table: Array) -> npt.NDArray[np.float32]:
    most: Array = np.fmax.reduce(table, axis=1)
    return most.astype(np.float32)
