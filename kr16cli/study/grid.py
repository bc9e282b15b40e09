"""Where a map looks: a grid of points in robroot, and the orientations tried at each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from kr16cli import kuka
from kr16cli.arrays import Array
from kr16cli.errors import InputError
from kr16cli.robot import RobotData

Orientation = Literal["fixed", "list", "free"]
Point = Literal["flange", "tool", "wrist"]

MOST_POSES = 10**11
"""More poses than this are a slip of the keyboard: they take days and terabytes."""
_MOST_ALONG = 10**6
_POINTS_AT_ONCE = 4096
_SLACK = 1e-9


@dataclass(frozen=True)
class Grid:
    """Points and orientations of a map.

    Attributes:
        x, y, z: coordinates along the axes of robroot, m, ascending.
        rotations: (k, 3, 3) R_robroot_point, the orientations tried at each point.
        kind: "fixed" one orientation, "list" a row of the map for each, "free" one row for each
            point with the best and worst of all orientations.
        step: spacing, m.
    """

    x: Array
    y: Array
    z: Array
    rotations: Array
    kind: Orientation
    step: float

    @property
    def points(self) -> int:
        """How many points."""
        return len(self.x) * len(self.y) * len(self.z)

    @property
    def poses(self) -> int:
        """How many poses."""
        return self.points * len(self.rotations)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a map: x, y, z, and the orientation where each has its row."""
        lead = (len(self.x), len(self.y), len(self.z))
        return (*lead, len(self.rotations)) if self.kind == "list" else lead

    def positions(self, start: int, stop: int, out: Array) -> Array:
        """Points `start` to `stop` in the order of the map (z fastest), into (n, 3)."""
        first, last, along = start // len(self.z), (stop - 1) // len(self.z), len(self.z)
        lines = np.arange(first, last + 1)  # of points above one another
        ix = lines // len(self.y)
        counts = np.full(len(lines), along)
        counts[0] -= start - first * along
        counts[-1] -= (last + 1) * along - stop
        out[:, 0] = np.repeat(self.x[ix], counts)
        out[:, 1] = np.repeat(self.y[lines - ix * len(self.y)], counts)
        begin = start - first * along
        heights = self._heights
        if len(heights) < begin + stop - start:
            heights = np.resize(self.z, begin + stop - start)
        out[:, 2] = heights[begin : begin + stop - start]
        return out

    @cached_property
    def _heights(self) -> Array:
        """The heights of a line, again and again, for as many points as are usually asked for."""
        return np.resize(self.z, len(self.z) + _POINTS_AT_ONCE)


def make_grid(
    data: RobotData,
    step: float,
    *,
    ranges: Mapping[str, Sequence[float] | None] | None = None,
    rotations: Array,
    kind: Orientation = "fixed",
    longer: float = 0.0,
) -> Grid:
    """A grid with points at whole multiples of the step.

    Args:
        data: the robot; its reach bounds the axes that `ranges` leaves open.
        step: spacing, m.
        ranges: for "x", "y", "z" the lowest and highest coordinate (m), or one coordinate for a
            plane, or None.
        rotations: (k, 3, 3).
        kind: see `Grid`.
        longer: how far beyond the flange the mapped point may be, m.

    Raises:
        InputError: a step, range or number of poses that makes no grid.
    """
    g = data.geometry
    if not (math.isfinite(step) and step > 0.0):
        raise InputError(f"--grid is {step:g} m; the spacing must be more than 0")
    arm = g.a2 + math.hypot(g.a3, g.d4) + g.d6 + longer
    around, above = abs(g.a1) + arm, (g.d1 - arm, g.d1 + arm)
    bounds = {"x": (-around, around), "y": (-around, around), "z": above}
    axes = {name: _axis(name, (ranges or {}).get(name), bounds[name], step) for name in "xyz"}
    grid = Grid(axes["x"], axes["y"], axes["z"], rotations, kind, step)
    if grid.poses > MOST_POSES:
        raise InputError(
            f"--grid {step:g} m makes {grid.poses:.3g} poses; at most {MOST_POSES:.0e} are "
            "possible: take a larger spacing or narrower ranges"
        )
    return grid


def _axis(
    name: str, given: Sequence[float] | None, bound: tuple[float, float], step: float
) -> Array:
    if given is not None and len(given) == 1:
        return np.array([float(given[0])])
    low, high = bound if given is None else (float(given[0]), float(given[1]))
    if not low <= high:
        raise InputError(f"--{name} {low:g}:{high:g} m is empty; the lower end comes first")
    count = (high - low) / step
    if count > _MOST_ALONG:
        raise InputError(
            f"--grid {step:g} m makes {count:.3g} points along {name}, more than "
            f"{_MOST_ALONG:.0e}; take a larger spacing"
        )
    first, last = math.ceil(low / step - _SLACK), math.floor(high / step + _SLACK)
    if last < first:
        raise InputError(
            f"--{name} {low:g}:{high:g} m holds no multiple of the spacing {step:g} m; widen it, "
            "or give one coordinate for a plane"
        )
    axis: Array = step * np.arange(first, last + 1, dtype=np.float64)
    return axis


def from_abc(angles: Sequence[Sequence[float]], *, si: bool = False) -> Array:
    """(k, 3, 3) rotations of A, B, C in degrees, or rad with `si`."""
    matrices = [kuka.matrix_from_pose([0.0, 0.0, 0.0, *abc], si=si) for abc in angles]
    return np.array(matrices)[:, :3, :3]


def all_around(directions: int, rolls: int = 1) -> Array:
    """Orientations whose z axes are spread evenly over the sphere, each turned in equal steps.

    The directions are a Fibonacci spiral: equal shares of area along z, golden angle around it.

    Args:
        directions: how many z axes, 1 or more.
        rolls: turns about each, 1 or more.

    Returns:
        (directions * rolls, 3, 3).
    """
    for name, value in (("directions", directions), ("rolls", rolls)):
        if value < 1:
            raise InputError(f"--{name} is {value}; it must be a whole number of 1 or more")
    k = np.arange(directions)
    height = 1.0 - (2.0 * k + 1.0) / directions
    around = k * (math.pi * (3.0 - math.sqrt(5.0)))
    radius = np.sqrt(1.0 - height * height)
    z = np.stack([radius * np.cos(around), radius * np.sin(around), height], axis=-1)
    x = np.stack([height * np.cos(around), height * np.sin(around), -radius], axis=-1)
    frame = np.stack([x, np.cross(z, x), z], axis=-1)
    turn = np.arange(rolls) * (2.0 * math.pi / rolls)
    c, s, o = np.cos(turn), np.sin(turn), np.zeros(rolls)
    about_z = np.array([[c, -s, o], [s, c, o], [o, o, o + 1.0]]).transpose(2, 0, 1)
    made: Array = (frame[:, None] @ about_z).reshape(-1, 3, 3)
    return made
