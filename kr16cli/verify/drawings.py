"""Numbers that a report draws and no case judges: plain arrays from `Robot`, by name.

Lengths in m, angles in degrees where the name ends in `_deg`, all else SI. Nothing here imports
matplotlib, and a page computes nothing: it draws what these functions return.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from kr16cli import kuka
from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.robot_file import load_data
from kr16cli.units import RAD_PER_DEG, deg
from kr16cli.verify.records import Setting, SkipCase
from kr16cli.verify.sampling import need_links
from kr16cli.verify.suites.datasheet import envelope, reference

Drawing = Mapping[str, Any]
Producer = Callable[[Setting], Drawing]

DRAWINGS: dict[str, Producer] = {}
"""All producers by name."""

HOME_DEG = (0.0, -90.0, 90.0, 0.0, 0.0, 0.0)
SHOWN_DEG = (20.0, -75.0, 105.0, 40.0, 50.0, -30.0)
"""A configuration whose pose all eight branches reach."""

_TURNED, _RAISED = -55.0 * RAD_PER_DEG, 20.0 * RAD_PER_DEG  # the oblique view's direction


def drawing(run: Producer) -> Producer:
    """Register a producer under its name."""
    DRAWINGS[run.__name__] = run
    return run


def draw(names: Sequence[str], setting: Setting) -> tuple[dict[str, Drawing], dict[str, str]]:
    """The drawings asked for, and for those that could not be made the reason."""
    made: dict[str, Drawing] = {}
    absent: dict[str, str] = {}
    plain = Setting(setting.robot.with_tool(None), setting.seed, setting.quick)
    for name in names:
        try:
            made[name] = DRAWINGS[name](plain)
        except SkipCase as reason:
            absent[name] = str(reason)
    return made, absent


def skeleton(robot: Robot, q: Array) -> Array:
    """Points of the arm's centre line, (..., 7, 3): floor, A1, A2, A3, A4, wrist, flange."""
    frames = robot.frames(q)
    origins = frames.dh[..., :, :3, 3]
    floor = np.zeros_like(origins[..., 0, :])
    column = floor + np.array([0.0, 0.0, robot.data.geometry.d1])
    named = [floor, column, *(origins[..., i, :] for i in (1, 2, 3, 4)), frames.flange[..., :3, 3]]
    return np.stack(named, axis=-2)


def oblique(points: Array) -> Array:
    """Points (..., 3) seen from the front right and above, (..., 2)."""
    x, y, z = np.moveaxis(points, -1, 0)
    across = -math.sin(_TURNED) * x + math.cos(_TURNED) * y
    away = math.cos(_TURNED) * x + math.sin(_TURNED) * y
    return np.stack([across, z * math.cos(_RAISED) - away * math.sin(_RAISED)], axis=-1)


@drawing
def poses(setting: Setting) -> Drawing:
    """The zero pose and home: centre line, joint axes with their positive sense, lengths."""
    robot = setting.robot
    q = np.radians([(0.0,) * 6, HOME_DEG])
    frames = robot.frames(q)
    points = skeleton(robot, q)
    middle = (points[:, :-1] + points[:, 1:]) / 2  # on the axes of A1, A4 and A6
    on_axis = np.stack(
        [middle[:, 0], points[:, 2], points[:, 3], middle[:, 4], points[:, 5], middle[:, 5]], axis=1
    )
    pose = [kuka.pose_from_matrix(T.tolist()) for T in frames.flange]
    return {
        "names": ("zero pose", "home"),
        "q_deg": np.degrees(q),
        "points": points,
        "axis_points": on_axis,
        "axis_directions": np.swapaxes(robot.jacobian(q)[:, 3:], 1, 2),
        "frame_origins": frames.dh[:, :, :3, 3],
        "frame_axes": np.swapaxes(frames.dh[:, :, :3, :3], 2, 3),
        "pose_mm_deg": pose,
        "lengths": robot.data.geometry._asdict(),
    }


@drawing
def known_poses(setting: Setting) -> Drawing:
    """Flange poses of data/reference/poses.csv beside the model's, mm and degrees."""
    if setting.robot.data.name != "KUKA KR 16-2":
        raise SkipCase("poses are published for the KUKA KR 16-2 only")
    rows = []
    for row in reference("poses"):
        angles = [float(row[f"a{i}"]) for i in range(1, 7)]
        pose = kuka.pose_from_matrix(setting.robot.fk(np.radians(angles)).tolist())
        published = [row.get(k) or "" for k in ("x_mm", "y_mm", "z_mm", "a", "b", "c")]
        rows.append({"q_deg": angles, "published": published, "model": pose, **_origin(row)})
    return {"rows": rows}


