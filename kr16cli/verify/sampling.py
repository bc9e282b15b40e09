"""Where cases look: named regimes of configurations, random motions, and random robots.

Configurations are (n, 6) in rad. Distances from a singular family are spread evenly over the
decades 1e-3 to 1e-12, either side.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kr16cli.robot import Geometry, LinkData, Payload, RobotData
from kr16cli.verify.records import Setting, SkipCase

Array = npt.NDArray[np.float64]
Random = np.random.Generator

LOAD = Payload(16.0, (0.02, -0.05, 0.12), (0.30, 0.36, 0.25, 0.01, -0.02, 0.03))
"""A payload without symmetry, so that no axis can be mistaken for another."""

TILTED = (1.7, -2.3, -9.1)
"""A gravity vector along no axis (m/s2): a robot on a slope."""


def random(setting: Setting, name: str) -> Random:
    """A generator of its own for each case, so that cases do not disturb each other."""
    return np.random.default_rng([setting.seed, zlib.crc32(name.encode())])


def generic(rng: Random, n: int, data: RobotData | None = None) -> Array:
    """All of (-pi, pi]."""
    return rng.uniform(-math.pi, math.pi, (n, 6))


def rates(rng: Random, n: int) -> Array:
    """Joint speeds or accelerations, up to 3 rad/s or rad/s2."""
    return rng.uniform(-3.0, 3.0, (n, 6))


def within_limits(rng: Random, n: int, data: RobotData) -> Array:
    """Every joint at one of its limits (one in three) or inside."""
    lower, upper = (np.array([getattr(j, side) for j in data.joints]) for side in _SIDES)
    pick = rng.integers(0, 6, (n, 6))
    inside = rng.uniform(lower, upper, (n, 6))
    return np.where(pick == 0, lower, np.where(pick == 1, upper, inside))


_SIDES = ("lower", "upper")


def round_angles(rng: Random, n: int, data: RobotData | None = None) -> Array:
    """What people type: multiples of 45 degrees; most are singular in some way."""
    return np.asarray(np.radians(rng.choice([0.0, 45, -45, 90, -90, 135, -135, 180], (n, 6))))


def offsets(rng: Random, n: int) -> Array:
    """Signed distances, 1e-3 to 1e-12, even over the decades."""
    return np.asarray(rng.choice([-1.0, 1.0], n) * 10.0 ** -rng.uniform(3.0, 12.0, n))


def straight(g: Geometry) -> float:
    """Angle q3 of the stretched arm; half a turn on, it is folded."""
    return -math.atan2(g.a3, g.d4)


def turned(angle: Array) -> Array:
    """The angle within (-pi, pi]."""
    return np.asarray(math.pi - np.remainder(math.pi - angle, 2 * math.pi))


def with_joint(q: Array, joint: int, values: Array | float) -> Array:
    """The configurations with joint 1 to 6 set."""
    changed = q.copy()
    changed[:, joint - 1] = values
    return changed


def on_shoulder(rng: Random, q: Array, g: Geometry, gap: Array | float) -> Array:
    """The configurations with the wrist centre at the signed distance `gap` from the A1 axis.

    q3 is bent at random and q2 solved from a1 + u cos q2 + v sin q2 = gap, either root.
    """
    bend = rng.uniform(-2.4, 2.4, len(q))
    q3 = straight(g) + bend
    u = g.a2 + g.d4 * np.cos(q3) - g.a3 * np.sin(q3)
    v = -(g.d4 * np.sin(q3) + g.a3 * np.cos(q3))
    reach = np.clip((gap - g.a1) / np.hypot(u, v), -1.0, 1.0)
    q2 = np.arctan2(v, u) + rng.choice([-1.0, 1.0], len(q)) * np.arccos(reach)
    return with_joint(with_joint(q, 2, turned(q2)), 3, turned(q3))


def _near_wrist(rng: Random, n: int, data: RobotData) -> Array:
    return with_joint(generic(rng, n), 5, offsets(rng, n))


def _near_wrist_pi(rng: Random, n: int, data: RobotData) -> Array:
    return with_joint(generic(rng, n), 5, turned(math.pi + offsets(rng, n)))


def _near_stretched(rng: Random, n: int, data: RobotData) -> Array:
    q3 = straight(data.geometry) + offsets(rng, n)
    return with_joint(generic(rng, n), 3, turned(q3))


def _near_folded(rng: Random, n: int, data: RobotData) -> Array:
    q3 = straight(data.geometry) + math.pi + offsets(rng, n)
    return with_joint(generic(rng, n), 3, turned(q3))


def _near_shoulder(rng: Random, n: int, data: RobotData) -> Array:
    return on_shoulder(rng, generic(rng, n), data.geometry, offsets(rng, n))


def on_wrist(rng: Random, n: int, data: RobotData) -> Array:
    """A4 and A6 in line: q5 exactly 0 or pi."""
    return with_joint(generic(rng, n), 5, rng.choice([0.0, math.pi], n))


def on_elbow(rng: Random, n: int, data: RobotData) -> Array:
    """The arm stretched or folded, as exactly as floating point tells."""
    at = straight(data.geometry) + rng.choice([0.0, math.pi], n)
    return with_joint(generic(rng, n), 3, turned(at))


def on_shoulder_axis(rng: Random, n: int, data: RobotData) -> Array:
    """The wrist centre on the A1 axis, as exactly as floating point tells."""
    return on_shoulder(rng, generic(rng, n), data.geometry, 0.0)


def on_both(rng: Random, n: int, data: RobotData) -> Array:
    """The wrist centre on the A1 axis and A4 and A6 in line."""
    return with_joint(on_shoulder_axis(rng, n, data), 5, rng.choice([0.0, math.pi], n))


REGIMES: dict[str, tuple[str, Callable[[Random, int, RobotData], Array]]] = {
    "generic": ("all of joint space", generic),
    "limits": ("joints at their limits or inside", within_limits),
    "round": ("multiples of 45 degrees", round_angles),
    "near-wrist": ("q5 within 1e-3 .. 1e-12 rad of 0", _near_wrist),
    "near-wrist-pi": ("q5 within 1e-3 .. 1e-12 rad of 180 degrees", _near_wrist_pi),
    "near-stretched": ("elbow within 1e-3 .. 1e-12 rad of stretched", _near_stretched),
    "near-folded": ("elbow within 1e-3 .. 1e-12 rad of folded", _near_folded),
    "near-shoulder": ("wrist centre within 1e-3 .. 1e-12 m of the A1 axis", _near_shoulder),
    "on-wrist": ("q5 exactly 0 or 180 degrees", on_wrist),
    "on-elbow": ("elbow stretched or folded", on_elbow),
    "on-shoulder": ("wrist centre on the A1 axis", on_shoulder_axis),
    "on-both": ("wrist centre on the A1 axis and q5 0 or 180 degrees", on_both),
}
"""Name -> (what it is, how it is drawn)."""


def regular(rng: Random, n: int, data: RobotData, margin: float = 1e-2) -> Array:
    """Configurations at least `margin` (rad, m) away from all singular families."""
    g = data.geometry
    kept: list[Array] = []
    while sum(map(len, kept)) < n:
        q = generic(rng, 2 * n + 16)
        lean = q[:, 1] + q[:, 2]
        shoulder = g.a1 + g.a2 * np.cos(q[:, 1]) + g.d4 * np.cos(lean) - g.a3 * np.sin(lean)
        elbow = np.sin(q[:, 2] - straight(g))
        distance = np.minimum(np.abs(shoulder), np.abs(elbow))
        kept.append(q[np.minimum(distance, np.abs(np.sin(q[:, 4]))) > margin])
    return np.concatenate(kept)[:n]


def random_robot(rng: Random, data: RobotData) -> RobotData:
    """Another robot of the same structure: random lengths and physical links, in both frames.

    What holds for it does not lean on a zero or a symmetry of one robot's numbers.
    """
    low = (0.3, 0.1, 0.4, -0.2, 0.4, 0.05)
    high = (0.9, 0.5, 0.9, 0.2, 0.9, 0.3)
    geometry = Geometry(*map(float, rng.uniform(low, high)))
    links = tuple(_random_link(rng, data, i) for i in range(6))
    return replace(data, geometry=geometry, links=links, gravity=TILTED)


def _random_link(rng: Random, data: RobotData, index: int) -> LinkData:
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    squares = rng.uniform(0.01, 0.1, 3)  # integrals of x^2, y^2, z^2: any three are a body's
    mass = float(rng.uniform(2.0, 40.0))
    tensor = mass * rotation @ np.diag(squares.sum() - squares) @ rotation.T
    six = [float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    com = rng.uniform(-0.3, 0.3, 3).tolist()
    return LinkData(
        mass=mass,
        com=(com[0], com[1], com[2]),
        inertia=(six[0], six[1], six[2], six[3], six[4], six[5]),
        frame=("zero-pose", "dh")[index % 2],
        provenance=data.geometry_provenance,
    )


def need_links(data: RobotData) -> None:
    """Skip a case on dynamics for a robot without inertial data."""
    if not data.links:
        raise SkipCase(f"{data.name} has no inertial data: 0 of 6 links")


def joined(parts: Sequence[Array]) -> Array:
    """Samples of several regimes as one batch."""
    return np.concatenate(list(parts))
