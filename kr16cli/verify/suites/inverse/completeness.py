"""No solution is missing and none is too many: counted against other root finders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kr16cli import Robot
from kr16cli.robot import Geometry
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent import roots
from kr16cli.verify.independent.rotations import Array, angle_gap, from_abc
from kr16cli.verify.measure import finding, known, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.inverse.closure import (
    elbow_cosines,
    missing,
    outside_principal,
    same,
    solved,
)

_IK = ("kr16cli.Robot.ik", "kr16cli.model.inverse.solve")


def anywhere(rng: sampling.Random, n: int, reach: float) -> Array:
    """Random poses in a box around the arm, in and out of reach."""
    poses = np.zeros((n, 4, 4))
    poses[:, :3, :3] = from_abc(rng.uniform(-np.pi, np.pi, (n, 3)))
    poses[:, :3, 3] = rng.uniform(-reach, reach, (n, 3))
    poses[:, 3, 3] = 1.0
    return poses


def _set_gap(rows: Array, others: Array) -> Array:
    """How far two sets of solutions (n, 8, 6) are apart, rad; infinite where counts differ."""
    ours, theirs = (known(a) for a in (rows, others))
    a, b = (np.nan_to_num(v, nan=0.0) for v in (rows, others))
    apart = np.stack([angle_gap(a[:, i, None], b) for i in range(8)], axis=1)
    apart = np.where(ours[:, :, None] & theirs[:, None, :], apart, np.inf)
    forth = np.where(ours, apart.min(axis=2), 0.0).max(axis=1)
    back = np.where(theirs, apart.min(axis=1), 0.0).max(axis=1)
    same = ours.sum(axis=1) == theirs.sum(axis=1)
    return np.where(same, np.maximum(forth, back), np.inf)


def _compared(robot: Robot, poses: Array) -> tuple[Array, Array]:
    """Errors and poses, those within 1e-4 of a singular family left out."""
    poses = poses[clear_of_singular(robot, poses)]
    others = roots.quartic(robot.data.geometry, poses).angles
    return _set_gap(robot.ik(poses), others), poses


def clear_of_singular(robot: Robot, poses: Array) -> npt.NDArray[np.bool_]:
    """Which poses have no branch within about 1e-2 (elbow), 1e-2 m, 1e-3 of a singular family."""
    g = robot.data.geometry
    safe = np.nan_to_num(robot.ik(poses), nan=0.5)
    wrist = poses[:, :3, 3] - g.d6 * poses[:, :3, 2]
    clear = np.abs(np.abs(elbow_cosines(robot, poses)) - 1.0).min(axis=1) > 1e-4
    clear &= np.hypot(wrist[:, 0], wrist[:, 1]) > 1e-2
    return np.asarray(clear & (np.abs(np.sin(safe[..., 4])).min(axis=1) > 1e-3))


@case(
    "inverse.complete",
    title="The solutions are all there are",
    statement="The set of solutions equals that of Pieper's quartic in tan(q3/2) with both wrists, "
    "which holds every solution; 0, 4 or 8 of them",
    regime="poses of random configurations, and random poses in a box around the arm",
    method="eigenvalues of the quartic's companion matrix; counts and angles compared both ways",
    grade="B",
    tolerance=1e-6,
    unit="rad",
    reason="near a double root (elbow 1e-4 from stretched) the quartic keeps half its digits",
    equations=("3.13", "3.14", "3.16"),
    functions=_IK,
)
def complete(setting: Setting) -> Finding:
    """Counting by algebra."""
    rng, robot = sampling.random(setting, "complete"), setting.robot.with_tool(None)
    n = setting.samples(20000, 400)
    made = poe.flange(robot.data.geometry, sampling.generic(rng, n))
    error, poses = _compared(robot, np.concatenate([made, anywhere(rng, n, 2.0)]))
    found = known(robot.ik(poses)).sum(axis=1)
    count = np.bincount(found, minlength=9)
    text = f"solutions per pose: 0 for {count[0]}, 4 for {count[4]}, 8 for {count[8]} poses"
    figures = {"solutions": list(range(9)), "poses": count.tolist()}
    return finding(error, text, figures=figures, T=poses)


@case(
    "inverse.complete-other-arms",
    title="The solutions of other arms of the same structure are all there are",
    statement="As inverse.complete, for random lengths, a3 < 0 included; angles in (-pi, pi]",
    regime="random lengths; poses of random configurations and random poses",
    method="eigenvalues of the quartic's companion matrix",
    grade="B",
    tolerance=1e-6,
    unit="rad",
    reason="as for inverse.complete",
    equations=("3.13", "3.14", "3.16"),
    functions=_IK,
)
def complete_other_arms(setting: Setting) -> Finding:
    """Nothing leans on one robot's lengths."""
    rng = sampling.random(setting, "complete-other")
    errors, poses = [], []
    for _ in range(setting.samples(30, 3)):
        low, high = (0.3, 0.1, 0.4, -0.2, 0.4, 0.05), (0.9, 0.5, 0.9, 0.2, 0.9, 0.3)
        g = Geometry(*map(float, rng.uniform(low, high)))
        robot = Robot(replace(setting.robot.data, geometry=g))
        made = poe.flange(g, sampling.generic(rng, 100))
        error, kept = _compared(robot, np.concatenate([made, anywhere(rng, 100, 2.0)]))
        errors.append(np.where(outside_principal(robot.ik(kept)), np.inf, error))
        poses.append(kept)
    return finding(np.concatenate(errors), "sets of solutions", T=np.concatenate(poses))


