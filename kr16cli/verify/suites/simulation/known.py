"""Motions whose course is known in closed form: a pendulum, and errors under control."""

from __future__ import annotations

import numpy as np

from kr16cli.simulate import evidence
from kr16cli.simulate.evidence import Comparison
from kr16cli.verify import sampling
from kr16cli.verify.measure import finding, gap, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.simulation.common import SIMULATE, numbers


def _found(runs: list[Comparison], evidence_text: str) -> Finding:
    """The worst of several comparisons at equal times."""
    return finding(largest(*(gap(r.found, r.expected) for r in runs)), evidence_text)


@case(
    "simulation.pendulum",
    title="With all joints but one held, the arm is a pendulum",
    statement="theta = 2 asin(k cd(w t, k)), k = sin(amplitude / 2), w^2 = gravity torque's "
    "amplitude / M_jj",
    regime="A2 at 86 deg and A5 at 160 deg, with a payload, from rest; full run: 1.5 s",
    method="Jacobi's elliptic functions against the simulation with five joints held",
    grade="C",
    tolerance=1e-7,
    unit="rad",
    reason="solver errors of 1e-10 a step grow by two decades",
    equations=("3.38", "3.42"),
    functions=(SIMULATE, "kr16cli.Arm.mass_matrix", "kr16cli.Arm.gravity"),
)
def pendulum(setting: Setting) -> Finding:
    """A closed form of the nonlinear swing."""
    data, quick = numbers(setting), setting.quick
    chosen = ((1, 1.5),) if quick else ((1, 1.5), (4, 2.8))
    runs = [
        evidence.pendulum(
            data, joint=joint, amplitude=amplitude, duration=0.1 if quick else 1.5,
            payload=sampling.LOAD, samples=5 if quick else 50,
        )
        for joint, amplitude in chosen
    ]  # fmt: skip
    moved = max(float(np.ptp(r.expected, axis=0).max()) for r in runs)
    return _found(runs, f"{len(runs)} swings of up to {moved:.2g} rad")


@case(
    "simulation.joint-errors",
    title="Computed torque gives the designed error dynamics in joint space",
    statement="e'' + 2 z w e' + w^2 e = 0 for each joint, with friction and rotors counted",
    regime="damping 0.3, 0.7, 1 and 1.5, rigid and with drives; quick: 0.7, rigid, 0.1 s",
    method="closed-form solution from the first error and its rate",
    grade="C",
    tolerance=1e-7,
    unit="rad",
    reason="solver errors of 1e-9 a step; the model is cancelled to rounding",
    functions=(SIMULATE, "kr16cli.simulate.controllers.ComputedTorque"),
)
def joint_errors(setting: Setting) -> Finding:
    """Six oscillators, each by itself."""
    data, quick = numbers(setting), setting.quick
    kinds = [(0.7, False)] if quick else [(z, z == 0.7) for z in (0.3, 0.7, 1.0, 1.5)]
    runs = [
        evidence.joint_error_dynamics(
            data, 12.0, z, drives=drives, duration=0.1 if quick else 0.6
        )
        for z, drives in kinds
    ]  # fmt: skip
    return _found(runs, f"{len(runs)} controllers, six joints each")


@case(
    "simulation.task-errors",
    title="Computed torque gives the designed error dynamics in task space",
    statement="e'' + 2 z w e' + w^2 e = 0 for place and the roll, pitch, yaw of R_ref^T R",
    regime="damping 0.5 and 1; quick: 0.7, 0.1 s",
    method="closed-form solution from the first error",
    grade="C",
    tolerance=1e-7,
    unit="m, rad",
    reason="solver errors of 1e-9 a step, times the Jacobian's condition",
    equations=("3.44", "3.45", "3.46", "3.47", "3.48", "3.49"),
    functions=(SIMULATE, "kr16cli.simulate.task_control.TaskComputedTorque"),
)
def task_errors(setting: Setting) -> Finding:
    """Six oscillators of the flange."""
    data, quick = numbers(setting), setting.quick
    runs = [
        evidence.task_error_dynamics(data, 12.0, z, duration=0.1 if quick else 0.6)
        for z in ((0.7,) if quick else (0.5, 1.0))
    ]
    return _found(runs, f"{len(runs)} controllers, three lengths and three angles")
