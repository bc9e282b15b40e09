"""A controller closed around a reference: continuous, or sampled as real ones are."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from kr16cli.simulate.core import Controller, Reference

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Sampling:
    """How a controller meets the world.

    It measures every `period` (s) and holds its torque between; the torque acts `delay` (s)
    after the measurement. Angles are read in steps of `resolution` (rad), 0 for exact; speeds
    are then differences of the angles read, over the period. Torques are given in steps of
    `torque_step` (N m), 0 for exact.
    """

    period: float
    delay: float = 0.0
    resolution: float = 0.0
    torque_step: float = 0.0


class ClosedLoop:
    """The torque of a controller that sees the state at every instant."""

    def __init__(self, controller: Controller, reference: Reference) -> None:
        self.controller, self.reference = controller, reference
        self.breaks: Sequence[float] = list(reference.breaks)

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """Torques at time t in state q, qd."""
        return self.controller.torque(t, q, qd, self.reference)


class SampledLoop:
    """The torque of a controller that measures at instants and holds its output between.

    `sample` is told of every instant; a call gives the torque in force at a time, also in the
    past, so that a run can be looked at afterwards. Before the first torque takes effect,
    it acts all the same: the controller was on before.

    Args:
        controller: what computes the torques.
        reference: what it follows.
        sampling: when, how late and how coarsely.
        duration: until when it is sampled, s.
    """

    steady = True

    def __init__(
        self, controller: Controller, reference: Reference, sampling: Sampling, duration: float
    ) -> None:
        self.controller, self.reference, self.sampling = controller, reference, sampling
        count = int(duration / sampling.period * (1.0 + 1e-12)) + 1
        self.instants = [k * sampling.period for k in range(count)]
        self.breaks: Sequence[float] = sorted(
            {*self.instants, *map(self._late, range(count)), *reference.breaks}
        )
        self._next = 0
        self._angles: list[float] | None = None
        self._times: list[float] = []
        self._torques: list[list[float]] = []

    def _late(self, k: int) -> float:
        """When the torque measured at instant k acts, s; an instant exactly where it is one."""
        period, delay = self.sampling.period, self.sampling.delay
        whole = round(delay / period)
        late = abs(delay - whole * period) <= _ROUNDING * period
        return (k + whole) * period if late else k * period + delay

    def sample(self, t: float, q: Sequence[float], qd: Sequence[float]) -> None:
        """Measure and compute if time t (s) is an instant whose turn it is."""
        s, k = self.sampling, self._next
        if k >= len(self.instants) or t < self.instants[k] - _ROUNDING * s.period:
            return
        angles, speeds = self._measured(q, qd)
        tau = self.controller.torque(self.instants[k], angles, speeds, self.reference)
        if s.torque_step:
            tau = [round(v / s.torque_step) * s.torque_step for v in tau]
        self._times.append(self._late(k))
        self._torques.append(tau)
        self._next += 1

    def _measured(
        self, q: Sequence[float], qd: Sequence[float]
    ) -> tuple[Sequence[float], Sequence[float]]:
        """Angles and speeds as the encoders tell them."""
        step = self.sampling.resolution
        if not step:
            return q, qd
        angles = [round(v / step) * step for v in q]
        before = self._angles
        self._angles = angles
        if before is None:
            return angles, qd
        return angles, [(a - b) / self.sampling.period for a, b in zip(angles, before, strict=True)]

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """Torques in force at time t."""
        if not self._times:
            self.sample(0.0, q, qd)
        return self._torques[max(0, bisect_right(self._times, t) - 1)]
