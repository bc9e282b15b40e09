"""The record of a run, and its files: npz with SI arrays, CSV with units in the header."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np

from kr16cli.arrays import Array
from kr16cli.errors import FileError
from kr16cli.simulate.events import Event
from kr16cli.simulate.integrate import Statistics

SCHEMA = "kr16.run/1"

UNITS = {
    "time": "s",
    "q": "rad",
    "qd": "rad/s",
    "qdd": "rad/s2",
    "tau": "N m",
    "pose": "m m m rad rad rad",
    "energy_kinetic": "J",
    "energy_potential": "J",
    "work_torque": "J",
    "work_friction": "J",
    "work_wrench": "J",
    "work_contact": "J",
}
"""The arrays of a run and their units."""

REFERENCE_UNITS = {"q_ref": "rad", "error": "m rad"}
"""The arrays of a run that follows a reference."""

WORK_NAMES = ("work_torque", "work_friction", "work_wrench", "work_contact")

_PARTS = {"pose": tuple("xyzabc"), "error": ("error_position", "error_angle")}
_EVENT = np.dtype([("time", "f8"), ("joint", "U8"), ("kind", "U16"), ("value", "f8")])


@dataclass(frozen=True)
class Run:
    """What was seen in a simulation: n samples, SI units, angles in rad.

    Attributes:
        time: (n,) s; the first is 0, the last the duration of a complete run.
        q, qd, qdd: (n, 6) joint angles, speeds and accelerations.
        tau: (n, 6) torques that the drives gave, N m; friction is not in them.
        pose: (n, 6) x, y, z (m) and A, B, C (rad) of the flange in robroot.
        energy_kinetic, energy_potential: (n,) J.
        work_torque, work_friction: (n,) J done by the torques and lost in friction so far.
        work_wrench, work_contact: (n,) J done by the external wrench and by joint stops.
        events: joints passing their limits, a target reached, in order of time.
        statistics: what the solver was asked, and did.
        failure: why the run ended before its time, or None.
        scenario: the scenario as a table in SI units.
        robot: name of the robot; `model_sha256` the hash of its parameter file's numbers.
        q_ref: (n, 6) reference angles, or None without a reference.
        error: (n, 2) distance (m) and angle (rad) of the flange from its reference, or None.
        stopped: why a run ended early as it was asked to, or None.
    """

    time: Array
    q: Array
    qd: Array
    qdd: Array
    tau: Array
    pose: Array
    energy_kinetic: Array
    energy_potential: Array
    work_torque: Array
    work_friction: Array
    work_wrench: Array
    work_contact: Array
    events: tuple[Event, ...]
    statistics: Statistics
    failure: str | None
    scenario: Mapping[str, Any]
    robot: str
    model_sha256: str
    q_ref: Array | None = None
    error: Array | None = None
    stopped: str | None = None

    @property
    def complete(self) -> bool:
        """Whether the run lasted as long as it was to."""
        return self.failure is None and self.stopped is None

    @property
    def units(self) -> dict[str, str]:
        """The arrays this run has, and their units."""
        return UNITS if self.q_ref is None else UNITS | REFERENCE_UNITS

    @property
    def drift(self) -> Array:
        """(n,) J: change of energy that no work explains; the integration's error."""
        energy = self.energy_kinetic + self.energy_potential
        work = self.work_torque - self.work_friction + self.work_wrench + self.work_contact
        unexplained: Array = energy - energy[0] - work
        return unexplained

    def metadata(self) -> dict[str, Any]:
        """What the arrays do not say, JSON-ready."""
        from kr16cli import __version__

        return {
            "schema": SCHEMA,
            "version": __version__,
            "robot": self.robot,
            "model_sha256": self.model_sha256,
            "scenario": dict(self.scenario),
            "complete": self.complete,
            "failure": self.failure,
            "stopped": self.stopped,
            "solver": self.statistics._asdict(),
            "units": self.units,
        }

    def to_npz(self) -> bytes:
        """The run as the content of an npz file: its arrays, `events`, and JSON `metadata`.

        `events` is an array of records (time, joint, kind, value).
        """
        out = BytesIO()
        np.savez(
            out,
            **{name: getattr(self, name) for name in self.units},
            events=np.array(list(map(tuple, self.events)), dtype=_EVENT),
            metadata=np.array(json.dumps(self.metadata(), ensure_ascii=False)),
        )
        return out.getvalue()

    def to_csv(self) -> str:
        """The run as CSV in SI units, one sample a row, units in the header: `q1 [rad]`.

        A run that ended before its time has a last column `status` that says so in each row.
        """
        header, columns = ["time [s]"], [self.time[:, None]]
        for name, unit in list(self.units.items())[1:]:
            values = np.asarray(getattr(self, name))
            columns.append(values.reshape(len(self.time), -1))
            if name in _PARTS:
                header += [f"{n} [{u}]" for n, u in zip(_PARTS[name], unit.split(), strict=True)]
            elif values.ndim == 1:
                header.append(f"{name} [{unit}]")
            else:
                header += [f"{name}{i} [{unit}]" for i in range(1, 7)]
        mark = [] if self.complete else ["partial"]
        out = StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(header + ["status"] * len(mark))
        for row in (np.hstack(columns) + 0.0).tolist():
            writer.writerow([*map(repr, row), *mark])
        return out.getvalue()


def load_run(path: str | Path) -> Run:
    """Read a run from the npz file it was saved in.

    Raises:
        FileError: the file cannot be read or holds no run.
    """
    try:
        with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
            known = [*UNITS, *(name for name in REFERENCE_UNITS if name in archive)]
            arrays = {name: np.asarray(archive[name], dtype=np.float64) for name in known}
            events = [Event(*record) for record in archive["events"].tolist()]
            about = json.loads(str(archive["metadata"]))
        return Run(
            **arrays,
            events=tuple(events),
            statistics=Statistics(**about["solver"]),
            failure=about["failure"],
            scenario=about["scenario"],
            robot=about["robot"],
            model_sha256=about["model_sha256"],
            stopped=about.get("stopped"),
        )
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None
    except Exception as error:  # zip, NumPy and JSON each complain in their own way
        reason = " ".join(str(error.args[0] if error.args else error).split())
        raise FileError(path, f"holds no run of kr16 simulate: {reason}") from None
