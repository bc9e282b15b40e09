"""Robots that differ in their numbers, told to the solvers that move them all at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kr16cli.arrays import Array
from kr16cli.robot import Payload, RobotData
from kr16cli.rollout import Variation


def variation_of(data: RobotData, count: int, *, drives: bool) -> dict[str, Array]:
    """Links and drives of a robot whose numbers are floats or arrays, as `Variation` takes them.

    Args:
        data: the robot; arrays have shape (count,).
        count: how many robots it stands for.
        drives: rotor inertia and friction, too.

    Returns:
        The fields of a `Variation`.
    """

    def table(values: Sequence[Any]) -> Array:
        wide = [np.broadcast_to(np.asarray(v, dtype=float), count) for v in values]
        return np.stack(wide, axis=-1)

    made = {
        "link_mass": table([link.mass for link in data.links]),
        "link_com": np.stack([table(link.com) for link in data.links], axis=1),
        "link_inertia": np.stack([table(link.inertia) for link in data.links], axis=1),
    }
    if drives:
        joints = data.joints
        made["rotor_inertia"] = table([joint.reflected_inertia for joint in joints])
        made["coulomb"] = table([0.0 if j.coulomb is None else j.coulomb for j in joints])
        made["viscous"] = table([0.0 if j.viscous is None else j.viscous for j in joints])
    return made


def crowd_of(
    robots: Sequence[RobotData], payloads: Sequence[Payload | None], *, drives: bool
) -> Variation:
    """What differs between robots of one geometry, and what they carry.

    Args:
        robots: n of them.
        payloads: on their flanges, n.
        drives: rotor inertia and friction, too.
    """
    first, made = robots[0], {}
    if any(robot is not first for robot in robots):
        each = [variation_of(robot, 1, drives=drives) for robot in robots]
        made = {name: np.concatenate([one[name] for one in each]) for name in each[0]}
    if any(robot.gravity != first.gravity for robot in robots):
        made["gravity"] = np.array([robot.gravity for robot in robots])
    if any(payloads):
        loads = [load or Payload() for load in payloads]
        made["payload_mass"] = np.array([load.mass for load in loads])
        made["payload_com"] = np.array([load.com for load in loads])
        made["payload_inertia"] = np.array([load.inertia for load in loads])
    return Variation(**made)
