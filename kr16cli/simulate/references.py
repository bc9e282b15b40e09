"""Wanted motions of the joints: rest, point to point, splines through waypoints, sequences."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

from kr16cli.errors import NoAnswerError
from kr16cli.robot import JointData
from kr16cli.simulate.core import JointTarget, Reference, TaskTarget, task_target
from kr16cli.simulate.profiles import Shape, make_profile
from kr16cli.single import Arm
from kr16cli.tolerances import TOLERANCES
from kr16cli.units import deg

RISE = 0.25
"""Time (s) in which a joint reaches its greatest speed where no acceleration is given."""

SLACK = 1e-9
"""Relative excess of a speed over its limit that is rounding."""

_REST = (0.0,) * 6


class JointReference(ABC):
    """A reference given in joint space; the flange's motion follows from it."""

    duration = 0.0
    breaks: Sequence[float] = ()

    def __init__(self, arm: Arm) -> None:
        self.arm = arm

    @abstractmethod
    def joint(self, t: float) -> JointTarget:
        """The motion of the joints at time t (s)."""

    def task(self, t: float) -> TaskTarget:
        """The motion of the flange at time t (s)."""
        return task_target(self.arm, self.joint(t))


class Hold(JointReference):
    """Rest at q (rad) for `duration` (s), and after it; `checked` against the limits."""

    def __init__(
        self, arm: Arm, q: Sequence[float], duration: float = 0.0, *, checked: bool = True
    ) -> None:
        super().__init__(arm)
        if checked:
            check_angles(arm, q, "the reference")
        self._target, self.duration = JointTarget(list(q), _REST, _REST), duration

    def joint(self, t: float) -> JointTarget:
        """The rest."""
        return self._target


class JointMove(JointReference):
    """Point to point: all joints start and end together, along a straight line in joint space.

    As fast as the slowest joint allows.

    Args:
        arm: the robot.
        start: joint angles, rad.
        end: joint angles, rad.
        shape: of the profile.
        speed: greatest joint speeds, rad/s.
        acceleration: greatest joint accelerations, rad/s2.
    """

    def __init__(
        self,
        arm: Arm,
        start: Sequence[float],
        end: Sequence[float],
        shape: Shape,
        speed: Sequence[float],
        acceleration: Sequence[float],
    ) -> None:
        super().__init__(arm)
        check_angles(arm, start, "the start of a PTP motion")
        check_angles(arm, end, "the end of a PTP motion")
        self._start, self._end = list(start), list(end)
        self._way = [b - a for a, b in zip(start, end, strict=True)]
        moves = [i for i in range(6) if self._way[i] != 0.0]
        if not moves:
            self._profile = None
            return
        rate = min(speed[i] / abs(self._way[i]) for i in moves)
        ramp = min(acceleration[i] / abs(self._way[i]) for i in moves)
        self._profile = make_profile(shape, rate, ramp)
        self.duration, self.breaks = self._profile.duration, self._profile.breaks

    def joint(self, t: float) -> JointTarget:
        """The motion at time t (s)."""
        if self._profile is None or t <= 0.0:
            return JointTarget(self._start, _REST, _REST)
        if t >= self.duration:
            return JointTarget(self._end, _REST, _REST)
        s, rate, acceleration = self._profile.at(t)
        return JointTarget(
            [a + s * w for a, w in zip(self._start, self._way, strict=True)],
            [rate * w for w in self._way],
            [acceleration * w for w in self._way],
        )