def _origin(row: Mapping[str, str]) -> dict[str, str]:
    return {key: row.get(key) or "" for key in ("source", "status")}


@drawing
def branches(setting: Setting) -> Drawing:
    """The eight solutions of one pose as centre lines in an oblique view."""
    robot = setting.robot
    T = robot.fk(np.radians(SHOWN_DEG))
    q = robot.ik(T)
    found = np.asarray(np.isfinite(q).all(axis=1))
    shown = np.where(found.reshape(-1, 1), q, 0.0)
    lower, upper = (
        np.array([getattr(j, s) for j in robot.data.joints]) for s in ("lower", "upper")
    )
    status, turn = robot.status_turn(shown)
    a5 = robot.jacobian(shown)[:, 3:, 4]
    points = skeleton(robot, shown)
    outside = np.logical_or(shown < lower, shown > upper)
    return {
        "pose_mm_deg": kuka.pose_from_matrix(T.tolist()),
        "found": found,
        "q_deg": np.degrees(shown),
        "points": oblique(points),
        "a5_ends": oblique(np.stack([points[:, 5], points[:, 5] + 0.28 * a5], axis=1)),
        "status": status,
        "turn": turn,
        "outside": [[f"A{i + 1}" for i in range(6) if row[i]] for row in outside.tolist()],
        "floor": oblique(_circle(0.28)),
    }


def _circle(radius: float) -> Array:
    t = np.linspace(0.0, 2 * math.pi, 41)
    return np.stack([radius * np.cos(t), radius * np.sin(t), 0 * t], axis=-1)


@drawing
def mass_centres(setting: Setting) -> Drawing:
    """Mass centres in the pose of figure 3.3: the chapter's arm and the robot."""
    need_links(setting.robot.data)
    arms = []
    for robot in (Robot(load_data("chapter3")), setting.robot):
        q = np.zeros(6)
        centres = robot.mass_centres(q)
        mass = np.array([link.mass for link in robot.data.links])
        arms.append(
            {
                "name": robot.data.name,
                "points": skeleton(robot, q),
                "centres": centres,
                "mass": mass,
                "total": mass @ centres / mass.sum(),
            }
        )
    return {"arms": arms, "q_deg": [0.0] * 6}


@drawing
def singularity_maps(setting: Setting) -> Drawing:
    """Determinant, smallest singular value and condition over two slices of joint space.

    Linear rows in m, angular rows in rad: singular values compare 1 m with 1 rad.
    """
    robot, n = setting.robot, 91
    slices = []
    for across, up, held in ((2, 4, (0.0, -60.0, 0.0, 0.0, 0.0, 0.0)), (1, 2, (0, 0, 0, 0, 60, 0))):
        x_deg, y_deg = (_range_deg(robot, joint, n) for joint in (across, up))
        q = np.radians(np.tile(np.array(held, dtype=float), (n, n, 1)))
        q[:, :, across] = np.radians(x_deg)
        q[:, :, up] = np.radians(y_deg)[:, None]
        sigma = np.linalg.svd(robot.jacobian(q), compute_uv=False)
        factors = robot.singularity(q)
        slices.append(
            {
                "x": f"A{across + 1}",
                "y": f"A{up + 1}",
                "held_deg": held,
                "x_deg": x_deg,
                "y_deg": y_deg,
                "determinant": np.abs(factors.determinant),
                "smallest": sigma[..., -1],
                "condition": np.minimum(sigma[..., 0] / np.maximum(sigma[..., -1], 1e-12), 1e4),
                "shoulder": factors.shoulder,
                "elbow": factors.elbow,
                "wrist": factors.wrist,
            }
        )
    return {"slices": slices, "samples": n * n}


def _range_deg(robot: Robot, joint: int, n: int) -> Array:
    j = robot.data.joints[joint]
    return np.linspace(deg(j.lower), deg(j.upper), n)


