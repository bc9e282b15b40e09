"""The simulator's motions beside those of MuJoCo and Pinocchio."""

from __future__ import annotations

import numpy as np

from kr16cli.simulate.scenario import TorqueSpec
from kr16cli.verify import sampling
from kr16cli.verify.engines import SOURCES, engine, integrated
from kr16cli.verify.measure import finding, gap
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.simulation.common import SIMULATE, SPEED, START, TAU, numbers, run


def _register(name: str) -> None:
    source = SOURCES[name]
    own_steps = name == "mujoco"

    @case(
        f"simulation.{name}",
        title=f"{source.title} moves the arm likewise",
        statement="q(t) of kr16 simulate = q(t) of the engine",
        regime="constant torques from a moving start, a payload, on a slope; 2 s, 0.06 s if quick",
        method="MuJoCo's own Runge-Kutta steps of 0.5 ms"
        if own_steps
        else f"{source.title}'s accelerations integrated by DOP853 at 1e-9",
        grade="A",
        tolerance=1e-6,
        unit="rad",
        reason="errors of 1e-10 a step grow by three decades in 2 s; chaos forbids longer runs",
        functions=(SIMULATE,),
        engine=name,
    )
    def motion(setting: Setting) -> Finding:
        data = numbers(setting).with_gravity(sampling.TILTED)
        other = engine(name, data, sampling.LOAD, quick=setting.quick)
        own = run(
            setting, torque=TorqueSpec("constant", TAU), payload=sampling.LOAD,
            gravity=sampling.TILTED, duration=0.06 if setting.quick else 2.0,
        )  # fmt: skip
        start = np.array(START), np.array(SPEED), np.array(TAU), own.time[1:]
        by_steps = getattr(other, "motion", None)  # MuJoCo integrates by itself
        theirs = by_steps(*start) if by_steps else integrated(other.forward_dynamics, *start)
        apart = gap(own.q[1:], theirs)
        figures = {"time": own.time[1:].tolist(), "gap": apart.tolist()}
        moved = np.abs(own.q - own.q[0]).max()
        text = f"{own.time[-1]:g} s; the arm moved by up to {moved:.2g} rad"
        return finding(apart, text, figures=figures, q=own.q[1:])


for _name in ("pinocchio", "mujoco"):
    _register(_name)
