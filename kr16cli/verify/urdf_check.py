"""`kr16 verify model FILE.urdf`: what of somebody's URDF differs from this robot, by how much.

The URDF is compared with the parameter file, not with `kr16cli.model`: joint axes, zero and
signs, the six lengths of Table 3.1 measured between the axes, flange, limits, and bodies.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kr16cli import units
from kr16cli.robot import RobotData
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import bodies
from kr16cli.verify.independent.rotations import Array, about_axis, pose_gap
from kr16cli.verify.records import Outcome, Result
from kr16cli.verify.urdf_read import UrdfArm, UrdfJoint, read_urdf

_LENGTHS = ("d1", "a1", "a2", "a3", "d4", "d6")
_SAMPLES = 500
_NOT_STATED = 1e6
"""An effort or speed of 0 or from here up is a placeholder."""


class _Match(NamedTuple):
    """How their joints relate to ours: q_ours = sign q_theirs + zero (quarter turns)."""

    zero: Array
    sign: Array


def check(data: RobotData, path: str | Path, seed: int = 20161) -> list[Result]:
    """Every difference of a URDF from the robot, as results.

    Raises:
        FileError: the file cannot be read, or is not a chain of six revolute joints.
    """
    arm = read_urdf(path)
    match = _match(data, arm)
    results = [*_conventions(arm, match), *_lengths(data, arm)]
    results += [*_flange(data, arm, match), _poses(data, arm, seed), *_limits(data, arm, match)]
    return [*results, *_bodies(data, arm, match)]


def _match(data: RobotData, arm: UrdfArm) -> _Match:
    """The quarter turns of our joints, and signs, that lay our axes on theirs at their zero."""
    turns = np.array([0.0, np.pi / 2, -np.pi / 2, np.pi])
    choices = np.array(list(itertools.product(turns, repeat=5)))
    q = np.concatenate([choices, np.zeros((len(choices), 1))], axis=1)
    moves = poe.motions(data.geometry, q)
    mismatch = np.abs(choices).sum(axis=1) * 1e-6  # of equals, the least turned
    for i, (joint, axis) in enumerate(zip(arm.joints, poe.AXES, strict=True)):
        z = moves[i][:, :3, :3] @ axis
        o = poe.carried(moves[i], poe.points(data.geometry)[i])
        off = np.cross(o - joint.point, joint.axis)
        mismatch += np.linalg.norm(np.cross(z, joint.axis), axis=1) + np.linalg.norm(off, axis=1)
    best = q[int(mismatch.argmin())]
    last = [poe.flange(data.geometry, np.append(best[:5], turn)) for turn in turns]
    apart = [pose_gap(pose, arm.tip_pose)[1] for pose in last]
    best[5] = turns[int(np.argmin(np.round(apart, 6)))]
    moves = poe.motions(data.geometry, best)
    pairs = zip(moves, poe.AXES, arm.joints, strict=False)
    sign = [1.0 if (m[:3, :3] @ axis) @ joint.axis >= 0 else -1.0 for m, axis, joint in pairs]
    return _Match(best, np.array(sign))


def _conventions(arm: UrdfArm, match: _Match) -> list[Result]:
    names = [joint.name for joint in arm.joints]
    flipped = [name for name, s in zip(names, match.sign, strict=True) if s < 0]
    shifted = {
        name: units.deg(float(v)) for name, v in zip(names, match.zero, strict=True) if v != 0.0
    }
    text = ", ".join(f"{name} by {v:+g} deg" for name, v in shifted.items())
    return [
        _judged(
            "signs", "Joints turn the way KUKA's do", len(flipped), 0.5, "joints",
            "a sign is right or wrong", f"turn the other way: {', '.join(flipped) or 'none'}",
            {"joints": flipped},
        ),
        _judged(
            "zero", "The zero pose is KUKA's", max(map(abs, shifted.values()), default=0.0), 1e-3,
            "deg", "other zeros are whole quarter turns off",
            f"zero differs: {text}" if shifted else "all six are KUKA's", shifted,
        ),
    ]  # fmt: skip


def _lengths(data: RobotData, arm: UrdfArm) -> list[Result]:
    """Lengths of Table 3.1 measured between their axes, and whether the axes fit the table."""
    z = [joint.axis for joint in arm.joints]
    p = [joint.point for joint in arm.joints]
    wrist, miss_4 = _nearest(p[3], z[3], p[4], z[4])
    crossing, miss_6 = _nearest(p[4], z[4], p[5], z[5])
    elbow, _ = _nearest(p[3], z[3], p[2], z[2])
    on_shoulder, _ = _nearest(p[1], z[1], p[0], z[0])
    measured = {
        "d1": float(on_shoulder[2]),
        "a1": _between(p[0], z[0], p[1], z[1]),
        "a2": _between(p[1], z[1], p[2], z[2]),
        "a3": _between(p[2], z[2], p[3], z[3]),
        "d4": float(np.linalg.norm(wrist - elbow)),
        "d6": float(abs((arm.tip_pose[:3, 3] - crossing) @ z[5])),
    }
    ours = data.geometry._asdict()
    found = [
        _judged(
            key, f"Length {key} of Table 3.1", 1e3 * abs(measured[key] - abs(ours[key])), 0.01,
            "mm", "files carry lengths to 0.01 mm",
            f"here {1e3 * measured[key]:.3f} mm, this robot {1e3 * abs(ours[key]):.3f} mm",
            {"theirs_mm": 1e3 * measured[key], "ours_mm": 1e3 * abs(ours[key])},
        )
        for key in _LENGTHS
    ]  # fmt: skip
    miss = 1e3 * max(miss_4, miss_6, float(np.linalg.norm(wrist - crossing)))
    text = "distances between the axes of A4, A5 and A6"
    found.append(
        _judged("wrist", "The wrist's axes meet in a point", miss, 0.01, "mm", "as lengths", text)
    )
    right = ((0, 1, 0.0), (1, 2, 1.0), (2, 3, 0.0), (3, 4, 0.0), (4, 5, 0.0))
    tilt = max(abs(np.degrees(np.arcsin(min(1.0, _skewness(z[i], z[j], c))))) for i, j, c in right)
    text = "A1-A2, A3-A4, A4-A5, A5-A6 square, A2-A3 parallel"
    return [
        *found,
        _judged(
            "axes", "Neighbouring axes are square or parallel", float(tilt), 1e-3, "deg",
            "files carry angles to 1e-5 rad", text,
        ),
    ]  # fmt: skip


def _skewness(a: Array, b: Array, cosine: float) -> float:
    """Sine of how far two axes are from square (0) or parallel (1)."""
    return float(np.linalg.norm(np.cross(a, b))) if cosine else float(abs(a @ b))


def _nearest(p: Array, z: Array, q: Array, y: Array) -> tuple[Array, float]:
    """The point of line (p, z) nearest to line (q, y), and how far apart they are there."""
    normal = np.cross(z, y)
    square = float(normal @ normal)
    if square < 1e-12:
        return p, _between(p, z, q, y)
    t = np.cross(q - p, y) @ normal / square
    return p + t * z, abs(float((q - p) @ normal)) / square**0.5


def _between(p: Array, z: Array, q: Array, y: Array) -> float:
    """Distance of two lines, parallel or not."""
    normal = np.cross(z, y)
    size = float(np.linalg.norm(normal))
    if size < 1e-6:
        return float(np.linalg.norm(np.cross(q - p, z)))
    return abs(float((q - p) @ normal)) / size


def _flange(data: RobotData, arm: UrdfArm, match: _Match) -> list[Result]:
    """Their tip at their zero against our flange there."""
    ours = poe.flange(data.geometry, match.zero)
    distance, angle = pose_gap(ours, arm.tip_pose)
    shown = f"{arm.tip} at zero, in {arm.root}"
    return [
        _judged(
            "flange-position", "The flange is at KUKA's place at zero", 1e3 * float(distance), 0.01,
            "mm", "as lengths", shown, {"theirs_mm": (1e3 * arm.tip_pose[:3, 3]).tolist()},
        ),
        _judged(
            "flange-axes", "The flange has KUKA's axes at zero", float(np.degrees(angle)), 1e-3,
            "deg", "files carry angles to 1e-5 rad", shown,
        ),
    ]  # fmt: skip


def _poses(data: RobotData, arm: UrdfArm, seed: int) -> Result:
    """The same joint angles, fed to both as they stand."""
    rng = np.random.default_rng(seed)
    q = rng.uniform([j.lower for j in data.joints], [j.upper for j in data.joints], (_SAMPLES, 6))
    total = np.broadcast_to(np.eye(4), (_SAMPLES, 4, 4))
    for i, joint in enumerate(arm.joints):
        step = np.zeros((_SAMPLES, 4, 4))
        step[:, :3, :3] = about_axis(joint.axis, q[:, i])
        step[:, :3, 3] = joint.point - step[:, :3, :3] @ joint.point
        step[:, 3, 3] = 1.0
        total = total @ step
    distance = np.linalg.norm(
        (total @ arm.tip_pose)[:, :3, 3] - poe.flange(data.geometry, q)[:, :3, 3], axis=1
    )
    worst = int(distance.argmax())
    angles = [units.deg(v) for v in q[worst].tolist()]
    return _judged(
        "poses", "Equal joint angles put the flange in the same place",
        1e3 * float(distance[worst]), 0.05, "mm", "five lengths of 0.01 mm each",
        f"{_SAMPLES} configurations within the limits",
        {"q_deg": angles, "command": f"kr16 fk {' '.join(map(repr, angles))}"}, _SAMPLES, seed,
    )  # fmt: skip


def _limits(data: RobotData, arm: UrdfArm, match: _Match) -> list[Result]:
    found = []
    for ours, theirs, zero, sign in zip(data.joints, arm.joints, *match, strict=True):
        ends = _range(theirs, float(zero), float(sign))
        title = f"Range of {ours.name}"
        mine = f"this robot {units.deg(ours.lower):g} to {units.deg(ours.upper):g} deg"
        name = f"limits-{ours.name}"
        if ends is None:
            found.append(_skipped(name, title, f"{theirs.name} states no range; {mine}"))
            continue
        off = units.deg(max(abs(ends[0] - ours.lower), abs(ends[1] - ours.upper)))
        text = f"here {units.deg(ends[0]):g} to {units.deg(ends[1]):g} deg; {mine}"
        found.append(_judged(name, title, off, 0.01, "deg", "files round to 0.01 deg", text))
    found.append(_rates(data, arm, "velocity", "speed", "speeds", "Joint speeds", "rad/s"))
    found.append(_rates(data, arm, "effort", "torque", "torques", "Joint torques", "N m"))
    return found


def _range(joint: UrdfJoint, zero: float, sign: float) -> tuple[float, float] | None:
    """Their range in our angles."""
    if joint.lower is None or joint.upper is None:
        return None
    ends = sorted(sign * v + zero for v in (joint.lower, joint.upper))
    return ends[0], ends[1]


def _rates(
    data: RobotData, arm: UrdfArm, theirs: str, ours: str, name: str, title: str, unit: str
) -> Result:
    off: dict[str, float] = {}
    for mine, other in zip(data.joints, arm.joints, strict=True):
        a, b = getattr(mine, ours), getattr(other, theirs)
        if a is not None and b is not None and 0.0 < b < _NOT_STATED:
            off[mine.name] = abs(b / a - 1)
    if not off:
        return _skipped(name, title, f"no {theirs} is stated")
    wrong = [
        f"{mine.name} {getattr(other, theirs):g}, this robot {getattr(mine, ours):g} {unit}"
        for mine, other in zip(data.joints, arm.joints, strict=True)
        if off.get(mine.name, 0.0) > 1e-3
    ]
    text = "; ".join(wrong) or f"{len(off)} of 6 stated, all equal"
    return _judged(name, title, max(off.values()), 1e-3, "relative", "files round", text)


def _bodies(data: RobotData, arm: UrdfArm, match: _Match) -> list[Result]:
    """Masses, mass centres and inertia tensors in robroot's axes at our zero pose."""
    names = ("mass", "mass-centre", "inertia")
    titles = ("Masses of the links", "Mass centres of the links", "Inertia tensors of the links")
    if not data.links or all(body is None for body in arm.bodies):
        who = data.name if not data.links else "the URDF"
        text = f"{who} has no inertial data"
        return [_skipped(*pair, text) for pair in zip(names, titles, strict=True)]
    moves = poe.motions(data.geometry, match.zero)[1:]
    errors: list[list[float]] = [[], [], []]
    texts: list[list[str]] = [[], [], []]
    for i, (ours, theirs, move) in enumerate(zip(bodies(data), arm.bodies, moves, strict=True), 1):
        if theirs is None:
            gaps, shown = [np.inf] * 3, ["none"] * 3
        else:
            R = move[:3, :3]
            centre, inertia = poe.carried(move, ours.centre), R @ ours.inertia @ R.T
            apart = 1e3 * float(np.linalg.norm(theirs.centre - centre))
            size = float(np.abs(inertia).max())
            gaps = [abs(theirs.mass / ours.mass - 1), apart]
            gaps.append(float(np.abs(theirs.inertia - inertia).max()) / size)
            shown = [f"{theirs.mass:g} kg, this robot {ours.mass:g} kg", f"{apart:.3f} mm apart"]
            shown.append(f"up to {gaps[2]:.2%} of its largest entry")
        for k, tolerance in enumerate((1e-3, 0.1, 1e-3)):
            errors[k].append(gaps[k])
            if gaps[k] > tolerance:
                texts[k].append(f"link {i}: {shown[k]}")
    rest = (
        (1e-3, "relative", "files round to three digits"),
        (0.1, "mm", "files round to 0.1 mm"),
        (1e-3, "relative", "files round to three digits"),
    )
    return [
        _judged(name, title, max(e), *how, "; ".join(t) or "all six agree",
                {"link": int(np.argmax(e)) + 1})
        for name, title, e, t, how in zip(names, titles, errors, texts, rest, strict=True)
    ]  # fmt: skip


