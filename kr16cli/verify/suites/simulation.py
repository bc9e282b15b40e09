"""Suite `simulation`: motions against an independent integration, energy, and solver order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kr16cli import Robot
from kr16cli.robot import RobotData
from kr16cli.simulate.core import euler_step, rk4_step
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.run import Run
from kr16cli.simulate.scenario import Scenario, SolverSpec, TorqueSpec
from kr16cli.verify import sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.independent.rotations import Array, from_abc
from kr16cli.verify.measure import finding, gap, largest, relative
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case

_Six = tuple[float, float, float, float, float, float]
_START: _Six = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
_SPEED: _Six = (0.4, -0.3, 0.2, 0.5, -0.6, 0.7)
_TAU: _Six = (120.0, -500.0, -150.0, 12.0, -15.0, 3.0)


def _scenario(setting: Setting, **changes: object) -> Scenario:
    duration = 0.12 if setting.quick else 1.0
    base = Scenario("verify", q=_START, qd=_SPEED, duration=duration, output_step=0.02)
    return replace(base, **changes)  # type: ignore[arg-type]  # fields by name


def _run(setting: Setting, **changes: object) -> tuple[Run, RobotData]:
    data = setting.robot.data
    sampling.need_links(data)
    return simulate(data, _scenario(setting, **changes)), data


def _driven(setting: Setting) -> tuple[Run, RobotData]:
    """Constant torques with rotor inertia, friction and a payload; stiff, so not for long."""
    return _run(
        setting, torque=TorqueSpec("constant", _TAU), drives=True, payload=sampling.LOAD,
        duration=0.04 if setting.quick else 0.5,
        solver=SolverSpec(rtol=1e-7, atol=1e-8) if setting.quick else SolverSpec(),
    )  # fmt: skip


@case(
    "simulation.energy",
    title="A free arm keeps its energy",
    statement="T + P is constant without torques and friction",
    regime="a fall with speeds in all joints, payload on the flange",
    method="energy of every sample against the first",
    grade="C",
    tolerance=1e-7,
    unit="relative",
    reason="solver errors of 1e-9 a step over some hundred steps; relative to the largest T",
    functions=("kr16cli.simulate.experiment.simulate", "kr16cli.Robot.energy"),
)
def energy(setting: Setting) -> Finding:
    """Conservation."""
    run, _ = _run(setting, payload=sampling.LOAD)
    total = run.energy_kinetic + run.energy_potential
    drift = np.abs(total - total[0]) / run.energy_kinetic.max()
    figures = {"time": run.time.tolist(), "drift": drift.tolist()}
    text = f"{len(run.time)} samples in {run.time[-1]:g} s"
    return finding(drift, text, figures=figures, q=run.q, qd=run.qd)


@case(
    "simulation.work",
    title="Energy gained is the work of torques less that of friction",
    statement="T + P - (T + P)(0) = work of torques - work of friction",
    regime="constant torques, rotor inertia and friction, payload on the flange",
    method="work integrated beside the motion; energy of every sample",
    grade="C",
    tolerance=1e-6,
    unit="relative",
    reason="solver errors of 1e-9 a step; relative to the work done",
    functions=("kr16cli.simulate.experiment.simulate", "kr16cli.Robot.friction"),
)
def work(setting: Setting) -> Finding:
    """Balance."""
    run, _ = _driven(setting)
    error = np.abs(run.drift) / np.abs(run.work_torque).max()
    lost = np.diff(run.work_friction)
    error[1:] = np.where(lost < 0, np.inf, error[1:])  # friction only takes
    return finding(error, f"friction took {run.work_friction[-1]:.0f} J", q=run.q, qd=run.qd)


@case(
    "simulation.hold",
    title="Gravity compensation holds the arm still",
    statement="tau = G(q) keeps q = q(0) and qd = 0",
    regime="from rest, payload on the flange, on a slope",
    method="largest move of any joint",
    grade="C",
    tolerance=1e-9,
    unit="rad, rad/s",
    reason="torques cancel to 1e-13 N m; nothing is left to move the arm",
    functions=("kr16cli.simulate.experiment.simulate", "kr16cli.Robot.gravity"),
)
def hold(setting: Setting) -> Finding:
    """At rest it stays."""
    run, _ = _run(
        setting, torque=TorqueSpec("gravity"), payload=sampling.LOAD, qd=(0.0,) * 6,
        gravity=sampling.TILTED,
    )  # fmt: skip
    error = largest(gap(run.q, np.array(_START)), np.abs(run.qd).max(axis=1))
    return finding(error, f"{run.time[-1]:g} s of rest", q=run.q)


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
    functions=("kr16cli.simulate.experiment.simulate", "kr16cli.Robot.forward_dynamics"),
)
def lagrange(setting: Setting) -> Finding:
    """Another model, another integrator."""
    duration = 0.06 if setting.quick else 0.4
    run, data = _run(
        setting, torque=TorqueSpec("constant", _TAU), payload=sampling.LOAD, duration=duration
    )
    other, tau = Lagrangian(data, sampling.LOAD), np.array(_TAU)

    def rate(state: Array) -> Array:
        q, qd = state[:6], state[6:]
        bias = other.inverse_dynamics(q, qd, np.zeros(6))
        return np.concatenate([qd, np.linalg.solve(other.mass_matrix(q), tau - bias)])

    h, rows = 0.01 if setting.quick else 0.005, [np.array([*_START, *_SPEED])]
    for _ in range(round(duration / h)):
        y = rows[-1]
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        rows.append(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3)))
    theirs = np.array(rows)[:: round(0.02 / h), :6]
    return finding(gap(run.q, theirs), f"{len(theirs)} samples in {duration:g} s", q=run.q)


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
    run, data = _driven(setting)
    other, robot = Lagrangian(data, sampling.LOAD), Robot(data, drives=True)
    rotors = np.array([j.reflected_inertia for j in data.joints])
    tau = other.inverse_dynamics(run.q, run.qd, run.qdd) + rotors * run.qdd
    kinetic = other.kinetic(run.q, run.qd) + (rotors * run.qd**2).sum(axis=1) / 2
    T = poe.flange(data.geometry, run.q)
    error = largest(
        gap(run.pose[:, :3], T[:, :3, 3]),
        gap(from_abc(run.pose[:, 3:]), T[:, :3, :3], 2),
        relative(tau + robot.friction(run.qd), run.tau),
        gap(run.tau, np.array(_TAU)),
        np.abs(run.energy_kinetic / kinetic - 1),
        np.abs(run.energy_potential - other.potential(run.q)) / 1e3,
    )
    return finding(error, "pose, torques and energies of every sample", q=run.q, qd=run.qd)


@case(
    "simulation.reversal",
    title="A free motion run backwards returns to its start",
    statement="q(-t) of the reversed end state = q(t)",
    regime="a fall with speeds in all joints",
    method="the end state with its speeds reversed, simulated for the same time",
    grade="C",
    tolerance=1e-5,
    unit="rad",
    reason="solver errors of 1e-9 a step grow by three decades there and back",
    functions=("kr16cli.simulate.experiment.simulate",),
)
def reversal(setting: Setting) -> Finding:
    """Time has no direction here."""
    run, _ = _run(setting)
    last, speed = tuple(run.q[-1].tolist()), tuple((-run.qd[-1]).tolist())
    back, _ = _run(setting, q=last, qd=speed)
    return finding(gap(back.q[::-1], run.q), f"{run.time[-1]:g} s forth and back", q=run.q)


@case(
    "simulation.tolerance",
    title="A tighter solver changes nothing that matters",
    statement="q(t) at rtol 1e-9 and at rtol 1e-12 agree",
    regime="a fall with speeds in all joints",
    method="the same scenario at two tolerances",
    grade="C",
    tolerance=1e-6,
    unit="rad",
    reason="errors of 1e-9 a step grow by two to three decades in free motion",
    functions=("kr16cli.simulate.integrate.Integration",),
)
def tolerance(setting: Setting) -> Finding:
    """Numerical error, estimated."""
    run, _ = _run(setting)
    tight, _ = _run(setting, solver=SolverSpec(rtol=1e-12, atol=1e-13))
    figures = {"time": run.time.tolist(), "gap": gap(run.q, tight.q).tolist()}
    return finding(gap(run.q, tight.q), "joint angles at two tolerances", figures=figures, q=run.q)


@case(
    "simulation.order",
    title="Fixed steps have the order they claim",
    statement="error of a motion ~ h^4 for Runge-Kutta steps, ~ h for Euler's",
    regime="a fall of 0.2 s from a moving start; three or four step sizes, halved",
    method="slope of log error over log step, against a reference with a quarter of the least step",
    grade="C",
    tolerance=0.25,
    unit="difference of order",
    reason="the next term of the error bends the line by about h",
    functions=("kr16cli.simulate.core.rk4_step", "kr16cli.simulate.core.euler_step"),
)
def order(setting: Setting) -> Finding:
    """Convergence."""
    sampling.need_links(setting.robot.data)
    arm, rest = setting.robot.arm, [0.0] * 6

    def rate(t: float, state: Sequence[float]) -> list[float]:
        return [*state[6:], *arm.forward_dynamics(state[:6], state[6:], rest)]

    figures: dict[str, list[float]] = {}
    off = []
    # Steps large enough that errors stand above rounding, small enough for the asymptote.
    for name, step, counts in (
        ("Runge-Kutta", rk4_step, (4, 8, 16) if setting.quick else (5, 10, 20, 40)),
        ("Euler", euler_step, (16, 32, 64) if setting.quick else (25, 50, 100, 200)),
    ):
        ends = []
        for count in (*counts, (4 if step is rk4_step else 1) * counts[-1]):
            state, h = [*_START, *_SPEED], 0.2 / count
            for i in range(count):
                state = list(step(rate, i * h, state, h))
            ends.append(np.array(state[:6]))
        reference = ends.pop() if step is rk4_step else _exact_end(figures)
        if step is rk4_step:
            figures["end"] = reference.tolist()
        errors = [float(np.abs(end - reference).max()) for end in ends[: len(counts)]]
        steps = [0.2 / count for count in counts]
        slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
        figures[f"{name} step"], figures[f"{name} error"] = steps, errors
        off.append(abs(slope - (4.0 if step is rk4_step else 1.0)))
    return finding(off, "orders of two methods", figures=figures)


def _exact_end(figures: dict[str, list[float]]) -> Array:
    return np.array(figures["end"])
