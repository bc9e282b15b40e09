"""Hypothesis strategies of configurations, poses and motions, by named regimes.

A regime says where in joint space a test looks; a property that holds everywhere is tried in
each. Singular places and limits are written out here for the KR 16-2, not asked of the package.

Regimes of configurations (six angles in rad):

* generic: all of (-pi, pi], no other condition; almost surely far from every singularity.
* limits: every joint at one of its limits, or some inside.
* round: what people type: 0, +-45, +-90, 180 degrees; most are singular in some way.
* near_wrist: q5 within 1e-3 .. 1e-12 of 0, either sign.
* near_wrist_pi: q5 within 1e-3 .. 1e-12 of +-180 degrees.
* near_stretched, near_folded: q3 within 1e-3 .. 1e-12 of the straight or folded elbow.
* near_shoulder: the wrist centre 1e-3 .. 1e-12 m from the A1 axis, either side.
* singular_wrist, singular_wrist_pi, singular_stretched, singular_folded, singular_shoulder: on
  the family as exactly as floating point tells.
* singular_all: shoulder and wrist (0 or 180 degrees) singular at once, near or exactly.
"""

from __future__ import annotations

import math

from hypothesis import strategies as st

PI = math.pi

# Lengths of Table 3.1 and limits of the KR 16-2, m and degrees.
D1, A1, A2, A3, D4, D6 = 0.675, 0.260, 0.680, 0.035, 0.670, 0.158
LIMITS_DEG = ((-185, 185), (-155, 35), (-130, 154), (-350, 350), (-130, 130), (-350, 350))
STRAIGHT = -math.atan2(A3, D4)  # q3 of the stretched arm; half a turn on, it is folded

angle = st.floats(-PI, PI, exclude_min=True)
rate = st.floats(-5.0, 5.0)
load = st.floats(-100.0, 100.0)

rates = st.lists(rate, min_size=6, max_size=6)
loads = st.lists(load, min_size=6, max_size=6)
gravities = st.tuples(*[st.floats(-20.0, 20.0)] * 3)

generic = st.lists(angle, min_size=6, max_size=6)
round_angles = st.lists(
    st.sampled_from([math.radians(v) for v in (0, 45, -45, 90, -90, 135, -135, 180)]),
    min_size=6,
    max_size=6,
)
limits = st.tuples(
    *[
        st.sampled_from([math.radians(lo), math.radians(hi)])
        | st.floats(math.radians(lo), math.radians(hi))
        for lo, hi in LIMITS_DEG
    ]
).map(list)

offset = st.builds(
    lambda exponent, sign: sign * 10.0**exponent, st.floats(-12.0, -3.0), st.sampled_from([1, -1])
)
"""A distance from a singularity, signed, even over nine decades."""


def _with(q: list[float], **joints: float) -> list[float]:
    """The configuration with joints, named q1 to q6, set."""
    return [joints.get(f"q{i}", v) for i, v in enumerate(q, 1)]


def _turned(value: float) -> float:
    """The angle within (-pi, pi]."""
    return value - 2 * PI if value > PI else value + 2 * PI if value <= -PI else value


def on_shoulder(q: list[float], bend: float, side: int, gap: float) -> list[float]:
    """The configuration with q3 = STRAIGHT + bend and q2 such that the wrist centre is at gap.

    `gap` is the wrist centre's signed distance (m) from the A1 axis, `side` one of the two
    angles q2 that reach it. Solves a1 + u cos q2 + v sin q2 = gap.
    """
    q3 = STRAIGHT + bend
    u = A2 + D4 * math.cos(q3) - A3 * math.sin(q3)
    v = -(D4 * math.sin(q3) + A3 * math.cos(q3))
    q2 = math.atan2(v, u) + side * math.acos((gap - A1) / math.hypot(u, v))
    return _with(q, q2=_turned(q2), q3=_turned(q3))


# A bend within 2.4 rad leaves the wrist centre more than a1 from the A2 axis.
_bend = st.floats(-2.4, 2.4)
_side = st.sampled_from([1, -1])
_none = st.just(0.0)
_q5 = st.sampled_from([0.0, PI]) | offset | offset.map(lambda d: _turned(PI + d))

_ELBOWS = {"stretched": STRAIGHT, "folded": STRAIGHT + PI}

REGIMES: dict[str, st.SearchStrategy[list[float]]] = {
    "generic": generic,
    "limits": limits,
    "round": round_angles,
    "near_wrist": st.builds(lambda q, d: _with(q, q5=d), generic, offset),
    "near_wrist_pi": st.builds(lambda q, d: _with(q, q5=_turned(PI + d)), generic, offset),
    "near_shoulder": st.builds(on_shoulder, generic, _bend, _side, offset),
    "singular_wrist": generic.map(lambda q: _with(q, q5=0.0)),
    "singular_wrist_pi": generic.map(lambda q: _with(q, q5=PI)),
    "singular_shoulder": st.builds(on_shoulder, generic, _bend, _side, _none),
    "singular_all": st.builds(
        lambda q, bend, side, gap, q5: _with(on_shoulder(q, bend, side, gap), q5=q5),
        generic,
        _bend,
        _side,
        _none | offset,
        _q5,
    ),
    **{
        f"near_{name}": st.builds(lambda q, d, at=at: _with(q, q3=_turned(at + d)), generic, offset)
        for name, at in _ELBOWS.items()
    },
    **{
        f"singular_{name}": generic.map(lambda q, at=at: _with(q, q3=_turned(at)))
        for name, at in _ELBOWS.items()
    },
}

everywhere = st.one_of(*REGIMES.values())
"""A configuration of any regime."""

regular = generic.filter(
    lambda q: (
        abs(math.sin(q[4])) > 1e-2
        and abs(math.sin(q[2] - STRAIGHT)) > 1e-2
        and abs(A1 + A2 * math.cos(q[1]) + D4 * math.cos(q[1] + q[2]) - A3 * math.sin(q[1] + q[2]))
        > 1e-2
    )
)
"""A configuration at least 1e-2 (rad, m) away from all three singular families."""
