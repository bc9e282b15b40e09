"""Laws that every motion keeps: energy, work, rest, and time without a direction."""

from __future__ import annotations

import numpy as np

from kr16cli.kernels.engine import has_native
from kr16cli.simulate import evidence
from kr16cli.simulate.scenario import SolverSpec, TorqueSpec
from kr16cli.verify import sampling
from kr16cli.verify.measure import finding, gap, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case, using_engine
from kr16cli.verify.suites.simulation.common import SIMULATE, START, numbers, run


@case(
    "simulation.energy",
    title="A free arm keeps its energy",
    statement="T + P is constant without torques and friction",
    regime="a swing with speeds in all joints, payload on the flange; 60 s, or 0.12 s where quick",
    method="energy of every sample against the first; the full run on the compiled kernels where "
    "there are any",
    grade="C",
    tolerance=1e-7,
    unit="relative",
    reason="solver errors of 1e-9 a step, most of which cancel; relative to the largest T",
    functions=(SIMULATE, "kr16cli.Robot.energy"),
)
def energy(setting: Setting) -> Finding:
    """Conservation."""
    duration, data = (0.12 if setting.quick else 60.0), numbers(setting)
    with using_engine("native" if has_native() and not setting.quick else "numpy"):
        swing = evidence.conservative_swing(data, duration, sampling.LOAD)
    total = swing.energy_kinetic + swing.energy_potential
    drift = np.abs(total - total[0]) / swing.energy_kinetic.max()
    figures = {"time": swing.time.tolist(), "drift": drift.tolist()}
    short = len(swing.time) < 2 or swing.time[-1] < duration
    text = f"{len(swing.time)} samples in {swing.time[-1]:g} s"
    return finding(drift + np.inf * short if short else drift, text, figures=figures,
                   q=swing.q, qd=swing.qd)  # fmt: skip


@case(
    "simulation.work",
    title="Energy gained is the work of all torques less that of friction",
    statement="T + P - (T + P)(0) = work of drives - friction + wrench + joint stops",
    regime="torques beyond the drives' limits, rotor inertia, friction, payload; in the full run "
    "a wrench at the flange and a joint against its stop as well",
    method="works integrated beside the motion; energy of every sample; friction only takes",
    grade="C",
    tolerance=1e-6,
    unit="relative",
    reason="solver errors of 1e-9 a step; relative to the largest work",
    functions=(SIMULATE, "kr16cli.Robot.friction", "kr16cli.simulate.plant.Plant"),
)
def work(setting: Setting) -> Finding:
    """Balance."""
    busy = evidence.busy_run(numbers(setting), 0.02 if setting.quick else 0.12)
    works = {
        "drives": busy.work_torque, "friction": busy.work_friction,
        "wrench": busy.work_wrench, "stops": busy.work_contact,
    }  # fmt: skip
    sizes = {name: float(np.abs(w).max()) for name, w in works.items()}
    error = np.abs(busy.drift) / max(sizes.values())
    idle = [name for name in ("drives", "friction") if sizes[name] < 1.0]
    if not setting.quick:
        idle += [name for name in ("wrench", "stops") if sizes[name] < 1.0]
    error[1:] = np.where(np.diff(busy.work_friction) < 0, np.inf, error[1:])
    text = ", ".join(f"{name} {size:.3g} J" for name, size in sizes.items())
    if idle:
        return finding(error + np.inf, f"no work of {' and '.join(idle)}: {text}")
    return finding(error, f"largest works: {text}", q=busy.q, qd=busy.qd)


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
    functions=(SIMULATE, "kr16cli.Robot.gravity"),
)
def hold(setting: Setting) -> Finding:
    """At rest it stays."""
    still = run(
        setting, torque=TorqueSpec("gravity"), payload=sampling.LOAD, qd=(0.0,) * 6,
        gravity=sampling.TILTED,
    )  # fmt: skip
    error = largest(gap(still.q, np.array(START)), np.abs(still.qd).max(axis=1))
    return finding(error, f"{still.time[-1]:g} s of rest", q=still.q)


@case(
    "simulation.reversal",
    title="A free motion run backwards returns to its start",
    statement="q(-t) of the reversed end state = q(t)",
    regime="a fall with speeds in all joints; 0.5 s, or 0.05 s where quick",
    method="the end state with its speeds reversed, simulated for the same time at rtol 1e-12",
    grade="C",
    tolerance=1e-8,
    unit="rad",
    reason="solver errors of 1e-12 a step grow by two to three decades there and back",
    functions=(SIMULATE,),
)
def reversal(setting: Setting) -> Finding:
    """Time has no direction here."""
    found = evidence.reversal(numbers(setting), 0.05 if setting.quick else 0.5)
    error = gap(found.found, found.expected)
    return finding(error, f"{found.time[-1]:g} s forth and back", q=found.expected)


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
    plain, tight = run(setting), run(setting, solver=SolverSpec(rtol=1e-12, atol=1e-13))
    apart = gap(plain.q, tight.q)
    figures = {"time": plain.time.tolist(), "gap": apart.tolist()}
    return finding(apart, "joint angles at two tolerances", figures=figures, q=plain.q)
