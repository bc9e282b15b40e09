"""Where rounding decides: the reach's edge, and a wrist that is straight to the last digit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kr16cli import Robot
from kr16cli.robot import Geometry
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, pose_gap
from kr16cli.verify.measure import COUNT, counted, finding, known
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.inverse.closure import same

_IK = ("kr16cli.Robot.ik", "kr16cli.model.inverse.solve")


def _beyond(setting: Setting, sign: float, excess: Array, radius: Array) -> Array:
    """Poses whose wrist centre, `radius` from the A1 axis, has the elbow cosine sign (1 + excess).

    The flange's orientation is that of random configurations.
    """
    g, rng = setting.robot.data.geometry, sampling.random(setting, "slack")
    n, forearm = len(excess), math.hypot(g.a3, g.d4)
    square = g.a2**2 + forearm**2 + 2 * g.a2 * forearm * sign * (1 + excess)
    poses = poe.flange(g, sampling.generic(rng, n))
    around = rng.uniform(-math.pi, math.pi, n)
    up = np.sqrt(square - (radius - g.a1) ** 2) * rng.choice([-1.0, 1.0], n)
    centre = np.stack([radius * np.cos(around), radius * np.sin(around), g.d1 + up], axis=-1)
    poses[:, :3, 3] = centre + g.d6 * poses[:, :3, 2]
    return poses


@case(
    "inverse.slack",
    title="How far beyond its reach a pose still counts as rounding",
    statement="an elbow cosine beyond 1 by less than 1e-12 closes, by more it does not; 1e-9 where "
    "the wrist centre is on the A1 axis",
    regime="cosines 10 % to 90 % below and above the slack: stretched, folded, and on the axis",
    method="wrist centres placed by the law of cosines",
    grade="B",
    tolerance=COUNT,
    unit="wrong poses",
    reason="a branch is there or not",
    equations=("3.13", "3.14"),
    functions=_IK,
)
def slack(setting: Setting) -> Finding:
    """The line between out of reach and rounding."""
    rng, robot = sampling.random(setting, "slack-size"), setting.robot.with_tool(None)
    g, n = robot.data.geometry, setting.samples(400, 60)
    share = rng.choice([-1.0, 1.0], n) * rng.uniform(0.1, 0.9, n)
    folded = abs(g.a2 - math.hypot(g.a3, g.d4))
    wrong, poses = [], []
    for sign, allowed, radius in (
        (1.0, 1e-12, rng.uniform(0.1, 1.0, n)),
        (-1.0, 1e-12, g.a1 + folded * rng.uniform(-0.9, 0.9, n)),
        (1.0, 1e-9, np.zeros(n)),
    ):
        poses.append(_beyond(setting, sign, allowed * (1 + share), radius))
        there = known(robot.ik(poses[-1]))[:, :4].all(axis=1)
        wrong.append(there != (share < 0))
    text = f"{3 * n} poses at the edge of the reach"
    return counted(np.concatenate(wrong), text, pose=np.concatenate(poses))


@case(
    "inverse.straight-wrist",
    title="A wrist that is straight to the last digit",
    statement="sin q5 = 0 without any rounding divides nothing by zero: A4 keeps its known value",
    regime="an arm of lengths 1/8, 1/4, ... stretched level, so that every number is exact",
    method="residuals by the product of exponentials",
    grade="B",
    tolerance=1e-9,
    unit="m, rad",
    reason="the contract; another A4 counts as infinite",
    equations=("3.27", "3.28"),
    functions=_IK,
)
def straight_wrist(setting: Setting) -> Finding:
    """No rounding comes to the rescue."""
    rng, n = sampling.random(setting, "straight-wrist"), setting.samples(200, 30)
    g = Geometry(d1=0.5, a1=0.25, a2=0.75, a3=0.0, d4=0.5, d6=0.125)
    robot = Robot(replace(setting.robot.data, geometry=g))
    q = np.zeros((n, 6))
    q[:, 5] = rng.uniform(-1.5, 1.5, n)
    poses = poe.flange(g, q)
    poses[:, :3, 2], poses[:, 0, :2] = (1.0, 0.0, 0.0), 0.0
    poses[:, :3, 3] = (g.a1 + g.a2 + g.d4 + g.d6, 0.0, g.d1)
    near = np.zeros((n, 6))
    near[:, 3] = rng.uniform(-1.5, 1.5, n)
    rows = robot.ik(poses, near)
    error = np.maximum(*pose_gap(poe.flange(g, rows[:, 0]), poses))
    kept = np.abs(rows[:, 0, 3] - near[:, 3]) < 1e-12
    single = [robot.arm.ik(T.tolist(), k.tolist()) for T, k in zip(poses, near, strict=True)]
    equal = [same(np.array(s.angles), own, 1e-9) for s, own in zip(single, rows, strict=True)]
    return finding(np.where(kept & np.array(equal), error, np.inf), "an exact arm", pose=poses)
