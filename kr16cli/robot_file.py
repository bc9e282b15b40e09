"""Read a robot parameter file (TOML, schema kr16.robot/1) into RobotData.

The numbers of a file are checked by `robot_check` before any of them is used. Lengths, masses
and inertias stand in SI already; limits and speeds come in degrees and leave in radians.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from kr16cli.assets import asset
from kr16cli.errors import FileError, ParameterError
from kr16cli.robot import (
    Geometry,
    Inertia6,
    JointData,
    LinkData,
    Provenance,
    RobotData,
    Tolerance,
    Vector3,
)
from kr16cli.robot_check import problems_in
from kr16cli.robot_rules import GEOMETRY, RATINGS, look_up
from kr16cli.units import rad

DEFAULT = "kr16_2"
STANDARD_GRAVITY: Vector3 = (0.0, 0.0, -9.81)


def load_data(path: str | Path | None = None) -> RobotData:
    """Load and check a robot.

    Args:
        path: a parameter file, or the name of a shipped one such as "kr16_l6"; None loads the
            KR 16-2.

    Returns:
        The robot's numbers in SI units.

    Raises:
        FileError: the file cannot be read or is no TOML.
        ParameterError: the first broken rule, with key, value and rule.
    """
    file = _find(path)
    return parse_data(_read(file), str(file))


def parse_data(table: Mapping[str, Any], path: str) -> RobotData:
    """Check a parsed parameter file and turn it into RobotData.

    Args:
        table: what tomllib returns, or a mapping of the same shape.
        path: what messages call the file.

    Returns:
        The robot's numbers in SI units.

    Raises:
        ParameterError: the first broken rule.
    """
    problems = problems_in(table, path)
    if problems:
        raise problems[0]
    ratings = table.get("ratings", {})
    return RobotData(
        name=table["name"],
        geometry=Geometry(*(_number(table["geometry"][key]) for key in GEOMETRY)),
        geometry_provenance=_provenance(table["geometry"]),
        joints=tuple(_joint(joint) for joint in table["joint"]),
        links=tuple(_link(link) for link in table.get("link", ())),
        gravity=cast("Vector3", _numbers(table.get("gravity", STANDARD_GRAVITY))),
        ratings={key: _number(ratings[key]) for key in RATINGS if key in ratings},
        ratings_provenance=_provenance(ratings) if ratings else None,
        conflicts=tuple(_conflict(table, conflict) for conflict in table.get("conflict", ())),
        path=path,
    )


def problems(path: str | Path | None = None) -> list[ParameterError]:
    """Every broken rule of a parameter file, in the order of the format; [] if it is sound.

    Args:
        path: as for `load_data`.

    Raises:
        FileError: the file cannot be read or is no TOML, so no rule could be tried.
    """
    file = _find(path)
    return problems_in(_read(file), str(file))


def template() -> str:
    """A commented parameter file to start from: the KR 16-2's own."""
    return asset(f"data/{DEFAULT}.toml").read_text(encoding="utf-8")


def _find(path: str | Path | None) -> Path:
    """The file meant; a bare name that is no file here is looked up among the shipped robots."""
    if path is None:
        return asset(f"data/{DEFAULT}.toml")
    file = Path(path)
    if str(path) != file.stem or file.is_file():
        return file
    shipped = sorted(asset("data").glob("*.toml"))
    for candidate in shipped:
        if candidate.stem == file.stem:
            return candidate
    if file.exists():
        return file
    names = ", ".join(candidate.stem for candidate in shipped)
    raise FileError(file, f"no such file, and no shipped robot of that name; shipped: {names}")


def _read(file: Path) -> dict[str, Any]:
    """The table of a TOML file; FileError with the reason and the place where there is none."""
    try:
        text = file.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        reason = f"not UTF-8 text at byte {error.start}; save the file as UTF-8"
        raise FileError(file, reason) from None
    except IsADirectoryError:
        raise FileError(file, "is a directory; name a parameter file in it") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(file, f"cannot be read: {reason}") from None
    if not text.strip():
        raise FileError(file, "is empty; `kr16 robot template` writes a file to start from")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise FileError(file, "no TOML: nested too deeply") from None
    except ValueError as error:  # TOMLDecodeError says the line; others come from int()
        raise FileError(file, f"no TOML: {' '.join(str(error).split())}") from None


def _number(value: float) -> float:
    """A float without a negative zero, so that -0.0 and 0 hash alike."""
    return float(value) + 0.0


def _numbers(values: Any) -> tuple[float, ...]:
    return tuple(map(_number, values))


def _provenance(group: Mapping[str, Any]) -> Provenance:
    notes = group.get("note", {})
    status, source = group["status"], tuple(group["source"])
    return Provenance(
        status=status,
        source=source,
        notes={key: note["text"] for key, note in notes.items() if "text" in note},
        overrides={
            key: Provenance(note.get("status", status), tuple(note.get("source", source)))
            for key, note in notes.items()
            if "status" in note or "source" in note
        },
        tolerances={
            key: Tolerance(note.get("tolerance"), _in_si(key, note.get("plus_minus")))
            for key, note in notes.items()
            if "tolerance" in note or "plus_minus" in note
        },
    )


def _in_si(key: str, value: float | None) -> float | None:
    """A number of a note in the SI unit of its key."""
    return rad(value) if value is not None and "_deg" in key else value


def _joint(joint: Mapping[str, Any]) -> JointData:
    lower, upper = joint["limits_deg"]

    def optional(key: str) -> float | None:
        return _number(joint[key]) if key in joint else None

    speed_deg_s = optional("speed_deg_s")
    return JointData(
        name=joint["name"],
        # The same conversion as for typed angles, so 185 typed is within a limit of 185.
        lower=rad(_number(lower)),
        upper=rad(_number(upper)),
        provenance=_provenance(joint),
        speed=None if speed_deg_s is None else rad(speed_deg_s),
        torque=optional("torque_nm"),
        gear_ratio=optional("gear_ratio"),
        rotor_inertia=optional("rotor_inertia"),
        coulomb=optional("coulomb_nm"),
        viscous=optional("viscous_nms"),
    )


def _link(link: Mapping[str, Any]) -> LinkData:
    return LinkData(
        mass=_number(link["mass"]),
        com=cast("Vector3", _numbers(link["com"])),
        inertia=cast("Inertia6", _numbers(link["inertia"])),
        frame=link["frame"],
        provenance=_provenance(link),
        tolerance=_number(link["tolerance"]) if "tolerance" in link else None,
    )


def _conflict(table: Mapping[str, Any], conflict: Mapping[str, Any]) -> str:
    """A conflict in words: the values, the one that is used, why, and the sources."""
    unit = look_up(table, conflict["key"])[1]
    values = " or ".join(f"{float(value):g}" for value in conflict["values"])
    used = f"{float(conflict['chosen']):g} {unit}".rstrip()
    sources = ", ".join(conflict["source"])
    return f"{conflict['key']}: {values}; {used} is used: {conflict['reason']} ({sources})"
