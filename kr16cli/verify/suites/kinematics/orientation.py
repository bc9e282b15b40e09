"""Roll-pitch-yaw (KUKA's A, B, C), its rate matrix, and distances between poses."""

from __future__ import annotations

import math

import numpy as np

from kr16cli import kuka
from kr16cli.kernels.columns import ARRAYS
from kr16cli.model import orientation as model
from kr16cli.verify import sampling
from kr16cli.verify.independent.rotations import (
    Array,
    about_axis,
    axial,
    derivative,
    from_abc,
    pose_gap,
)
from kr16cli.verify.measure import finding, gap, largest, stacked
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case


def _angles(rng: sampling.Random, n: int) -> Array:
    """A, B, C: anywhere, near B = +-90 and exactly there, and round."""
    abc = rng.uniform(-math.pi, math.pi, (4 * n, 3))
    abc[:, 1] /= 2
    side = rng.choice([-1.0, 1.0], n) * math.pi / 2
    abc[n : 2 * n, 1] = side + sampling.offsets(rng, n)
    abc[2 * n : 3 * n, 1] = side
    abc[3 * n :] = np.radians(rng.choice([0.0, 90, -90, 180], (n, 3)))
    return abc


def _poses(R: Array) -> Array:
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3] = R
    T[..., 3, 3] = 1.0
    return T


@case(
    "kinematics.rpy",
    title="A, B, C reproduce the orientation, at B = +-90 too",
    statement="Rz(A) Ry(B) Rx(C) of (3.45)'s angles = R; B within +-90 deg; A = 0 at the pole",
    regime="anywhere, within 1e-3 .. 1e-12 of B = +-90 deg, exactly there, round",
    method="three elementary rotations multiplied; kuka.matrix_from_abc likewise",
    grade="B",
    tolerance=1e-14,
    unit="1",
    reason="atan2 and two products; within 1e-9 of the pole A = 0 moves R by that at most, "
    "and C absorbs it",
    equations=("3.44", "3.45"),
    functions=(
        "kr16cli.Robot.rpy",
        "kr16cli.model.orientation.rpy_from_rotation",
        "kr16cli.model.orientation.rotation_from_rpy",
        "kr16cli.kuka.abc_from_matrix",
    ),
)
def rpy(setting: Setting) -> Finding:
    """Orientation to angles and back."""
    rng = sampling.random(setting, "rpy")
    R = from_abc(_angles(rng, setting.samples(3000, 100)))
    found = setting.robot.rpy(_poses(R))
    pole = np.hypot(R[:, 0, 0], R[:, 1, 0]) < 1e-9
    in_range = np.abs(found[:, 1]) <= math.pi / 2
    chosen = np.where(pole & (found[:, 0] != 0.0) | ~in_range, np.inf, 0.0)
    # At the pole A = 0 by choice; where R is only near it, r11 and r21 change by their size.
    slack = np.where(pole, 2 * np.hypot(R[:, 0, 0], R[:, 1, 0]), 0.0)
    remade = np.maximum(gap(from_abc(found), R, 2) - slack, 0.0)
    written = stacked(model.rotation_from_rpy(ARRAYS.trig(list(found.T))), len(found))
    again = gap(written, from_abc(found), 2)
    floats = [gap(kuka.matrix_from_abc(*kuka.abc_from_matrix(r.tolist())), r, 2) for r in R[::10]]
    error = largest(remade, again, chosen)
    error[::10] = largest(error[::10], np.maximum(np.array(floats) - slack[::10], 0.0))
    return finding(error, "rotations remade from A, B, C", T=_poses(R))


@case(
    "kinematics.rate-matrix",
    title="Rate matrix B, its inverse and its rate",
    statement="omega = B(Phi) Phi'; B^-1 B = 1; B' = dB/dt",
    regime="theta at least 1e-3 away from +-90 deg",
    method="R' R^T by complex step of three elementary rotations",
    grade="B",
    tolerance=1e-11,
    unit="1, rad/s",
    reason="B^-1 grows to 1e3 at the regime's edge and rounding with it",
    equations=("3.46",),
    functions=(
        "kr16cli.Robot.rate_matrix",
        "kr16cli.model.orientation.inverse_rate_matrix",
        "kr16cli.model.orientation.rate_matrix_dot",
    ),
)
def rate_matrix(setting: Setting) -> Finding:
    """Angle rates and angular velocity."""
    rng, robot = sampling.random(setting, "rate-matrix"), setting.robot
    n = setting.samples(5000, 200)
    abc = rng.uniform(-math.pi, math.pi, (n, 3))
    abc[:, 1] = rng.uniform(-1, 1, n) * (math.pi / 2 - 1e-3)
    speed = rng.uniform(-2, 2, (n, 3))
    R, R_dot = from_abc(abc), derivative(from_abc, (abc, speed))
    omega = axial(R_dot @ np.swapaxes(R, -1, -2))
    B = robot.rate_matrix(abc)
    cs = ARRAYS.trig(list(abc.T))
    inverse = stacked(model.inverse_rate_matrix(cs), n)
    B_dot = stacked(model.rate_matrix_dot(cs, list(speed.T)), n)
    literal = derivative(_literal, (abc, speed))
    error = largest(
        gap((B @ speed[..., None])[..., 0], omega),
        gap(inverse @ B, np.eye(3), 2),
        gap(B_dot, literal, 2),
    )
    return finding(error, "B Phi' - omega, B^-1 B - 1, B' - dB/dt", abc=abc)