@case(
    "inverse.level-forearm",
    title="An arm without the 35 mm: the folded elbow is +180 degrees",
    statement="with a3 = 0 the stretched arm is q3 = 0 and the folded one q3 = pi, never -pi",
    regime="stretched and folded arms, a3 = 0",
    method="the range of all angles, and residuals by the product of exponentials",
    grade="B",
    tolerance=1e-9,
    unit="m, rad",
    reason="the contract; an angle out of range counts as infinite",
    functions=_IK,
)
def level_forearm(setting: Setting) -> Finding:
    """The edge of the elbow's range."""
    rng = sampling.random(setting, "level-forearm")
    g = setting.robot.data.geometry._replace(a3=0.0)
    robot = Robot(replace(setting.robot.data, geometry=g))
    q = sampling.on_elbow(rng, setting.samples(2000, 200), robot.data)
    poses, rows, error = solved(robot, q)
    wrong = outside_principal(rows) | missing(robot, poses, rows)
    return finding(np.where(wrong, np.inf, np.nanmax(error, axis=1)), "residuals and range", q=q)


@case(
    "inverse.newton",
    title="A root finder that knows no structure finds nothing else",
    statement="Every configuration that Newton's method converges to is among the solutions",
    regime="poses of random configurations, 1e-2 away from all singular families",
    method="damped Newton from random starts on the product of exponentials",
    grade="B",
    tolerance=1e-7,
    unit="rad",
    reason="Newton stops at 1e-10 in the pose; conditioning adds up to 1e2 squared",
    functions=_IK,
)
def newton(setting: Setting) -> Finding:
    """Counting by search."""
    rng, robot = sampling.random(setting, "newton"), setting.robot.with_tool(None)
    g = robot.data.geometry
    n, starts = setting.samples(40, 2), setting.samples(200, 30)
    q = sampling.regular(rng, n, robot.data)
    poses = poe.flange(g, q)
    rows = robot.ik(poses)
    errors, found, there = [], 0, int(known(rows).sum())
    for pose, own in zip(poses, rows, strict=True):
        reached = roots.newton(g, pose, rng.uniform(-np.pi, np.pi, (starts, 6)))
        found += len(reached)
        apart = angle_gap(reached[:, None], own[known(own)][None])
        errors.append(apart.min(axis=1, initial=np.inf).max(initial=0.0))
    text = f"Newton reached {found} of {there} solutions, and nothing else"
    return finding(errors, text, q=q)


@case(
    "inverse.reach",
    title="What explains a missing branch",
    statement="reach[shoulder] = (squared distance of the wrist centre from the A2 axis, cosine "
    "of the elbow angle); no elbow closes beyond +-1",
    regime="random poses in and out of reach",
    method="distances taken from the product of exponentials and the pose",
    grade="B",
    tolerance=1e-13,
    unit="m2, 1",
    reason="sums of squares of lengths up to 3 m",
    equations=("3.13",),
    functions=("kr16cli.Arm.ik",),
)
def reach(setting: Setting) -> Finding:
    """The numbers behind `why`."""
    rng, robot = sampling.random(setting, "reach"), setting.robot
    g = robot.data.geometry
    poses = anywhere(rng, setting.samples(1000, 100), 2.5)
    wrist = poses[:, :3, 3] - g.d6 * poses[:, :3, 2]
    forward = np.hypot(wrist[:, 0], wrist[:, 1])[:, None] * np.array([1.0, -1.0]) - g.a1
    square = forward**2 + (wrist[:, 2] - g.d1)[:, None] ** 2
    said = [robot.arm.ik(T.tolist()) for T in poses]
    error = largest(
        *(np.abs(np.array([s.reach[k][0] for s in said]) - square[:, k]) for k in (0, 1)),
        *(
            np.abs(np.array([s.reach[k][1] for s in said]) - elbow_cosines(robot, poses)[:, k])
            for k in (0, 1)
        ),
    )
    arrays = robot.ik(poses)
    singles = np.array([s.angles for s in said])
    differ = [not same(one, other, 1e-9) for one, other in zip(singles, arrays, strict=True)]
    flagged = [bool(s.on_axis or any(s.folded) or any(s.straight_wrist)) for s in said]
    wrong = np.array(differ) | np.array(flagged)
    return finding(np.where(wrong, np.inf, error), "floats and arrays, both shoulders", T=poses)
