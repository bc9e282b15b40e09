"""What the cases on simulation share: a start, torques, and runs of the robot."""

from __future__ import annotations

from dataclasses import replace

from kr16cli.robot import RobotData
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.run import Run
from kr16cli.simulate.scenario import Scenario, Six, SolverSpec, TorqueSpec
from kr16cli.verify import sampling
from kr16cli.verify.records import Setting

START: Six = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
SPEED: Six = (0.4, -0.3, 0.2, 0.5, -0.6, 0.7)
TAU: Six = (120.0, -500.0, -150.0, 12.0, -15.0, 3.0)
SIMULATE = "kr16cli.simulate.experiment.simulate"


def numbers(setting: Setting) -> RobotData:
    """The robot's numbers; a case is skipped where inertias are missing."""
    sampling.need_links(setting.robot.data)
    return setting.robot.data


def run(setting: Setting, **changes: object) -> Run:
    """A motion from START with SPEED, 1 s long, or 0.12 s where quick."""
    duration = 0.12 if setting.quick else 1.0
    base = Scenario("verify", q=START, qd=SPEED, duration=duration, output_step=0.02)
    return simulate(numbers(setting), replace(base, **changes))  # type: ignore[arg-type]  # by name


def driven(setting: Setting) -> Run:
    """Constant torques with rotor inertia, friction and a payload; stiff, so not for long."""
    return run(
        setting, torque=TorqueSpec("constant", TAU), drives=True, payload=sampling.LOAD,
        duration=0.01 if setting.quick else 0.5, output_step=0.0025 if setting.quick else 0.02,
        solver=SolverSpec(rtol=1e-7, atol=1e-8) if setting.quick else SolverSpec(),
    )  # fmt: skip
