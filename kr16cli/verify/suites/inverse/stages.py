"""The stages of section 3.2 one by one: wrist centre, first joint, arm plane, sets, last joint."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from kr16cli import Robot
from kr16cli.robot import Geometry
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, angle_gap, from_abc
from kr16cli.verify.measure import finding, gap, known, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.inverse.closure import solved

_IK = ("kr16cli.Robot.ik", "kr16cli.model.inverse.solve")
_OFF = "at least 1e-2 (rad, m) away from all singular families; other arms too"
_AMPLIFIED = "angles are ill-conditioned by 1 / 1e-2 twice; a few 1e-12 found"


def _arms(setting: Setting, name: str, full: int, quick: int) -> Iterator[tuple[Robot, Array]]:
    """The robot and two arms of other lengths, a3 < 0 once, with regular configurations."""
    rng, data = sampling.random(setting, name), setting.robot.data
    low, high = (0.3, 0.1, 0.4, 0.02, 0.4, 0.05), (0.9, 0.5, 0.9, 0.2, 0.9, 0.3)
    for k in range(3):
        own = data
        if k:
            g = Geometry(*map(float, rng.uniform(low, high)))
            own = replace(data, geometry=g._replace(a3=g.a3 * (-1) ** k))
        yield Robot(own), sampling.regular(rng, setting.samples(full, quick), own)


def _turned(angle: Array) -> Array:
    """How far an angle is from a whole number of turns."""
    return np.abs(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


@case(
    "inverse.round-trip",
    title="Inverse kinematics undoes forward kinematics",
    statement="q = T^-1(o, R): fk(q) = T for every solution q of T, and the q that made T is one",
    regime=_OFF,
    method="pose, and residual of every solution, by the product of exponentials",
    grade="B",
    tolerance=1e-10,
    unit="m, rad",
    reason=_AMPLIFIED,
    equations=("3.7",),
    functions=_IK,
)
def round_trip(setting: Setting) -> Finding:
    """From end to end."""
    errors, angles = [], []
    for robot, q in _arms(setting, "round-trip", 3000, 150):
        _, rows, error = solved(robot, q)
        safe = np.where(known(rows)[..., None], rows, np.inf)
        own = _turned(np.where(np.isfinite(safe), safe - q[:, None], np.pi)).max(axis=2).min(axis=1)
        errors.append(largest(np.nan_to_num(error, nan=0.0).max(axis=1), own))
        angles.append(q)
    return finding(np.concatenate(errors), "three arms", q=np.concatenate(angles))


@case(
    "inverse.wrist-centre",
    title="The wrist centre in closed form",
    statement="o_c = [s1 r; c1 r; d1 - a3 c23 - a2 s2 - d4 s23] in b, r = a1 + a2 c2 + d4 c23 - "
    "a3 s23, is where A4, A5 and A6 meet",
    regime="all of joint space; other arms too",
    method="a point on the wrist axes of the zero pose carried by the product of exponentials; "
    "the flange less d6 along its z",
    grade="B",
    tolerance=1e-14,
    unit="m",
    reason="positions up to 2 m after six rounded products",
    equations=("3.8", "3.9"),
    functions=("kr16cli.Robot.frames", "kr16cli.Arm.wrist_centre", "kr16cli.model.forward.arm"),
)
def wrist_centre(setting: Setting) -> Finding:
    """Three components."""
    errors, angles = [], []
    for robot, q in _arms(setting, "wrist-centre", 5000, 300):
        g = robot.data.geometry
        theirs, T = poe.wrist_centre(g, q), poe.flange(g, q)
        error = largest(
            gap(robot.frames(q).wrist_centre, theirs),
            gap(T[:, :3, 3] - g.d6 * T[:, :3, 2], theirs),
        )
        some = slice(None, None, 15)
        single = np.array([robot.arm.wrist_centre(row) for row in q[some].tolist()])
        error[some] = largest(error[some], gap(single, theirs[some]))
        errors.append(error)
        angles.append(q)
    return finding(np.concatenate(errors), "three arms", q=np.concatenate(angles))


@case(
    "inverse.first-joint",
    title="The first joint turns the arm's plane through the wrist centre",
    statement="tan q1 = x_c / y_c in b; q11 faces the wrist centre, q12 = q11 + pi turns its back "
    "on it",
    regime=_OFF,
    method="direction of the wrist centre in robroot by the product of exponentials, for the rows "
    "of either shoulder",
    grade="B",
    tolerance=1e-11,
    unit="rad, m",
    reason="rounding over a distance of at least 1e-2 m from the A1 axis",
    equations=("3.10", "3.11"),
    functions=_IK,
)
def first_joint(setting: Setting) -> Finding:
    """Two values, half a turn apart."""
    errors, angles = [], []
    for robot, q in _arms(setting, "first-joint", 3000, 200):
        g = robot.data.geometry
        wrist = poe.wrist_centre(g, q)
        rows = robot.ik(poe.flange(g, q))
        facing = np.arctan2(-wrist[:, 1], wrist[:, 0])[:, None]
        expected = facing + np.where(np.arange(8) < 4, 0.0, math.pi)
        # Seen from the arm's plane the wrist centre lies neither left nor right.
        aside = wrist[:, :1] * np.sin(rows[..., 0]) + wrist[:, 1:2] * np.cos(rows[..., 0])
        off = np.maximum(_turned(rows[..., 0] - expected), np.abs(aside))
        some = known(rows)
        errors.append(np.where(some.any(1), np.where(some, off, 0.0).max(axis=1), np.inf))
        angles.append(q)
    return finding(np.concatenate(errors), "both shoulders of three arms", q=np.concatenate(angles))


@case(
    "inverse.arm-plane",
    title="Two links in the arm's plane",
    statement="o_c1 = a1 + d4 c23 - a3 s23 + a2 c2, o_c2 = d1 - a3 c23 - d4 s23 - a2 s2 for the "
    "q2, q3 of every solution: forward and height of o_c after A1 is turned back",
    regime=_OFF,
    method="forward and height of the wrist centre by the product of exponentials; the formulas "
    "evaluated at the solutions' angles",
    grade="B",
    tolerance=1e-11,
    unit="m",
    reason="rounding of angles that are ill-conditioned by 1 / 1e-2",
    equations=("3.12", "3.15"),
    functions=_IK,
)
def arm_plane(setting: Setting) -> Finding:
    """What (3.13) to (3.16) solve."""
    errors, angles = [], []
    for robot, q in _arms(setting, "arm-plane", 3000, 200):
        g = robot.data.geometry
        rows = robot.ik(poe.flange(g, q))
        q2, lean = rows[..., 1], rows[..., 1] + rows[..., 2]
        forward = g.a1 + g.d4 * np.cos(lean) - g.a3 * np.sin(lean) + g.a2 * np.cos(q2)
        height = g.d1 - g.a3 * np.cos(lean) - g.d4 * np.sin(lean) - g.a2 * np.sin(q2)
        wrist = poe.wrist_centre(g, q)[:, None]
        turned_back = wrist[..., 0] * np.cos(rows[..., 0]) - wrist[..., 1] * np.sin(rows[..., 0])
        off = np.maximum(np.abs(forward - turned_back), np.abs(height - wrist[..., 2]))
        some = known(rows)
        errors.append(np.where(some.any(1), np.where(some, off, 0.0).max(axis=1), np.inf))
        angles.append(q)
    return finding(np.concatenate(errors), "solutions of three arms", q=np.concatenate(angles))


@case(
    "inverse.arm-sets",
    title="Which arm postures there are: Q_1, Q_2, Q_3 or none",
    statement="Delta_i > 0 gives {q1i, q21, q31} and {q1i, q22, q32}, Delta_i < 0 neither, for "
    "i = 1, 2; each triplet reaches o_c, no two are equal, and they hang on o_c alone, not on R",
    regime="wrist centres of all four sign patterns, the elbow 1e-4 m off stretched and folded; "
    "two random orientations each",
    method="Delta_i > 0 by plane geometry: circles about A2 and o_c meet; triplets placed by the "
    "product of exponentials",
    grade="B",
    tolerance=1e-9,
    unit="m, rad",
    reason="an elbow 1e-4 m off stretched costs two digits; a wrong set counts as infinite",
    equations=("3.17", "3.18", "3.19", "3.20"),
    functions=_IK,
)
def arm_sets(setting: Setting) -> Finding:
    """Zero, two or four triplets, and which."""
    rng, robot = sampling.random(setting, "arm-sets"), setting.robot.with_tool(None)
    g, n = robot.data.geometry, setting.samples(20000, 1500)
    forearm = math.hypot(g.a3, g.d4)
    reach = g.a1 + g.a2 + forearm
    wrist = rng.uniform(-1.0, 1.0, (n, 3)) * (reach, reach, g.a2 + forearm) + (0.0, 0.0, g.d1)
    # A fold of 12 mm about A2: one in three is put near it, where Delta_1 or Delta_2 is negative.
    near = rng.random(n) < 1 / 3
    side = rng.uniform(-math.pi, math.pi, n)
    ring = g.a1 + rng.uniform(-1.5, 1.5, n) * abs(g.a2 - forearm)
    wrist[near] = np.stack(
        [ring * np.cos(side), ring * np.sin(side),
         g.d1 + rng.uniform(-1.0, 1.0, n) * abs(g.a2 - forearm)], axis=-1,
    )[near]  # fmt: skip
    ground = np.hypot(wrist[:, 0], wrist[:, 1])
    far = np.hypot(ground[:, None] * (1.0, -1.0) - g.a1, (wrist[:, 2] - g.d1)[:, None])
    nearest, farthest = abs(g.a2 - forearm), g.a2 + forearm
    clear = (np.minimum(np.abs(far - nearest), np.abs(far - farthest)) > 1e-4).all(axis=1)
    wrist, far = wrist[clear & (ground > 1e-2)], far[clear & (ground > 1e-2)]
    expected = np.repeat((far > nearest) & (far < farthest), 2, axis=1)  # rows 00, 01, 10, 11
    one, other = (_triplets(robot, wrist, rng) for _ in range(2))
    there = known(one)
    remade = np.zeros((*one.shape[:-1], 6))
    remade[..., :3] = np.where(there[..., None], one, 0.0)
    off = np.where(there, gap(poe.wrist_centre(g, remade), wrist[:, None]), 0.0).max(axis=1)
    twins = there[:, 0::2] & (angle_gap(remade[:, 0::2], remade[:, 1::2]) < 1e-3)
    turned = np.where(there & known(other), angle_gap(one, np.nan_to_num(other)), 0.0).max(axis=1)
    wrong = (there != expected).any(1) | (known(other) != expected).any(1) | twins.any(axis=1)
    first = expected[:, ::2]
    counts = {
        "Q_1": int(first.all(axis=1).sum()), "Q_2": int((first[:, 0] & ~first[:, 1]).sum()),
        "Q_3": int((~first[:, 0] & first[:, 1]).sum()), "none": int((~first).all(axis=1).sum()),
    }  # fmt: skip
    text = ", ".join(f"{name} at {count} wrist centres" for name, count in counts.items())
    error = np.where(wrong, np.inf, largest(off, turned))
    return finding(error if min(counts.values()) else error + np.inf, text, wrist=wrist)


def _triplets(robot: Robot, wrist: Array, rng: sampling.Random) -> Array:
    """(q1, q2, q3) of the four arm postures for a random orientation, (n, 4, 3)."""
    T = np.zeros((len(wrist), 4, 4))
    T[:, :3, :3] = from_abc(rng.uniform(-math.pi, math.pi, (len(wrist), 3)))
    T[:, :3, 3] = wrist + robot.data.geometry.d6 * T[:, :3, 2]
    T[:, 3, 3] = 1.0
    return np.asarray(robot.ik(T)[:, ::2, :3])


@case(
    "inverse.wrist-in-line",
    title="With A4 and A6 in line only their sum turns the hand",
    statement="R_6^3 at q5 = 0 is [-c46, -s46, 0; -s46, c46, 0; 0, 0, -1], c46 = cos(q4 + q6)",
    regime="q5 = 0, all of joint space; (q4 + phi, q6 - phi) beside (q4, q6)",
    method="the literal matrices of Table 3.1 multiplied",
    grade="B",
    tolerance=1e-14,
    unit="1",
    reason="products of four rounded rotations",
    equations=("3.27",),
    functions=("kr16cli.Robot.frames", "kr16cli.Arm.r36", "kr16cli.model.forward.r36"),
)
def wrist_in_line(setting: Setting) -> Finding:
    """R36 of a straight wrist."""
    rng, robot = sampling.random(setting, "wrist-in-line"), setting.robot
    q = sampling.generic(rng, setting.samples(5000, 300))
    q[:, 4] = 0.0
    shifted = q + rng.uniform(-math.pi, math.pi, len(q))[:, None] * (0, 0, 0, 1.0, 0, -1.0)
    inside = poe.dh_frames(robot.data.geometry, q)
    literal = np.swapaxes(inside[3], -1, -2)[:, :3, :3] @ inside[6][:, :3, :3]
    c, s, zero = np.cos(q[:, 3] + q[:, 5]), np.sin(q[:, 3] + q[:, 5]), 0.0 * q[:, 0]
    rows = [[-c, -s, zero], [-s, c, zero], [zero, zero, zero - 1.0]]
    printed = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    error = largest(
        gap(robot.frames(q).R36, literal, 2),
        gap(robot.frames(shifted).R36, literal, 2),
        gap(literal, printed, 2),
    )
    some = slice(None, None, 15)
    single = np.array([robot.arm.r36(row) for row in q[some].tolist()])
    error[some] = largest(error[some], gap(single, literal[some], 2))
    return finding(error, "R36 twice", q=q)


@case(
    "inverse.last-joint",
    title="With A4 and A6 in line, A6 is what the known A4 leaves",
    statement="q6 = Atan2(-r12, -r11) - q4 at q5 = 0, q4 the last known value; for q5 = pi "
    "q6 = Atan2(r12, r11) + q4",
    regime="q5 exactly 0 or pi, the rest 1e-2 away from singular; random known configurations",
    method="r_ij of R_6^3 from the literal matrices of Table 3.1 at the configuration that made "
    "the pose",
    grade="B",
    tolerance=1e-9,
    unit="rad",
    reason="rounding of the arm's three angles, ill-conditioned by 1 / 1e-2 twice",
    equations=("3.28",),
    functions=_IK,
)
def last_joint(setting: Setting) -> Finding:
    """The corrected (3.28)."""
    rng, robot = sampling.random(setting, "last-joint"), setting.robot.with_tool(None)
    n, g = setting.samples(3000, 200), setting.robot.data.geometry
    q = sampling.with_joint(
        sampling.regular(rng, n, robot.data), 5, rng.choice([0.0, math.pi], n)
    )  # fmt: skip
    near = sampling.generic(rng, n)
    rows = robot.ik(poe.flange(g, q), near)
    arm = 2 * (poe.forward_of_column(g, q) < 0) + (poe.elbow_side(g, q) > 0)
    own = rows.reshape(n, 4, 2, 6)[np.arange(n), arm]
    inside = poe.dh_frames(g, q)
    r = np.swapaxes(inside[3], -1, -2)[:, :3, :3] @ inside[6][:, :3, :3]
    flipped = np.abs(q[:, 4]) > 1.0
    # At q5 = pi, R_6^3 = [c, s, 0; -s, c, 0; 0, 0, 1] with the cosine and sine of q6 - q4.
    sign = np.where(flipped, 1.0, -1.0)
    both = np.arctan2(sign * r[:, 0, 1], sign * r[:, 0, 0])
    expected = np.where(flipped, both + near[:, 3], both - near[:, 3])
    error = largest(
        _turned(own[..., 5] - expected[:, None]).max(axis=1),
        _turned(own[..., 3] - near[:, None, 3]).max(axis=1),
    )
    return finding(np.where(known(own).all(axis=1), error, np.inf), "q4 and q6", q=q, near=near)
