"""Kinematics, dynamics and simulation of the KUKA KR 16-2.

The public names below load on first use, so that `import kr16cli` stays cheap and a single
query never imports NumPy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kr16cli.api import Robot, load_robot
    from kr16cli.errors import FileError, InputError, Kr16Error, NoAnswerError
    from kr16cli.robot import Payload, RobotData
    from kr16cli.robot_file import load_data
    from kr16cli.single import Arm

__version__ = "0.1.0"

__all__ = [
    "Arm",
    "FileError",
    "InputError",
    "Kr16Error",
    "NoAnswerError",
    "Payload",
    "Robot",
    "RobotData",
    "__version__",
    "load_data",
    "load_robot",
]

_HOME = {
    "Arm": "single",
    "FileError": "errors",
    "InputError": "errors",
    "Kr16Error": "errors",
    "NoAnswerError": "errors",
    "Payload": "robot",
    "Robot": "api",
    "RobotData": "robot",
    "load_data": "robot_file",
    "load_robot": "api",
}


def __getattr__(name: str) -> object:
    """Load a public name from its module on first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
