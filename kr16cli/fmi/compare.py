"""An FMU beside the direct simulator: the same inputs to both, and how far they differ."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from kr16cli.fmi import variables
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.play import Signals
from kr16cli.fmi.reading import Fmu
from kr16cli.fmi.variables import JOINTS, Part, Start, table
from kr16cli.robot import RobotData
from kr16cli.single import Arm

STOP, STEP = 1.0, 0.01
"""Length and communication step of the comparison, s."""

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

    def row(self) -> dict[str, Any]:
        """The same as plain data; null is not finite."""
        return {
            "passed": not self.problems,
            "problems": self.problems,
            "deviations": [
                {**d._asdict(), "largest": _finite(d.largest), "relative": _finite(d.relative)}
                for d in self.deviations
            ],
            "tolerance": self.tolerance,
            "steps": self.steps,
        }


class Comparison:
    """The same inputs to an FMU and to the direct simulator: slow, small waves.

    Args:
        fmu: the FMU; its start values count.
        data: the robot that it should be.
    """

    def __init__(self, fmu: Fmu, data: RobotData) -> None:
        self._data, self._part = data, _part(fmu)
        self._starts = fmu.starts()
        q = [self._starts.get(name, 0.0) for name in variables.six("q_start")]
        self._table = table(data, Start(q=q, gravity=data.gravity), self._part)
        self._places = {v.name: k for k, v in enumerate(self._table)}
        outputs = {v.name for v in fmu.scalars if v.causality == "output"}
        self.times = [k * STEP for k in range(round(STOP / STEP) + 1)]
        self.shared = [
            v.name
            for v in self._table
            if v.name in outputs and variables.group(v.name) in _COMPARED
        ]
        self.inputs = self._waves(q, {v.name for v in fmu.scalars if v.causality == "input"})
        self._expected: dict[bool, Mapping[str, Sequence[float]]] = {}

    def _waves(self, q: Sequence[float], there: set[str]) -> dict[str, list[float]]:
        """Inputs about what keeps the arm near its start."""
        waves: dict[str, list[float]] = {}
        for i in JOINTS:
            w, size = 2.0 + 0.7 * i, 0.03 / i
            swing = [math.sin(w * t) for t in self.times]
            waves[f"tau[{i}]"] = [(20.0 if i < 4 else 0.2) * v for v in swing]
            for name in ("q_ref", "q"):
                waves[f"{name}[{i}]"] = [
                    q[i - 1] + size * (1.0 - math.cos(w * t)) for t in self.times
                ]
            for name in ("qd_ref", "qd"):
                waves[f"{name}[{i}]"] = [size * w * v for v in swing]
            waves[f"wrench[{i}]"] = [(5.0 if i < 4 else 0.1) * v for v in swing]
        mine = {v.name for v in self._table if v.causality == "input"}
        return {name: values for name, values in waves.items() if name in there & mine}

    def _machine(self) -> Machine:
        """The direct simulator with the start values of the FMU."""
        machine = Machine(self._table, self._data, Arm, self._part)
        for v in self._table:
            if v.causality != "output" and v.name in self._starts:
                machine.set([self._places[v.name]], [self._starts[v.name]])
        return machine

    def expected(self, *, after: bool = False) -> Mapping[str, Sequence[float]]:
        """What the direct simulator says, by output, with inputs held over each step.

        Args:
            after: outputs are taken after the inputs of the moment act, not before.

        Raises:
            InputError: the simulator refuses the start values, or cannot follow.
        """
        if after not in self._expected:
            self._expected[after] = self._run(after=after)
        return self._expected[after]

    def _run(self, *, after: bool) -> dict[str, list[float]]:
        machine, places = self._machine(), [self._places[name] for name in self.shared]
        names = [self._places[name] for name in self.inputs]
        inputs = list(zip(*self.inputs.values(), strict=True)) or [()] * len(self.times)
        machine.enter()
        machine.set(names, inputs[0])
        machine.leave()
        rows = [machine.get(places)]
        for k in range(1, len(self.times)):
            start, end = self.times[k - 1], self.times[k]
            machine.set(names, inputs[k - 1])
            machine.step(start, end - start)
            if after:
                machine.set(names, inputs[k])
            rows.append(machine.get(places))
        return dict(zip(self.shared, map(list, zip(*rows, strict=True)), strict=True))

    def signals(self, *, stairs: bool) -> Signals:
        """The inputs for a host: a row for each step, or two, between which they jump."""
        if not stairs:
            return Signals(self.times, self.inputs)
        times = [t for t in self.times for _ in range(2)][1:]
        columns = {n: [v for v in c for _ in range(2)][:-1] for n, c in self.inputs.items()}
        return Signals(times, columns)

    def report(
        self,
        columns: Mapping[str, Sequence[float]],
        problems: Sequence[str],
        tolerance: float,
        *,
        after: bool = False,
    ) -> Report:
        """What there is to say of the outputs of a run.

        Args:
            columns: by output, one value for each of `times`.
            problems: known before.
            tolerance: largest deviation allowed over the size of a quantity.
            after: as for `expected`.
        """
        steps, lengths = len(self.times) - 1, {len(columns[name]) for name in self.shared}
        if lengths != {steps + 1}:
            return Report([*problems, f"the run has not {steps + 1} samples"], [], tolerance, steps)
        found = self._deviations(columns, self.expected(after=after))
        beyond = [
            f"{d.group} deviates by {d.largest:.3g} {d.unit} at {d.time:g} s, {d.relative:.3g} of "
            f"its size; at most {tolerance:g} is allowed"
            for d in found
            if not d.relative <= tolerance
        ]
        return Report([*problems, *beyond], found, tolerance, steps)

    def _deviations(
        self, columns: Mapping[str, Sequence[float]], expected: Mapping[str, Sequence[float]]
    ) -> list[Deviation]:
        """The largest deviation of each group of outputs; NaN counts as infinite."""
        worst: dict[str, Deviation] = {}
        units = {v.name: variables.TYPES[v.type].unit for v in self._table}
        for name in self.shared:
            key = variables.group(name)
            for t, a, b in zip(self.times, columns[name], expected[name], strict=True):
                gap = abs(a - b) if math.isfinite(a) else math.inf
                if key not in worst or gap > worst[key].largest:
                    worst[key] = Deviation(key, gap, units[name], t, gap / _SIZES[key])
        return list(worst.values())


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _part(fmu: Fmu) -> Part:
    """Ours says what it is; else a controller is what measures angles."""
    if fmu.cargo:
        return Part(fmu.cargo.about["part"])
    measures = any(v.name == "q[1]" and v.causality == "input" for v in fmu.scalars)
    return Part.CONTROLLER if measures else Part.ROBOT
