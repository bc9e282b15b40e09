"""The C of a native FMU: hand-written files, the printed model, and the numbers of a robot."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from kr16cli.assets import asset
from kr16cli.errors import FileError
from kr16cli.fmi.native import names, numbers, traced

NATIVE, TRACK = "fmu/native", "fmu/track"
ROBOT, MOTION = "kr16_robot_data.h", "kr16_track_data.h"
_KERNELS = ("ode.c", "ode.h", "kr16_math.h")


@lru_cache(maxsize=1)
def common() -> dict[str, str]:
    """Text by file name of all that is the same for every robot, sorted."""
    folder = asset(NATIVE)
    files = [*folder.glob("*.[ch]"), *(folder / "include").glob("*.h"), *map(_kernel, _KERNELS)]
    found = {file.name: text_of(file) for file in files}
    found["kr16_model.h"] = traced.model_h()
    found["kr16_model.c"] = traced.model_c()
    found["kr16_stepped.c"] = traced.stepped_c()
    found["kr16_tapes.c"] = traced.tapes_c()
    return dict(sorted(names.prefixed(found).items()))


def complete(table: numbers.Table) -> dict[str, str]:
    """The same with the numbers of a robot."""
    return dict(sorted({**common(), ROBOT: numbers.as_c(table)}.items()))


@lru_cache(maxsize=1)
def digest() -> str:
    """SHA-256 of all that is the same for every robot."""
    return _digest(common())


def _digest(files: Mapping[str, str]) -> str:
    found = hashlib.sha256()
    for part in (part.encode() for item in files.items() for part in item):
        found.update(len(part).to_bytes(8, "big") + part)
    return found.hexdigest()


@lru_cache(maxsize=1)
def track_common() -> dict[str, str]:
    """Text by file name of the trajectory source, the same for every motion, sorted."""
    folder = asset(NATIVE)
    shared = [folder / "probe.c", *(folder / "include").glob("fmi2*.h")]
    found = {file.name: text_of(file) for file in (*asset(TRACK).glob("*.[ch]"), *shared)}
    return dict(sorted(names.prefixed(found).items()))


@lru_cache(maxsize=1)
def track_digest() -> str:
    """SHA-256 of all that is the same for every motion."""
    return _digest(track_common())


def units(files: Mapping[str, str] | None = None) -> list[str]:
    """The names to compile: of the files of a robot's FMU, or of others."""
    return [name for name in (common() if files is None else files) if name.endswith(".c")]


def _kernel(name: str) -> Path:
    """A file that the FMU shares with the compiled kernels."""
    return Path(__file__).resolve().parents[2] / "kernels" / "native" / name


def text_of(file: Path) -> str:
    """The text of an asset; FileError with what to do where it cannot be read."""
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise FileError(file, f"cannot be read: {reason}; reinstall kr16cli") from None
