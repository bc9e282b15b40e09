"""From what a scenario says to the controller, the reference and the torque that run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from kr16cli.api import Robot
from kr16cli.kuka import matrix_from_abc
from kr16cli.simulate.controllers import (
    ComputedTorque,
    GravityCompensation,
    GravityPD,
    Zero,
    gains,
)
from kr16cli.simulate.core import Controller, Reference, Torque
from kr16cli.simulate.fast import quickest_arm
from kr16cli.simulate.krl_program import Pace, load_program, program
from kr16cli.simulate.loop import ClosedLoop, SampledLoop
from kr16cli.simulate.motion_spec import ControllerSpec, ReferenceSpec
from kr16cli.simulate.paths import Circle, Curve, Line, PathMove
from kr16cli.simulate.references import RISE, Chain, Hold, JointMove, Spline, greatest_speeds
from kr16cli.simulate.scenario_check import ANGLE, ANGLE_DEG
from kr16cli.simulate.task_control import TaskComputedTorque
from kr16cli.simulate.timed_csv import read_timed_csv
from kr16cli.simulate.torque import make_torque
from kr16cli.single import Arm, Matrix
from kr16cli.units import rad

if TYPE_CHECKING:
    from kr16cli.simulate.scenario import Scenario

_RAD_COLUMNS = tuple(f"q{i}" for i in range(1, 7))
_DEG_COLUMNS = tuple(f"a{i}" for i in range(1, 7))


def make_drive(scenario: Scenario, arm: Arm) -> tuple[Torque, Reference | None]:
    """The torque of a scenario, and the reference it follows, if any.

    Raises:
        FileError: a torque, waypoint or program file cannot be used.
        NoAnswerError: the reference leaves the workspace or the limits, or jumps a branch.
    """
    spec = scenario.controller
    if spec is None:
        return make_torque(scenario.torque, arm, scenario.folder), None
    reference = None
    if scenario.reference is not None:
        reference = make_reference(scenario.reference, arm, scenario.q, scenario.folder)
    controller = make_controller(spec, arm, scenario.q)
    followed = reference or Hold(arm, scenario.q, checked=False)
    if spec.sampling is None:
        return ClosedLoop(controller, followed), reference
    loop = SampledLoop(controller, followed, spec.sampling, scenario.duration)
    return loop, reference


def make_controller(spec: ControllerSpec, arm: Arm, q: Sequence[float]) -> Controller:
    """A controller for a robot that starts at q (rad)."""
    known = arm if spec.knows_payload else quickest_arm(Robot(arm.data, drives=arm.drives))
    if spec.kind == "zero":
        return Zero()
    if spec.kind == "gravity":
        return GravityCompensation(known)
    if spec.kind == "pd" and (spec.kp is None or spec.kd is None):
        return GravityPD.tuned(known, q, spec.frequency, spec.damping)
    kp, kd = gains(spec.frequency, spec.damping)
    kp, kd = list(spec.kp or kp), list(spec.kd or kd)
    if spec.kind == "pd":
        return GravityPD(known, kp, kd)
    if spec.kind == "computed_torque":
        return ComputedTorque(known, kp, kd)
    return TaskComputedTorque(known, kp, kd, near=spec.near, strength=spec.strength)


def make_reference(
    spec: ReferenceSpec, arm: Arm, q: Sequence[float], folder: Path = Path()
) -> Reference:
    """A reference for a robot that starts at q (rad); a file's name is relative to `folder`."""
    motion = _motion(spec, arm, q, folder)
    if not spec.start:
        return motion
    return Chain([Hold(arm, motion.joint(0.0).q, spec.start), motion])


def _motion(spec: ReferenceSpec, arm: Arm, q: Sequence[float], folder: Path) -> Reference:
    """The motion itself, beginning at once."""
    speed = greatest_speeds(arm.data.joints, spec.speed_part)
    acceleration = spec.acceleration or [v / RISE for v in greatest_speeds(arm.data.joints)]
    if spec.kind == "hold":
        return Hold(arm, spec.end or q)
    if spec.kind == "ptp":
        return JointMove(arm, q, spec.end or q, spec.shape, speed, acceleration)
    if spec.kind == "csv":
        return _waypoints(folder / str(spec.file), arm)
    if spec.kind == "krl":
        pace = Pace(spec.shape, speed, acceleration, spec.path)
        if spec.program is not None:
            return program(spec.program, arm, q, pace)
        return load_program(folder / str(spec.file), arm, q, pace)
    end: Matrix | None = None if spec.abc is None else matrix_from_abc(*spec.abc)
    return PathMove(arm, q, _curve(spec, arm, q), end, spec.shape, spec.path)


def _curve(spec: ReferenceSpec, arm: Arm, q: Sequence[float]) -> Curve:
    """The line or circle from the flange at q."""
    here = [row[3] for row in arm.fk(q)[:3]]
    if spec.kind == "circle":
        centre = [a + b for a, b in zip(here, spec.centre or (0.0,) * 3, strict=True)]
        return Circle(here, centre, spec.normal or (0.0, 0.0, 1.0), spec.angle)
    if spec.place is not None:
        return Line(here, spec.place)
    return Line(here, [a + b for a, b in zip(here, spec.offset or (0.0,) * 3, strict=True)])


def _waypoints(path: Path, arm: Arm) -> Spline:
    """Waypoints over time: q1 to q6 in rad, or a1 to a6 in degrees."""
    table = read_timed_csv(path, {_RAD_COLUMNS: ANGLE, _DEG_COLUMNS: ANGLE_DEG})
    if table.names == _RAD_COLUMNS:
        return Spline(arm, table.times, table.rows)
    return Spline(arm, table.times, [[rad(v) for v in row] for row in table.rows])
