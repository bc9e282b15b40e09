"""What a parameter file leaves open: its numbers with a tolerance, and robots drawn from them.

A link's tolerance counts for its mass, for its mass centre along its own direction, and for its
inertia as a whole (a scaled tensor still is a body's); a note's tolerance takes its place for
one key. `plus_minus` moves each coordinate or entry on its own. Numbers without a tolerance are
taken as exact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from kr16cli.arrays import Array
from kr16cli.errors import InputError
from kr16cli.robot import JointData, LinkData, Provenance, RobotData, Tolerance

Distribution = Literal["normal", "uniform"]

_LEAST_FACTOR = 0.01
"""No factor falls below this: a mass or an inertia stays positive."""

_AXES = "xyz"
_ENTRIES = ("xx", "yy", "zz", "xy", "xz", "yz")
_DRIVE = {
    "gear_ratio": "gear_ratio",
    "rotor_inertia": "rotor_inertia",
    "coulomb_nm": "coulomb",
    "viscous_nms": "viscous",
}


class Uncertain(NamedTuple):
    """One source of uncertainty.

    Attributes:
        name: dotted key, such as "link[2].mass"; links and joints counted from 1.
        half: half width of the interval that holds it with 95 %: a factor's, or in SI.
        unit: "relative" or the SI unit.
        apply: (data, deviation) -> data with the number moved by the deviation, in `unit`.
    """

    name: str
    half: float
    unit: str
    apply: Callable[[RobotData, Any], RobotData]


def uncertain(data: RobotData, *, drives: bool = False) -> list[Uncertain]:
    """Every number of a robot with a tolerance above 0.

    Args:
        data: the robot.
        drives: count rotor inertia, gear ratio and friction, too.

    Raises:
        InputError: there is none.
    """
    found = list(_of_geometry(data))
    for i, link in enumerate(data.links):
        found += _of_link(i, link)
    if drives:
        for i, joint in enumerate(data.joints):
            found += _of_joint(i, joint)
    if not found:
        raise InputError(
            f"{data.name} ({data.path}) states no tolerance: 0 numbers have one; give a [[link]] a "
            "tolerance, or a note a tolerance or plus_minus"
        )
    return found


def taken_as_exact(data: RobotData, *, drives: bool = False) -> list[str]:
    """A sentence on the links, and with `drives` the drives, without any tolerance; else none."""
    exact = [
        f"link {i}"
        for i, link in enumerate(data.links, 1)
        if not link.tolerance and not link.provenance.tolerances
    ]
    if drives:
        exact += [
            f"the drive of {joint.name}"
            for joint in data.joints
            if any(getattr(joint, f) for f in _DRIVE.values()) and not any(_of_joint(0, joint))
        ]
    return [f"no tolerance is stated for {', '.join(exact)}; taken as exact"] if exact else []


def moved(data: RobotData, sources: Sequence[Uncertain], deviations: Any) -> RobotData:
    """The robot with every source moved.

    Args:
        data: the robot.
        sources: of `uncertain`.
        deviations: one for each source, in its unit; numbers, or arrays for many robots at once,
            whose data then hold arrays.
    """
    for source, deviation in zip(sources, deviations, strict=True):
        data = source.apply(data, deviation)
    return data


def standard(sources: Sequence[Uncertain], distribution: Distribution) -> Array:
    """Standard deviations (d,): half the half width if normal (95 % is two), over sqrt(3) else."""
    half = np.array([source.half for source in sources])
    return half * (0.5 if distribution == "normal" else 1.0 / np.sqrt(3.0))


def drawn(sources: Sequence[Uncertain], uniform: Array, distribution: Distribution) -> Array:
    """Deviations (n, d) from numbers in (0, 1), (n, d), by the inverse distribution.

    A normal factor is cut off where it would fall below one hundredth.
    """
    half = np.array([source.half for source in sources])
    if distribution == "uniform":
        made: Array = (2.0 * uniform - 1.0) * half
        return made
    from scipy.special import ndtr, ndtri

    factor = np.array([source.unit == "relative" for source in sources])
    sigma = standard(sources, distribution)
    lowest = np.where(factor, (_LEAST_FACTOR - 1.0) / sigma, -np.inf)
    below = ndtr(lowest)
    deviations: Array = sigma * ndtri(below + uniform * (1.0 - below))
    return deviations


def _tolerance(provenance: Provenance, key: str, whole: float | None = None) -> Tolerance:
    """The tolerance of a key: its note's, else the group's."""
    own = provenance.tolerances.get(key)
    return Tolerance(whole) if own is None else own


def _of_geometry(data: RobotData) -> Iterator[Uncertain]:
    for key in data.geometry._fields:
        tolerance = _tolerance(data.geometry_provenance, key)
        half = tolerance.absolute or (tolerance.relative or 0.0) * abs(getattr(data.geometry, key))
        if half:
            yield Uncertain(f"geometry.{key}", half, "m", _Length(key))


def _of_link(i: int, link: LinkData) -> Iterator[Uncertain]:
    for key, unit, names in (
        ("mass", "kg", ("",)), ("com", "m", _AXES), ("inertia", "kg m2", _ENTRIES)
    ):  # fmt: skip
        tolerance = _tolerance(link.provenance, key, link.tolerance)
        if tolerance.absolute:
            for k, name in enumerate(names):
                label = f"link[{i + 1}].{key}" + (f".{name}" if name else "")
                yield Uncertain(label, tolerance.absolute, unit, _Entry(i, key, k))
        elif tolerance.relative:
            label = f"link[{i + 1}].{key}"
            yield Uncertain(label, tolerance.relative, "relative", _Scale(i, key))


def _of_joint(i: int, joint: JointData) -> Iterator[Uncertain]:
    for key, field in _DRIVE.items():
        tolerance, value = _tolerance(joint.provenance, key), getattr(joint, field)
        half = tolerance.absolute or (tolerance.relative or 0.0) * (value or 0.0)
        if half and value:
            yield Uncertain(f"joint[{i + 1}].{key}", half / value, "relative", _Drive(i, field))


@dataclass(frozen=True)
class _Length:
    key: str

    def __call__(self, data: RobotData, deviation: Any) -> RobotData:
        value = getattr(data.geometry, self.key) + deviation
        return replace(data, geometry=data.geometry._replace(**{self.key: value}))


@dataclass(frozen=True)
class _Scale:
    """A number of a link, or all of a group of numbers, by a factor."""

    link: int
    key: str

    def __call__(self, data: RobotData, deviation: Any) -> RobotData:
        value, factor = getattr(data.links[self.link], self.key), 1.0 + deviation
        scaled = tuple(v * factor for v in value) if isinstance(value, tuple) else value * factor
        return _with_link(data, self.link, {self.key: scaled})


@dataclass(frozen=True)
class _Entry:
    """One number of a link, moved."""

    link: int
    key: str
    entry: int

    def __call__(self, data: RobotData, deviation: Any) -> RobotData:
        value = getattr(data.links[self.link], self.key)
        if not isinstance(value, tuple):
            return _with_link(data, self.link, {self.key: value + deviation})
        values = [v + deviation if k == self.entry else v for k, v in enumerate(value)]
        return _with_link(data, self.link, {self.key: tuple(values)})


@dataclass(frozen=True)
class _Drive:
    joint: int
    field: str

    def __call__(self, data: RobotData, deviation: Any) -> RobotData:
        joint = data.joints[self.joint]
        value = getattr(joint, self.field) * (1.0 + deviation)
        joints = list(data.joints)
        joints[self.joint] = replace(joint, **{self.field: value})
        return replace(data, joints=tuple(joints))


def _with_link(data: RobotData, index: int, changes: dict[str, Any]) -> RobotData:
    links = list(data.links)
    links[index] = replace(links[index], **changes)
    return replace(data, links=tuple(links))
