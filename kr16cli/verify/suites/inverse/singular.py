"""Singular poses: the free angle comes from the known configuration, and branches merge."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from kr16cli import Robot
from kr16cli.robot import Geometry
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, angle_gap, pose_gap
from kr16cli.verify.measure import COUNT, counted, finding, known, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.inverse.closure import missing, same

_IK = ("kr16cli.Robot.ik", "kr16cli.model.inverse.solve")
_RULE = "the free angle is copied: cos and sin there and back round by 1e-16"


def _closure(robot: Robot, poses: Array, rows: Array) -> Array:
    """Worst residual of the rows of each pose; infinite where a branch is missing."""
    there = known(rows)
    remade = poe.flange(robot.data.geometry, np.where(there[..., None], rows, 0.0))
    error = np.where(there, largest(*pose_gap(remade, poses[:, None])), 0.0).max(axis=1)
    return np.where(missing(robot, poses, rows) | ~there.any(axis=1), np.inf, error)


def _apart(rows: Array, one: slice, other: slice) -> Array:
    """Largest angle between rows that must be equal (0 for both missing)."""
    gap = np.nan_to_num(angle_gap(rows[:, one], rows[:, other]), nan=0.0)
    return np.asarray(gap.max(axis=1))


def _free(rows: Array, joint: int, near: Array) -> Array:
    """How far a joint of all rows is from that of the known configuration."""
    off = rows[..., joint - 1] - near[:, None, joint - 1]
    turned = np.abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi)
    return np.asarray(np.nan_to_num(turned, nan=0.0).max(axis=1))


@case(
    "inverse.singular-shoulder",
    title="Wrist centre on the A1 axis: A1 keeps its known value",
    statement="q1 = near q1 in every row, rows b and b + 4 are equal, the pose is reproduced, "
    "and `on_axis` says so",
    regime="wrist centre within 1e-12 m of the A1 axis",
    method="rule of section 3.2.3; residuals by the product of exponentials",
    grade="B",
    tolerance=1e-9,
    unit="rad, m",
    reason=_RULE + "; the pose moves by the distance from the axis, at most 1e-10",
    functions=(*_IK, "kr16cli.Arm.ik"),
)
def shoulder(setting: Setting) -> Finding:
    """A1 free."""
    rng, robot = sampling.random(setting, "shoulder"), setting.robot.with_tool(None)
    n = setting.samples(5000, 200)
    q = sampling.on_shoulder(rng, sampling.generic(rng, n), robot.data.geometry, 0.0)
    near = sampling.generic(rng, n)
    poses = poe.flange(robot.data.geometry, q)
    rows = robot.ik(poses, near)
    error = largest(
        _closure(robot, poses, rows),
        _free(rows, 1, near),
        _apart(rows, slice(0, 4), slice(4, 8)),
        _unsaid(robot, poses, near, rows, "on_axis"),
    )
    return finding(error, "q1, merged rows and residuals", q=q, near=near)


@case(
    "inverse.singular-wrist",
    title="q5 = 0 or 180 degrees: A4 keeps its known value",
    statement="q4 = near q4 in the rows of that arm posture, the two wrists are equal, the pose is "
    "reproduced, and `straight_wrist` says so",
    regime="q5 exactly 0 or pi",
    method="rule of section 3.2.3; residuals by the product of exponentials",
    grade="B",
    tolerance=1e-9,
    unit="rad, m",
    reason=_RULE,
    functions=(*_IK, "kr16cli.Arm.ik"),
)
def wrist(setting: Setting) -> Finding:
    """A4 free."""
    rng, robot = sampling.random(setting, "wrist"), setting.robot.with_tool(None)
    n, g = setting.samples(5000, 200), setting.robot.data.geometry
    q = sampling.regular(rng, n, robot.data)
    q = sampling.with_joint(q, 5, rng.choice([0.0, math.pi], n))
    near = sampling.generic(rng, n)
    poses = poe.flange(g, q)
    rows = robot.ik(poses, near)
    arm = 2 * (poe.forward_of_column(g, q) < 0) + (poe.elbow_side(g, q) > 0)
    own = rows.reshape(n, 4, 2, 6)[np.arange(n), arm]
    exact = largest(
        _free(own, 4, near),
        angle_gap(own[:, 0], own[:, 1]),
        angle_gap(own[:, 0, :3], q[:, :3]),
        _free(own, 5, q),
    )
    said = _unsaid(robot, poses, near, rows, "straight_wrist")
    return finding(
        largest(_closure(robot, poses, rows), exact, said), "q4 and merged wrists", q=q, near=near
    )


def _unsaid(robot: Robot, poses: Array, near: Array, rows: Array, flag: str) -> Array:
    """Infinite where a single query differs from the batch or does not name the singular case."""
    error = np.zeros(len(poses))
    for i in range(0, len(poses), max(1, len(poses) // 30)):
        single = robot.arm.ik(poses[i].tolist(), near[i].tolist())
        equal = same(np.array(single.angles), rows[i], 1e-6)
        named = getattr(single, flag)
        told = any(named) if isinstance(named, list) else bool(named)
        error[i] = 0.0 if equal and told else np.inf
    return error


@case(
    "inverse.singular-elbow",
    title="Stretched or folded arm: the elbow pair merges",
    statement="The two elbows agree to the square root of rounding and the pose is reproduced",
    regime="a3 c3 + d4 s3 = 0 as exactly as floating point tells",
    method="residuals by the product of exponentials",
    grade="B",
    tolerance=1e-6,
    unit="rad",
    reason="an elbow cosine wrong by 1e-15 is an angle of 1e-7; residuals are held to 1e-9",
    functions=_IK,
)
def elbow(setting: Setting) -> Finding:
    """The reach's edge: poses there must not be lost to rounding."""
    rng, robot = sampling.random(setting, "elbow"), setting.robot.with_tool(None)
    g = robot.data.geometry
    q = sampling.on_elbow(rng, setting.samples(5000, 400), robot.data)
    q = q[np.abs(poe.forward_of_column(g, q)) > 1e-3]
    poses = poe.flange(g, q)
    rows = robot.ik(poses)
    shoulder = (poe.forward_of_column(g, q) < 0).astype(int)
    own = rows.reshape(len(q), 2, 4, 6)[np.arange(len(q)), shoulder]
    # q4 and q6 of a straight wrist are anything; the arm's three angles merge.
    merged = angle_gap(own[:, :2, :3], own[:, 2:, :3]).max(axis=1)
    back = angle_gap(own[:, 0, :3], q[:, :3])
    held = np.where(_closure(robot, poses, rows) > 1e-9, np.inf, 0.0)
    return finding(largest(merged, back, held), "elbow pairs and residuals", q=q)


