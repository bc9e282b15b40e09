"""Wanted motions of the flange along straight lines and circles, solved for the joints.

The joints follow by inverse kinematics, each configuration nearest to the one before, so that
no branch is ever changed by a jump; a path for which that fails is refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple, Protocol

from kr16cli import linear
from kr16cli.errors import NoAnswerError
from kr16cli.model.orientation import pose_distance
from kr16cli.model.scalars import FLOATS, cross, dot, matvec
from kr16cli.model.task import product, transpose
from kr16cli.simulate.core import JointTarget, TaskTarget
from kr16cli.simulate.profiles import Profile, Shape, make_profile
from kr16cli.simulate.references import check_angles, check_speeds
from kr16cli.single import Arm, Matrix
from kr16cli.units import deg, mm

KNOT = 0.004
"""Time between the configurations solved beforehand, s."""

KNOTS = 64
"""Their least number."""

JUMP = 0.2
"""A joint move (rad) between two poses of a path that halving their distance twelve times does
not shorten below this is a jump between branches."""

_HALVINGS = 12
_HALF_TURN = math.pi - 1e-6
_REST = (0.0,) * 6

Point = tuple[float, float, float]


class Way(NamedTuple):
    """A point of a path and its first two derivatives by s: m."""

    position: Point
    first: Point
    second: Point


class Curve(Protocol):
    """A path of the flange's origin, s from 0 to 1."""

    length: float

    def at(self, s: float) -> Way:
        """The point at s."""


class Line:
    """A straight line between two points (m)."""

    def __init__(self, start: Sequence[float], end: Sequence[float]) -> None:
        self._start = _point(start)
        self._way = _point([b - a for a, b in zip(start, end, strict=True)])
        self.length = math.sqrt(dot(self._way, self._way))

    def at(self, s: float) -> Way:
        """The point at s."""
        moved = _point([a + s * w for a, w in zip(self._start, self._way, strict=True)])
        return Way(moved, self._way, (0.0, 0.0, 0.0))


class Circle:
    """An arc from a point (m) about a centre (m).

    Args:
        start: first point.
        centre: centre of the circle.
        normal: its axis, at right angles to start - centre; any length.
        angle: length of the arc, rad, right-handed about the normal.
    """

    def __init__(
        self,
        start: Sequence[float],
        centre: Sequence[float],
        normal: Sequence[float],
        angle: float,
    ) -> None:
        size = math.sqrt(sum(v * v for v in normal))
        self._centre, self._angle = _point(centre), angle
        self._along = _point([a - c for a, c in zip(start, centre, strict=True)])
        self._across = cross(_point([v / size for v in normal]), self._along)
        self.radius = math.sqrt(dot(self._along, self._along))
        self.length = self.radius * abs(angle)

    def at(self, s: float) -> Way:
        """The point at s."""
        c, n = math.cos(s * self._angle), math.sin(s * self._angle)
        w = self._angle
        pairs = list(zip(self._centre, self._along, self._across, strict=True))
        return Way(
            _point([o + c * u + n * v for o, u, v in pairs]),
            _point([w * (c * v - n * u) for _, u, v in pairs]),
            _point([-w * w * (c * u + n * v) for _, u, v in pairs]),
        )


def arc_through(start: Sequence[float], middle: Sequence[float], end: Sequence[float]) -> Circle:
    """The arc from a point over a second to a third (m), as KRL's CIRC.

    Raises:
        NoAnswerError: the three points lie on a line.
    """
    a = _point([m - s for m, s in zip(middle, start, strict=True)])
    b = _point([e - s for e, s in zip(end, start, strict=True)])
    normal = cross(a, b)
    square = dot(normal, normal)
    if square <= 1e-12 * dot(a, a) * dot(b, b):
        raise NoAnswerError("CIRC: the three points lie on a line; use LIN, or another point")
    # The circumcentre, seen from the start.
    towards = cross(
        _point([dot(a, a) * v - dot(b, b) * u for u, v in zip(a, b, strict=True)]), normal
    )
    centre = [s + v / (2.0 * square) for s, v in zip(start, towards, strict=True)]
    u = _point([s - c for s, c in zip(start, centre, strict=True)])
    v = _point([e - c for e, c in zip(end, centre, strict=True)])
    angle = math.atan2(dot(cross(u, v), normal) / math.sqrt(square), dot(u, v))
    return Circle(start, centre, normal, angle % math.tau)


class Turn(NamedTuple):
    """A rotation about an axis that stands still in robroot: unit axis and angle (rad)."""

    axis: Point
    angle: float

    @classmethod
    def between(cls, start: Matrix, end: Matrix) -> Turn:
        """The shortest turn from one rotation (3x3 rows) to another; NoAnswerError at 180 deg."""
        r = product(end, transpose(start))
        twice = _point([r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]])
        sine = 0.5 * math.sqrt(dot(twice, twice))
        angle = math.atan2(sine, 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1.0))
        if angle > _HALF_TURN:
            raise NoAnswerError(
                "the orientation turns by 180 deg along a path: no way round is the shorter; "
                "give an orientation between"
            )
        if sine == 0.0:
            return cls((0.0, 0.0, 1.0), 0.0)
        return cls(_point([v / (2.0 * sine) for v in twice]), angle)

    def matrix(self, s: float) -> Matrix:
        """The part s of the turn as rows, by Rodrigues' formula."""
        c, n = math.cos(s * self.angle), math.sin(s * self.angle)
        x, y, z = self.axis
        skew = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
        return [
            [
                (c if i == j else 0.0) + (1.0 - c) * self.axis[i] * self.axis[j] + n * skew[i][j]
                for j in range(3)
            ]
            for i in range(3)
        ]


class PathSpeed(NamedTuple):
    """Greatest speed and acceleration of a path: m/s, m/s2; of the orientation rad/s, rad/s2."""

    speed: float = 0.25
    acceleration: float = 1.0
    turning: float = math.pi / 2.0
    turning_acceleration: float = math.pi * 2.0


