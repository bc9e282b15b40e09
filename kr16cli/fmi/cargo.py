"""What an FMU carries beside code: its identity, variables, robot, and where a build came from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any, NamedTuple

from kr16cli.errors import FileError
from kr16cli.fmi.portable import robot_from_json, robot_json
from kr16cli.fmi.variables import Variable
from kr16cli.robot import RobotData

NAME = "cargo.json"
SCHEMA = "kr16.fmu_cargo/1"


class Cargo(NamedTuple):
    """`about` holds texts for the model description; `variables` is the table."""

    about: Mapping[str, Any]
    variables: tuple[Variable, ...]
    data: RobotData


def dump(cargo: Cargo) -> str:
    """The cargo as JSON text, the same for the same cargo."""
    table = {
        "schema": SCHEMA,
        "about": dict(cargo.about),
        "variables": [list(v) for v in cargo.variables],
        "robot": robot_json(cargo.data),
    }
    return json.dumps(table, sort_keys=True, indent=1, allow_nan=False) + "\n"


def load(text: str) -> Cargo:
    """The cargo that `dump` wrote."""
    table = json.loads(text)
    variables = tuple(Variable(*row) for row in table["variables"])
    return Cargo(table["about"], variables, robot_from_json(table["robot"]))


def own(package: str) -> Cargo:
    """The cargo that lies in a package; FileError with a reason if it cannot be used."""
    file = files(package).joinpath(NAME)
    try:
        return load(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, LookupError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise FileError(str(file), f"cannot be used ({reason}); unpack the FMU anew") from None