@drawing
def workspace(setting: Setting) -> Drawing:
    """Section of the wrist centre's workspace at A1 = 0, x and z in m, and published figures.

    `edges` are images of the limits of A2 and A3 and of the stretched arm; `inside` says which
    points of a grid some posture reaches within the limits of A2 and A3.
    """
    robot, g = setting.robot, setting.robot.data.geometry
    (l2, u2), (l3, u3) = ((j.lower, j.upper) for j in robot.data.joints[1:3])
    straight = -math.atan2(g.a3, g.d4)
    edges = {}
    for name, joint, value, other in (
        (f"A2 = {deg(l2):g} deg", 1, l2, (l3, u3)),
        (f"A2 = {deg(u2):g} deg", 1, u2, (l3, u3)),
        (f"A3 = {deg(l3):g} deg", 2, l3, (l2, u2)),
        (f"A3 = {deg(u3):g} deg", 2, u3, (l2, u2)),
        (f"arm stretched, A3 = {deg(straight):.2f} deg", 2, straight, (l2, u2)),
    ):
        q = np.zeros((181, 6))
        q[:, joint], q[:, 3 - joint] = value, np.linspace(*other, 181)
        edges[name] = robot.frames(q).wrist_centre[:, [0, 2]]
    grid = np.zeros((401, 401, 6))
    grid[..., 1], grid[..., 2] = np.linspace(l2, u2, 401)[:, None], np.linspace(l3, u3, 401)
    wrist = robot.frames(grid.reshape(-1, 6)).wrist_centre
    x_edges, z_edges = (_bins(wrist[:, i], 0.025) for i in (0, 2))
    count, _, _ = np.histogram2d(wrist[:, 0], wrist[:, 2], bins=(x_edges, z_edges))
    return {
        "edges": edges,
        "x": x_edges,
        "z": z_edges,
        "inside": count.T > 0,
        "arm": skeleton(robot, np.radians(HOME_DEG))[:, [0, 2]],
        "figures": _published(setting),
    }


def _bins(values: Array, width: float) -> Array:
    start, stop = math.floor(values.min() / width), math.ceil(values.max() / width)
    return width * np.arange(start, stop + 1)


def _published(setting: Setting) -> list[dict[str, Any]]:
    """The rows of data/reference/envelope.csv with the computed figures; none for other arms."""
    try:
        computed = envelope(setting)
    except SkipCase:
        return []
    keys = ("figure", "unit", "status", "source", "means")
    return [
        {k: row[k] for k in keys}
        | {
            "value": float(row["value"]),
            "tolerance": float(row["tolerance"]),
            "computed": computed[row["figure"]],
        }
        for row in reference("envelope")
    ]


@drawing
def torques(setting: Setting) -> Drawing:
    """Torques of a reference motion with the rated load, and gravity torques over A2 and A3.

    From home to (90, -30, 60, 90, 60, -120) deg along a quintic of time, in the least whole
    tenth of a second in which no joint passes its rated speed.
    """
    data = setting.robot.data
    need_links(data)
    limits = [j.torque for j in data.joints]
    speeds = [j.speed for j in data.joints]
    if None in limits or None in speeds:
        raise SkipCase("the parameter file gives no torques or speeds of the drives")
    limit, speed = np.array(limits, dtype=float), np.array(speeds, dtype=float)
    load = data.ratings.get("payload_kg", 0.0)
    aside, ahead = (data.ratings.get(f"rated_load_com_{k}_mm", 0.0) / 1e3 for k in ("xy", "z"))
    robot = Robot(data, drives=True).with_payload(load, (aside, 0.0, ahead))
    start, end = np.radians(HOME_DEG), np.radians((90.0, -30.0, 60.0, 90.0, 60.0, -120.0))
    duration = math.ceil(10 * 1.875 * float(np.max(np.abs(end - start) / speed))) / 10
    s = np.linspace(0.0, 1.0, 201)[:, None]
    move = end - start
    q = start + move * (10 * s**3 - 15 * s**4 + 6 * s**5)
    qd = move / duration * (30 * s**2 - 60 * s**3 + 30 * s**4)
    qdd = move / duration**2 * (60 * s - 180 * s**2 + 120 * s**3)
    tau = robot.inverse_dynamics(q, qd, qdd)
    n = 61
    a2, a3 = (_range_deg(robot, joint, n) for joint in (1, 2))
    grid = np.zeros((n, n, 6))
    grid[..., 1], grid[..., 2] = np.radians(a2), np.radians(a3)[:, None]
    share = np.abs(robot.gravity(grid)) / limit
    return {
        "time": s[:, 0] * duration,
        "q": q,
        "qd": qd,
        "qdd": qdd,
        "tau": tau,
        "limit": limit,
        "names": [j.name for j in data.joints],
        "speed_share": np.abs(qd).max(axis=0) / speed,
        "torque_share": np.abs(tau).max(axis=0) / limit,
        "payload": robot.payload,
        "payload_kg": load,
        "com_mm": (aside * 1e3, 0.0, ahead * 1e3),
        "start_deg": np.degrees(start),
        "end_deg": np.degrees(end),
        "a2_deg": a2,
        "a3_deg": a3,
        "gravity_share": share.max(axis=-1),
    }
