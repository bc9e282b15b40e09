"""Plant and controller as the parameters and inputs of an instance ask for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from kr16cli.fmi.stiff import rosenbrock_step
from kr16cli.fmi.variables import COM, GRAVITY, INERTIA, six
from kr16cli.fmi.written_arm import WrittenArm, WrittenTaskControl
from kr16cli.robot import JointData, Payload, RobotData
from kr16cli.robot_rules import checked_payload
from kr16cli.simulate.controllers import ComputedTorque, GravityCompensation, GravityPD, Zero, gains
from kr16cli.simulate.core import Controller, Setpoint, euler_step, rk4_step
from kr16cli.simulate.plant import Limits, Plant, Wrench
from kr16cli.simulate.task_control import TaskComputedTorque
from kr16cli.single import Arm

_Step = Callable[[Plant, float, Sequence[float], float], list[float]]


def _method(number: int, arm: Arm) -> _Step:
    """The step of the number of solver.method."""
    if number == 2:
        return lambda plant, t, state, h: rk4_step(plant.rates, t, state, h)
    if number == 3:
        return lambda plant, t, state, h: euler_step(plant.rates, t, state, h)
    if isinstance(arm, WrittenArm):
        return partial(rosenbrock_step, solve=arm.solve)
    return rosenbrock_step


_NOTHING = (0.0,) * 6


class Drive:
    """What is asked of the drives: a controller's torque, plus the inputs tau."""

    breaks: Sequence[float] = ()

    def __init__(self, controller: Controller, setpoint: Setpoint, tau: Sequence[float]) -> None:
        self._controller, self._setpoint, self._tau = controller, setpoint, tau
        self._idle = isinstance(controller, Zero)

    def __call__(self, t: float, q: Sequence[float], qd: Sequence[float]) -> Sequence[float]:
        """The torques, N m."""
        if self._idle:
            return self._tau
        own = self._controller.torque(t, q, qd, self._setpoint)
        return [a + b for a, b in zip(own, self._tau, strict=True)]


class Settings:
    """Plant, controller and solver for one set of parameters.

    Args:
        data: the robot.
        values: of all parameters, by name.
        make_arm: makes an arm of `data`, `payload=` and `drives=`.
    """

    def __init__(
        self, data: RobotData, values: Mapping[str, Any], make_arm: Callable[..., Arm]
    ) -> None:
        def row(name: str) -> list[float]:
            return [values[n] for n in six(name)]

        drives = values["drives"]
        x, y, z = (values[n] for n in GRAVITY)
        joints = (
            _joint(*numbers)
            for numbers in zip(
                data.joints, row("rotor_inertia"), row("friction.coulomb"),
                row("friction.viscous"), strict=True,
            )
        )  # fmt: skip
        own = replace(data, joints=tuple(joints), gravity=(x, y, z))
        self.arm = make_arm(own, payload=_payload(values), drives=drives)
        self.step = values.get("solver.step", 1e-3)
        self.controller = _controller(self.arm, values, row)
        contact = values.get("limits.joint", 1) == 2
        limits = Limits(
            joint="contact" if contact else "report",
            torque=values.get("limits.torque", False),
            speed=values.get("limits.speed", False),
        )
        nothing = Drive(Zero(), Setpoint(self.arm, _NOTHING), _NOTHING)
        self.plant = Plant(self.arm, nothing, limits=limits)
        method = values.get("solver.method", 1)
        chosen = (4 if drives or contact else 2) if method == 1 else method
        self._advance = _method(chosen, self.arm)
        self.stale = True

    def advance(self, time: float, state: Sequence[float], h: float) -> list[float]:
        """The state one internal step of h (s) later."""
        return self._advance(self.plant, time, state, h)

    def inputs_changed(self) -> None:
        """The inputs are no longer those taken."""
        self.stale = True

    def take_inputs(self, inputs: Mapping[str, Sequence[float]]) -> None:
        """Let the inputs act: tau (N m), q_ref, qd_ref, qdd_ref, and wrench (N, N m)."""
        setpoint = Setpoint(self.arm, inputs["q_ref"], inputs["qd_ref"], inputs["qdd_ref"])
        self.plant.torque = Drive(self.controller, setpoint, inputs.get("tau", _NOTHING))
        load = inputs.get("wrench", _NOTHING)
        self.plant.wrench = Wrench(load[:3], load[3:], start=-1e300) if any(load) else None
        self.stale = False


def _joint(joint: JointData, rotor: float, coulomb: float, viscous: float) -> JointData:
    """The joint with other drive numbers; the rotor's inertia is given at the joint."""
    return replace(joint, rotor_inertia=rotor, gear_ratio=1.0, coulomb=coulomb, viscous=viscous)


def _payload(values: Mapping[str, Any]) -> Payload:
    """The load on the flange, if a body can have its inertia."""
    com = [values[name] for name in COM]
    return checked_payload(values["payload.mass"], com, [values[name] for name in INERTIA])


def _controller(
    arm: Arm, values: Mapping[str, Any], row: Callable[[str], list[float]]
) -> Controller:
    """The controller of control.mode with gains for its natural frequency and damping."""
    mode, frequency = values["control.mode"], row("control.frequency")
    damping = values["control.damping"]
    if mode == 1:
        return Zero()
    if mode == 2:
        return GravityCompensation(arm)
    if mode == 3:
        return GravityPD.tuned(arm, row("q_start"), frequency, damping)
    if mode == 4:
        return ComputedTorque(arm, *gains(frequency, damping))
    kind = WrittenTaskControl if isinstance(arm, WrittenArm) else TaskComputedTorque
    return kind(arm, *gains(frequency, damping))
