"""Bands for plots of torque: how far a motion's torque can be trusted, or why no band applies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kr16cli.arrays import Array
from kr16cli.robot import Payload, RobotData
from kr16cli.simulate.run import Run
from kr16cli.study.spread import taken_as_exact
from kr16cli.study.uncertainty import torque_bands

_MOST = 401
"""Samples at which a band is computed; between them it is drawn straight."""


class Bands(NamedTuple):
    """Half widths (n, 6) of 95 % bands, N m, or None; and words that say what they are, or why."""

    half: Array | None
    words: str


def of_motion(
    data: RobotData,
    q: Array,
    qd: Array,
    qdd: Array,
    *,
    payload: Payload | None = None,
    drives: bool = False,
) -> Bands:
    """Bands of the torque that a motion needs.

    Args:
        data: the robot.
        q: (n, 6) angles, rad.
        qd: (n, 6) speeds, rad/s.
        qdd: (n, 6) accelerations, rad/s2.
        payload: on the flange.
        drives: count rotor inertia and friction.
    """
    if not data.links:
        return Bands(None, "no band: the parameter file has no inertial data")
    # Evenly spread over the samples, first and last among them.
    pick = np.unique(np.linspace(0, len(q) - 1, min(_MOST, len(q))).round().astype(int))
    parts = (np.ascontiguousarray(v[pick]) for v in (q, qd, qdd))
    found = torque_bands(data, *parts, payload=payload, drives=drives)
    if not found.any():
        return Bands(None, "no band: the parameter file states no tolerance that moves a torque")
    every = np.arange(len(q))
    half = np.stack([np.interp(every, pick, column) for column in found.T], axis=-1)
    words = (
        "band: 95 % of the torque this motion needs, given the file's tolerances (two sigma, first "
        "order)"
    )
    return Bands(half, "; ".join([words, *taken_as_exact(data, drives=drives)]))


def of_run(data: RobotData, run: Run) -> Bands:
    """Bands of the torque of a recorded run.

    Where a controller follows a motion the torque is its answer, as uncertain as the model.
    Where the torque is given it is exact, and the motion is what is uncertain.
    """
    table = run.scenario
    if table.get("controller") is None:
        return Bands(
            None,
            "no band on torque: it is given, the motion answers; kr16 uncertainty SCENARIO shows "
            "how far",
        )
    gravity = table.get("gravity")
    placed = data if gravity is None else data.with_gravity(tuple(gravity))
    load = table.get("payload")
    payload = None if load is None else Payload(
        load["mass"], tuple(load["com"]), tuple(load["inertia"])
    )  # fmt: skip
    return of_motion(
        placed, run.q, run.qd, run.qdd, payload=payload, drives=bool(table.get("drives"))
    )
