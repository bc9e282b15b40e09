"""Which engine serves batches; KR16_ENGINE forces one. No NumPy is imported to ask."""

from __future__ import annotations

import os
from importlib.util import find_spec

from kr16cli.errors import InputError, MissingPartError

ENGINES = ("native", "numpy")


def has_native() -> bool:
    """Whether this installation has the compiled kernels."""
    return find_spec("kr16cli.kernels._native") is not None


def engine_name() -> str:
    """Name of the engine that serves: the environment's KR16_ENGINE, else the fastest here.

    Raises:
        InputError: KR16_ENGINE names no engine. MissingPartError: one that is not built.
    """
    name = os.environ.get("KR16_ENGINE", "").strip().lower()
    if not name:
        return "native" if has_native() else "numpy"
    if name not in ENGINES:
        raise InputError(f"KR16_ENGINE is {name!r}; choose {' or '.join(ENGINES)}")
    if name == "native" and not has_native():
        raise MissingPartError(
            "the native engine that KR16_ENGINE asks for",
            None,
            "install kr16cli again where there is a C compiler, or unset KR16_ENGINE",
        )
    return name
