"""Closed-form inverse kinematics of section 3.2: eight branches, singular cases, any batch.

Branch index 4*shoulder + 2*elbow + wrist:
shoulder 0: q1 = atan2(x_c, y_c) of the chapter's frame, the wrist centre in front;
elbow 0: a3 c3 + d4 s3 <= 0; wrist 0: q5 >= 0.

Each angle is computed from the ones before it (A4 from the pose, A5 from A4, A6 from A4), so
that an angle made ill-determined by a near singularity is corrected by the next: the pose is
reproduced to rounding at any distance from a singularity. Exactly singular poses take the free
angle from `near` (sections 3.2.3): A1 when the wrist centre is on the A1 axis, A4 when q5 = 0
or 180 deg, A2 when the arm folds onto its own shoulder. The pair of branches then merges into
equal rows, as the elbow pair does at full stretch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from kr16cli.model.orientation import Rows
from kr16cli.model.scalars import Functions, Scalar, Trig, Vector, angle_sum
from kr16cli.robot import Geometry
from kr16cli.tolerances import TOLERANCES


class Solutions(NamedTuple):
    """Eight solutions and what explains the missing ones.

    `angles[b]` are six angles in (-pi, pi], NaN (floats) where branch b is out of reach.
    `reach[shoulder]` is (squared distance from A2 axis to wrist centre (m2), elbow cosine);
    beyond +-1 no elbow closes. `on_axis`, `straight_wrist[arm]` and `folded[shoulder]` are the
    singular cases; `wrist_sine[arm]` is |sin q5|, `beyond[shoulder]` whether no elbow closes and
    `turn[shoulder]` A1 all the same.
    """

    angles: list[list[Scalar]]
    reach: list[tuple[Scalar, Scalar]]
    on_axis: Scalar
    straight_wrist: list[Scalar]
    folded: list[Scalar]
    wrist_sine: list[Scalar]
    beyond: list[Scalar]
    turn: list[Scalar]


def principal(angle: Scalar, ns: Functions) -> Scalar:
    """The angle with -pi replaced by pi: (-pi, pi]."""
    return ns.where(angle <= -ns.pi, ns.pi, angle)


def turned_back(angle: Scalar, half_turn: Scalar, ns: Functions) -> Scalar:
    """An angle in (-pi, pi] less `half_turn` (pi, or 0 to keep it), in (-pi, pi] again."""
    back = angle - half_turn
    return ns.where(back > -ns.pi, back, angle + half_turn)


def wrist_centre(rotation: Rows, p: Sequence[Scalar], g: Geometry) -> Vector:
    """o_c of (3.8) in robroot, m: the flange point moved back by d6 along the flange's z."""
    x, y, z = (p[i] - g.d6 * rotation[i][2] for i in range(3))
    return x, y, z


class _Near(NamedTuple):
    """(cos, sin) of the known configuration's joints that may be free."""

    q1: tuple[Scalar, Scalar]
    q2: tuple[Scalar, Scalar]
    q4: tuple[Scalar, Scalar]


class _Elbow(NamedTuple):
    """Upper-arm solutions of one shoulder: (q2, q3) and the forearm's (c23, s23) per elbow."""

    pairs: list[tuple[Scalar, Scalar]]
    forearm: list[tuple[Scalar, Scalar]]
    reach: tuple[Scalar, Scalar]
    beyond: Scalar
    folded: Scalar


class _Plane(NamedTuple):
    """The flange rotation by rows in the arm's plane: forward, lateral and up."""

    forward: Sequence[Scalar]
    lateral: Sequence[Scalar]
    up: Sequence[Scalar]


def _elbows(u: Scalar, w: Scalar, g: Geometry, near: _Near, slack: Scalar, ns: Functions) -> _Elbow:
    """q2 and q3 for a wrist centre u forward of and w above the A2 axis, (3.13)-(3.16).

    `slack` is how far the elbow's cosine may pass 1 by rounding.

    With L = hypot(a3, d4) and q3' = q3 + atan2(a3, d4):
    u^2 + w^2 = a2^2 + L^2 + 2 a2 L cos q3' (a square, not the printed fourth power).
    """
    forearm = ns.sqrt(g.a3 * g.a3 + g.d4 * g.d4)
    tilt, cos_tilt, sin_tilt = ns.atan2(g.a3, g.d4), g.d4 / forearm, g.a3 / forearm
    square = u * u + w * w
    cosine = (square - (g.a2 * g.a2 + forearm * forearm)) / (2 * g.a2 * forearm)
    sine_square = (1 - cosine) * (1 + cosine)
    beyond = sine_square < -2 * slack
    c = ns.where(beyond, math.nan, cosine)
    s = ns.sqrt(ns.where(sine_square < TOLERANCES.merged * TOLERANCES.merged, 0, sine_square))
    bend = ns.atan2(s, c)
    # -bend - tilt >= -3 pi / 2 and bend - tilt <= 3 pi / 2: each can leave (-pi, pi] at one end.
    q3_under, q3_over = -bend - tilt, bend - tilt
    q3_under = ns.where(q3_under <= -ns.pi, (ns.pi - tilt) + (ns.pi - bend), q3_under)
    q3_over = ns.where(q3_over > ns.pi, q3_over - 2 * ns.pi, q3_over)

    folded = square < TOLERANCES.fold * TOLERANCES.fold
    over = 1 / ns.where(folded, 1, square)
    along, across = g.a2 + forearm * c, forearm * s
    au, aw, bu, bw = along * u, along * w, across * u, across * w
    c3_even, c3_odd = c * cos_tilt, s * sin_tilt
    s3_even, s3_odd = c * sin_tilt, s * cos_tilt
    pairs, forearms = [], []
    for q3, c2, s2, trig3 in (
        (q3_under, au + bw, bu - aw, (c3_even - c3_odd, -s3_odd - s3_even)),
        (q3_over, au - bw, -bu - aw, (c3_even + c3_odd, s3_odd - s3_even)),
    ):
        c2_free, s2_free = (ns.where(folded, n, v) for n, v in zip(near.q2, (c2, s2), strict=True))
        pairs.append((principal(ns.atan2(s2_free, c2_free), ns), q3))
        forearms.append(angle_sum((c2_free * over, s2_free * over), trig3))
    return _Elbow(pairs, forearms, (square, cosine), beyond, folded)


