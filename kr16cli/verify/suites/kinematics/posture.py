"""Status and Turn, singular factors, and the text a pose is written as."""

from __future__ import annotations

import math

import numpy as np

from kr16cli import kuka, units
from kr16cli.model.posture import status, turn
from kr16cli.robot import Geometry
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array
from kr16cli.verify.measure import COUNT, counted, finding, gap
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case


@case(
    "kinematics.status-turn",
    title="Status and Turn follow the published rules",
    statement="S: wrist centre behind A1; wrist beyond the line A2-A3; A5 < 0. T: sign bits",
    regime="all of joint space, joints up to +-350 deg; away from the switches",
    method="signs of distances taken from the product of exponentials",
    grade="B",
    tolerance=COUNT,
    unit="wrong configurations",
    reason="a bit is right or wrong",
    functions=("kr16cli.Robot.status_turn", "kr16cli.model.posture.status"),
)
def status_turn(setting: Setting) -> Finding:
    """By geometry."""
    rng, robot = sampling.random(setting, "status-turn"), setting.robot
    n = setting.samples(5000, 400)
    q = np.where(rng.random((n, 6)) < 0.3, rng.uniform(-6.1, 6.1, (n, 6)), sampling.generic(rng, n))
    q = q[_off_the_switches(robot.data.geometry, q)]
    g = robot.data.geometry
    behind = poe.forward_of_column(g, q) < 0
    bent = poe.elbow_side(g, q) > 0
    flipped = np.remainder(q[:, 4], 2 * math.pi) >= math.pi
    s, t = robot.status_turn(q)
    wrong = (s != behind + 2 * bent + 4 * flipped) | (t != (q < 0) @ (1 << np.arange(6)))
    # Bits are whole numbers: KRL text knows no S 2.0.
    whole = s.dtype.kind == t.dtype.kind == "i" and type(status(q[0].tolist(), g)) is int
    return counted(wrong | (not whole), "S and T of every configuration", q=q)


def _off_the_switches(g: Geometry, q: Array) -> Array:
    ahead, side = np.abs(poe.forward_of_column(g, q)), np.abs(poe.elbow_side(g, q))
    return np.asarray((ahead > 1e-9) & (side > 1e-9) & (np.abs(np.sin(q[:, 4])) > 1e-9))


@case(
    "kinematics.status-switches",
    title="Status and Turn at the switches",
    statement="0 has no sign bit; A5 = +-180 and -10 set S bit 2, +10 and +-360 do not; "
    "A3 = -atan(a3 / d4) sets S bit 1; rounding of 1e-13 beside a switch changes nothing",
    regime="on the switches, rounding beside them, and just outside (1e-9)",
    method="a table of what the rule says there",
    grade="C",
    tolerance=COUNT,
    unit="wrong configurations",
    reason="a bit is right or wrong",
    functions=("kr16cli.model.posture.status", "kr16cli.model.posture.turn"),
)
def status_switches(setting: Setting) -> Finding:
    """The edges of the rule."""
    g = setting.robot.data.geometry
    straight = sampling.straight(g)
    over = sampling.on_shoulder(sampling.random(setting, "status"), np.zeros((1, 6)), g, 0.0)[0]
    a5 = [(0, 0), (1e-13, 0), (-1e-13, 0), (-1e-9, 4), (1e-9, 0), (math.pi, 4), (-math.pi, 4)]
    a5 += [(math.radians(v), s) for v, s in ((10, 0), (-10, 4), (190, 4), (350, 4), (-350, 0))]
    a5 += [(math.radians(v), s) for v, s in ((370, 0), (-370, 4), (-190, 0), (540, 4))]
    rows: list[tuple[list[float], int]] = [
        ([0.0, -1.0, 1.0, 0.0, angle, 0.0], 2 + bit) for angle, bit in a5
    ]
    for step, bit in ((0.0, 2), (1e-13, 2), (-1e-13, 2), (1e-9, 2), (-1e-9, 0)):
        rows.append(([0.0, -1.0, straight + step, 0.0, 0.5, 0.0], bit))
    outward = 1e-9 if poe.forward_of_column(g, over + np.eye(6)[1] * 1e-6) > 0 else -1e-9
    bent = 2 if poe.elbow_side(g, over) > 0 else 0
    for step, bit in ((0.0, 0), (outward, 0), (-outward, 1)):
        rows.append(([0.0, over[1] + step, over[2], 0.0, 0.5, 0.0], bit + bent))
    wrong = [status(q, g) != expected for q, expected in rows]
    joints = (0.0, -0.0, 1e-13, -1e-13, 1e-9, -1e-9, 3.0, -3.0)
    bits = (0, 0, 0, 0, 0, 1, 0, 1)
    for i in range(6):
        for angle, bit in zip(joints, bits, strict=True):
            q = [0.0] * 6
            q[i] = angle
            wrong.append(turn(q) != bit << i)
    wrong.append(turn([-1.0] * 6) != 63)
    text = f"{len(rows)} configurations on and beside the switches of S, 49 of T"
    return counted(wrong, text)


@case(
    "kinematics.text",
    title="A pose survives being written and read",
    statement="X Y Z A B C in mm and degrees, and KRL text, give the pose back",
    regime="all of joint space, round angles",
    method="written, parsed and compared",
    grade="D",
    tolerance=1e-10,
    unit="m, 1",
    reason="text has nine decimals of mm and degrees, 1e-11 rad; A, B, C double it near B = 90",
    functions=("kr16cli.kuka.pose_from_matrix", "kr16cli.kuka.matrix_from_pose"),
)
def text(setting: Setting) -> Finding:
    """The millimetre and degree edge."""
    rng, robot = sampling.random(setting, "text"), setting.robot
    n, g = setting.samples(500, 60), robot.data.geometry
    q = np.concatenate([sampling.generic(rng, n), sampling.round_angles(rng, n)])
    poses = robot.fk(q)
    errors = []
    for T, angles in zip(poses.tolist(), q.tolist(), strict=True):
        pose = kuka.pose_from_matrix(T)
        written = kuka.format_e6pos(pose, status(angles, g), turn(angles))
        read = kuka.parse_krl(written).numbers(kuka.POSE_FIELDS)
        axes = kuka.parse_krl(kuka.format_e6axis([units.deg(v) for v in angles]))
        turned = [units.rad(v) for v in axes.numbers(kuka.AXIS_FIELDS)]
        errors.append(
            max(
                float(gap(kuka.matrix_from_pose(pose), T, 2)),
                float(gap(read, pose)) * 1e-3,
                float(gap(turned, angles)),
            )
        )
    return finding(errors, "poses and axes through X..C, E6POS and E6AXIS text", q=q)
