"""The table of FMUs beside the direct simulator: each FMU, interface, host and platform a row."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from kr16cli.errors import CheckFailedError, InputError, MissingPartError
from kr16cli.fmi import build, check, choices, reading
from kr16cli.fmi.compare import STEP, STOP, Comparison, Report
from kr16cli.fmi.compiling import find_compiler
from kr16cli.fmi.native import build as builder
from kr16cli.fmi.native.library import ALL, HOST, MODEL, platforms
from kr16cli.fmi.native.toolchain import TARGETS
from kr16cli.fmi.platforms import WORDS, Job, Runner, UnusableError
from kr16cli.fmi.reading import Fmu
from kr16cli.fmi.variables import Part
from kr16cli.robot import RobotData

SCHEMA = "kr16.fmu_table/1"
KINDS = ("co-simulation", "model-exchange")
"""How a host runs an FMU."""

_HOST = "C host"
_PARTS = 10
"""Runge and Kutta's steps of the C host in each communication step: those of the simulator."""

Row = dict[str, Any]
Tell = Callable[[str], None]


def table(
    data: RobotData,
    tell: Tell = lambda text: None,
    *,
    everywhere: bool = True,
    native: bool = True,
) -> Row:
    """Build the FMUs of a robot and run them by every interface wherever this machine can.

    Args:
        data: the robot, with inertial data.
        tell: is told of each row before it is made.
        everywhere: on all platforms that can be compiled and run, else on this machine's alone.
        native: the native FMUs too, and those of the controller; else the pythonfmu FMU alone.

    Returns:
        The record of schema `kr16.fmu_table/1`.

    Raises:
        InputError: no inertial data.
        MissingPartError: FMPy or pythonfmu is missing.
        CheckFailedError: an FMU does not build.
    """
    notes: list[str] = []
    with tempfile.TemporaryDirectory(prefix="kr16_table_") as folder, Runner() as runner:
        made = _Table(data, Path(folder), runner, notes, tell)
        rows = list(made.rows(everywhere=everywhere) if native else made.first())
    return {
        "schema": SCHEMA,
        "robot": data.name,
        "model_sha256": data.sha256,
        "units": {d["group"]: d["unit"] for row in rows for d in row["deviations"]},
        "input": {"stop": STOP, "step": STEP},
        "result": {"rows": rows},
        "warnings": notes,
    }


class _Table(NamedTuple):
    """The making of one table."""

    data: RobotData
    folder: Path
    runner: Runner
    notes: list[str]
    tell: Tell

    def first(self, part: Part = Part.ROBOT) -> Iterator[Row]:
        """The pythonfmu FMU's row."""
        options, _ = choices.options(self.data, None, part, find_compiler())
        fmu = self._written(_name(part, None), build.build(self.data, options))
        yield self._by_fmpy(fmu, Comparison(fmu, self.data), KINDS[0])

    def rows(self, *, everywhere: bool) -> Iterator[Row]:
        """All rows."""
        crossing = everywhere and find_spec("ziglang") is not None
        if everywhere and not crossing:
            self._note("without ziglang (pip install ziglang) only this machine's library is built")
        for part in Part:
            yield from self.first(part)
            wide = crossing and part is Part.ROBOT
            try:
                for version in (2, 3):
                    chosen = platforms(ALL if wide else HOST, version)
                    yield from self._native_rows(part, version, chosen)
            except (MissingPartError, InputError) as reason:
                self._note(f"no native FMU: {reason}")

    def _native_rows(self, part: Part, version: int, chosen: Sequence[str]) -> Iterator[Row]:
        fmu = self._native_fmu(part, version, chosen)
        compared = Comparison(fmu, self.data)
        for kind in KINDS if part is Part.ROBOT else KINDS[:1]:
            yield self._by_fmpy(fmu, compared, kind)
        for platform in chosen if part is Part.ROBOT else ():
            try:
                self.runner.prepare(platform)
            except UnusableError as reason:
                self._note(f"not run on {WORDS[platform]}: {reason}")
                continue
            for kind in KINDS:
                yield self._by_program(fmu, compared, platform, kind)

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def _native_fmu(self, part: Part, version: int, chosen: Sequence[str]) -> Fmu:
        name = _name(part, version)
        self.tell(f"building {name}")
        usual, _ = choices.options(self.data, None, part, None)
        options = builder.Options(usual.start, part, version=version, platforms=chosen)
        return self._written(name, builder.build(self.data, options))

    def _written(self, name: str, content: bytes) -> Fmu:
        path = self.folder / name
        path.write_bytes(content)
        return reading.read(path)

    def _by_fmpy(self, fmu: Fmu, compared: Comparison, kind: str) -> Row:
        name = Path(fmu.path).name
        self.tell(f"{name} in FMPy, {kind}")
        report = check.check(fmu, self.data, None, kind, compared)
        return {"file": name, **check.envelope(fmu, report, kind)["result"]}

    def _by_program(self, fmu: Fmu, compared: Comparison, platform: str, kind: str) -> Row:
        name, where = Path(fmu.path).name, self.runner.words(platform)
        self.tell(f"{name} in a C host on {where}, {kind}")
        return {
            "file": name,
            "fmi_version": fmu.attributes["fmiVersion"],
            "interface": kind,
            "host": _HOST,
            "platform": where,
            **run(self.runner, platform, fmu, compared, kind).row(),
        }


