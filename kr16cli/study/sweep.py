"""A scenario run again and again with other numbers: one row of figures for each run.

Where nothing answers the motion, the compiled solvers move many runs at once (`open_runs`); all
else, and what they cannot finish, the simulator runs one by one. Each row says who ran it.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from kr16cli.arrays import Array
from kr16cli.errors import FileError, Kr16Error
from kr16cli.robot import RobotData
from kr16cli.robot_file import load_data, parse_data
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.run import Run
from kr16cli.simulate.scenario import load_scenario, parse_scenario, read_table, scenario_file
from kr16cli.single import Arm
from kr16cli.study import open_runs
from kr16cli.study.design import Design
from kr16cli.study.open_runs import Case
from kr16cli.study.paths import Place, Tables, changed, find, unit_of
from kr16cli.study.work import Chunk, Column

_STATUS = 120
_CHUNK = {True: 256, False: 8}
"""Runs of a chunk, of the compiled solvers and of the simulator: about a second."""

ROLLOUT, SIMULATOR = "rollout", "simulator"

FIGURES: Mapping[str, Column] = {
    "time_end": Column("f8", (), "s"),
    "q_end": Column("f8", (6,), "rad"),
    "qd_max": Column("f8", (6,), "rad/s"),
    "tau_max": Column("f8", (6,), "N m"),
    "tau_share": Column("f8", (), "1"),
    "position_end": Column("f8", (3,), "m"),
    "error_position": Column("f8", (), "m"),
    "error_angle": Column("f8", (), "rad"),
    "energy_kinetic_max": Column("f8", (), "J"),
    "work_torque": Column("f8", (), "J"),
    "energy_drift": Column("f8", (), "J"),
    "limits_passed": Column("i4"),
}
"""What is told of each run, beside `status`: "ok", or why there is no (full) run. `tau_share` is
the largest |torque| over the joint's, `error_*` the largest distance from the reference (NaN
without one), `limits_passed` how often a joint left its range."""


@dataclass(frozen=True)
class SweepWork:
    """A sweep; a run is a row.

    Attributes:
        tables: the scenario's and the robot's, before anything is varied.
        path: of the robot's file, for messages.
        scenario_path: of the scenario's.
        folder: what files in the scenario are relative to.
        design: the values.
        simulator: run all by the simulator, whatever the compiled solvers could do.
    """

    tables: Tables
    path: str
    scenario_path: str
    folder: str
    design: Design
    simulator: bool = False
    prefers: Literal["threads", "processes"] = field(default="processes", init=False)

    def __post_init__(self) -> None:
        _ = self.places

    @cached_property
    def places(self) -> list[Place]:
        """Where the varied numbers stand."""
        return [find(self.tables, v.path) for v in self.design.variables]

    @cached_property
    def unserved(self) -> str | None:
        """Why every run takes the simulator; None where the compiled solvers serve."""
        if self.simulator:
            return "it was asked for"
        return open_runs.unserved(self.base.scenario)

    @cached_property
    def base(self) -> Case:
        """The robot and the scenario of the files."""
        scenario = parse_scenario(self.tables.scenario, self.scenario_path, Path(self.folder))
        return Case(parse_data(self.tables.robot, self.path), scenario)

    @property
    def rows(self) -> int:
        """See `work.Work`."""
        return self.design.count

    @property
    def chunk_rows(self) -> int:
        """See `work.Work`."""
        return _CHUNK[self.unserved is None]

    def columns(self) -> dict[str, Column]:
        """See `work.Work`: the varied numbers by path, the figures, the engine, the status."""
        varied = {
            v.path: Column("f8", unit="factor" if v.factor else unit_of(self.tables, v.path))
            for v in self.design.variables
        }
        told = {"engine": Column("U9"), "status": Column(f"U{_STATUS}")}
        return {**varied, **FIGURES, **told}

    def describe(self) -> dict[str, Any]:
        """See `work.Work`."""
        d = self.design
        return {
            "study": "sweep",
            "scenario": self.tables.scenario,
            "robot": self.tables.robot,
            "vary": [
                [v.path, list(v.values), v.low, v.high, v.normal, v.factor] for v in d.variables
            ],
            "design": d.kind,
            "runs": d.count,
            "seed": d.seed,
            "engine": ROLLOUT if self.unserved is None else SIMULATOR,
        }

    def compute(self, start: int, stop: int) -> Chunk:
        """See `work.Work`."""
        values = self.design.rows(start, stop)
        made: Chunk = {v.path: values[:, i] for i, v in enumerate(self.design.variables)}
        for name, column in self.columns().items():
            if name in FIGURES:
                absent = -1 if column.dtype == "i4" else np.nan
                made[name] = np.full((len(values), *column.shape), absent, dtype=column.dtype)
            elif name not in made:
                made[name] = np.full(len(values), "", dtype=column.dtype)
        cases: dict[int, Case] = {}
        for i, row in enumerate(values.tolist()):
            try:
                cases[i] = self.case(row)
            except Kr16Error as error:
                made["status"][i] = _words(_reason(error))
        if self.unserved is None:
            self._at_once(made, cases)
        for i, case in cases.items():
            self._alone(made, i, case)
        return made

    @staticmethod
    def _at_once(made: Chunk, cases: dict[int, Case]) -> None:
        """Fill the rows of the runs that the compiled solvers complete, and take them out."""
        try:
            found = open_runs.figures(list(cases.values()))
        except Kr16Error:
            return  # the simulator finds whose fault it is
        rows = np.array(list(cases), dtype=int)[found.complete]
        for name, told in found.columns.items():
            made[name][rows] = told[found.complete]
        made["engine"][rows], made["status"][rows] = ROLLOUT, "ok"
        for i in rows.tolist():
            del cases[i]

    @staticmethod
    def _alone(made: Chunk, i: int, case: Case) -> None:
        """Fill the row of a run of the simulator, or say why there is none."""
        made["engine"][i] = SIMULATOR
        try:
            run = simulate(*case)
        except Kr16Error as error:
            made["status"][i] = _words(_reason(error))
            return
        for name, value in figures(run, case.data).items():
            made[name][i] = value
        made["status"][i] = "ok" if run.failure is None else _words(run.failure)

    def case(self, values: list[float]) -> Case:
        """The robot and the scenario with these values.

        Raises:
            Kr16Error: values that break a rule of the files.
        """
        new = [
            _value(place.value, value, factor=v.factor)
            for place, value, v in zip(self.places, values, self.design.variables, strict=True)
        ]
        tables = changed(self.tables, self.places, new)
        data, scenario = self.base
        if tables.robot is not self.tables.robot:
            data = parse_data(tables.robot, self.path)
        if tables.scenario is not self.tables.scenario:
            scenario = parse_scenario(tables.scenario, self.scenario_path, Path(self.folder))
        return Case(data, scenario)

    def one(self, values: list[float]) -> tuple[RobotData, Run]:
        """The robot and its run in the simulator with these values.

        Raises:
            Kr16Error: values that break a rule of the files, or a reference out of reach.
        """
        case = self.case(values)
        return case.data, simulate(*case)


def _value(stands: Any, value: float, *, factor: bool) -> Any:
    """What takes the place of a number, or of every number of a list."""
    if isinstance(stands, list):
        return [_value(v, value, factor=factor) for v in stands]
    new = stands * value if factor else value
    return int(new) if isinstance(stands, int) and float(new).is_integer() else new


def sweep_of(
    robot_file: str, scenario: str, design: Design, *, simulator: bool = False
) -> SweepWork:
    """A sweep of a scenario file (or a shipped one's name) with a robot file.

    With `simulator` no compiled solver takes the simulator's place.

    Raises:
        FileError, ParameterError: the files themselves must be sound.
        InputError: a path that names no number, or a robot without inertial data.
    """
    file = scenario_file(scenario)
    load_scenario(file)
    Arm(load_data(robot_file)).require_inertia()
    robot = tomllib.loads(Path(robot_file).read_text(encoding="utf-8-sig"))
    tables = Tables(read_table(file), robot)
    return SweepWork(tables, robot_file, str(file), str(file.parent), design, simulator)


def figures(run: Run, data: RobotData) -> dict[str, Any]:
    """The figures of a run, by name of `FIGURES`."""
    tau = np.abs(run.tau).max(axis=0)
    known = [(t, j.torque) for t, j in zip(tau, data.joints, strict=True) if j.torque is not None]
    error = np.full(2, np.nan) if run.error is None else run.error.max(axis=0)
    return {
        "time_end": run.time[-1],
        "q_end": run.q[-1],
        "qd_max": np.abs(run.qd).max(axis=0),
        "tau_max": tau,
        "tau_share": max((t / limit for t, limit in known), default=np.nan),
        "position_end": run.pose[-1, :3],
        "error_position": error[0],
        "error_angle": error[1],
        "energy_kinetic_max": run.energy_kinetic.max(),
        "work_torque": run.work_torque[-1],
        "energy_drift": np.abs(run.drift).max(),
        "limits_passed": sum(event.kind.startswith("leave") for event in run.events),
    }


def flat_columns(work: SweepWork, chunk: Mapping[str, Any]) -> dict[str, Array]:
    """A chunk with a column for each number: q_end_1 to q_end_6 and so on."""
    made: dict[str, Any] = {}
    for name, column in work.columns().items():
        values = np.asarray(chunk[name])
        if column.shape:
            made |= {f"{name}_{i + 1}": values[:, i] for i in range(column.shape[0])}
        else:
            made[name] = values
    return made


def _reason(error: Kr16Error) -> str:
    """Why there is no run, without the file's place: answers are the same on every machine."""
    return error.reason if isinstance(error, FileError) else str(error)


def _words(text: str) -> str:
    """One line that fits the column."""
    return " ".join(text.split())[:_STATUS]
