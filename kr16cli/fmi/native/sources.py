"""The C of a native FMU: hand-written files, the printed model, and the numbers of a robot."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from kr16cli.assets import asset
from kr16cli.errors import FileError
from kr16cli.fmi.native import numbers, traced

NATIVE = "fmu/native"
ROBOT = "kr16_robot_data.h"
_KERNELS = ("ode.c", "ode.h", "kr16_math.h")


@lru_cache(maxsize=1)
def common() -> dict[str, str]:
    """Text by file name of all that is the same for every robot, sorted."""
    folder = asset(NATIVE)
    files = [*folder.glob("*.[ch]"), *(folder / "include").glob("*.h"), *map(_kernel, _KERNELS)]
    found = {file.name: _text(file) for file in files}
    found["kr16_model.h"] = traced.model_h()
    found["kr16_model.c"] = traced.model_c()
    found["kr16_tapes.c"] = traced.tapes_c()
    return dict(sorted(found.items()))


def complete(table: numbers.Table) -> dict[str, str]:
    """The same with the numbers of a robot."""
    return dict(sorted({**common(), ROBOT: numbers.as_c(table)}.items()))


@lru_cache(maxsize=1)
def digest() -> str:
    """SHA-256 of all that is the same for every robot."""
    found = hashlib.sha256()
    for part in (part.encode() for item in common().items() for part in item):
        found.update(len(part).to_bytes(8, "big") + part)
    return found.hexdigest()


def units() -> list[str]:
    """The names to compile."""
    return [name for name in common() if name.endswith(".c")]


def _kernel(name: str) -> Path:
    """A file that the FMU shares with the compiled kernels."""
    return Path(__file__).resolve().parents[2] / "kernels" / "native" / name


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise FileError(file, f"cannot be read: {reason}; reinstall kr16cli") from None