@case(
    "inverse.singular-fold",
    title="An arm folded onto its own shoulder: A2 keeps its known value",
    statement="Where a2 = hypot(a3, d4) and the wrist centre is on the A2 axis, q2 = near q2; "
    "1e-3 m, 3e-5 m, and up to 1e-10 m off it, every solution reproduces the pose",
    regime="lengths 0.85, 0.40, 0.75 m; on the fold, and 1e-3, 3e-5, 1e-10, 1e-12 m off",
    method="rule of section 3.2.3; residuals by the product of exponentials",
    grade="B",
    tolerance=5e-8,
    unit="rad, m",
    reason="within 1e-9 m counts as folded; 3e-5 m off, cosines near -1 cost half their digits",
    functions=_IK,
)
def fold(setting: Setting) -> Finding:
    """A2 free; only another arm of the structure can fold so far."""
    rng, base = sampling.random(setting, "fold"), setting.robot.data
    g = Geometry(base.geometry.d1, base.geometry.a1, 0.85, 0.40, 0.75, base.geometry.d6)
    robot = Robot(replace(base, geometry=g))
    n = setting.samples(2000, 100)
    folded = sampling.straight(g) + math.pi
    q = sampling.with_joint(sampling.generic(rng, 2 * n), 3, sampling.turned(np.array(folded)))
    off = rng.choice([1e-3, 4e-5, 1e-10, 1e-12], n)
    q[n:, 2] = sampling.turned(folded + rng.choice([-1.0, 1.0], n) * off)
    near = sampling.generic(rng, 2 * n)
    poses = poe.flange(g, q)
    rows = robot.ik(poses, near)
    free = _free(rows[:, :4], 2, near)
    free[n:] = 0.0
    error = largest(_closure(robot, poses, rows), free)
    single = robot.arm.ik(poses[0].tolist(), near[0].tolist())
    told = single.folded == [True, False]
    equal = same(np.array(single.angles), rows[0], 1e-9)
    error[0] = error[0] if told and equal else np.inf
    return finding(error, "q2 and residuals, on the fold and near it", q=q, near=near)


@case(
    "inverse.path",
    title="A path through singularities stays continuous",
    statement="ik_path follows a straight and a turning path through q5 = 0; joint steps stay "
    "small, free angles keep their last value, and every pose is reproduced",
    regime="joint paths through q5 = 0 and past +-180 deg of A1, A4 and A6",
    method="poses and residuals by the product of exponentials",
    grade="B",
    tolerance=1e-9,
    unit="rad, m",
    reason="the contract for residuals; a jump counts as infinite",
    functions=("kr16cli.Robot.ik_path",),
)
def path(setting: Setting) -> Finding:
    """The last known value is a state."""
    robot, g = setting.robot.with_tool(None), setting.robot.data.geometry
    n = setting.samples(400, 60)
    time = np.linspace(0.0, 1.0, 2 * n + 1)[:, None]
    start = np.array([2.9, -1.2, 1.0, 2.8, 0.4, -2.9])
    stop = np.array([3.6, -1.5, 1.3, 3.5, -0.4, -3.6])
    straight = start + (stop - start) * time
    straight[:, 3] = start[3]  # A4 at rest, so that the way through q5 = 0 is continuous
    poses = poe.flange(g, straight)
    found = robot.ik_path(poses, start)
    residual = largest(*pose_gap(poe.flange(g, found), poses))
    steps = np.abs(np.diff(found, axis=0)).max(axis=1)
    jump = np.concatenate([[np.abs(found[0] - start).max()], steps]) > 10.0 / n
    return finding(np.where(jump, np.inf, residual), "a path of poses", q=straight)


@case(
    "inverse.flags",
    title="Regular poses are not called singular",
    statement="on_axis, straight_wrist and folded are false away from their families",
    regime="at least 1e-2 away from all singular families",
    method="flags of single queries",
    grade="C",
    tolerance=COUNT,
    unit="wrong poses",
    reason="a flag is right or wrong",
    functions=("kr16cli.Arm.ik",),
)
def flags(setting: Setting) -> Finding:
    """No false alarm."""
    rng, robot = sampling.random(setting, "flags"), setting.robot
    q = sampling.regular(rng, setting.samples(500, 60), robot.data)
    wrong = []
    for T in poe.flange(robot.data.geometry, q):
        s = robot.arm.ik(T.tolist())
        wrong.append(bool(s.on_axis) or any(s.straight_wrist) or any(s.folded))
    return counted(wrong, "flags of single queries", q=q)
