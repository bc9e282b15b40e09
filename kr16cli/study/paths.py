"""Numbers of a scenario and of its robot by dotted path: found, and replaced, before checking.

A path is that of the file: `payload.mass`, `controller.kp[2]`, `initial.q_deg[3]`,
`link[2].mass`, `joint[1].viscous_nms`, counted from 1. Words for a whole list stand for all its
entries. `gains` means `controller`. A name in both files is the scenario's.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple

from kr16cli.errors import InputError
from kr16cli.robot_rules import look_up

_PART = re.compile(r"(\w+)(?:\[(\d+)\])?$")
_ROBOT = ("geometry", "joint", "link")
_ALIAS = {"gains": "controller"}
_SHOWN = 4

# Numbers that a scenario may hold although its file leaves them out, with where each starts.
_OPTIONAL: Mapping[str, Any] = {
    "payload": {"mass": 0.0, "com": [0.0] * 3},
    "gravity": [0.0, 0.0, -9.81],
    "initial": {"qd_deg_s": [0.0] * 6},
    "output_step_s": 0.01,
}
_OF_FOLLOWERS: Mapping[str, Any] = {
    "controller": {"natural_frequency": 10.0, "damping_ratio": 1.0, "delay_s": 0.0},
    "reference": {"speed_percent": 100.0},
}


_UNITS: Mapping[str, str] = {
    "payload.mass": "kg",
    "payload.com": "m",
    "payload.inertia": "kg m2",
    "gravity": "m/s2",
    "initial.q": "rad",
    "initial.qd": "rad/s",
    "controller.natural_frequency": "rad/s",
}
# The longest first: the speed deg_s ends in s, too.
_SUFFIXES: Mapping[str, str] = {
    **{"_deg_s": "deg/s", "_m_s2": "m/s2", "_m_s": "m/s", "_percent": "%"},
    **{"_deg": "deg", "_nm": "N m", "_mm": "mm", "_n": "N", "_s": "s"},
}


class Tables(NamedTuple):
    """The tables of a scenario file and of a robot file."""

    scenario: dict[str, Any]
    robot: dict[str, Any]


class Place(NamedTuple):
    """Where a number stands: in which file, by which keys; `value` is what stands there."""

    path: str
    file: str
    keys: tuple[str | int, ...]
    value: Any


def find(tables: Tables, path: str) -> Place:
    """The number, or list of numbers, of a path.

    Raises:
        InputError: nothing has this path; near ones are listed.
    """
    keys = _keys(path)
    for file, table in (("robot", tables.robot), ("scenario", _widened(tables.scenario))):
        if (file == "robot") != (bool(keys) and keys[0] in _ROBOT):
            continue
        node: Any = table
        try:
            for key in keys:
                node = node[key]
        except (KeyError, IndexError, TypeError):
            break
        if keys and _numbers(node):
            return Place(path, file, keys, node)
    near = get_close_matches(path, known(tables), n=_SHOWN, cutoff=0.5)
    hint = f"near: {', '.join(near)}" if near else f"such as: {', '.join(known(tables)[:_SHOWN])}"
    raise InputError(f"--vary {path}: no number of the scenario or the robot has this path; {hint}")


def unit_of(tables: Tables, path: str) -> str:
    """The unit of the number a path names; empty where it has none, or it depends."""
    keys = _keys(path)
    if keys and keys[0] in _ROBOT:
        return look_up(tables.robot, path)[1]
    name = ".".join(key for key in keys if isinstance(key, str))
    suffixes = (unit for suffix, unit in _SUFFIXES.items() if name.endswith(suffix))
    return _UNITS.get(name) or next(suffixes, "")


def known(tables: Tables) -> list[str]:
    """Every path there is."""
    made = list(_leaves(_widened(tables.scenario), ""))
    robot = {key: tables.robot[key] for key in _ROBOT if key in tables.robot}
    return [*made, *_leaves(robot, "")]


def changed(tables: Tables, places: list[Place], values: list[float | list[float]]) -> Tables:
    """The tables with other values at some places; what nothing changes is not copied.

    A payload of no mass is no payload.
    """
    files = {place.file for place in places}
    made = Tables(*(copy.deepcopy(t) if f in files else t for f, t in tables._asdict().items()))
    for place, value in zip(places, values, strict=True):
        if place.file == "scenario":
            _grow(made.scenario, place.keys)
        node: Any = made.robot if place.file == "robot" else made.scenario
        for key in place.keys[:-1]:
            node = node[key]
        node[place.keys[-1]] = value
        _settle(made.robot, place, value)
    load = made.scenario.get("payload")
    if "scenario" in files and isinstance(load, dict) and not load.get("mass"):
        del made.scenario["payload"]
    return made


def _settle(robot: dict[str, Any], place: Place, value: float | list[float]) -> None:
    """Forget that sources disagree on a number that no longer is what was chosen among them."""
    if place.file == "robot" and value != place.value and "conflict" in robot:
        robot["conflict"] = [c for c in robot["conflict"] if c.get("key") != place.path]


def _keys(path: str) -> tuple[str | int, ...]:
    keys: list[str | int] = []
    for part in path.split("."):
        match = _PART.match(part)
        if match is None:
            return ()
        keys.append(match[1])
        if match[2] is not None:
            if match[2] == "0":
                return ()
            keys.append(int(match[2]) - 1)
    first = keys[0]
    keys[0] = _ALIAS.get(str(first), first)
    return tuple(keys)


def _widened(scenario: Mapping[str, Any]) -> dict[str, Any]:
    """A scenario's table with the numbers it leaves out."""
    optional = dict(_OPTIONAL)
    optional |= {key: value for key, value in _OF_FOLLOWERS.items() if key in scenario}
    made = copy.deepcopy(dict(scenario))
    for key, value in optional.items():
        if isinstance(value, Mapping):
            made[key] = {**value, **made.get(key, {})}
        else:
            made.setdefault(key, value)
    if "qd" in made["initial"]:
        made["initial"].pop("qd_deg_s")
    return made


def _grow(scenario: dict[str, Any], keys: tuple[str | int, ...]) -> None:
    """Write down what a place stands in, where the file leaves it out."""
    first = str(keys[0])
    inner = scenario.get(first)
    if inner is not None and (len(keys) == 1 or not isinstance(inner, dict) or keys[1] in inner):
        return
    whole = _widened(scenario)[first]
    if inner is None and len(keys) > 1 and isinstance(whole, dict):
        inner = scenario[first] = {}
    if inner is None:
        scenario[first] = copy.deepcopy(whole)
    else:
        inner[keys[1]] = copy.deepcopy(whole[keys[1]])


def _numbers(node: Any) -> bool:
    """Whether a node is a number, or a list of nothing else."""
    if isinstance(node, list):
        return bool(node) and all(_numbers(v) and not isinstance(v, list) for v in node)
    return isinstance(node, int | float) and not isinstance(node, bool)


def _leaves(node: Any, path: str) -> Iterator[str]:
    if isinstance(node, Mapping):
        for key, value in node.items():
            if key != "note":
                yield from _leaves(value, f"{path}.{key}" if path else str(key))
    elif isinstance(node, list):
        if _numbers(node):
            yield path
        for i, value in enumerate(node, 1):
            yield from _leaves(value, f"{path}[{i}]")
    elif _numbers(node):
        yield path
