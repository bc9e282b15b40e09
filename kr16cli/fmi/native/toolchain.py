"""Compile the library of a native FMU: for this machine, or with zig for others."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from kr16cli.errors import CheckFailedError, FileError, MissingPartError

_FLAGS = ("-std=c11", "-DNDEBUG", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden",
          "-fno-tree-vectorize", "-Wall", "-Wextra")  # fmt: skip
"""Without contraction to multiply-adds, all platforms give the same numbers."""

_COMPACT = ("-fno-slp-vectorize", "-fno-unroll-loops")
"""What clang would do for speed without gain here. For the same reason its -Os is quick."""

QUICK = ("kr16_stepped.c", "trig.c", "plant.c", "control.c", "ode.c", "steps.c", "tape.c",
         "machine.c", "values.c", "setup.c")  # fmt: skip
"""What runs thousands of times; the rest is made small."""


class Target(NamedTuple):
    """A platform: its folders in FMI 2.0 (or none) and 3.0, zig's name of it, file suffix.

    `ours` is Python's (sys.platform, machine) of it.
    """

    folder2: str
    folder3: str
    zig: str
    suffix: str
    ours: tuple[str, str]


TARGETS = {
    "linux64": Target("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so",
                      ("linux", "x86_64")),
    "win64": Target("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll", ("win32", "amd64")),
    "win32": Target("win32", "x86-windows", "x86-windows-gnu", ".dll", ("win32", "x86")),
    "linux-aarch64": Target("", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so",
                            ("linux", "aarch64")),
    "macos-x86_64": Target("darwin64", "x86_64-darwin", "x86_64-macos.10.13", ".dylib",
                           ("darwin", "x86_64")),
    "macos-arm64": Target("darwin64", "aarch64-darwin", "aarch64-macos.11.0", ".dylib",
                          ("darwin", "arm64")),
}  # fmt: skip
"""Platforms by the names that `--platforms` takes."""


def host() -> str | None:
    """The name of this machine's platform, or None if it is none of them."""
    known = hasattr(os, "uname")
    machine = os.uname().machine if known else os.environ.get("PROCESSOR_ARCHITECTURE", "")
    ours = (sys.platform, machine.lower())
    return next((name for name, target in TARGETS.items() if target.ours == ours), None)


def compiled(files: Mapping[str, str], target: str, compiler: str | None) -> bytes:
    """The shared library of C files.

    Args:
        files: text by name.
        target: name of the platform.
        compiler: a C compiler of this machine, whose platform is the target; None for zig.

    Raises:
        MissingPartError: zig is needed and PyPI's ziglang is not installed.
        CheckFailedError: it did not compile, with the first complaint.
        FileError: the compiler cannot be run.
    """
    units = [name for name in files if name.endswith(".c")]
    with tempfile.TemporaryDirectory(prefix="kr16_native_") as folder:
        here = Path(folder)
        for name, text in files.items():
            (here / name).write_bytes(text.encode())
        output = f"KR16{TARGETS[target].suffix}"
        steps = _by_host(compiler, units, output) if compiler else _by_zig(units, target, output)
        for command in steps:
            _run(command, folder, target)
        return (here / output).read_bytes()


def _split(units: Sequence[str]) -> tuple[list[str], list[str]]:
    return [u for u in units if u in QUICK], [u for u in units if u not in QUICK]


def _by_host(compiler: str, units: Sequence[str], output: str) -> list[list[str]]:
    """Commands of a compiler of this machine (Linux): quick parts, small parts, linking."""
    quick, small = _split(units)
    flags = [*_FLAGS, "-fPIC", "-fno-asynchronous-unwind-tables", "-fno-unwind-tables"]
    objects = [f"{name.removesuffix('.c')}.o" for name in units]
    return [
        *([compiler, *flags, "-O2", "-c", *quick] for _ in quick[:1]),
        [compiler, *flags, "-Os", "-c", *small],
        [compiler, "-shared", "-s", "-Wl,--build-id=none", "-Wl,--hash-style=gnu",
         "-Wl,-z,noseparate-code", "-Wl,-z,defs",
         "-o", output, *objects, "-lm"],
    ]  # fmt: skip


def _by_zig(units: Sequence[str], target: str, output: str) -> list[list[str]]:
    """The command of zig for a platform."""
    if importlib.util.find_spec("ziglang") is None:
        raise MissingPartError("ziglang", "cross")
    platform = TARGETS[target]
    quick, small = _split(units)
    more = {
        ".so": ["-fno-unwind-tables"],
        ".dll": ["-fno-compiler-rt"],  # 50 kB in every DLL; probe.c has what is needed of it
        ".dylib": ["-fno-unwind-tables", "-headerpad", "20", "-install_name", f"@rpath/{output}"],
    }
    flags = [*_FLAGS, *_COMPACT, *(("-DKR16_PROBE",) if platform.suffix == ".dll" else ())]
    return [[
        sys.executable, "-m", "ziglang", "build-lib", "-dynamic", "-target", platform.zig,
        "-O", "ReleaseSmall", "-fstrip", "-lc", "--name", "KR16", f"-femit-bin={output}",
        *more[platform.suffix],
        "-cflags", *flags, "-Os", "--", *quick, "-cflags", *flags, "-Oz", "--", *small,
    ]]  # fmt: skip


def _run(command: Sequence[str], folder: str, target: str) -> None:
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, check=False, timeout=900
        )
    except (OSError, subprocess.SubprocessError) as error:
        raise FileError(command[0], f"cannot be run: {error}") from None
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line] or ["no message"]
        name = "zig" if "ziglang" in command else command[0]
        raise CheckFailedError(f"{name} cannot build the FMU for {target}: {lines[0]}")
