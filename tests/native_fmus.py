"""Native FMUs built once for all tests, and instances of them in FMPy."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy
from fmpy import fmi2, fmi3

import kr16cli
from kr16cli.fmi import choices
from kr16cli.fmi.native import build
from kr16cli.fmi.native.library import platforms
from kr16cli.fmi.variables import Part, Start

_KEPT: list[tempfile.TemporaryDirectory[str]] = []


@lru_cache
def content(
    version: int = 2, part: Part = Part.ROBOT, start: Start | None = None, *, arrays: bool = False
) -> bytes:
    """A native FMU of the KR 16-2 for this machine."""
    data = kr16cli.load_data()
    usual, _ = choices.options(data, None, part, None)
    options = build.Options(
        start or usual.start, part, version=version, platforms=platforms("host", version),
        arrays=arrays,
    )  # fmt: skip
    return build.build(data, options)


@lru_cache
def file(
    version: int = 2, part: Part = Part.ROBOT, start: Start | None = None, *, arrays: bool = False
) -> Path:
    """The same as a file that lives as long as the tests."""
    folder = tempfile.TemporaryDirectory(prefix="kr16_tests_")
    _KEPT.append(folder)
    path = Path(folder.name) / "KR16.fmu"
    path.write_bytes(content(version, part, start, arrays=arrays))
    return path


@lru_cache
def unpacked(path: Path) -> tuple[str, Any]:
    """Folder and description of an FMU."""
    folder = tempfile.TemporaryDirectory(prefix="kr16_tests_")
    _KEPT.append(folder)
    return fmpy.extract(str(path), folder.name), fmpy.read_model_description(str(path))


_CLASSES = {
    (2, False): fmi2.FMU2Slave, (2, True): fmi2.FMU2Model,
    (3, False): fmi3.FMU3Slave, (3, True): fmi3.FMU3Model,
}  # fmt: skip


class Instance:
    """An instance spoken to by names of variables; its calls are FMPy's, in `fmu`."""

    def __init__(self, path: Path, *, exchange: bool = False, events: bool = False) -> None:
        folder, self.description = unpacked(path)
        self.version = int(self.description.fmiVersion[0])
        self.messages: list[str] = []
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.fmu = _CLASSES[self.version, exchange](
            guid=self.description.guid, unzipDirectory=folder, modelIdentifier="KR16",
            instanceName="tested",
        )  # fmt: skip
        self._instantiate({"eventModeUsed": True} if events else {})

    def _instantiate(self, more: dict[str, bool]) -> None:
        if self.version == 3:
            self._log = fmi3.fmi3LogMessageCallback(self._heard3)
            self.fmu.instantiate(loggingOn=True, logMessage=self._log, **more)
            return
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._heard2)
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self._callbacks = callbacks
        self.fmu.instantiate(callbacks=callbacks, loggingOn=True)

    def _heard2(self, _: Any, name: Any, status: int, category: Any, message: bytes) -> None:
        self.messages.append(message.decode())

    def _heard3(self, _: Any, status: int, category: Any, message: bytes) -> None:
        self.messages.append(message.decode())

    def begin(self, **values: float) -> Instance:
        """Set variables (dots written as __) and initialize at time 0."""
        if self.version == 2:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=0.0)
        for name, value in values.items():
            self.set([name.replace("__", ".")], [value])
        self.fmu.exitInitializationMode()
        return self

    def references(self, names: Sequence[str]) -> list[int]:
        return [self.variables[name].valueReference for name in names]

    def set(self, names: Sequence[str], values: Sequence[float]) -> None:
        """Set values, each by the call of its type."""
        for name, value in zip(names, values, strict=True):
            call = getattr(self.fmu, f"set{self.variables[name].type}")
            call(self.references([name]), [value])

    def get(self, names: Sequence[str]) -> list[float]:
        """Values of any type as numbers."""
        call = self.fmu.getReal if self.version == 2 else self.fmu.getFloat64
        return [float(v) for v in call(self.references(names))]

    def states(self, x: Sequence[float]) -> None:
        """Set the continuous states."""
        self.fmu.setContinuousStates((ctypes.c_double * 12)(*x), 12)

    def step(self, time: float, size: float) -> None:
        """One communication step."""
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=size)

    def close(self) -> None:
        self.fmu.freeInstance()