class PathMove:
    """The flange along a curve while it turns evenly, with one profile for both.

    Args:
        arm: the robot.
        near: configuration the path starts from, rad.
        curve: way of the flange's origin; it must start at the flange's place.
        end: rotation at the end (3x3 rows); None keeps the first.
        shape: of the profile.
        limits: greatest speeds and accelerations.

    Raises:
        NoAnswerError: the path leaves the workspace, a joint its limits, or a branch ends; the
            message says where.
    """

    def __init__(
        self,
        arm: Arm,
        near: Sequence[float],
        curve: Curve,
        end: Matrix | None,
        shape: Shape,
        limits: PathSpeed,
    ) -> None:
        self.arm, self._curve = arm, curve
        self._start = [row[:3] for row in arm.fk(near)[:3]]
        self._turn = Turn.between(self._start, end or self._start)
        self._profile = self._timing(shape, limits)
        self.duration = self._profile.duration if self._profile else 0.0
        self.breaks: Sequence[float] = self._profile.breaks if self._profile else ()
        self._knots = [list(near)]
        if self._profile:
            self._solve()

    def _timing(self, shape: Shape, limits: PathSpeed) -> Profile | None:
        """The profile that respects the limits of place and orientation; None to stay."""
        ways = (
            (self._curve.length, limits.speed, limits.acceleration),
            (abs(self._turn.angle), limits.turning, limits.turning_acceleration),
        )
        moves = [(v / way, a / way) for way, v, a in ways if way > 1e-12]
        if not moves:
            return None
        return make_profile(shape, min(v for v, _ in moves), min(a for _, a in moves))

    def _solve(self) -> None:
        """The configurations along the path, checked."""
        count = max(KNOTS, math.ceil(self.duration / KNOT))
        self._step = self.duration / count
        for k in range(1, count + 1):
            before, t = self._knots[-1], k * self._step
            q = self._nearest(t, before)
            move = max(abs(a - b) for a, b in zip(q, before, strict=True))
            if move > JUMP:
                self._refuse_jump(t - self._step, before, t, q)
            check_angles(self.arm, q, f"the path at {self._where(t)}")
            self._knots.append(q)
        # Speeds last: near the edge of the workspace they grow, and the edge is the reason.
        for k, (before, q) in enumerate(pairwise(self._knots), 1):
            rates = [(a - b) / self._step for a, b in zip(q, before, strict=True)]
            check_speeds(self.arm, rates, f"the path at {self._where(k * self._step)}")

    def _nearest(self, t: float, near: Sequence[float]) -> list[float]:
        """The configuration at time t (s) nearest to another, whole turns added."""
        target = self._pose(t)
        found = [
            [b + math.remainder(a - b, math.tau) for a, b in zip(row, near, strict=True)]
            for row in self.arm.ik(target, near).angles
            if not math.isnan(row[0])
        ]
        if not found:
            raise NoAnswerError(
                f"the path leaves the workspace at {self._where(t)}; shorten or move it"
            )
        return min(found, key=lambda q: max(abs(a - b) for a, b in zip(q, near, strict=True)))

    def _refuse_jump(self, t0: float, q0: Sequence[float], t1: float, q1: Sequence[float]) -> None:
        """Halve towards a move that is too long; NoAnswerError if it does not get shorter."""
        for _ in range(_HALVINGS):
            middle = 0.5 * (t0 + t1)
            q = self._nearest(middle, q0)
            if max(abs(a - b) for a, b in zip(q, q0, strict=True)) > JUMP:
                t1, q1 = middle, q
            else:
                t0, q0 = middle, q
        moves = [abs(b - a) for a, b in zip(q0, q1, strict=True)]
        if max(moves) > JUMP:
            i = moves.index(max(moves))
            raise NoAnswerError(
                f"the path jumps to another branch at {self._where(t1)}: A{i + 1} from "
                f"{deg(q0[i]):.4g} to {deg(q1[i]):.4g} deg; keep away from singularities"
            )

    def _where(self, t: float) -> str:
        x, y, z = (mm(v) for v in self._curve.at(self._progress(t)[0]).position)
        return f"{t:.4g} s (X {x:.1f} Y {y:.1f} Z {z:.1f} mm)"

    def _progress(self, t: float) -> tuple[float, float, float]:
        return self._profile.at(t) if self._profile else (0.0, 0.0, 0.0)

    def _pose(self, t: float) -> Matrix:
        """T_robroot_flange at time t (s)."""
        s, *_ = self._progress(t)
        rotation = product(self._turn.matrix(s), self._start)
        return [[*row, v] for row, v in zip(rotation, self._curve.at(s).position, strict=True)]

    def task(self, t: float) -> TaskTarget:
        """The motion of the flange at time t (s)."""
        s, rate, acceleration = self._progress(t)
        way = self._curve.at(s)
        axis, angle = self._turn
        return TaskTarget(
            list(way.position),
            product(self._turn.matrix(s), self._start),
            [*(rate * v for v in way.first), *(angle * rate * v for v in axis)],
            [
                *(
                    acceleration * v + rate * rate * w
                    for v, w in zip(way.first, way.second, strict=True)
                ),
                *(angle * acceleration * v for v in axis),
            ],
        )

    def joint(self, t: float) -> JointTarget:
        """The motion of the joints at time t (s): qd = J^-1 x', qdd = J^-1 (x'' - J' qd)."""
        if t <= 0.0 or t >= self.duration:
            return JointTarget(self._knots[0 if t <= 0.0 else -1], _REST, _REST)
        q = self._nearest(t, self._knots[round(t / self._step)])
        target = self.task(t)
        back = linear.inverse(self.arm.jacobian(q))
        qd = matvec(back, target.twist)
        drift = matvec(self.arm.jacobian_dot(q, qd), qd)
        rest = [a - b for a, b in zip(target.acceleration, drift, strict=True)]
        return JointTarget(q, qd, matvec(back, rest))


def tracking_error(arm: Arm, q: Sequence[float], target: TaskTarget) -> tuple[float, float]:
    """How far the flange at q is from a target: distance (m) and angle (rad)."""
    rows = [[*r, p] for r, p in zip(target.rotation, target.position, strict=True)]
    return pose_distance(arm.fk(q), rows, FLOATS)


def _point(values: Sequence[float]) -> Point:
    x, y, z = values
    return x, y, z
