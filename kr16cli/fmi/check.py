"""Check an FMU: its description, its states, and its motion against the direct simulator."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from kr16cli.errors import CheckFailedError, InputError
from kr16cli.fmi import play, variables
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.reading import Fmu
from kr16cli.fmi.variables import JOINTS, Part, Start, table
from kr16cli.robot import RobotData
from kr16cli.robot_file import load_data
from kr16cli.single import Arm

SCHEMA = "kr16.fmu_check/1"
EQUAL_STEPS = 1e-9
"""Largest relative deviation allowed where both take the same steps: round-off, grown by 1 s of
motion."""

OWN_STEPS = 1e-5
"""The same for an FMU that steps in its own way."""

_COMPARED = ("q", "qd", "qdd", "tau_applied", "pose", "energy", "tau")
_SIZES = {"q": 1.0, "qd": 1.0, "qdd": 10.0, "tau_applied": 100.0, "tau": 100.0, "pose": 1.0,
          "energy": 100.0}  # fmt: skip


class Deviation(NamedTuple):
    """Largest deviation of a group of outputs, its unit, when, and over the group's size."""

    group: str
    largest: float
    unit: str
    time: float
    relative: float


class Report(NamedTuple):
    """What a check found; it passed if `problems` is empty."""

    problems: list[str]
    deviations: list[Deviation]
    tolerance: float
    steps: int


def check(fmu: Fmu, robot: RobotData | None, tolerance: float | None = None) -> Report:
    """Check an FMU.

    Args:
        fmu: the FMU, ours or another with the same variables.
        robot: what it should move like; None takes the numbers inside an FMU of ours, else the
            KR 16-2.
        tolerance: largest deviation over the size of a quantity; None chooses by whose FMU
            it is.

    Raises:
        MissingPartError: FMPy is not installed.
    """
    path = str(Path(fmu.path).resolve())
    problems = list(play.ask("validate", fmu=path)["problems"])
    own = fmu.cargo is not None
    if own:
        problems += _states(path, fmu)
    data = robot or (fmu.cargo.data if fmu.cargo else load_data())
    if fmu.cargo and robot and robot.sha256 != fmu.cargo.data.sha256:
        problems.append(
            f"the FMU holds {fmu.cargo.data.name}, model {fmu.cargo.data.sha256[:12]}; "
            f"{robot.path} is model {robot.sha256[:12]}"
        )
    allowed = tolerance or (EQUAL_STEPS if own else OWN_STEPS)
    stop, step = 1.0, 0.01
    deviations: list[Deviation] = []
    try:
        found = _Comparison(fmu, data, stop, step)
        if not found.shared:
            problems.append("no output is named like ours; nothing can be compared")
            return Report(problems, [], allowed, 0)
        deviations, trouble = found.run()
        problems += trouble
    except InputError as error:
        problems.append(f"the direct simulator refuses it: {error}")
    problems += [
        f"{d.group} deviates by {d.largest:.3g} {d.unit} at {d.time:g} s, {d.relative:.3g} of its "
        f"size; at most {allowed:g} is allowed"
        for d in deviations
        if not d.relative <= allowed
    ]
    return Report(problems, deviations, allowed, round(stop / step))


def _states(path: str, fmu: Fmu) -> list[str]:
    """What is wrong with saving, restoring and resetting."""
    answer = play.ask("states", fmu=path, step=fmu.number("stepSize") or 0.01)
    if "failure" in answer:
        return [f"saving and restoring failed: {answer['failure']}"]
    return [f"{what} does not repeat the run" for what in answer["differing"]]


