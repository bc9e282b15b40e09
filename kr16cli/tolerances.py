"""Every threshold of the package, each with the reason for its value."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """Named thresholds; SI units.

    shoulder: wrist centre this near the A1 axis (m) leaves A1 free. Taking A1 from `near` then
        moves the wrist centre by at most this much: a tenth of the closure promised (1e-9 m).
    wrist: |sin q5| below this leaves A4 free; the orientation changes by at most this (rad).
    fold: shoulder-to-wrist distance (m) below which A2 is free; only an arm with
        a2 = hypot(a3, d4) can fold so far.
    cosine: an elbow cosine beyond 1 by less than this is rounding of a pose made by forward
        kinematics and is taken as 1; it is some thousand units in the last place.
    cosine_on_axis: the same where A1 is free: turning A1 to `near` moves the A2 axis against the
        wrist centre by up to `shoulder`, which changes the cosine by about a1/(a2 L) times it.
    merged: a sine of the elbow angle below this is taken as 0 and the elbow pair merges: the
        root of 1 - cos^2 has half the digits, so smaller sines are rounding. It moves the wrist
        centre by less than 5e-15 m.
    closure: the residual (m, rad) every solution of the inverse kinematics stays below.
    pole: hypot(r11, r21) below this is B = +-90 deg, where A is chosen as 0.
    near_singular: sines of distances to a singular family (shoulder in units of the reach)
        below this are worth a warning: angles there amplify pose errors a thousand times.
    rotation: how far R^T R of a typed or read rotation may be from the identity: poses written
        with six decimals pass, wrong matrices do not.
    limit: an angle beyond its limit by less than this (rad) is inside: 185 deg typed is in.
    turn_switch: within this of zero (rad) a controller may ignore the Turn bit (one vendor's
        blog, unconfirmed).
    sign: an angle (rad) or length (m) this near zero is zero that went through rounding, and
        has no sign for Status and Turn.
    coulomb_speed: joint speed (rad/s) at which regularised Coulomb friction has 71 % of its
        value, qd / sqrt(qd^2 + v^2): small beside working speeds (2.7 rad/s), no chatter.
    """

    shoulder: float = 1e-10
    wrist: float = 1e-10
    fold: float = 1e-9
    cosine: float = 1e-12
    cosine_on_axis: float = 1e-9
    merged: float = 1e-7
    closure: float = 1e-9
    pole: float = 1e-9
    near_singular: float = 1e-3
    rotation: float = 1e-5
    limit: float = 1e-9
    turn_switch: float = 0.03490658503988659
    sign: float = 1e-12
    coulomb_speed: float = 0.01


TOLERANCES = Tolerances()
