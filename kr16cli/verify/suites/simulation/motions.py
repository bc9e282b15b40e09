"""Motions beside an independent integration, and what a run records."""

from __future__ import annotations

import numpy as np

from kr16cli import Robot
from kr16cli.simulate.scenario import TorqueSpec
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.independent.rotations import Array, from_abc
from kr16cli.verify.measure import finding, gap, largest, relative
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.simulation.common import (
    SIMULATE,
    SPEED,
    START,
    TAU,
    driven,
    numbers,
    run,
)


@case(
    "simulation.lagrange",
    title="A motion by Lagrange's equations is the same motion",
    statement="q(t) of the simulation = q(t) of M qdd = tau - C qd - G integrated apart",
    regime="constant torques from a moving start, payload on the flange; 0.4 s, or 0.06 s if quick",
    method="independent M and forces, classical Runge-Kutta with steps of 5 ms, 10 ms if quick",
    grade="B",
    tolerance=1e-6,
    unit="rad",
    reason="fourth-order steps leave about 1e-8; free motion lets errors grow",
    functions=(SIMULATE, "kr16cli.Robot.forward_dynamics"),
)
def lagrange(setting: Setting) -> Finding:
    """Another model, another integrator."""
    duration = 0.06 if setting.quick else 0.4
    own = run(
        setting, torque=TorqueSpec("constant", TAU), payload=sampling.LOAD, duration=duration
    )  # fmt: skip
    other, tau = Lagrangian(numbers(setting), sampling.LOAD), np.array(TAU)

    def rate(state: Array) -> Array:
        q, qd = state[:6], state[6:]
        bias = other.inverse_dynamics(q, qd, np.zeros(6))
        return np.concatenate([qd, np.linalg.solve(other.mass_matrix(q), tau - bias)])

    h, rows = 0.01 if setting.quick else 0.005, [np.array([*START, *SPEED])]
    for _ in range(round(duration / h)):
        y = rows[-1]
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        rows.append(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3)))
    theirs = np.array(rows)[:: round(0.02 / h), :6]
    return finding(gap(own.q, theirs), f"{len(theirs)} samples in {duration:g} s", q=own.q)


@case(
    "simulation.record",
    title="A run's columns belong together",
    statement="pose = fk(q); M qdd + C qd + G + friction = tau; T, P by their definitions",
    regime="constant torques with drives, payload on the flange",
    method="product of exponentials and Lagrange's equations on the recorded state",
    grade="B",
    tolerance=1e-9,
    unit="relative",
    reason="the condition of M, up to 1e5, on accelerations",
    functions=("kr16cli.simulate.run.Run",),
)
def record(setting: Setting) -> Finding:
    """What is written down."""
    own, data = driven(setting), numbers(setting)
    other, robot = Lagrangian(data, sampling.LOAD), Robot(data, drives=True)
    rotors = np.array([j.reflected_inertia for j in data.joints])
    tau = other.inverse_dynamics(own.q, own.qd, own.qdd) + rotors * own.qdd
    kinetic = other.kinetic(own.q, own.qd) + (rotors * own.qd**2).sum(axis=1) / 2
    T = poe.flange(data.geometry, own.q)
    error = largest(
        gap(own.pose[:, :3], T[:, :3, 3]),
        gap(from_abc(own.pose[:, 3:]), T[:, :3, :3], 2),
        relative(tau + robot.friction(own.qd), own.tau),
        gap(own.tau, np.array(TAU)),
        np.abs(own.energy_kinetic / kinetic - 1),
        np.abs(own.energy_potential - other.potential(own.q)) / 1e3,
    )
    return finding(error, "pose, torques and energies of every sample", q=own.q, qd=own.qd)
