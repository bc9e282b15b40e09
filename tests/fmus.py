"""FMUs built once for all tests, and a host that drives one by the calls of FMI 2.0."""

from __future__ import annotations

import atexit
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy
import pytest
from fmpy import fmi2

import kr16cli
from kr16cli.fmi import build, choices, compiling
from kr16cli.fmi.variables import Part, Start

BENT = tuple(map(math.radians, (0.0, -60.0, 60.0, 0.0, 30.0, 0.0)))
Q = [f"q[{i}]" for i in range(1, 7)]
QD = [f"qd[{i}]" for i in range(1, 7)]
TAU = [f"tau[{i}]" for i in range(1, 7)]
TESTS = Path(__file__).resolve().parent
SHIM = [False, pytest.param(True, marks=pytest.mark.skipif(
    compiling.find_compiler() is None, reason="no C compiler for the shim"))]  # fmt: skip
"""Without and with the parts in C."""


@lru_cache
def content(
    start: Start | None = None, part: Part = Part.ROBOT, *, with_shim: bool = False
) -> bytes:
    """An FMU of the KR 16-2."""
    compiler = compiling.find_compiler() if with_shim else None
    options, _ = choices.options(kr16cli.load_data(), None, part, compiler)
    return build.build(kr16cli.load_data(), options._replace(start=start or options.start))


@lru_cache
def file(start: Start | None = None, part: Part = Part.ROBOT, *, with_shim: bool = False) -> Path:
    """The same as a file that lives as long as the tests."""
    folder = tempfile.TemporaryDirectory(prefix="kr16_tests_")
    atexit.register(folder.cleanup)
    path = Path(folder.name) / "KR16.fmu"
    path.write_bytes(content(start, part, with_shim=with_shim))
    return path


class Host:
    """One instance of an FMU.

    Args:
        path: the FMU.
        folder: where it is unpacked already, or None.
        resources: resource location to pass in place of the right one.
    """

    def __init__(self, path: Path, folder: str | None = None, resources: str | None = None) -> None:
        self.description = fmpy.read_model_description(str(path))
        self.folder = folder or fmpy.extract(str(path))
        self.messages: list[tuple[int, str]] = []
        self.slave = fmi2.FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="tested",
        )
        self._references = {v.name: v for v in self.description.modelVariables}
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._log)
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self._callbacks = callbacks
        if resources is not None:
            self.slave.unzipDirectory = resources
        self.slave.instantiate(callbacks=callbacks, loggingOn=True)

    def _log(self, _: Any, name: Any, status: int, category: Any, message: bytes) -> None:
        self.messages.append((status, message.decode()))

    def begin(self, **values: float) -> None:
        """Set parameters (dots written as __) and initialize at time 0."""
        self.slave.setupExperiment(startTime=0.0)
        for name, value in values.items():
            self.set([name.replace("__", ".")], [value])
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def set(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set values, each by the call of its type."""
        for name, value in zip(names, values, strict=True):
            variable = self._references[name]
            call = getattr(self.slave, f"set{variable.type}")
            call([variable.valueReference], [value])

    def get(self, names: Sequence[str]) -> list[float]:
        """Real values."""
        return list(self.slave.getReal([self._references[n].valueReference for n in names]))

    def steps(self, count: int, size: float, start: float = 0.0) -> None:
        """Equal communication steps."""
        for k in range(count):
            self.slave.doStep(start + k * size, size)

    def free(self) -> None:
        """End and free the instance."""
        self.slave.freeInstance()


@contextmanager
def hosted(path: Path, folder: str | None = None) -> Iterator[Host]:
    """An instance that is freed in the end."""
    host = Host(path, folder)
    try:
        yield host
    finally:
        host.free()


def isolated(code: str, *arguments: object) -> str:
    """What code prints in a process of its own; a crash of the FMU would end only that."""
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", code, *map(str, arguments)],
        capture_output=True, text=True, timeout=300, check=False,
        env={"PYTHONPATH": f"{TESTS}:{TESTS.parent}", "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout
