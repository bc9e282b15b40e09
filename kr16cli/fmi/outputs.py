"""The outputs of the FMU, computed in groups when a host asks for them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from kr16cli.fmi.settings import Settings
from kr16cli.model.orientation import rpy_from_rotation
from kr16cli.model.scalars import FLOATS
from kr16cli.tolerances import TOLERANCES

INPUTS = ("tau", "q_ref", "qd_ref", "qdd_ref", "wrench")
"""The inputs, six numbers each."""

Six = Sequence[float]


def group(name: str) -> str:
    """The group an output is computed in: its name without index, or the first part of it."""
    stem = name.partition("[")[0]
    return stem if stem.startswith("limit") else stem.partition(".")[0]


def compute(name: str, settings: Settings, time: float, q: Six, qd: Six) -> Sequence[Any]:
    """The values of a group, in the table's order, at a time (s) and state (rad, rad/s)."""
    return _GROUPS[name](settings, time, q, qd)


def _applied(s: Settings, t: float, q: Six, qd: Six) -> list[float]:
    return s.plant.applied(s.plant.torque(t, q, qd), qd)


def _acceleration(s: Settings, t: float, q: Six, qd: Six) -> list[float]:
    return s.plant.acceleration(t, q, qd, _applied(s, t, q, qd))


def _pose(s: Settings, t: float, q: Six, qd: Six) -> list[float]:
    T = s.arm.fk(q)
    return [*(row[3] for row in T[:3]), *rpy_from_rotation([row[:3] for row in T[:3]], FLOATS)]


def _outside(s: Settings, t: float, q: Six, qd: Six) -> list[bool]:
    slack = TOLERANCES.limit
    return [
        not j.lower - slack <= angle <= j.upper + slack
        for j, angle in zip(s.arm.data.joints, q, strict=True)
    ]


def _fast(s: Settings, t: float, q: Six, qd: Six) -> list[bool]:
    return [
        j.speed is not None and abs(rate) > j.speed
        for j, rate in zip(s.arm.data.joints, qd, strict=True)
    ]


def _loaded(s: Settings, t: float, q: Six, qd: Six) -> list[bool]:
    return [
        j.torque is not None and abs(tau) > j.torque
        for j, tau in zip(s.arm.data.joints, s.plant.torque(t, q, qd), strict=True)
    ]


_GROUPS: dict[str, Callable[[Settings, float, Six, Six], Sequence[Any]]] = {
    "q": lambda s, t, q, qd: q,
    "qd": lambda s, t, q, qd: qd,
    "qdd": _acceleration,
    "tau_applied": _applied,
    "tau": lambda s, t, q, qd: s.plant.torque(t, q, qd),
    "pose": _pose,
    "energy": lambda s, t, q, qd: s.arm.energy(q, qd),
    "limit.position": _outside,
    "limit.speed": _fast,
    "limit.torque": _loaded,
}
