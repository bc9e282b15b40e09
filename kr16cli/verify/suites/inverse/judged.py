"""What the branches of a pose are worth, for maps: against the quartic's solutions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kr16cli import Robot
from kr16cli.robot import Geometry
from kr16cli.tolerances import TOLERANCES
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent import roots
from kr16cli.verify.independent.rotations import Array
from kr16cli.verify.measure import finding, known
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.inverse.completeness import anywhere, clear_of_singular

_NONE = 1e9
"""Distance to the limits, negative, where nothing is in reach."""

_EDGE = 1e-6
"""Branches this near a limit (rad) may count or not."""


def _worth(robot: Robot, rows: Array) -> tuple[Array, Array]:
    """(n, 6) what solutions (n, 8, 6) are worth, and of which poses one is near a limit."""
    g, joints = robot.data.geometry, robot.data.joints
    there = known(rows)
    q = np.where(there[..., None], rows, 0.3)
    lower, upper = (np.array([getattr(j, side) for j in joints]) for side in ("lower", "upper"))
    turns = 2 * math.pi * np.arange(-2, 3)[:, None, None, None]
    inside = np.minimum(q + turns - lower, upper - q - turns).max(axis=0)  # any whole turns
    distance = np.where(there, inside.min(axis=-1), -_NONE)
    within = distance > -TOLERANCES.limit
    size = np.abs(np.linalg.det(poe.jacobian(g, q, poe.zero_flange(g)[:3, 3])))
    forearm = math.hypot(g.a3, g.d4)
    factors = (
        np.abs(poe.forward_of_column(g, q)) / (g.a1 + g.a2 + forearm),
        np.abs(poe.elbow_side(g, q)) / forearm,
        np.abs(np.sin(q[..., 4])),
    )
    least = np.minimum.reduce(factors)
    none = ~within.any(axis=1)
    worth = np.stack(
        [
            there.sum(axis=1).astype(float),
            within.sum(axis=1).astype(float),
            np.where(within, size, 0.0).max(axis=1),
            np.where(none, 0.0, np.where(within, size, np.inf).min(axis=1)),
            distance.max(axis=1),
            np.where(within, least, 0.0).max(axis=1),
        ],
        axis=-1,
    )
    return worth, np.asarray((np.abs(distance) < _EDGE).any(axis=1))


@case(
    "inverse.judged",
    title="What the branches of a pose are worth",
    statement="number of branches, number within the limits, largest and smallest |det J| of "
    "those, the best distance to a limit, the best least factor of (3.37) over its largest value",
    regime="poses of random configurations and anywhere, 1e-2 off singular; other arms and limits; "
    "no branch within 1e-6 rad of a limit",
    method="all solutions by Pieper's quartic, whole turns tried one by one, |det J| by LAPACK on "
    "the product of exponentials",
    grade="B",
    tolerance=1e-6,
    unit="1, m3, rad",
    reason="near a double root the quartic keeps half its digits; a wrong count is 1 or more",
    equations=("3.26", "3.37"),
    functions=("kr16cli.Robot.judge_branches", "kr16cli.model.branches.judge"),
)
def judged(setting: Setting) -> Finding:
    """Six numbers."""
    rng, data = sampling.random(setting, "judged"), setting.robot.data
    n, errors, kept = setting.samples(1500, 50), [], []
    for k in range(3):
        own = data
        if k:
            low, high = (0.3, 0.1, 0.4, 0.02, 0.4, 0.05), (0.9, 0.5, 0.9, 0.2, 0.9, 0.3)
            limits = np.sort(rng.uniform(-math.pi, math.pi, (6, 2)), axis=1)
            limits += np.array([-0.6, 0.6])
            joints = tuple(
                replace(j, lower=float(a), upper=float(b))
                for j, (a, b) in zip(data.joints, limits, strict=True)
            )
            own = replace(data, geometry=Geometry(*map(float, rng.uniform(low, high))),
                          joints=joints)  # fmt: skip
        robot = Robot(own)
        inside = sampling.within_limits(rng, n, own)
        made = poe.flange(own.geometry, np.concatenate([inside, sampling.generic(rng, n)]))
        poses = np.concatenate([made, anywhere(rng, n, 2.0)])
        poses = poses[clear_of_singular(robot, poses)]
        theirs, unsure = _worth(robot, roots.quartic(own.geometry, poses).angles)
        found = robot.judge_branches(poses)
        errors.append(np.abs(found - theirs).max(axis=1)[~unsure])
        kept.append(poses[~unsure])
    error, poses = np.concatenate(errors), np.concatenate(kept)
    return finding(error, f"six numbers of {len(poses)} poses, three arms", T=poses)


@case(
    "inverse.judged-edges",
    title="What the branches of singular poses and of poses at the limits are worth",
    statement="a merged pair counts twice, a free joint is taken as 0, a branch exactly at a limit "
    "is within it, and |det J| of singular branches is 0",
    regime="q5 = 0 or 180 deg, stretched arms, and wrist joints exactly at their limits",
    method="the rows of ik with near = 0 judged one by one, |det J| by LAPACK on the product of "
    "exponentials",
    grade="C",
    tolerance=1e-6,
    unit="1, m3, rad",
    reason="the stretched elbow is known to 1e-7; a wrong count is 1 or more",
    functions=("kr16cli.Robot.judge_branches", "kr16cli.model.branches.judge"),
)
def judged_edges(setting: Setting) -> Finding:
    """Where rounding must not decide."""
    rng, data, n = sampling.random(setting, "judged-edges"), setting.robot.data, 60
    # With A4 held to +-0.2 rad a free A4 decides whether a branch is within.
    held = replace(data.joints[3], lower=-0.2, upper=0.2)
    narrow = replace(data, joints=(*data.joints[:3], held, *data.joints[4:]))
    errors, kept = [], []
    for own in (data, narrow):
        robot = Robot(own)
        lower, upper = (np.array([getattr(j, s) for j in own.joints]) for s in ("lower", "upper"))
        side = rng.random((n, 6)) < 0.5
        inside = np.array([0.3, 0.3, 0.3, 0.0, 0.0, 0.0])  # the arm's joints off, the wrist's at
        at_limits = np.where(side, lower + inside, upper - inside)
        parts = (sampling.on_wrist(rng, n, own), sampling.on_elbow(rng, n, own), at_limits)
        poses = np.concatenate([poe.flange(own.geometry, q) for q in parts])
        theirs, _ = _worth(robot, robot.ik(poses, np.zeros(6)))
        errors.append(np.abs(robot.judge_branches(poses) - theirs).max(axis=1))
        kept.append(poses)
    return finding(np.concatenate(errors), "six numbers, two ranges of A4", T=np.concatenate(kept))
