"""What happens during a run: joints that pass their limits, a target that is reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np

from kr16cli.arrays import Array
from kr16cli.robot import JointData
from kr16cli.tolerances import TOLERANCES

Dense = Callable[[Any], Array]
"""The solver's interpolation of a step: times (n,) to states (16, n); what comes after the six
angles and six speeds does not matter here."""

ARRIVAL = "target_reached"

REACHED = 1e-3
"""A joint this near to its target (rad, 0.06 deg) has reached it."""

_PARTS = 8
"""Parts of a step between which turning points are looked for."""


class Event(NamedTuple):
    """`kind` of event, its `time` (s), `joint` and `value` (the limit, rad).

    Kinds: "outside_lower", "outside_upper": the run starts beyond the limit; "leave_..." and
    "return_...": the joint passes the limit outward or inward. "target_reached", joint "all":
    the reference is over and every joint first within `value` of its end.
    """

    time: float
    joint: str
    kind: str
    value: float


class Watch(Protocol):
    """Looks for events."""

    def start(self, time: float, q: Array) -> list[Event]:
        """The events at the start, angles q (6,)."""

    def step(self, t0: float, t1: float, dense: Dense) -> list[Event]:
        """The events within a step, in order of time."""


class Watches:
    """Several watches as one."""

    def __init__(self, watches: Sequence[Watch]) -> None:
        self._watches = tuple(watches)

    def start(self, time: float, q: Array) -> list[Event]:
        """The events at the start."""
        return [event for watch in self._watches for event in watch.start(time, q)]

    def step(self, t0: float, t1: float, dense: Dense) -> list[Event]:
        """The events within a step, in order of time."""
        return sorted(event for watch in self._watches for event in watch.step(t0, t1, dense))


class TargetWatch:
    """Finds the time at which the end of a reference is reached, for the first time.

    Args:
        after: when the reference is over, s.
        q: its last configuration, rad.
    """

    def __init__(self, after: float, q: Sequence[float]) -> None:
        self._after, self._q, self._done = after, np.asarray(q), False

    def start(self, time: float, q: Array) -> list[Event]:
        """Nothing: a start is no arrival."""
        return []

    def step(self, t0: float, t1: float, dense: Dense) -> list[Event]:
        """The arrival, if it lies within the step."""
        t0 = max(t0, self._after)
        if self._done or t0 > t1:
            return []

        def gap(t: float) -> float:
            return float(np.abs(dense(np.array([t]))[:6, 0] - self._q).max()) - REACHED

        times = np.linspace(t0, t1, _PARTS + 1).tolist()
        for a, b in pairwise(times):
            if gap(a) <= 0.0 or gap(b) <= 0.0:
                self._done = True
                return [Event(a if gap(a) <= 0.0 else _zero(gap, a, b), "all", ARRIVAL, REACHED)]
        return []


class LimitWatch:
    """Finds the times at which joints pass their limits, as exactly as the solution itself.

    An angle beyond its limit by less than `tolerances.limit` is inside.
    """

    def __init__(self, joints: Sequence[JointData]) -> None:
        self._joints = tuple(joints)
        self._lower = np.array([j.lower - TOLERANCES.limit for j in joints])
        self._upper = np.array([j.upper + TOLERANCES.limit for j in joints])

    def start(self, time: float, q: Array) -> list[Event]:
        """An event for each joint that is outside at the start."""
        return [
            Event(time, joint.name, f"outside_{side}", limit)
            for joint, angle, low, high in zip(
                self._joints, q, self._lower, self._upper, strict=True
            )
            for side, limit, outside in (
                ("lower", joint.lower, angle < low),
                ("upper", joint.upper, angle > high),
            )
            if outside
        ]

    def step(self, t0: float, t1: float, dense: Dense) -> list[Event]:
        """The events within a step, in order of time."""
        times = np.linspace(t0, t1, _PARTS + 1)
        states = dense(times)
        q, qd = states[:6], states[6:12]
        reach = np.abs(qd).max(axis=1) * (t1 - t0)
        low, high = q.min(axis=1) - reach, q.max(axis=1) + reach
        near = (low < self._lower) | (high > self._upper)
        found = [event for i in np.flatnonzero(near) for event in self._joint(int(i), times, dense)]
        return sorted(found)

    def _joint(self, i: int, times: Array, dense: Dense) -> list[Event]:
        """Passages of joint i, whose angle is monotonic between `times` and its turning points."""
        joint = self._joints[i]
        turning = [
            _root(dense, 6 + i, 0.0, a, b)
            for a, b in pairwise(times)
            if dense(a)[6 + i] * dense(b)[6 + i] < 0.0
        ]
        nodes = np.unique([*times, *turning])
        angles = dense(nodes)[i]
        events = []
        for side, limit, bound, sign in (
            ("lower", joint.lower, self._lower[i], -1.0),
            ("upper", joint.upper, self._upper[i], 1.0),
        ):
            outside = sign * (angles - bound) > 0.0
            for k in np.flatnonzero(outside[1:] != outside[:-1]):
                what = "leave" if outside[k + 1] else "return"
                time = _root(dense, i, bound, nodes[k], nodes[k + 1])
                events.append(Event(time, joint.name, f"{what}_{side}", limit))
        return events


def _root(dense: Dense, row: int, value: float, a: float, b: float) -> float:
    """The time in [a, b] at which a row of the state passes a value."""
    return _zero(lambda t: float(dense(t)[row]) - value, a, b)


def _zero(function: Callable[[float], float], a: float, b: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(function, a, b, xtol=1e-14, rtol=1e-14))
