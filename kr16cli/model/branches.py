"""The eight branches of a pose judged together: how many, how good, how far from the limits.

For maps over the workspace, which want a few numbers for a pose and not its 48 angles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.inverse import solve_near, wrist_centre
from kr16cli.model.orientation import Rows
from kr16cli.model.scalars import Functions, Scalar
from kr16cli.robot import Geometry
from kr16cli.tolerances import TOLERANCES

_STRAIGHT = ((1.0, 0.0),) * 6
_HUGE = 1e9  # beyond every angle and every product of lengths


class Judged(NamedTuple):
    """What the branches of one pose are worth.

    `solutions` counts the branches in reach and `within` those inside the joint limits; a merged
    pair counts twice. `best` and `worst` are the largest and smallest |det J| (m3) of those
    within, which for six joints is Yoshikawa's manipulability; `limits` (rad) is the best
    branch's distance to its nearest joint limit, and `singular` (0 to 1) the best branch's least
    factor of (3.37), each over its largest value. Without a branch within they are 0, 0, the
    least bad (negative) distance, -1e9 where nothing is in reach, and 0.
    """

    solutions: Scalar
    within: Scalar
    best: Scalar
    worst: Scalar
    limits: Scalar
    singular: Scalar


def judge(
    rotation: Rows,
    p: Sequence[Scalar],
    g: Geometry,
    middle: Sequence[Scalar],
    half: Sequence[Scalar],
    ns: Functions,
) -> Judged:
    """Judge the branches of the flange pose (rotation rows, position m) in robroot.

    Args:
        rotation: of the pose, rows.
        p: its position, m.
        g: lengths, m.
        middle: of each joint's range, rad, in [-pi, pi]. Whole turns are added to an angle where
            that brings it inside.
        half: half the width of each range, rad.
        ns: functions of the scalars.
    """
    found = solve_near(rotation, p, g, _STRAIGHT, ns)
    x, y, _ = wrist_centre(rotation, p, g)
    radius, forearm = ns.sqrt(x * x + y * y), ns.sqrt(g.a3 * g.a3 + g.d4 * g.d4)
    solutions: Scalar = 0.0
    within: Scalar = 0.0
    best: Scalar = 0.0
    worst: Scalar = _HUGE
    limits: Scalar = -_HUGE
    singular: Scalar = 0.0
    for arm in range(4):
        _, cosine = found.reach[arm // 2]
        bent = (1 - cosine) * (1 + cosine)
        elbow = ns.sqrt(ns.where(bent < 0.0, 0.0, bent))
        wrist = found.wrist_sine[arm]
        # The three factors of (3.37) over their largest values, and their product times a2.
        least = _least([radius / (g.a1 + g.a2 + forearm), elbow, wrist], ns)
        volume = g.a2 * radius * (forearm * elbow) * wrist
        shoulder = arm // 2
        solutions = solutions + ns.where(found.beyond[shoulder], 0.0, 2.0)
        posture = [found.turn[shoulder], *found.angles[2 * arm][1:3]]
        upper = _least([_to_limit(posture[i], middle[i], half[i], ns) for i in range(3)], ns)
        for angles in found.angles[2 * arm : 2 * arm + 2]:
            lower = [_to_limit(angles[i], middle[i], half[i], ns) for i in range(3, 6)]
            distance = _least([upper, *lower], ns)
            distance = ns.where(found.beyond[shoulder], -_HUGE, distance)
            inside = ns.where(distance > -TOLERANCES.limit, 1.0, 0.0)
            within = within + inside
            best = _larger(best, inside * volume, ns)
            worst = _least([worst, volume + (1.0 - inside) * _HUGE], ns)
            singular = _larger(singular, inside * least, ns)
            limits = _larger(limits, distance, ns)
    worst = ns.where(within > 0.0, worst, 0.0)
    return Judged(solutions, within, best, worst, limits, singular)


def _to_limit(angle: Scalar, middle: Scalar, half: Scalar, ns: Functions) -> Scalar:
    """Distance of an angle in (-pi, pi] to the nearer end of its range, negative outside, rad.

    The angle and the angles whole turns away are one posture; the one nearest to the middle of
    the range counts.
    """
    away = _magnitude(angle - middle, ns)
    return half - ns.where(away > ns.pi, 2 * ns.pi - away, away)


def _magnitude(value: Scalar, ns: Functions) -> Scalar:
    return ns.where(value < 0.0, -value, value)


def _larger(a: Scalar, b: Scalar, ns: Functions) -> Scalar:
    return ns.where(a < b, b, a)


def _least(values: Sequence[Scalar], ns: Functions) -> Scalar:
    least = values[0]
    for value in values[1:]:
        least = ns.where(value < least, value, least)
    return least