class Spline(JointReference):
    """Cubic splines through waypoints, at rest at both ends; accelerations have no jumps.

    Args:
        arm: the robot.
        times: rising, s; the first may be later than 0: rest until then.
        points: joint angles at these times, rad.

    Raises:
        NoAnswerError: a joint passes its limit or its greatest speed; joint and time are told.
    """

    def __init__(self, arm: Arm, times: Sequence[float], points: Sequence[Sequence[float]]) -> None:
        from scipy.interpolate import CubicSpline

        super().__init__(arm)
        self._times, self.duration = list(times), times[-1]
        self._first, self._last = list(points[0]), list(points[-1])
        self.breaks = self._times
        if len(times) > 1:
            # c[k][i][j]: coefficient of power 3 - k in piece i of joint j.
            spline = CubicSpline(times, points, axis=0, bc_type="clamped")
            self._pieces = spline.c.transpose(1, 2, 0).tolist()
        self._check()

    def joint(self, t: float) -> JointTarget:
        """The motion at time t (s)."""
        if t <= self._times[0] or t >= self.duration:
            return JointTarget(self._first if t <= self._times[0] else self._last, _REST, _REST)
        i = bisect_right(self._times, t) - 1
        u = t - self._times[i]
        piece = self._pieces[i]
        return JointTarget(
            [((a * u + b) * u + c) * u + d for a, b, c, d in piece],
            [(3.0 * a * u + 2.0 * b) * u + c for a, b, c, _ in piece],
            [6.0 * a * u + 2.0 * b for a, b, _, _ in piece],
        )

    def _check(self) -> None:
        """Angles and speeds at the waypoints and at the extremes between."""
        for t in self._extremes():
            target = self.joint(t)
            check_angles(self.arm, target.q, f"the reference at {t:.6g} s")
            check_speeds(self.arm, target.qd, f"the reference at {t:.6g} s")

    def _extremes(self) -> list[float]:
        """Waypoints, and where a joint turns back or is fastest."""
        times = set(self._times)
        for i, piece in enumerate(self._pieces if len(self._times) > 1 else []):
            length = self._times[i + 1] - self._times[i]
            for a, b, c, _ in piece:
                inner = [-b / (3.0 * a)] if a else []
                root = b * b - 3.0 * a * c
                if a and root >= 0.0:
                    inner += [(-b + side * math.sqrt(root)) / (3.0 * a) for side in (1.0, -1.0)]
                elif not a and b:
                    inner.append(-c / (2.0 * b))
                times |= {self._times[i] + u for u in inner if 0.0 < u < length}
        return sorted(times)


class Chain:
    """References one after the other, each from where the one before ends."""

    def __init__(self, parts: Sequence[Reference]) -> None:
        self._parts = list(parts)
        self._starts = [0.0, *accumulate(part.duration for part in parts)]
        self.duration = self._starts[-1]
        self.breaks: Sequence[float] = sorted(
            {s + b for s, p in zip(self._starts, parts, strict=False) for b in p.breaks}
        )

    def _part(self, t: float) -> tuple[Reference, float]:
        """The part that runs at time t (s), and the time since it began."""
        i = min(max(bisect_right(self._starts, t) - 1, 0), len(self._parts) - 1)
        return self._parts[i], t - self._starts[i]

    def joint(self, t: float) -> JointTarget:
        """The motion of the joints at time t (s)."""
        part, since = self._part(t)
        return part.joint(since)

    def task(self, t: float) -> TaskTarget:
        """The motion of the flange at time t (s)."""
        part, since = self._part(t)
        return part.task(since)


def greatest_speeds(joints: Sequence[JointData], part: float = 1.0) -> list[float]:
    """`part` of each joint's greatest speed, rad/s; pi rad/s where the file gives none."""
    return [part * (j.speed if j.speed is not None else math.pi) for j in joints]


def check_angles(arm: Arm, q: Sequence[float], what: str) -> None:
    """NoAnswerError where an angle lies outside its limits."""
    for joint, angle in zip(arm.data.joints, q, strict=True):
        for side, beyond, limit in (
            ("lower", joint.lower - angle, joint.lower),
            ("upper", angle - joint.upper, joint.upper),
        ):
            if beyond > TOLERANCES.limit:
                raise NoAnswerError(
                    f"{what} needs {joint.name} = {deg(angle):.6g} deg, its {side} limit is "
                    f"{deg(limit):g} deg; choose another way"
                )


def check_speeds(arm: Arm, qd: Sequence[float], what: str) -> None:
    """NoAnswerError where a speed exceeds its limit."""
    for joint, rate in zip(arm.data.joints, qd, strict=True):
        if joint.speed is not None and abs(rate) > joint.speed * (1.0 + SLACK):
            raise NoAnswerError(
                f"{what} needs {joint.name} at {deg(abs(rate)):.4g} deg/s, its limit is "
                f"{deg(joint.speed):g} deg/s; move more slowly or elsewhere"
            )
