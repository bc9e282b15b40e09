"""The shim: the library of the FMU on Linux that finds libpython and forwards to pythonfmu's.

pythonfmu's own library expects Python's symbols in the process, which only Python has.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from kr16cli.assets import asset
from kr16cli.errors import CheckFailedError, FileError

FOLDER = "binaries/linux64"
WRAPPER = "libpythonfmu-export.so"
_FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra", "-fPIC", "-shared", "-fvisibility=hidden",
          "-Wl,--build-id=none", "-Wl,-z,defs", "-s")  # fmt: skip


def find_compiler() -> str | None:
    """A C compiler of this machine: $CC, cc, gcc or clang; None off Linux on x86-64."""
    if os.name != "posix" or os.uname().sysname != "Linux" or os.uname().machine != "x86_64":
        return None
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found:
            return found
    return None


@lru_cache(maxsize=4)
def compiled(compiler: str) -> bytes:
    """The shim as a shared library.

    Raises:
        CheckFailedError: the compiler did not make it, with its first complaint.
    """
    source = asset("fmu/shim/shim.c")
    with tempfile.TemporaryDirectory(prefix="kr16_shim_") as folder:
        shutil.copy(source, folder)
        command = [compiler, *_FLAGS, "-o", "shim.so", source.name, "-ldl", "-pthread"]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, check=False, timeout=120
            )
        except (OSError, subprocess.SubprocessError) as error:
            raise FileError(compiler, f"cannot be run: {error}; give --no-shim") from None
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line] or ["no message"]
            raise CheckFailedError(f"{compiler} cannot build the shim: {lines[0]}; give --no-shim")
        return (Path(folder) / "shim.so").read_bytes()


def put_in(entries: Mapping[str, bytes], library: bytes, model: str, guid: str) -> dict[str, bytes]:
    """The entries of an FMU with the shim as its library and pythonfmu's beside it."""
    own = f"{FOLDER}/{model}.so"
    found = dict(entries)
    found[f"{FOLDER}/{WRAPPER}"] = found[own]
    found[own] = library
    found["resources/guid.txt"] = f"{guid}\n".encode()
    return found
