"""KUKA's edge: X Y Z A B C poses in mm and degrees, Status and Turn, payload text.

Pure functions on floats; matrices are lists of rows. KUKA's A, B, C are the chapter's roll,
pitch and yaw (3.44): R = Rz(A) Ry(B) Rx(C). Status and Turn are computed by rule, not read
from a controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from kr16cli import units
from kr16cli.errors import InputError
from kr16cli.krl import (
    AXIS_FIELDS,
    POSE_FIELDS,
    KrlRecord,
    format_e6axis,
    format_e6pos,
    parse_krl,
)
from kr16cli.model.orientation import rotation_from_rpy, rpy_from_rotation
from kr16cli.model.posture import status, turn
from kr16cli.model.scalars import FLOATS
from kr16cli.robot import Payload
from kr16cli.robot_rules import checked_payload
from kr16cli.tolerances import TOLERANCES

__all__ = [
    "AXIS_FIELDS",
    "POSE_FIELDS",
    "KrlRecord",
    "abc_from_matrix",
    "format_e6axis",
    "format_e6pos",
    "full_turn_variants",
    "matrix_from_abc",
    "matrix_from_pose",
    "near_turn_switch",
    "parse_krl",
    "parse_load_data",
    "payload_from_numbers",
    "pose_from_matrix",
    "status",
    "turn",
]

Matrix = list[list[float]]
Limits = Sequence[tuple[float, float]]

TURNING_JOINTS = (0, 3, 5)
"""Joints whose range exceeds one turn on arms of this structure."""


def abc_from_matrix(R: Sequence[Sequence[float]]) -> tuple[float, float, float]:
    """A, B, C in rad of a rotation matrix (3.45), kept exact at B = +-90 deg.

    Args:
        R: 3x3 rotation, or a 4x4 pose of which the rotation is used.

    Returns:
        A and C in (-pi, pi], B in [-pi/2, pi/2]. At B = +-90 deg only A -+ C is defined: A is
        0 by choice, and C then reproduces the orientation.
    """
    # Adding 0.0 turns -0.0 into 0.0, which atan2 would answer with -pi.
    a, b, c = rpy_from_rotation([[v + 0.0 for v in row[:3]] for row in R[:3]], FLOATS)
    return a + 0.0, b + 0.0, _above_minus_pi(c)


def _above_minus_pi(angle: float) -> float:
    return math.pi if angle == -math.pi else angle + 0.0


def matrix_from_abc(a: float, b: float, c: float) -> Matrix:
    """Rotation Rz(A) Ry(B) Rx(C) (3.44) of angles in rad; 3x3."""
    return rotation_from_rpy([(math.cos(v), math.sin(v)) for v in (a, b, c)])


def matrix_from_pose(pose: Sequence[float], *, si: bool = False) -> Matrix:
    """Pose of a frame as a 4x4 matrix in m.

    Args:
        pose: X, Y, Z, A, B, C; mm and degrees, or m and rad with `si`.
        si: take `pose` as SI.
    """
    x, y, z, a, b, c = pose
    if si:
        R = matrix_from_abc(a, b, c)
        p = [x, y, z]
    else:
        R = rotation_from_rpy([units.cos_sin_deg(angle) for angle in (a, b, c)])
        p = [units.metres(x), units.metres(y), units.metres(z)]
    return [[*R[row], p[row]] for row in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def pose_from_matrix(T: Sequence[Sequence[float]], *, si: bool = False) -> list[float]:
    """X, Y, Z, A, B, C of a 4x4 pose in m: mm and degrees, or m and rad with `si`."""
    abc = abc_from_matrix(T)
    p = [T[row][3] + 0.0 for row in range(3)]
    if si:
        return [*p, *abc]
    return [*(units.mm(v) for v in p), *(units.deg(v) for v in abc)]


def near_turn_switch(q: Sequence[float]) -> list[int]:
    """Joints (0 to 5) of A1, A4, A6 within 2 deg of 0 but not at it, where T may be ignored."""
    return [i for i in TURNING_JOINTS if TOLERANCES.sign < abs(q[i]) < TOLERANCES.turn_switch]


def full_turn_variants(q: Sequence[float], limits: Limits) -> list[list[float]]:
    """The same pose with whole turns added to A1, A4 and A6, as far as the limits allow.

    Args:
        q: six joint angles, rad.
        limits: (lower, upper) of each joint, rad.

    Returns:
        Configurations, fewest turns away from `q` first. A joint outside its range at every
        turn keeps its value, so the list is never empty.
    """
    choices: list[list[tuple[int, float]]] = []
    for i, (angle, (lower, upper)) in enumerate(zip(q, limits, strict=True)):
        options = [(0, angle)]
        if i in TURNING_JOINTS:
            first = math.ceil((lower - TOLERANCES.limit - angle) / math.tau)
            last = math.floor((upper + TOLERANCES.limit - angle) / math.tau)
            inside = [(abs(k), angle + k * math.tau) for k in range(first, last + 1)]
            options = sorted(inside) or options
        choices.append(options)
    variants = sorted(product(*choices), key=lambda joints: sum(turns for turns, _ in joints))
    return [[angle for _, angle in joints] for joints in variants]


def payload_from_numbers(numbers: Sequence[float], *, si: bool = False) -> Payload:
    """A payload from M X Y Z and, if given, IX IY IZ.

    Args:
        numbers: mass (kg), mass centre in flange axes (mm, or m with `si`), and moments of
            inertia about the mass centre along flange axes (kg m2).
        si: take the mass centre in m.
    """
    mass, *rest = numbers
    com = [value if si else units.metres(value) for value in rest[:3]]
    moments = [*rest[3:], 0.0, 0.0, 0.0][:3]
    return _checked_payload(mass, com, moments, matrix_from_abc(0.0, 0.0, 0.0))


def parse_load_data(text: str) -> Payload:
    """A payload from KUKA LOAD_DATA text: mass, CM with principal axes, principal moments J.

    `{M 16,CM {X 0,Y 0,Z 120,A 0,B 0,C 0},J {X 0.36,Y 0.36,Z 0.36}}`: kg, mm, degrees, kg m2,
    at the flange. Left out: zero; a negative mass (KUKA: not set) is refused.
    """
    record = parse_krl(text)
    if record.type != "LOAD":
        raise InputError(f"expected LOAD_DATA with M, CM and J, got an aggregate {record.type}")
    mass = record.numbers(("M",))[0]
    x, y, z, a, b, c = (record.fields.get(f"CM.{name}", 0.0) for name in POSE_FIELDS)
    moments = [record.fields.get(f"J.{name}", 0.0) for name in "XYZ"]
    T = matrix_from_pose((x, y, z, a, b, c))
    return _checked_payload(mass, [T[row][3] for row in range(3)], moments, T)


def _checked_payload(
    mass: float, com: Sequence[float], moments: Sequence[float], R: Sequence[Sequence[float]]
) -> Payload:
    """A payload with principal `moments` (kg m2) along the columns of R."""

    def entry(i: int, j: int) -> float:
        return math.fsum(R[i][k] * moments[k] * R[j][k] for k in range(3))

    inertia = (entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2))
    return checked_payload(mass, com, inertia)
