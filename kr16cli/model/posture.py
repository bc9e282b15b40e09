"""KUKA's Status and Turn of a configuration, computed by rule from the chapter's quantities.

Not read from a controller: the rules are the published ones, the bits those of E6POS.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from kr16cli.model.jacobian import elbow_factor, shoulder_factor
from kr16cli.model.scalars import FLOATS, Functions, Scalar
from kr16cli.robot import Geometry
from kr16cli.tolerances import TOLERANCES


def status(q: Sequence[Scalar], g: Geometry, ns: Functions = FLOATS) -> Scalar:
    """Status S of six joint angles (rad): three bits that name the posture; int or array of int.

    Bit 0: the wrist centre lies behind the A1 axis (x < 0 in the frame turning with A1).
    Bit 1: a3 c3 + d4 s3 >= 0, which for A3 in range is A3 >= -atan(a3/d4).
    Bit 2: -180 <= A5 < 0 or A5 >= 180 deg, whole turns aside.
    """
    cs = ns.trig(q[:3])
    behind = shoulder_factor(cs, g) < -TOLERANCES.sign
    elbow = elbow_factor(cs, g) >= -TOLERANCES.sign
    flipped = (q[4] % math.tau >= math.pi) & (abs(q[4]) > TOLERANCES.sign)
    return behind + 2 * elbow + 4 * flipped


def turn(q: Sequence[Scalar]) -> Scalar:
    """Turn T of six joint angles (rad): bit i-1 is set where Ai < 0; int or array of int."""
    return sum((angle < -TOLERANCES.sign) << i for i, angle in enumerate(q))
