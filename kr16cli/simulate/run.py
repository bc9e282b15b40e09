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
}
"""The arrays of a run and their units."""

_POSE = ("x", "y", "z", "a", "b", "c")
_EVENT = np.dtype([("time", "f8"), ("joint", "U8"), ("kind", "U16"), ("value", "f8")])


@dataclass(frozen=True)
class Run:
    """What was seen in a simulation: n samples, SI units, angles in rad.

    Attributes:
        time: (n,) s; the first is 0, the last the duration of a complete run.
        q, qd, qdd: (n, 6) joint angles, speeds and accelerations.
        tau: (n, 6) applied torques, N m; friction is not in them.
        pose: (n, 6) x, y, z (m) and A, B, C (rad) of the flange in robroot.
        energy_kinetic, energy_potential: (n,) J.
        work_torque, work_friction: (n,) J done by the torques and lost in friction so far.
        events: joints passing their limits, in order of time.
        statistics: what the solver was asked, and did.
        failure: why the run ended before its time, or None.
        scenario: the scenario as a table in SI units.
        robot: name of the robot; `model_sha256` the hash of its parameter file's numbers.
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
    events: tuple[Event, ...]
    statistics: Statistics
    failure: str | None
    scenario: Mapping[str, Any]
    robot: str
    model_sha256: str

    @property
    def drift(self) -> Array:
        """(n,) J: change of energy that no work explains; the integration's error."""
        energy = self.energy_kinetic + self.energy_potential
        unexplained: Array = energy - energy[0] - (self.work_torque - self.work_friction)
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
            "complete": self.failure is None,
            "failure": self.failure,
            "solver": self.statistics._asdict(),
            "units": UNITS,
        }

    def to_npz(self) -> bytes:
        """The run as the content of an npz file: its arrays, `events`, and JSON `metadata`.

        `events` is an array of records (time, joint, kind, value).
        """
        out = BytesIO()
        np.savez(
            out,
            **{name: getattr(self, name) for name in UNITS},
            events=np.array(list(map(tuple, self.events)), dtype=_EVENT),
            metadata=np.array(json.dumps(self.metadata(), ensure_ascii=False)),
        )
        return out.getvalue()

    def to_csv(self) -> str:
        """The run as CSV in SI units, one sample a row, units in the header: `q1 [rad]`.

        A run that ended before its time has a last column `status` that says so in each row.
        """
        header, columns = ["time [s]"], [self.time[:, None]]
        for name, unit in list(UNITS.items())[1:]:
            values = np.asarray(getattr(self, name))
            columns.append(values.reshape(len(self.time), -1))
            if name == "pose":
                header += [f"{n} [{u}]" for n, u in zip(_POSE, unit.split(), strict=True)]
            elif values.ndim == 1:
                header.append(f"{name} [{unit}]")
            else:
                header += [f"{name}{i} [{unit}]" for i in range(1, 7)]
        mark = [] if self.failure is None else ["partial"]
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
            arrays = {name: np.asarray(archive[name], dtype=np.float64) for name in UNITS}
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
        )
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None
    except Exception as error:  # zip, NumPy and JSON each complain in their own way
        reason = " ".join(str(error).split())
        raise FileError(path, f"holds no run of kr16 simulate: {reason}") from None
