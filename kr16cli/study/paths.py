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


def known(tables: Tables) -> list[str]:
    """Every path there is."""
    made = list(_leaves(_widened(tables.scenario), ""))
    robot = {key: tables.robot[key] for key in _ROBOT if key in tables.robot}
    return [*made, *_leaves(robot, "")]


def changed(tables: Tables, places: list[Place], values: list[float | list[float]]) -> Tables:
    """Copies of the tables with other values at some places.

    A payload of no mass is no payload.
    """
    made = copy.deepcopy(tables)
    for place, value in zip(places, values, strict=True):
        if place.file == "scenario":
            _grow(made.scenario, place.keys)
        node: Any = made.robot if place.file == "robot" else made.scenario
        for key in place.keys[:-1]:
            node = node[key]
        node[place.keys[-1]] = value
    load = made.scenario.get("payload")
    if isinstance(load, dict) and not load.get("mass"):
        del made.scenario["payload"]
    return made


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
    wide = _widened(scenario)
    first = str(keys[0])
    if first not in scenario:
        whole = wide[first]
        scenario[first] = {} if isinstance(whole, dict) and len(keys) > 1 else copy.deepcopy(whole)
    if len(keys) > 1 and isinstance(scenario[first], dict) and keys[1] not in scenario[first]:
        scenario[first][keys[1]] = copy.deepcopy(wide[first][keys[1]])


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