def _judged(
    name: str, title: str, error: float, tolerance: float, unit: str, reason: str, evidence: str,
    worst: dict[str, Any] | None = None, samples: int = 1, seed: int = 0,
) -> Result:  # fmt: skip
    finite = bool(np.isfinite(error))
    status: Outcome = "passed" if finite and error <= tolerance else "failed"
    return _result(
        name, title, float(error) if finite else None, tolerance, unit, reason, evidence, status,
        worst or {}, samples, seed,
    )  # fmt: skip


def _skipped(name: str, title: str, evidence: str) -> Result:
    return _result(name, title, None, 1.0, "1", "not judged", evidence, "skipped", {}, 0, 0)


def _result(
    name: str, title: str, error: float | None, tolerance: float, unit: str, reason: str,
    evidence: str, status: Outcome, worst: dict[str, Any], samples: int, seed: int,
) -> Result:  # fmt: skip
    return Result(
        id=f"model.{name}",
        group="model",
        title=title,
        statement=f"{title}: the URDF's equals the parameter file's",
        regime="the zero pose" if samples <= 1 else "within the joint limits",
        method="the URDF read link by link, against the parameter file; not through kr16cli.model",
        grade="A",
        error=error,
        tolerance=tolerance,
        unit=unit,
        reason=reason,
        status=status,
        samples=samples,
        seed=seed,
        worst=worst,
        evidence=evidence,
    )