def solve(
    rotation: Rows, p: Sequence[Scalar], g: Geometry, near: Sequence[Scalar], ns: Functions
) -> Solutions:
    """All solutions for the flange pose (rotation rows, position m) in robroot.

    `near` is the configuration (rad) that supplies free angles. Joint limits are ignored.
    """
    return solve_near(rotation, p, g, ns.trig(near), ns)


def solve_near(
    rotation: Rows, p: Sequence[Scalar], g: Geometry, near: Trig, ns: Functions
) -> Solutions:
    """`solve` for `near` given as (cos, sin) pairs."""
    free = _Near(near[0], near[1], near[3])
    x, y, z = wrist_centre(rotation, p, g)
    radius = ns.sqrt(x * x + y * y)
    on_axis = radius < TOLERANCES.shoulder
    over = 1 / ns.where(on_axis, 1, radius)
    c1_r, s1_r = ns.where(on_axis, free.q1[0], x), ns.where(on_axis, free.q1[1], -y)
    q1 = principal(ns.atan2(s1_r, c1_r), ns)
    c1, s1 = c1_r * over, s1_r * over
    radius = ns.where(on_axis, 0, radius)

    front = _Plane(
        [c1 * rotation[0][j] - s1 * rotation[1][j] for j in range(3)],
        [-s1 * rotation[0][j] - c1 * rotation[1][j] for j in range(3)],
        rotation[2],
    )
    side = ns.where(on_axis, 1, -1)
    back = _Plane([side * v for v in front.forward], [side * v for v in front.lateral], front.up)
    slack = ns.where(on_axis, TOLERANCES.cosine_on_axis, TOLERANCES.cosine)
    behind = turned_back(q1, ns.where(on_axis, 0, ns.pi), ns)

    angles: list[list[Scalar]] = []
    reach, straight, folds, sines, beyond = [], [], [], [], []
    for first, forward, plane in ((q1, radius, front), (behind, -radius, back)):
        elbows = _elbows(forward - g.a1, z - g.d1, g, free, slack, ns)
        reach.append(elbows.reach)
        folds.append(elbows.folded)
        beyond.append(elbows.beyond)
        q1_or_nan = ns.where(elbows.beyond, math.nan, first)
        for (q2, q3), forearm in zip(elbows.pairs, elbows.forearm, strict=True):
            wrists, singular, sine = _wrists(plane, forearm, free, ns)
            straight.append(singular)
            sines.append(sine)
            angles.extend([q1_or_nan, q2, q3, *wrist] for wrist in wrists)
    return Solutions(angles, reach, on_axis, straight, folds, sines, beyond, [q1, behind])


def _wrists(
    plane: _Plane, forearm: tuple[Scalar, Scalar], near: _Near, ns: Functions
) -> tuple[list[list[Scalar]], Scalar, Scalar]:
    """The two wrists (q4, q5, q6) of one arm posture, (3.21)-(3.26) in the form given above.

    Also whether the wrist is straight, and |sin q5|.

    R36's first row is -n, its second the lateral row, its third minus the row along the forearm.
    """
    c23, s23 = forearm
    lx, ly, lz = plane.lateral
    nx, ny, nz = (s23 * f + c23 * u for f, u in zip(plane.forward, plane.up, strict=True))
    c5 = c23 * plane.forward[2] - s23 * plane.up[2]
    s5 = ns.sqrt(nz * nz + lz * lz)
    singular = s5 < TOLERANCES.wrist
    over = 1 / ns.where(singular, 1, s5)
    c4_r, s4_r = ns.where(singular, near.q4[0], -nz), ns.where(singular, near.q4[1], lz)
    q4 = principal(ns.atan2(s4_r, c4_r), ns)
    q5 = ns.atan2(ns.where(singular, 0, s5), c5)
    c4, s4 = c4_r * over, s4_r * over
    q6 = principal(ns.atan2(c4 * lx + s4 * nx, -(c4 * ly + s4 * ny)), ns)
    half_turn = ns.where(singular, 0, ns.pi)
    flipped = [
        turned_back(q4, half_turn, ns),
        principal(-q5, ns),
        turned_back(q6, half_turn, ns),
    ]
    return [[q4, q5, q6], flipped], singular, s5
