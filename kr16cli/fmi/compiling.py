"""Compile C into a shared library, the same bytes for the same sources and compiler."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from kr16cli.errors import CheckFailedError, FileError

_FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra", "-fPIC", "-shared", "-fvisibility=hidden",
          "-Wl,--build-id=none", "-s")  # fmt: skip


def find_compiler() -> str | None:
    """A C compiler of this machine: $CC, cc, gcc or clang; None off Linux on x86-64."""
    if os.name != "posix" or os.uname().sysname != "Linux" or os.uname().machine != "x86_64":
        return None
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found:
            return found
    return None


def library(compiler: str, what: str, sources: Mapping[str, str], options: Sequence[str]) -> bytes:
    """A shared library.

    Args:
        compiler: the C compiler.
        what: is compiled, for messages.
        sources: text by file name; those that end in .c are compiled.
        options: further words of the command.

    Raises:
        CheckFailedError: the compiler did not make it, with its first complaint.
        FileError: the compiler cannot be run.
    """
    with tempfile.TemporaryDirectory(prefix="kr16_compile_") as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        files = sorted(name for name in sources if name.endswith(".c"))
        command = [compiler, *_FLAGS, "-o", "made.so", *files, *options]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, check=False, timeout=120
            )
        except (OSError, subprocess.SubprocessError) as error:
            raise FileError(compiler, f"cannot be run: {error}; give --no-shim") from None
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line] or ["no message"]
            raise CheckFailedError(
                f"{compiler} cannot build {what}: {lines[0]}; give --no-shim for an FMU without "
                "compiled parts"
            )
        return (Path(folder) / "made.so").read_bytes()
