"""Suite `datasheet`: the parameter file and the model against published numbers.

The numbers are in data/reference/*.csv, each with its source (keys of SOURCES.md) and status.
They were written down from the sources, not from the parameter file.
"""

from __future__ import annotations

import csv
from functools import lru_cache

import numpy as np

from kr16cli import units
from kr16cli.assets import asset
from kr16cli.robot import Geometry, Provenance, RobotData
from kr16cli.robot_file import load_data
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, from_abc
from kr16cli.verify.measure import COUNT
from kr16cli.verify.records import Finding, Setting, SkipCase
from kr16cli.verify.registry import case

_Figures = dict[str, float]
_ROBOT = "KUKA KR 16-2"
_AXES = ("xx", "yy", "zz", "xy", "xz", "yz")


def reference(name: str) -> list[dict[str, str]]:
    """Rows of data/reference/NAME.csv."""
    with asset(f"data/reference/{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _ours(setting: Setting) -> RobotData:
    data = setting.robot.data
    if data.name != _ROBOT:
        raise SkipCase(f"the published numbers are those of the {_ROBOT}, not of {data.name}")
    return data


def numbers(data: RobotData) -> dict[str, float | None]:
    """Every number of a parameter file by key, in the reference's units."""
    found: dict[str, float | None] = {}
    for key, value in data.geometry._asdict().items():
        found[f"geometry.{key}"] = units.mm(value)
    for axis, value in zip("xyz", data.gravity, strict=True):
        found[f"gravity.{axis}"] = value
    for joint in data.joints:
        for key in ("lower", "upper", "speed"):
            value = getattr(joint, key)
            found[f"joint.{joint.name}.{key}"] = None if value is None else units.deg(value)
        for key in ("torque", "gear_ratio", "rotor_inertia", "coulomb", "viscous"):
            found[f"joint.{joint.name}.{key}"] = getattr(joint, key)
    for i, link in enumerate(data.links, 1):
        found[f"link.{i}.mass"] = link.mass
        for axis, value in zip("xyz", link.com, strict=True):
            found[f"link.{i}.com.{axis}"] = value
        for axis, value in zip(_AXES, link.inertia, strict=True):
            found[f"link.{i}.inertia.{axis}"] = value
    found |= {f"rating.{key}": value for key, value in data.ratings.items()}
    return found


@case(
    "datasheet.numbers",
    title="Every number of the parameter file is what its source says",
    statement="value = value of data/reference/kr16_2.csv, none missing, none more",
    regime="all numbers: lengths, limits, speeds, drives, masses, inertias, ratings, gravity",
    method="a second copy of every number, written down from the sources",
    grade="A",
    tolerance=1e-9,
    unit="relative",
    reason="only the conversion of degrees and millimetres rounds",
    functions=("kr16cli.robot_file.load_data",),
)
def all_numbers(setting: Setting) -> Finding:
    """The file says what its sources say."""
    found, rows = numbers(_ours(setting)), reference("kr16_2")
    errors: dict[str, float] = dict.fromkeys(set(found) ^ {row["key"] for row in rows}, np.inf)
    for row in rows:
        value, expected = found.get(row["key"]), float(row["value"])
        if value is not None:
            errors[row["key"]] = abs(value - expected) / (abs(expected) or 1.0)
    key = max(errors, key=lambda k: errors[k])
    expected_text = next((r["value"] for r in rows if r["key"] == key), "nothing")
    worst = {"key": key, "file": found.get(key), "reference": expected_text}
    return Finding(errors[key], len(rows), worst, f"{len(rows)} numbers")


@case(
    "datasheet.provenance",
    title="No number is called better than its source allows",
    statement="status of each number = status of data/reference/kr16_2.csv; every source is a key "
    "of SOURCES.md",
    regime="all numbers of the parameter file",
    method="a second copy of every status",
    grade="A",
    tolerance=COUNT,
    unit="numbers with another status",
    reason="a status is right or wrong",
    functions=("kr16cli.robot.Provenance",),
)
def provenance(setting: Setting) -> Finding:
    """Statuses, and that sources exist."""
    data = _ours(setting)
    known = asset("data/SOURCES.md").read_text(encoding="utf-8")
    wrong = [
        row["key"]
        for row in reference("kr16_2")
        if not row["key"].startswith("gravity") and _status(data, row["key"]) != row["status"]
    ]
    listed = {key for group in _groups(data) for key in group.source}
    wrong += sorted(key for key in listed if f"| {key} |" not in known)
    text = f"statuses of all numbers, {len(listed)} sources"
    return Finding(float(len(wrong)), len(listed), {"keys": wrong[:5]}, text)


def _groups(data: RobotData) -> list[Provenance]:
    groups = [data.geometry_provenance]
    groups += [joint.provenance for joint in data.joints]
    groups += [link.provenance for link in data.links]
    if data.ratings_provenance is not None:
        groups.append(data.ratings_provenance)
    return [own for group in groups for own in (group, *group.overrides.values())]


def _status(data: RobotData, key: str) -> str | None:
    group, *rest = key.split(".")
    if group == "geometry":
        return data.geometry_provenance.of(rest[0]).status
    if group == "rating" and data.ratings_provenance is not None:
        return data.ratings_provenance.of(rest[0]).status
    if group == "joint":
        joint = next(j for j in data.joints if j.name == rest[0])
        own = {"lower": "limits_deg", "upper": "limits_deg", "speed": "speed_deg_s"}
        own |= {"torque": "torque_nm", "coulomb": "coulomb_nm", "viscous": "viscous_nms"}
        return joint.provenance.of(own.get(rest[1], rest[1])).status
    if group == "link" and data.links:
        return data.links[int(rest[0]) - 1].provenance.of(rest[1]).status
    return None


@case(
    "datasheet.poses",
    title="Zero pose and home are where the published models have them",
    statement="fk(zero) = X 1768 Z 640 B 90; fk(home) = X 1088 Z 1320 A 0 B 90 C 0, S 2, T 2",
    regime="the published poses",
    method="numbers of data/reference/poses.csv and status_turn.csv",
    grade="A",
    tolerance=1e-9,
    unit="mm, 1",
    reason="sums of lengths given in whole millimetres, exact at whole quarter turns but for 1e-13",
    equations=("3.3", "3.4", "3.5", "3.6"),
    functions=("kr16cli.Robot.fk", "kr16cli.Robot.status_turn"),
)
def poses(setting: Setting) -> Finding:
    """Where the flange is said to be."""
    data, robot = _ours(setting), setting.robot.with_tool(None)
    errors, rows = [], reference("poses") + reference("status_turn")
    for row in rows:
        q = np.radians([float(row[f"a{i}"]) for i in range(1, 7)])
        T = robot.fk(q)
        error = 0.0
        if "x_mm" in row:
            place = [float(row[f"{axis}_mm"]) for axis in "xyz"]
            abc = np.radians([float(row[axis] or 0.0) for axis in "abc"])
            error = max(
                float(np.abs(T[:3, 3] * 1e3 - place).max()),
                float(np.abs(T[:3, :3] - from_abc(abc)).max()),
            )
        for name, bits in zip(("status", "turn"), robot.status_turn(q), strict=True):
            if row[name] and int(row[name]) != int(bits):
                error = np.inf
        errors.append(error)
    worst = rows[int(np.argmax(errors))]
    text = f"{len(rows)} published configurations of the {data.name}"
    return Finding(float(max(errors)), len(rows), {"row": worst["source"]}, text)


@lru_cache(maxsize=4)
def _envelope(g: Geometry, limits: tuple[tuple[float, float], ...], spacing: float) -> _Figures:
    """The figures of the working envelope, mm and m3, from geometry and the limits of A2 and A3.

    The grid's step of 0.5 deg misses an extreme by at most 0.02 mm.
    """
    q2, q3 = (np.linspace(lower, upper, 601) for lower, upper in limits)
    x, z = _section(g, q2[:, None], q3)
    straight = np.array(-np.arctan2(g.a3, g.d4))
    level = np.array(0.0)  # the stretched arm held level reaches farthest
    reach = float(_section(g, level, straight)[0])
    inner = float(x[:, -1].max())
    return {
        "reach": reach * 1e3,
        "wrist_height": float(z.max()) * 1e3,
        "total_height": float(z.max() - z.min()) * 1e3,
        "inner_reach": inner * 1e3,
        "reach_difference": (reach - inner) * 1e3,
        "rear_reach": -float(x.min()) * 1e3,
        "working_volume": _volume(g, limits, spacing),
    }


def envelope(setting: Setting) -> _Figures:
    """The computed figures of the working envelope."""
    data = _ours(setting)
    limits = tuple((j.lower, j.upper) for j in data.joints[1:3])
    return _envelope(data.geometry, limits, 0.01 if setting.quick else 0.004)


def _section(g: Geometry, q2: Array, q3: Array) -> tuple[Array, Array]:
    """Wrist centre in front of the A1 axis and above the floor."""
    lean = q2 + q3
    x = g.a1 + g.a2 * np.cos(q2) + g.d4 * np.cos(lean) - g.a3 * np.sin(lean)
    return x, g.d1 - g.a2 * np.sin(q2) - g.d4 * np.sin(lean) - g.a3 * np.cos(lean)


def _volume(g: Geometry, limits: tuple[tuple[float, float], ...], spacing: float) -> float:
    """Volume of the wrist centres, m3: cells of the section that an elbow reaches, turned round.

    A1 turns by more than a whole turn, so a cell counts once whether reached in front or behind.
    """
    top = g.d1 + g.a2 + np.hypot(g.a3, g.d4)
    radius = np.arange(spacing / 2, g.a1 + g.a2 + np.hypot(g.a3, g.d4), spacing)
    height = np.arange(g.d1 - (top - g.d1) + spacing / 2, top, spacing)
    r, z = np.meshgrid(radius, height)
    reached = np.zeros(r.shape, dtype=bool)
    forearm, tilt = np.hypot(g.a3, g.d4), np.arctan2(g.a3, g.d4)
    for side in (1.0, -1.0):
        u, w = side * r - g.a1, z - g.d1
        cosine = (u * u + w * w - g.a2**2 - forearm**2) / (2 * g.a2 * forearm)
        with np.errstate(invalid="ignore"):
            bend = np.arccos(cosine)
        for elbow in (bend, -bend):
            q3 = elbow - tilt
            q2 = np.arctan2(-w, u) - np.arctan2(
                forearm * np.sin(elbow), g.a2 + forearm * np.cos(elbow)
            )
            q2 = np.remainder(q2 + np.pi, 2 * np.pi) - np.pi
            inside = np.ones(r.shape, dtype=bool)
            for q, (lower, upper) in zip((q2, q3), limits, strict=True):
                inside &= (q >= lower) & (q <= upper)
            reached |= inside
    return float((2 * np.pi * r * spacing**2)[reached].sum())


def _register(row: dict[str, str]) -> None:
    name = row["figure"]

    @case(
        f"datasheet.{name.replace('_', '-')}",
        title=f"{row['means'][0].upper()}{row['means'][1:]}",
        statement=f"{row['value']} {row['unit']} ({row['status']}, {row['source']})",
        regime="the wrist centre over the ranges of A2 and A3",
        method="geometry and limits of the parameter file, on a grid",
        grade="A",
        tolerance=float(row["tolerance"]),
        unit=row["unit"],
        reason=row["reason"],
        functions=("kr16cli.robot_file.load_data",),
    )
    def figure(setting: Setting) -> Finding:
        ours = envelope(setting)[name]
        text = f"computed {ours:.2f} {row['unit']}; the figure is {row['status']}"
        return Finding(abs(ours - float(row["value"])), 1, {}, text)


for _row in reference("envelope"):
    _register(_row)


@case(
    "datasheet.ratings",
    title="The envelope's figures in the parameter file are those of the reference",
    statement="ratings.NAME_mm = value of data/reference/envelope.csv",
    regime="seven figures",
    method="two copies compared",
    grade="A",
    tolerance=1e-9,
    unit="mm, m3",
    reason="copied numbers",
    functions=("kr16cli.robot_file.load_data",),
)
def ratings(setting: Setting) -> Finding:
    """Two files, one number."""
    data = _ours(setting)
    errors = {}
    for row in reference("envelope"):
        value = data.ratings.get(f"{row['figure']}_{row['unit']}")
        errors[row["figure"]] = np.inf if value is None else abs(value - float(row["value"]))
    key = max(errors, key=lambda k: errors[k])
    return Finding(float(errors[key]), len(errors), {"figure": key}, "seven figures")


@case(
    "datasheet.masses",
    title="Moving and fixed masses add up to the whole arm",
    statement="sum of link masses = 235 kg - 63.37 kg of the base",
    regime="six links",
    method="sum",
    grade="A",
    tolerance=0.005,
    unit="kg",
    reason="half the last printed digit of the base's mass",
    functions=("kr16cli.robot_file.load_data",),
)
def masses(setting: Setting) -> Finding:
    """The budget of mass."""
    moving = sum(link.mass for link in _ours(setting).links)
    return Finding(abs(moving - (235.0 - 63.37)), 6, {}, f"moving mass {moving:.3f} kg")


@case(
    "datasheet.long-arm",
    title="The KR 16 L6 reaches what its data sheet says",
    statement="a1 + a2 + hypot(d4, a3) = 1911 mm for the KR 16 L6",
    regime="the shipped second arm",
    method="its published reach (S15)",
    grade="A",
    tolerance=0.5,
    unit="mm",
    reason="half the last printed digit",
    functions=("kr16cli.robot_file.load_data", "kr16cli.model.jacobian.singular_families"),
)
def long_arm(setting: Setting) -> Finding:
    """Nothing about one robot is in the code."""
    g = load_data("kr16_l6").geometry
    q = np.array([0.0, 0.0, -np.arctan2(g.a3, g.d4), 0.0, 0.0, 0.0])
    wrist = poe.wrist_centre(g, q)
    reach = 1e3 * float(np.hypot(wrist[0], wrist[1]))
    return Finding(abs(reach - 1911.0), 1, {}, f"computed {reach:.2f} mm")
