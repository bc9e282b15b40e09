"""Read a URDF as a chain of six moving joints: axes, points, limits and bodies at zero."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kr16cli.errors import FileError
from kr16cli.verify.independent.lagrange import Body, merged, tensor
from kr16cli.verify.independent.rotations import Array, from_abc

_MOVING = ("revolute", "continuous", "prismatic", "planar", "floating")
_TIPS = ("tool0", "flange")
_SIX = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True)
class UrdfJoint:
    """A revolute joint at the zero configuration, in the root link's axes (m, rad, N m).

    A limit that the file does not state is None.
    """

    name: str
    axis: Array
    point: Array
    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None


@dataclass(frozen=True)
class UrdfArm:
    """Six joints, the bodies they move (None without mass), and the tip's pose at zero."""

    joints: tuple[UrdfJoint, ...]
    bodies: tuple[Body | None, ...]
    tip: str
    tip_pose: Array
    root: str


def read_urdf(path: str | Path) -> UrdfArm:
    """Read a URDF file.

    Raises:
        FileError: it cannot be read, is no URDF, or is not one chain of six revolute joints.
    """
    try:
        tree = ET.fromstring(Path(path).read_bytes())
    except IsADirectoryError:
        raise FileError(path, "is a directory; name a URDF file in it") from None
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None
    except ET.ParseError as error:
        raise FileError(path, f"no XML: {error}") from None
    if tree.tag != "robot":
        raise FileError(path, f"no URDF: the root element is <{tree.tag}>, expected <robot>")
    if any("xacro" in str(element.tag) for element in tree.iter()):
        raise FileError(path, "is a xacro macro file; expand it first: xacro FILE > FILE.urdf")
    return _Reader(path, tree).arm()


class _Reader:
    """Walks the tree of links and joints."""

    def __init__(self, path: str | Path, tree: ET.Element) -> None:
        self.path = path
        self.links = {self._name(link, "link"): link for link in tree.findall("link")}
        self.joints = tree.findall("joint")
        self.children: dict[str, list[ET.Element]] = {}
        for joint in self.joints:
            parent = self._end(joint, "parent")
            self._end(joint, "child")
            self.children.setdefault(parent, []).append(joint)

    def arm(self) -> UrdfArm:
        below = [self._end(joint, "child") for joint in self.joints]
        roots = [name for name in self.links if name not in below]
        if len(roots) != 1 or len(set(below)) != len(below):
            raise FileError(self.path, f"the links are no tree: {len(roots)} links without parent")
        found: list[UrdfJoint] = []
        bodies: list[Body | None] = []
        place, base, tips = np.eye(4), roots[0], {}
        while True:
            attached, onward = self._rigid(base, place)
            if found:
                bodies.append(self._lumped(attached))
                tips = attached
            if not onward:
                break
            if len(onward) > 1 or len(found) == 6:
                names = ", ".join(self._name(joint, "joint") for joint, _ in onward)
                raise FileError(
                    self.path, f"expected one chain of six joints; beside or after it: {names}"
                )
            joint, place = onward[0]
            found.append(self._joint(joint, place))
            base = self._end(joint, "child")
        if len(found) != 6:
            raise FileError(self.path, f"has {len(found)} moving joints; this arm has six")
        tip = next((name for name in _TIPS if name in tips), base)
        return UrdfArm(tuple(found), tuple(bodies), tip, tips[tip], roots[0])

    def _rigid(
        self, link: str, place: Array
    ) -> tuple[dict[str, Array], list[tuple[ET.Element, Array]]]:
        """Links fixed to a link with their poses, and the moving joints that leave them."""
        attached, onward, todo = {link: place}, [], [(link, place)]
        while todo:
            name, pose = todo.pop()
            for joint in self.children.get(name, []):
                here = pose @ self._origin(joint)
                if joint.get("type") in _MOVING:
                    onward.append((joint, here))
                else:
                    child = self._end(joint, "child")
                    attached[child] = here
                    todo.append((child, here))
        return attached, onward

    def _joint(self, joint: ET.Element, place: Array) -> UrdfJoint:
        name, kind = self._name(joint, "joint"), joint.get("type")
        if kind not in ("revolute", "continuous"):
            raise FileError(self.path, f"joint {name} is {kind}; this arm has revolute joints")
        axis = np.array([1.0, 0.0, 0.0])
        element = joint.find("axis")
        if element is not None:
            axis = np.array(self._numbers(element, "xyz", 3, f"joint {name}"))
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            raise FileError(self.path, f"joint {name}: the axis is 0 0 0; it needs a direction")
        limit = joint.find("limit")
        stated: Mapping[str, str] = {} if limit is None else limit.attrib
        where = f"joint {name}, limit"
        lower, upper, effort, velocity = (
            self._number(stated[key], where, key) if key in stated else None
            for key in ("lower", "upper", "effort", "velocity")
        )
        if kind == "continuous":
            lower = upper = None
        direction = place[:3, :3] @ (axis / length)
        return UrdfJoint(name, direction, place[:3, 3], lower, upper, effort, velocity)

    def _lumped(self, attached: Mapping[str, Array]) -> Body | None:
        """All masses fixed together as one body, in the root's axes."""
        total: Body | None = None
        for name, place in attached.items():
            inertial = self.links[name].find("inertial") if name in self.links else None
            if inertial is None:
                continue
            where = f"link {name}"
            mass = self._attribute(inertial, "mass", "value", where)
            inertia = inertial.find("inertia")
            if inertia is None:
                raise FileError(self.path, f"{where}: inertial without <inertia>")
            six = [self._number(inertia.get(key, "0"), where, key) for key in _SIX]
            own = place @ self._origin(inertial)
            R = own[:3, :3]
            body = Body(mass, own[:3, 3], R @ tensor(six) @ R.T)
            if mass:
                total = body if total is None else merged(total, body)
        return total

    def _origin(self, element: ET.Element) -> Array:
        """Pose of an element's <origin>; the identity without one."""
        pose, origin = np.eye(4), element.find("origin")
        if origin is not None:
            where = f"origin of {element.get('name', element.tag)}"
            r, p, y = self._numbers(origin, "rpy", 3, where)
            pose[:3, :3] = from_abc(np.array([y, p, r]))
            pose[:3, 3] = self._numbers(origin, "xyz", 3, where)
        return pose

    def _name(self, element: ET.Element, kind: str) -> str:
        name = element.get("name")
        if not name:
            raise FileError(self.path, f"a {kind} has no name")
        return name

    def _end(self, joint: ET.Element, which: str) -> str:
        end = joint.find(which)
        name = None if end is None else end.get("link")
        if name is None or name not in self.links:
            shown = f"{name!r} is no link" if name else "is missing"
            raise FileError(self.path, f"joint {joint.get('name')}: {which} {shown}")
        return name

    def _numbers(self, element: ET.Element, key: str, count: int, where: str) -> Sequence[float]:
        words = element.get(key, "0 " * count).split()
        if len(words) != count:
            raise FileError(self.path, f"{where}: {key} has {len(words)} numbers, not {count}")
        return [self._number(word, where, key) for word in words]

    def _attribute(self, element: ET.Element, child: str, key: str, where: str) -> float:
        inner = element.find(child)
        text = None if inner is None else inner.get(key)
        if text is None:
            raise FileError(self.path, f"{where}: <{child} {key}=...> is missing")
        return self._number(text, where, key)

    def _number(self, text: str, where: str, key: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise FileError(self.path, f"{where}: {key} is {text!r}; it must be a finite number")
        return value
