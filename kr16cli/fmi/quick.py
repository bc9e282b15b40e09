"""The written-out functions as a compiled module of Python's stable ABI, for Linux on x86-64.

An FMU carries it beside the same functions in Python, which serve where it cannot be loaded.
"""

from __future__ import annotations

import sysconfig
from functools import lru_cache
from pathlib import Path

from kr16cli.assets import asset
from kr16cli.fmi import compiling, written

MODULE = "quick.abi3.so"


def headers() -> Path | None:
    """The folder of Python.h, or None where this Python came without (Debian: python3-dev)."""
    folder = Path(sysconfig.get_paths()["include"])
    return folder if (folder / "Python.h").is_file() else None


@lru_cache(maxsize=4)
def compiled(compiler: str) -> bytes:
    """The module; empty without the headers.

    Every operation is rounded as Python rounds it, on each machine: no contraction, no
    instructions beyond x86-64's first.

    Raises:
        CheckFailedError: the compiler did not make it.
    """
    folder = headers()
    if folder is None:
        return b""
    sources = {
        "quick.c": asset("fmu/quick/quick.c").read_text(encoding="utf-8"),
        "functions.h": written.c(),
    }
    options = ("-ffp-contract=off", f"-I{folder}", "-lm")
    return compiling.library(compiler, "the compiled functions", sources, options)