def _name(part: Part, version: int | None) -> str:
    """The file of an FMU; those of pythonfmu have no version."""
    words = [MODEL, *(["controller"] if part is Part.CONTROLLER else [])]
    return "_".join([*words, *([f"fmi{version}"] if version else [])]) + ".fmu"


def run(runner: Runner, platform: str, fmu: Fmu, compared: Comparison, kind: str) -> Report:
    """What the C host finds: deviations, and whether a saved state goes on alike elsewhere.

    In model exchange the host takes the steps that the simulator takes.

    Raises:
        UnusableError: the platform's programs do not run here.
    """
    problems: list[str] = []
    job = _job(platform, fmu, compared, kind)
    last, middle = job.rows[1], job.rows[1] // 2
    try:
        rows = runner.run(platform, job._replace(save=middle, state="state.bin"))
        later = job._replace(
            rows=(middle, last), inputs=job.inputs[middle:], state="state.bin"
        )  # fmt: skip
        if runner.run(platform, later) != rows[middle:]:
            problems.append("a state serialized and set in another process does not go on alike")
    except CheckFailedError as error:
        return Report([str(error)], [], check.EQUAL_STEPS, last)
    columns = dict(zip(compared.shared, zip(*rows, strict=True), strict=True))
    return compared.report(columns, problems, check.EQUAL_STEPS)


def _job(platform: str, fmu: Fmu, compared: Comparison, kind: str) -> Job:
    """The whole run; value references count from 1 in the order of the description."""
    places = {v.name: place for place, v in enumerate(fmu.variables, 1)}
    token = fmu.attributes.get("guid") or fmu.attributes["instantiationToken"]
    rows = list(zip(*compared.inputs.values(), strict=True))
    return Job(
        library=_library(fmu, platform),
        token=token,
        version=int(fmu.attributes["fmiVersion"][0]),
        exchange=kind == KINDS[1],
        step=STEP,
        parts=_PARTS,
        rows=(0, len(compared.times) - 1),
        references=([places[n] for n in compared.inputs], [places[n] for n in compared.shared]),
        inputs=rows,
    )


def _library(fmu: Fmu, platform: str) -> bytes:
    """The library of a platform out of an FMU."""
    target = TARGETS[platform]
    version = int(fmu.attributes["fmiVersion"][0])
    folder = target.folder2 if version == 2 else target.folder3
    with zipfile.ZipFile(fmu.path) as archive:
        return archive.read(f"binaries/{folder}/{MODEL}{target.suffix}")