class _Comparison:
    """The same inputs to the FMU and to the direct simulator."""

    def __init__(self, fmu: Fmu, data: RobotData, stop: float, step: float) -> None:
        self._fmu, self._stop, self._step = fmu, stop, step
        starts = fmu.starts()
        part = Part(fmu.cargo.about["part"]) if fmu.cargo else Part.ROBOT
        q = [starts.get(name, 0.0) for name in variables.six("q_start")]
        self._table = table(data, Start(q=q, gravity=data.gravity), part)
        names = {v.name for v in fmu.variables if v.causality == "output"}
        self.shared = [
            v.name for v in self._table if v.name in names and variables.group(v.name) in _COMPARED
        ]
        self._machine = Machine(self._table, data, Arm, part)
        self._places = {v.name: k for k, v in enumerate(self._table)}
        for v in self._table:
            if v.causality != "output" and v.name in starts:
                self._machine.set([self._places[v.name]], [starts[v.name]])
        self._inputs = self._signals(q, {v.name for v in fmu.variables if v.causality == "input"})

    def _signals(self, q: Sequence[float], there: set[str]) -> dict[str, list[float]]:
        """Inputs for the run: slow, small waves about what keeps the arm near its start."""
        count = round(self._stop / self._step) + 1
        times = [k * self._step for k in range(count)]
        waves: dict[str, list[float]] = {}
        for i in JOINTS:
            w, size = 2.0 + 0.7 * i, 0.03 / i
            swing = [math.sin(w * t) for t in times]
            waves[f"tau[{i}]"] = [(20.0 if i < 4 else 0.2) * v for v in swing]
            for name in ("q_ref", "q"):
                waves[f"{name}[{i}]"] = [q[i - 1] + size * (1.0 - math.cos(w * t)) for t in times]
            for name in ("qd_ref", "qd"):
                waves[f"{name}[{i}]"] = [size * w * v for v in swing]
            waves[f"wrench[{i}]"] = [(5.0 if i < 4 else 0.1) * v for v in swing]
        mine = {v.name for v in self._table if v.causality == "input"}
        return {name: values for name, values in waves.items() if name in there & mine}

    def run(self) -> tuple[list[Deviation], list[str]]:
        """Deviations by group, and what went wrong."""
        count = round(self._stop / self._step) + 1
        times = [k * self._step for k in range(count)]
        signals = play.Signals(times, self._inputs)
        try:
            columns, _ = play.play(self._fmu, signals, self._stop, self._step, {})
        except CheckFailedError as error:
            return [], [str(error)]
        expected = self._direct(times)
        if len(columns["time"]) != count:
            return [], [f"the run has {len(columns['time'])} samples, not {count}"]
        return self._deviations(times, columns, expected), []

    def _direct(self, times: Sequence[float]) -> dict[str, list[float]]:
        """What the direct simulator says, sampled as FMPy samples: before new inputs act."""
        machine, places = self._machine, [self._places[name] for name in self.shared]
        inputs = [self._places[name] for name in self._inputs]
        columns = list(self._inputs.values())
        machine.enter()
        machine.set(inputs, [c[0] for c in columns])
        machine.leave()
        rows = [machine.get(places)]
        for k in range(1, len(times)):
            machine.set(inputs, [c[k - 1] for c in columns])
            machine.step(times[k - 1], times[k] - times[k - 1])
            rows.append(machine.get(places))
        return dict(zip(self.shared, map(list, zip(*rows, strict=True)), strict=True))

    def _deviations(
        self,
        times: Sequence[float],
        columns: Mapping[str, Sequence[float]],
        expected: Mapping[str, Sequence[float]],
    ) -> list[Deviation]:
        """The largest deviation of each group; NaN counts as infinite."""
        worst: dict[str, Deviation] = {}
        units = {v.name: variables.TYPES[v.type].unit for v in self._table}
        for name in self.shared:
            key = variables.group(name)
            for t, a, b in zip(times, columns[name], expected[name], strict=True):
                gap = abs(a - b) if math.isfinite(a) else math.inf
                if key not in worst or gap > worst[key].largest:
                    worst[key] = Deviation(key, gap, units[name], t, gap / _SIZES[key])
        return list(worst.values())


def envelope(fmu: Fmu, report: Report) -> dict[str, Any]:
    """The JSON answer of `kr16 fmu check`."""
    about = fmu.cargo.about if fmu.cargo else {}
    return {
        "schema": SCHEMA,
        "robot": about.get("robot"),
        "model_sha256": about.get("model_sha256"),
        "units": {d.group: d.unit for d in report.deviations},
        "input": {"file": fmu.path},
        "result": {
            "fmi_version": fmu.attributes["fmiVersion"],
            "interface": play.interface(fmu),
            "host": f"FMPy {metadata.version('fmpy')}",
            "platform": f"{platform.system()} {platform.machine()}",
            "passed": not report.problems,
            "problems": report.problems,
            "deviations": [
                {**d._asdict(), "largest": _finite(d.largest), "relative": _finite(d.relative)}
                for d in report.deviations
            ],
            "tolerance": report.tolerance,
            "steps": report.steps,
        },
        "warnings": [],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
