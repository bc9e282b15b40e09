"""A robot's numbers as JSON, so that an FMU carries them and needs no parameter file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from kr16cli.robot import Geometry, JointData, LinkData, Provenance, RobotData


def robot_json(data: RobotData) -> dict[str, Any]:
    """The robot as a JSON-ready table, every float exact; the path is left out."""
    table: dict[str, Any] = json.loads(json.dumps({**_fields(data), "path": data.name}))
    return table


def _fields(data: RobotData) -> dict[str, Any]:
    fields = asdict(data)
    fields["geometry"] = data.geometry._asdict()
    return fields


def robot_from_json(table: Mapping[str, Any]) -> RobotData:
    """The robot that `robot_json` wrote."""
    rest = {key: table[key] for key in ("name", "ratings", "path")}
    ratings = table["ratings_provenance"]
    return RobotData(
        **rest,
        geometry=Geometry(**table["geometry"]),
        geometry_provenance=_provenance(table["geometry_provenance"]),
        joints=tuple(JointData(**_own(joint)) for joint in table["joints"]),
        links=tuple(_link(link) for link in table["links"]),
        gravity=_three(table["gravity"]),
        ratings_provenance=None if ratings is None else _provenance(ratings),
        conflicts=tuple(table["conflicts"]),
    )


def _own(table: Mapping[str, Any]) -> dict[str, Any]:
    return {**table, "provenance": _provenance(table["provenance"])}


def _link(table: Mapping[str, Any]) -> LinkData:
    fields = {**_own(table), "com": _three(table["com"]), "inertia": tuple(table["inertia"])}
    return LinkData(**fields)


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _provenance(table: Mapping[str, Any]) -> Provenance:
    return Provenance(
        status=table["status"],
        source=tuple(table["source"]),
        notes=dict(table["notes"]),
        overrides={key: _provenance(value) for key, value in table["overrides"].items()},
    )
