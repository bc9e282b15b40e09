"""A run in a few numbers, SI units, and the warnings it deserves."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli.arrays import Array
from kr16cli.robot import RobotData
from kr16cli.simulate.events import ARRIVAL
from kr16cli.simulate.run import UNITS, Run
from kr16cli.units import deg

SCHEMA = "kr16.simulate/1"
_FINAL = ("time", "q", "qd", "qdd", "tau", "pose")
_UNITS = {"drift": "J", "value": "rad", "tracking": "m rad", **UNITS}


def envelope(run: Run, data: RobotData) -> dict[str, Any]:
    """The JSON answer of `kr16 simulate`."""
    return {
        "schema": SCHEMA,
        "robot": run.robot,
        "model_sha256": run.model_sha256,
        "units": _UNITS,
        "input": dict(run.scenario),
        "result": summarise(run, data),
        "warnings": warnings(run, data),
    }


def summarise(run: Run, data: RobotData) -> dict[str, Any]:
    """Final state, energies, extremes over the samples, events and solver, JSON-ready."""
    names = [joint.name for joint in data.joints]
    drift = run.drift
    return {
        "scenario": run.scenario["name"],
        "complete": run.complete,
        "failure": run.failure,
        "stopped": run.stopped,
        "duration": float(run.time[-1]),
        "samples": len(run.time),
        "final": {key: _plain(getattr(run, key)[-1]) for key in _FINAL},
        "energy": {
            "kinetic_initial": _plain(run.energy_kinetic[0]),
            "kinetic_final": _plain(run.energy_kinetic[-1]),
            "kinetic_max": _plain(run.energy_kinetic.max()),
            "potential_initial": _plain(run.energy_potential[0]),
            "potential_final": _plain(run.energy_potential[-1]),
            "work_torque": _plain(run.work_torque[-1]),
            "work_friction": _plain(run.work_friction[-1]),
            "work_wrench": _plain(run.work_wrench[-1]),
            "work_contact": _plain(run.work_contact[-1]),
            "drift_final": _plain(drift[-1]),
            "drift_max": _plain(np.abs(drift).max()),
        },
        "extremes": {
            "joint": names,
            "q_min": _plain(run.q.min(axis=0)),
            "q_max": _plain(run.q.max(axis=0)),
            "qd_max": _largest(run.qd),
            "qdd_max": _largest(run.qdd),
            "tau_max": _largest(run.tau),
        },
        "tracking": _tracking(run),
        "events": [event._asdict() for event in run.events],
        "solver": run.statistics._asdict(),
    }


def _tracking(run: Run) -> dict[str, Any] | None:
    """The flange's distance (m) and angle (rad) from its reference."""
    if run.error is None:
        return None
    names = ("position", "angle")
    largest, final = run.error.max(axis=0), run.error[-1]
    return {f"{name}_largest": _plain(largest[i]) for i, name in enumerate(names)} | {
        f"{name}_final": _plain(final[i]) for i, name in enumerate(names)
    }


def warnings(run: Run, data: RobotData) -> list[str]:
    """What a real robot would not have done; one sentence each."""
    texts = [] if run.stopped is None else [f"the run ends at {run.time[-1]:.6g} s: {run.stopped}"]
    way = run.scenario.get("limits", {}).get("joint", "report")
    note = "; limits are reported, not enforced" if way == "report" else ""
    for joint, low, high, speed, torque in zip(
        data.joints, run.q.min(axis=0), run.q.max(axis=0), _largest(run.qd), _largest(run.tau),
        strict=True,
    ):  # fmt: skip
        mine = [event for event in run.events if event.joint == joint.name]
        if mine:
            at, kind = mine[0].time, mine[0].kind.split("_")[1]
            limit, worst = (joint.lower, low) if kind == "lower" else (joint.upper, high)
            texts.append(
                f"{joint.name} passes its {kind} limit of {deg(limit):g} deg at {at:.4g} s and "
                f"reaches {deg(float(worst)):.4g} deg{note}"
            )
        if joint.speed is not None and speed > joint.speed:
            texts.append(
                f"{joint.name} reaches {deg(speed):.4g} deg/s, more than its "
                f"{deg(joint.speed):g} deg/s"
            )
        if joint.torque is not None and torque > joint.torque:
            texts.append(
                f"{joint.name} is driven with {torque:.4g} N m, more than its {joint.torque:g} N m"
            )
    late = run.scenario.get("reference") and not any(e.kind == ARRIVAL for e in run.events)
    if late and run.scenario["reference"]["kind"] != "hold" and run.complete:
        texts.append(
            "the end of the reference is not reached; make duration_s longer or the motion faster"
        )
    rated, load = data.ratings.get("payload_kg"), run.scenario.get("payload") or {}
    if rated is not None and load.get("mass", 0.0) > rated:
        texts.append(f"payload {load['mass']:g} kg exceeds the rated {rated:g} kg")
    return texts


def _largest(values: Array) -> list[float]:
    """Largest magnitude of each column."""
    return [float(v) for v in np.abs(values).max(axis=0)]


def _plain(value: Any) -> Any:
    """An array or a number as JSON has it, without -0.0."""
    return (np.asarray(value) + 0.0).tolist()
