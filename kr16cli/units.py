"""Conversions at the edge: the only place with 1000 and pi/180.

Inside everything is SI (m, rad, kg, N m). KUKA's edge speaks mm and degrees.
"""

from __future__ import annotations

import math

MM_PER_M = 1000.0
RAD_PER_DEG = math.pi / 180.0

_QUARTER_SINE = (0.0, 1.0, 0.0, -1.0)


def rad(angle_deg: float) -> float:
    """Degrees to radians."""
    return angle_deg * RAD_PER_DEG


def deg(angle: float) -> float:
    """Radians to degrees."""
    return angle / RAD_PER_DEG


def metres(length_mm: float) -> float:
    """Millimetres to metres; a division, so that 1088 mm is the double nearest 1.088 m."""
    return length_mm / MM_PER_M


def mm(length: float) -> float:
    """Metres to millimetres."""
    return length * MM_PER_M


def cos_sin_deg(angle_deg: float) -> tuple[float, float]:
    """Cosine and sine of an angle in degrees, exact at whole quarter turns.

    People type 0, 90, -90 and 180; the rounding of pi/2 must not leak into their poses.
    """
    turns, rest = divmod(angle_deg, 90.0)
    if rest == 0.0:
        quarter = int(turns) % 4
        return _QUARTER_SINE[(quarter + 1) % 4], _QUARTER_SINE[quarter]
    return math.cos(rad(angle_deg)), math.sin(rad(angle_deg))
