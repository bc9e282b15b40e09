"""Which engine serves batches; KR16_ENGINE forces one. No NumPy is imported to ask."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from kr16cli.errors import InputError

if TYPE_CHECKING:
    from kr16cli.kernels.columns import Engine

_KNOWN = ("numpy",)


def engine_name() -> str:
    """Name of the engine that serves: the environment's KR16_ENGINE, else the fastest here."""
    name = os.environ.get("KR16_ENGINE") or _KNOWN[0]
    if name not in _KNOWN:
        raise InputError(f"KR16_ENGINE is {name!r}; this build has {', '.join(_KNOWN)}")
    return name


def engine() -> Engine:
    """The engine in force."""
    engine_name()
    from kr16cli.kernels.columns import Engine as NumpyEngine  # NumPy is heavy

    return NumpyEngine()
