"""The robot's numbers: what a parameter file says, checked, with unit, source and status.

`RobotData` is plain data in SI units and holds no arrays; `model` turns it into equations.
Reading and checking files is `robot_file`; the text of a file is never kept here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, NamedTuple

Status = Literal["datasheet", "agreed", "sibling", "derived", "estimated", "recalled"]

Vector3 = tuple[float, float, float]
Inertia6 = tuple[float, float, float, float, float, float]


class Geometry(NamedTuple):
    """Lengths of Table 3.1 in m; a3 > 0 puts the A4 axis below A3 when the forearm is level."""

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float


class Tolerance(NamedTuple):
    """How far a number may be off: `relative`, or `absolute` in the number's SI unit; one is None.

    It is the half width of an interval that holds the number with about 95 %.
    """

    relative: float | None = None
    absolute: float | None = None


@dataclass(frozen=True)
class Provenance:
    """Where a group of numbers comes from: a status, source keys and notes by key.

    `notes` holds the texts, `overrides` the own status and source and `tolerances` the own
    tolerance of single keys.
    """

    status: Status
    source: tuple[str, ...]
    notes: Mapping[str, str] = field(default_factory=dict)
    overrides: Mapping[str, Provenance] = field(default_factory=dict)
    tolerances: Mapping[str, Tolerance] = field(default_factory=dict)

    def of(self, key: str) -> Provenance:
        """Provenance of one key of the group, such as "d6": its own, else the group's."""
        return self.overrides.get(key, self)


@dataclass(frozen=True)
class JointData:
    """One joint: range (rad), speed (rad/s) and its drive, all on the link side of the gear.

    `rotor_inertia` (kg m2) is the motor's own, before the gear; the model multiplies it by
    the gear ratio squared, once. None means the file does not say.
    """

    name: str
    lower: float
    upper: float
    provenance: Provenance
    speed: float | None = None
    torque: float | None = None
    gear_ratio: float | None = None
    rotor_inertia: float | None = None
    coulomb: float | None = None
    viscous: float | None = None

    @property
    def reflected_inertia(self) -> float:
        """Rotor inertia seen at the joint, J G^2 in kg m2; 0 where the file is silent."""
        if self.rotor_inertia is None or self.gear_ratio is None:
            return 0.0
        return self.rotor_inertia * self.gear_ratio**2


@dataclass(frozen=True)
class LinkData:
    """One moving link: mass (kg), mass centre (m), inertia about the mass centre (kg m2).

    `inertia` is (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), tensor entries (not negated products).
    `frame` is "zero-pose" (robroot's axes at q = 0, origin on the joint; the wrist links
    share the wrist centre) or "dh" (frame i of Table 3.1). `tolerance` is relative.
    """

    mass: float
    com: Vector3
    inertia: Inertia6
    frame: Literal["zero-pose", "dh"]
    provenance: Provenance
    tolerance: float | None = None


@dataclass(frozen=True)
class Payload:
    """A rigid load on the flange: mass (kg), mass centre and inertia in flange axes.

    `com` in m from the flange origin; `inertia` about the load's mass centre as in LinkData.
    """

    mass: float = 0.0
    com: Vector3 = (0.0, 0.0, 0.0)
    inertia: Inertia6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RobotData:
    """A robot of the chapter's structure. `links` is empty for a kinematics-only file.

    `ratings` holds what the data sheet says of the whole arm (payload_kg, reach_mm, ...);
    `conflicts` lists what sources disagree on, in words.
    """

    name: str
    geometry: Geometry
    geometry_provenance: Provenance
    joints: tuple[JointData, ...]
    links: tuple[LinkData, ...]
    gravity: Vector3
    ratings: Mapping[str, float]
    ratings_provenance: Provenance | None
    conflicts: tuple[str, ...]
    path: str

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the numbers and names; comments, order, sources, statuses, notes do not count.

        Of canonical JSON: sorted keys, no spaces, floats in Python's shortest exact form.
        """
        import hashlib
        import json

        content = {
            "name": self.name,
            "geometry": self.geometry._asdict(),
            "joints": [_numbers(joint) for joint in self.joints],
            "links": [_numbers(link) for link in self.links],
            "gravity": self.gravity,
            "ratings": dict(self.ratings),
        }
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode("ascii")).hexdigest()

    def with_gravity(self, gravity: Vector3) -> RobotData:
        """The same robot under another gravity vector (m/s2, robroot axes)."""
        return replace(self, gravity=gravity)


def _numbers(record: JointData | LinkData) -> dict[str, object]:
    """The fields of a record, all but where they come from."""
    return {key: value for key, value in vars(record).items() if key != "provenance"}
