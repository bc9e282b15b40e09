"""How a motion runs along its way: s from 0 to 1 over time, starting and ending at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

Shape = Literal["trapezoid", "quintic"]

_QUINTIC_SPEED = 15.0 / 8.0
_QUINTIC_ACCELERATION = 10.0 / math.sqrt(3.0)


class Progress(NamedTuple):
    """s, its rate (1/s) and its acceleration (1/s2)."""

    s: float
    rate: float
    acceleration: float


class Profile(Protocol):
    """Progress over time."""

    duration: float

    @property
    def breaks(self) -> Sequence[float]:
        """Times at which the acceleration or its rate jumps, s."""

    def at(self, t: float) -> Progress:
        """Progress at time t (s): 0 before the start, 1 after the end."""


class Trapezoid:
    """Constant acceleration, constant rate, constant deceleration: the shortest of all.

    Args:
        rate: greatest rate, 1/s.
        acceleration: greatest acceleration, 1/s2.
    """

    def __init__(self, rate: float, acceleration: float) -> None:
        # Where the way is too short for the greatest rate, the trapezoid is a triangle.
        self.rate, self.acceleration = min(rate, math.sqrt(acceleration)), acceleration
        self.ramp = self.rate / acceleration
        self.duration = self.ramp + 1.0 / self.rate

    @property
    def breaks(self) -> Sequence[float]:
        """Ends of the ramps, s."""
        return [0.0, self.ramp, self.duration - self.ramp, self.duration]

    def at(self, t: float) -> Progress:
        """Progress at time t (s)."""
        left, a = self.duration - t, self.acceleration
        if t <= 0.0 or left <= 0.0:
            return Progress(0.0 if t <= 0.0 else 1.0, 0.0, 0.0)
        if t < self.ramp:
            return Progress(0.5 * a * t * t, a * t, a)
        if left < self.ramp:
            return Progress(1.0 - 0.5 * a * left * left, a * left, -a)
        return Progress(self.rate * (t - 0.5 * self.ramp), self.rate, 0.0)


class Quintic:
    """s = 10 u^3 - 15 u^4 + 6 u^5 with u = t / duration: acceleration without jumps.

    The largest rate is 15/8 / T at the middle, the largest acceleration 10 / sqrt(3) / T^2.

    Args:
        rate: greatest rate, 1/s.
        acceleration: greatest acceleration, 1/s2.
    """

    def __init__(self, rate: float, acceleration: float) -> None:
        self.duration = max(_QUINTIC_SPEED / rate, math.sqrt(_QUINTIC_ACCELERATION / acceleration))

    @property
    def breaks(self) -> Sequence[float]:
        """Start and end, s."""
        return [0.0, self.duration]

    def at(self, t: float) -> Progress:
        """Progress at time t (s)."""
        T = self.duration
        u = t / T
        if u <= 0.0 or u >= 1.0:
            return Progress(0.0 if u <= 0.0 else 1.0, 0.0, 0.0)
        v = 1.0 - u
        return Progress(
            u**3 * (10.0 - 15.0 * u + 6.0 * u * u),
            30.0 * u * u * v * v / T,
            60.0 * u * v * (1.0 - 2.0 * u) / (T * T),
        )


def make_profile(shape: Shape, rate: float, acceleration: float) -> Profile:
    """A profile within a greatest rate (1/s) and acceleration (1/s2)."""
    return (Trapezoid if shape == "trapezoid" else Quintic)(rate, acceleration)
