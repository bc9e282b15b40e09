"""Every solution reproduces its pose, in every regime; the labels of the branches are right."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from kr16cli import Robot
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, angle_gap, pose_gap
from kr16cli.verify.measure import COUNT, counted, finding, gap, known, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case

_IK = ("kr16cli.Robot.ik", "kr16cli.model.inverse.solve")
EDGE = 1e-11
"""An elbow cosine this near +-1 may or may not close: rounding decides."""


def solved(robot: Robot, q: Array) -> tuple[Array, Array, Array]:
    """Poses of q, their solutions, and the larger of position and rotation error of each row.

    The poses and the errors come from the product of exponentials. Rows out of reach are NaN.
    """
    g = robot.data.geometry
    poses = poe.flange(g, q)
    rows = robot.ik(poses)
    there = known(rows)
    remade = poe.flange(g, np.where(there[..., None], rows, 0.0))
    error = largest(*pose_gap(remade, poses[:, None]))
    return poses, rows, np.where(there, error, np.nan)


def elbow_cosines(robot: Robot, poses: Array) -> Array:
    """Cosine of the elbow angle for each shoulder, (n, 2); beyond +-1 the elbow cannot close."""
    g = robot.data.geometry
    wrist = poses[:, :3, 3] - g.d6 * poses[:, :3, 2]
    forward = np.hypot(wrist[:, 0], wrist[:, 1])[:, None] * np.array([1.0, -1.0]) - g.a1
    square = forward**2 + (wrist[:, 2] - g.d1)[:, None] ** 2
    forearm = math.hypot(g.a3, g.d4)
    return np.asarray((square - g.a2**2 - forearm**2) / (2 * g.a2 * forearm))


def missing(robot: Robot, poses: Array, rows: Array) -> Array:
    """Poses where a shoulder within reach has no solutions, or one out of reach has some."""
    cosine = np.abs(elbow_cosines(robot, poses))
    there = known(rows).reshape(-1, 2, 4)
    inside, outside = cosine <= 1 - EDGE, cosine > 1 + EDGE
    return np.asarray(((inside & ~there.all(-1)) | (outside & there.any(-1))).any(axis=-1))


def same(a: Array, b: Array, tolerance: float) -> bool:
    """Whether two sets of rows (8, 6) agree, whole turns aside; missing rows must be missing."""
    there = known(a)
    if not np.array_equal(there, known(b)):
        return False
    return bool((angle_gap(a[there], b[there]) <= tolerance).all())


def _register(name: str, words: str, draw: Callable[..., Array]) -> None:
    exact = name in ("generic", "limits", "round")

    @case(
        f"inverse.closure.{name}",
        title=f"Solutions reproduce the pose: {words}",
        statement="fk(ik(T)[b]) = T for every branch b, no branch in reach is missing, and the "
        "configuration that made the pose has a branch",
        regime=words,
        method="poses and residuals by the product of exponentials",
        grade="B",
        tolerance=1e-11 if exact else 1e-9,
        unit="m, rad",
        reason="rounding, times 1e2 where the wrist centre comes within 9 mm of the A2 axis"
        if exact
        else "the contract; where a distance below 1e-10 counts as singular, the pose moves by it",
        equations=("3.8", "3.12", "3.13", "3.14", "3.16", "3.21", "3.23", "3.24", "3.25", "3.26"),
        functions=_IK,
    )
    def closure(setting: Setting) -> Finding:
        rng, robot = sampling.random(setting, name), setting.robot.with_tool(None)
        q = draw(rng, setting.samples(20000, 500), robot.data)
        poses, rows, error = solved(robot, q)
        worst = np.max(np.nan_to_num(error, nan=0.0), axis=1)
        none = np.isnan(error).all(axis=1) | missing(robot, poses, rows)
        decades = np.log10(np.maximum(worst, 1e-17))
        count, edges = np.histogram(decades, bins=np.arange(-17.0, -8.5, 0.5))
        figures = {"log10_error": edges[:-1].tolist(), "count": count.tolist()}
        branches = np.bincount(np.isfinite(error).sum(axis=1), minlength=9)
        text = (
            f"residuals of {int(np.isfinite(error).sum())} solutions; poses with 4 branches "
            f"{int(branches[4])}, with 8 {int(branches[8])}"
        )
        return finding(np.where(none, np.inf, worst), text, figures=figures, q=q)


for _name, (_words, _draw) in sampling.REGIMES.items():
    _register(_name, _words, _draw)


@case(
    "inverse.recovery",
    title="The configuration itself is among the solutions, on its own branch",
    statement="q in (-pi, pi]^6 is row 4 shoulder + 2 elbow + wrist of ik(fk(q)), with shoulder 1 "
    "where the wrist centre is behind A1, elbow 1 where a3 c3 + d4 s3 > 0, wrist 1 where q5 < 0",
    regime="at least 1e-2 (rad, m) away from all singular families",
    method="labels by signs of distances taken from the product of exponentials",
    grade="B",
    tolerance=1e-10,
    unit="rad",
    reason="angles are ill-conditioned by 1 / 1e-2 twice; a few 1e-12 found",
    functions=_IK,
)
def recovery(setting: Setting) -> Finding:
    """Joint angles back."""
    rng, robot = sampling.random(setting, "recovery"), setting.robot.with_tool(None)
    g = robot.data.geometry
    q = sampling.regular(rng, setting.samples(20000, 1000), robot.data)
    rows = robot.ik(poe.flange(g, q))
    behind, bent = poe.forward_of_column(g, q) < 0, poe.elbow_side(g, q) > 0
    own = rows[np.arange(len(q)), 4 * behind + 2 * bent + (q[:, 4] < 0)]
    return finding(gap(own, q), "the row the configuration belongs to", q=q)


@case(
    "inverse.labels",
    title="Every row has the posture its index says, in principal angles",
    statement="shoulder, elbow and wrist of row b are the bits of b; angles in (-pi, pi]; "
    "the two wrists are (q4, q5, q6) and (q4 +- pi, -q5, q6 +- pi)",
    regime="at least 1e-2 away from all singular families, and round angles for the range",
    method="signs of distances taken from the product of exponentials",
    grade="B",
    tolerance=COUNT,
    unit="wrong poses",
    reason="a label is right or wrong",
    functions=_IK,
)
def labels(setting: Setting) -> Finding:
    """What the index of a row promises."""
    rng, robot = sampling.random(setting, "labels"), setting.robot.with_tool(None)
    g = robot.data.geometry
    q = sampling.regular(rng, setting.samples(5000, 300), robot.data)
    rows = robot.ik(poe.flange(g, q))
    there = known(rows)
    safe = np.where(there[..., None], rows, 0.5)
    index = np.arange(8)
    off = (poe.forward_of_column(g, safe) < 0) != (index // 4 == 1)
    off |= (poe.elbow_side(g, safe) > 0) != (index // 2 % 2 == 1)
    off |= (safe[..., 4] < 0) != (index % 2 == 1)
    one, other = safe[:, 0::2], safe[:, 1::2]
    half_turns = np.array([0.0, 0.0, 0.0, math.pi, 0.0, math.pi])
    mirrored = np.where(np.arange(6) == 4, -one, one) + half_turns
    flips = angle_gap(other, mirrored) > 1e-12
    wrong = (off & there).any(axis=1) | (flips & there[:, 0::2]).any(axis=1)
    both = np.concatenate([q, sampling.round_angles(rng, setting.samples(5000, 500))])
    wrong = np.concatenate([wrong, np.zeros(len(both) - len(q), dtype=bool)])
    wrong |= outside_principal(robot.ik(poe.flange(g, both)))
    # Poses built of exact numbers land on the edges of the range: +pi, never -pi.
    text = "signs of three distances, the wrist pair, and the range of all angles"
    return counted(wrong, text, q=both)


def outside_principal(rows: Array) -> Array:
    """Poses with an angle outside (-pi, pi]."""
    angles = np.nan_to_num(rows, nan=0.0)
    return np.asarray(((angles <= -math.pi) | (angles > math.pi)).any(axis=(-1, -2)))


@case(
    "inverse.edges",
    title="Angles on the edge of the range are +pi, never -pi",
    statement="-pi is given as pi for every joint, also for poses with negative zeros in them",
    regime="poses of exact numbers: 90 degree rotations at round places, with either sign of zero",
    method="rows inside (-pi, pi], each closing on the pose; floats and arrays alike",
    grade="C",
    tolerance=COUNT,
    unit="wrong poses",
    reason="an angle is in the range or not",
    functions=(*_IK, "kr16cli.Arm.ik"),
)
def edges(setting: Setting) -> Finding:
    """Signed zeros."""
    robot = setting.robot.with_tool(None)
    poses = _exact_poses(robot)
    rows = robot.ik(poses)
    there = known(rows)
    remade = poe.flange(robot.data.geometry, np.where(there[..., None], rows, 0.0))
    apart = np.where(there, largest(*pose_gap(remade, poses[:, None])), 0.0)
    wrong = outside_principal(rows) | (apart > 1e-9).any(axis=1) | missing(robot, poses, rows)
    for i in range(0, len(poses), 1 if not setting.quick else 5):
        single: Array = np.array(robot.arm.ik(poses[i].tolist()).angles)
        wrong[i] |= not same(single, rows[i], 1e-12) or bool(outside_principal(single))
    return counted(wrong, f"{int(there.sum())} solutions of poses with exact entries", T=poses)


def _exact_poses(robot: Robot) -> Array:
    """The 24 right-angled orientations at four places, zeros of both signs."""
    g = robot.data.geometry
    quarter = {k: np.round(np.array(k)) for k in ((1, 0, 0), (0, 1, 0), (0, 0, 1))}
    axes = [sign * v for v in quarter.values() for sign in (1.0, -1.0)]
    turns = [np.stack([x, y, np.cross(x, y)], axis=1) for x in axes for y in axes if x @ y == 0]
    places = ((1.1, 0.0, 1.3), (-1.0, 0.0, 1.2), (0.0, 1.1, 0.9), (0.0, -1.1, 0.9))
    poses = []
    for R in turns:
        for x, y, z in places:
            for zero in (0.0, -0.0):
                T = np.eye(4)
                T[:3, :3] = np.where(R == 0.0, zero, R)
                T[:3, 3] = np.array([x, y, z]) + g.d6 * R[:, 2]
                T[:3, 3] = np.where(T[:3, 3] == 0.0, zero, T[:3, 3])
                poses.append(T)
    return np.array(poses)
