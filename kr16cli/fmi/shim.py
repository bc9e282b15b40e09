"""The shim: the library of the FMU on Linux that finds libpython and forwards to pythonfmu's.

pythonfmu's own library expects Python's symbols in the process, which only Python has.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from kr16cli.assets import asset
from kr16cli.fmi import compiling

FOLDER = "binaries/linux64"
WRAPPER = "libpythonfmu-export.so"


@lru_cache(maxsize=4)
def compiled(compiler: str) -> bytes:
    """The shim as a shared library.

    Raises:
        CheckFailedError: the compiler did not make it, with its first complaint.
    """
    files = sorted(path for path in asset("fmu/shim").iterdir() if path.suffix in (".c", ".h"))
    sources = {path.name: path.read_text(encoding="utf-8") for path in files}
    options = ("-Wl,-z,defs", "-ldl", "-pthread")
    return compiling.library(compiler, "the shim", sources, options)


def put_in(entries: Mapping[str, bytes], library: bytes, model: str, guid: str) -> dict[str, bytes]:
    """The entries of an FMU with the shim as its library and pythonfmu's beside it."""
    own = f"{FOLDER}/{model}.so"
    found = dict(entries)
    found[f"{FOLDER}/{WRAPPER}"] = found[own]
    found[own] = library
    found["resources/guid.txt"] = f"{guid}\n".encode()
    return found
