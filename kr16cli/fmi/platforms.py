"""Platforms whose libraries this machine can run, natively, under wine or under qemu.

A small program in C, fmu/host/host.c, loads a native FMU's library as any tool would. It is
compiled for each platform, and runs in a scratch folder.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from kr16cli.assets import asset
from kr16cli.errors import CheckFailedError, FileError
from kr16cli.fmi.compiling import find_compiler
from kr16cli.fmi.native.toolchain import TARGETS, host

WORDS = {
    "linux64": "Linux x86_64", "win64": "Windows x86_64", "win32": "Windows x86",
    "linux-aarch64": "Linux aarch64", "macos-x86_64": "macOS x86_64", "macos-arm64": "macOS arm64",
}  # fmt: skip
"""What a platform is called, by its name in `TARGETS`."""

_LONGEST = 600.0
_ARM_LIBRARIES = Path("/usr/aarch64-linux-gnu")
_HOST, _HEADERS = "fmu/host/host.c", "fmu/native/include"


class Job(NamedTuple):
    """What the program is to do: `rows` first and last, `inputs` by row for rows first to last.

    `save` is the row before whose step the state is serialized into the file `state`; without
    it, the run begins with the state of that file, or anew where `state` is empty.
    """

    library: bytes
    token: str
    version: int
    exchange: bool
    step: float
    parts: int
    rows: tuple[int, int]
    references: tuple[Sequence[int], Sequence[int]]
    inputs: Sequence[Sequence[float]]
    save: int = -1
    state: str = ""


class UnusableError(Exception):
    """Programs for a platform cannot be made or run here; says why."""


class Runner:
    """Runs the program for platforms, in a scratch folder; a context manager."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="kr16_host_", ignore_cleanup_errors=True)
        self._ready: dict[str, tuple[str, ...]] = {}
        self._refused: dict[str, str] = {}

    def __enter__(self) -> Runner:
        return self

    def __exit__(self, *details: object) -> None:
        server = shutil.which("wineserver")
        if server and (self._here / "wine").exists():
            self._call((server, "-w"))  # it writes into the folder until it ends
        self._folder.cleanup()

    @property
    def _here(self) -> Path:
        return Path(self._folder.name)

    def words(self, platform: str) -> str:
        """The platform, and by what it is run if not natively."""
        return " ".join([WORDS[platform], *(f"({w})" for w in _emulator(platform)[:1])])

    def prepare(self, platform: str) -> None:
        """Compile the program for a platform and try it; the second time nothing is done.

        Raises:
            UnusableError: it cannot be made or run here.
        """
        if platform in self._refused:
            raise UnusableError(self._refused[platform])
        if platform not in self._ready:
            try:
                self._ready[platform] = self._made(platform)
            except (UnusableError, FileError) as reason:
                self._refused[platform] = str(reason)
                raise UnusableError(str(reason)) from None

    def _made(self, platform: str) -> tuple[str, ...]:
        """The words that run the program of a platform, compiled and tried."""
        command = _runner(platform)
        program = f"host_{platform}" + (".exe" if platform.startswith("win") else "")
        compiler = find_compiler() if platform == host() else None
        if compiler is None and importlib.util.find_spec("ziglang") is None:
            raise UnusableError("there is no compiler for it; pip install ziglang")
        made = self._call(_compile(compiler, platform, program))
        if made.returncode:
            raise UnusableError(f"the host does not compile: {made.stderr.strip()[:200]}")
        words = (*command, f"./{program}")
        if "usage" not in self._call(words).stderr:
            raise UnusableError(f"{command[0] if command else 'this machine'} does not run it")
        return words

    def run(self, platform: str, job: Job) -> list[tuple[float, ...]]:
        """The outputs of each row of a job.

        Raises:
            CheckFailedError: the program failed, with what it said.
            UnusableError: programs for the platform cannot run here.
        """
        self.prepare(platform)
        name = f"KR16{TARGETS[platform].suffix}"
        (self._here / name).write_bytes(job.library)
        answer = self._here / "answer.txt"
        answer.unlink(missing_ok=True)
        local = name if platform.startswith("win") else f"./{name}"
        (self._here / "job.txt").write_text("\n".join(_lines(job, local)), encoding="ascii")
        done = self._call((*self._ready[platform], "job.txt", answer.name))
        if done.returncode:
            said = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise CheckFailedError(f"the C host ended with code {done.returncode}: {said}")
        rows = answer.read_text(encoding="ascii").splitlines()
        return [tuple(map(_number, row.split())) for row in rows]

    def _call(self, command: Sequence[str]) -> subprocess.CompletedProcess[str]:
        quiet = {
            "WINEPREFIX": str(self._here / "wine"), "WINEDEBUG": "-all",
            "WINEDLLOVERRIDES": "mscoree=;mshtml=;winemenubuilder.exe=",
        }  # fmt: skip
        try:
            return subprocess.run(
                command, cwd=self._here, env=os.environ | quiet, capture_output=True, text=True,
                errors="replace", timeout=_LONGEST, check=False,
            )  # fmt: skip
        except (OSError, subprocess.SubprocessError) as error:
            raise FileError(command[0], f"cannot be run: {error}") from None


def _compile(compiler: str | None, platform: str, program: str) -> list[str]:
    """The command that compiles the program; zig's shares what it has built for the libraries."""
    source, flags = str(asset(_HOST)), ["-std=c11", "-ffp-contract=off", "-I", str(asset(_HEADERS))]
    if compiler:
        return [compiler, *flags, "-O1", "-o", program, source, "-ldl"]
    return [
        sys.executable, "-m", "ziglang", "build-exe", "-target", TARGETS[platform].zig,
        "-O", "ReleaseSmall", "-fstrip", "-lc", "--name", "host", f"-femit-bin={program}",
        "-cflags", *flags, "--", source,
    ]  # fmt: skip


def _emulator(platform: str) -> tuple[str, ...]:
    """The command that runs another platform's programs here; nothing for our own."""
    if platform == host():
        return ()
    if platform.startswith("win"):
        return ("wine",)
    if platform.startswith("linux") and sys.platform == "linux":
        libraries = ("-L", str(_ARM_LIBRARIES)) if platform == "linux-aarch64" else ()
        return (f"qemu-{TARGETS[platform].ours[1]}", *libraries)
    raise UnusableError("nothing here runs its programs")


def _runner(platform: str) -> tuple[str, ...]:
    command = _emulator(platform)
    if command and shutil.which(command[0]) is None:
        raise UnusableError(f"{command[0]} is not installed")
    return command


def _lines(job: Job, library: str) -> list[str]:
    """The job as the program reads it."""
    state = job.state or "-"
    files = ("-", state) if job.save >= 0 else (state, "-")
    head = (library, job.token, job.version, int(job.exchange), _bits(job.step), job.parts,
            *job.rows, job.save, *files)  # fmt: skip
    lists = [" ".join(map(str, (len(r), *r))) for r in job.references]
    rows = [" ".join(map(_bits, row)) for row in job.inputs]
    return [*map(str, head), *lists, *rows, ""]


def _bits(value: float) -> str:
    return struct.pack(">d", value).hex()


def _number(bits: str) -> float:
    value: float = struct.unpack(">d", bytes.fromhex(bits))[0]
    return value