def _literal(abc: Array) -> Array:
    """Columns of B: the axes of the three turns, each carried by the turns before it."""
    z, y, x = np.eye(3)[::-1]
    first = about_axis(z, abc[..., 0])
    second = first @ about_axis(y, abc[..., 1])
    fixed = np.broadcast_to(z, (*abc.shape[:-1], 3)).astype(abc.dtype)
    return np.stack([fixed, first @ y, second @ x], axis=-1)


@case(
    "kinematics.rpy-scipy",
    title="A, B, C against SciPy's rotations",
    statement="R = Rz(A) Ry(B) Rx(C), intrinsic Z-Y'-X''",
    regime="B within +-85 deg",
    method="scipy.spatial.transform.Rotation, sequence ZYX",
    grade="A",
    tolerance=1e-13,
    unit="rad",
    reason="angles are ill-conditioned by 1 / cos B, 12 at most",
    equations=("3.44", "3.45"),
    functions=("kr16cli.Robot.rpy",),
)
def rpy_scipy(setting: Setting) -> Finding:
    """Another library."""
    from scipy.spatial.transform import Rotation

    rng = sampling.random(setting, "rpy-scipy")
    n = setting.samples(3000, 200)
    abc = rng.uniform(-math.pi, math.pi, (n, 3)) * np.array([1.0, 85 / 180, 1.0])
    R = Rotation.from_euler("ZYX", abc).as_matrix()
    return finding(gap(setting.robot.rpy(_poses(R)), abc), "angles read back", T=_poses(R))


@case(
    "kinematics.pose-distance",
    title="Distance between poses",
    statement="|p_a - p_b| and the angle of R_a^T R_b, accurate for angles of 1e-12 too; "
    "the check for rotations accepts rotations and refuses others",
    regime="angles from 1e-12 to pi, and pi itself, about random axes",
    method="poses made at a known distance and angle",
    grade="B",
    tolerance=1e-7,
    unit="relative",
    reason="a rotation of 1e-8 rad is stored with 1e-16: eight digits; so is one of nearly pi",
    functions=("kr16cli.Robot.closure", "kr16cli.model.orientation.pose_distance"),
)
def pose_distance(setting: Setting) -> Finding:
    """The measure that IK is judged by."""
    rng, robot = sampling.random(setting, "pose-distance"), setting.robot.with_tool(None)
    n = setting.samples(1000, 500)
    q = sampling.generic(rng, n)
    poses = robot.fk(q)
    angle = 10.0 ** rng.uniform(-12, math.log10(3.14), n)
    angle[: n // 4] = math.pi  # half turns, where a cosine can round beyond -1
    shift = rng.normal(size=(n, 3))
    moved = poses.copy()
    axes = rng.normal(size=(n, 3))
    turns = about_axis(axes / np.linalg.norm(axes, axis=1, keepdims=True), angle)
    moved[:, :3, :3] = turns @ poses[:, :3, :3]
    moved[:, :3, 3] += shift
    length = np.linalg.norm(shift, axis=1)
    distance, found = robot.closure(moved, q)
    apart, turned = pose_gap(poses, moved)
    single = [robot.arm.closure(T.tolist(), row) for T, row in zip(moved, q.tolist(), strict=True)]
    off = gap(single, np.stack([distance, found], axis=-1))
    slack = np.where(angle == math.pi, 1e-7, 4e-15)  # of two rotations; asin is flat at pi
    by_angle = np.maximum(np.abs(found - angle) - slack, 0.0) / angle
    return finding(
        largest(np.abs(distance / length - 1), by_angle, np.abs(found - turned) / (angle + slack),
                np.abs(distance - apart), np.where(off > 1e-7, np.inf, 0.0)),
        "known distances and angles, measured",
        q=q,
    )  # fmt: skip


@case(
    "kinematics.rotation-defect",
    title="The measure of how far a matrix is from a rotation",
    statement="(|R|^2 - 3, |R|^2 - 3 - 2 (det R - 1)) for singular values 1 + e: "
    "(2 sum e + sum e^2, sum e^2 - 2 (e1 e2 + e1 e3 + e2 e3 + e1 e2 e3))",
    regime="rotations, and rotations stretched by up to 0.1",
    method="singular values set by hand",
    grade="B",
    tolerance=1e-13,
    unit="1",
    reason="sums of nine squares near 1",
    functions=("kr16cli.model.orientation.rotation_defect",),
)
def rotation_defect(setting: Setting) -> Finding:
    """What input poses are checked by."""
    rng = sampling.random(setting, "rotation-defect")
    n = setting.samples(1000, 100)
    left, right = (from_abc(rng.uniform(-3, 3, (n, 3))) for _ in range(2))
    e = rng.uniform(-0.1, 0.1, (n, 3))
    e[: n // 4] = 0.0
    a = left @ (np.eye(3) * (1 + e)[:, None, :]) @ right
    size, rest = model.rotation_defect([[a[:, i, j] for j in range(3)] for i in range(3)])
    squares, product = (e * e).sum(1), e.prod(1)
    pairs = e[:, 0] * e[:, 1] + e[:, 0] * e[:, 2] + e[:, 1] * e[:, 2]
    error = largest(
        np.abs(size - (2 * e.sum(1) + squares)),
        np.abs(rest - (squares - 2 * pairs - 2 * product)),
    )
    return finding(error, "both defects", stretch=e)
