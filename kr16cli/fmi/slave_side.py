"""What the slave inside an FMU needs: machines of its cargo, and the wrapper's books kept right."""

from __future__ import annotations

import ctypes
import json
from collections.abc import Callable
from functools import lru_cache, partial
from importlib import import_module
from types import ModuleType
from typing import Any

from kr16cli.fmi import cargo, written_arm
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.variables import Part, Variable

Warn = Callable[[str], None]


@lru_cache(maxsize=1)
def _loaded() -> tuple[cargo.Cargo, dict[str, Any], str]:
    """Cargo, written-out functions and identity of the package this module lies in."""
    package = __name__.partition(".")[0]
    module = _functions(package)
    functions = {name: getattr(module, name) for name in written_arm.NAMES}
    return cargo.own(package), functions, import_module(package).IDENTITY


def _functions(package: str) -> ModuleType:
    """The written-out functions: compiled where this machine can load them, else in Python."""
    try:
        return import_module(f"{package}.quick")
    except ImportError:
        return import_module(f"{package}.functions")


def variables() -> tuple[Variable, ...]:
    """The table of this FMU."""
    return _loaded()[0].variables


def about() -> tuple[dict[str, Any], str]:
    """Texts for the model description, and the identity."""
    freight, _, identity = _loaded()
    return dict(freight.about), identity


def new_machine(warn: Warn) -> Machine:
    """A new instance of this FMU's robot."""
    freight, functions, identity = _loaded()
    make_arm = partial(written_arm.WrittenArm, functions=functions)
    part = Part(freight.about["part"])
    return Machine(freight.variables, freight.data, make_arm, part, identity, warn)


def to_bytes(saved: dict[str, Any]) -> bytes:
    """A saved state as bytes; Python's JSON keeps every float exactly."""
    return json.dumps(saved, allow_nan=False).encode()


def from_bytes(content: bytes) -> Any:
    """What `to_bytes` wrote; None for anything else.

    It must not raise: the wrapper could not tell which instance's counts to correct.
    """
    try:
        return json.loads(content)
    except ValueError:
        return None


def keep(*things: object) -> None:
    """Add one to the reference counts of objects.

    The wrapper of pythonfmu 0.7.0 gives away references that are not its own: the dict of the
    script's module at each instantiation, and after each exception the class, the instance and
    its log, which it gives away again with the instance. Without this, the host would crash.
    """
    for thing in things:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))
