"""From a scenario to the start values and the default experiment of an FMU."""

from __future__ import annotations

from kr16cli.fmi.build import Options
from kr16cli.fmi.variables import LIMITS, MODES, Part, Start
from kr16cli.robot import Payload, RobotData
from kr16cli.simulate.motion_spec import ControllerSpec
from kr16cli.simulate.scenario import Scenario, SolverSpec
from kr16cli.units import rad

_BENT: tuple[float, ...] = tuple(map(rad, (0.0, -60.0, 60.0, 0.0, 30.0, 0.0)))
"""Where an FMU without scenario starts: away from every singularity, B from its pole as well."""

_DAMPED = (ControllerSpec("task_space").near, ControllerSpec("task_space").strength)
_KNOWN = {name: number for number, (name, _) in enumerate(MODES, 1)}
_METHODS = {"RK4": 2, "SemiImplicitEuler": 3}
_STOPS = {name: number for number, (name, _) in enumerate(LIMITS, 1)}


def options(
    data: RobotData, scenario: Scenario | None, part: Part, compiler: str | None
) -> tuple[Options, list[str]]:
    """What to build, and what of the scenario an FMU cannot say, a sentence each.

    Args:
        data: the robot; its gravity counts where the scenario is silent.
        scenario: gives start values, default experiment and controller; None for a bent arm
            without torques.
        part: the robot or its controller.
        compiler: for the shim, or None.
    """
    if scenario is None:
        usual = _KNOWN["torque" if part is Part.ROBOT else "computed_torque"]
        start = Start(q=_BENT, gravity=data.gravity, mode=usual)
        return Options(start, part, compiler=compiler), []
    controller, torque = scenario.controller, scenario.torque
    mode: str = "gravity" if torque.kind == "gravity" else "torque"
    notes: list[str] = []
    if controller is not None:
        mode = "torque" if controller.kind == "zero" else controller.kind
        notes += _unsaid(controller.sampling is not None, "the controller's sampling")
        notes += _unsaid(not controller.knows_payload, "a controller that ignores the payload")
        notes += _unsaid(controller.kp is not None, "gains kp, kd; it takes the frequency")
        damped = (controller.near, controller.strength)
        notes += _unsaid(damped != _DAMPED, "near_singular and singular_damping; it takes its own")
    notes += _unsaid(torque.kind == "csv", "the torque file; connect it to tau")
    notes += _unsaid(scenario.reference is not None, "the reference; connect it to q_ref, qd_ref")
    notes += _unsaid(scenario.wrench is not None, "the wrench; connect it to wrench")
    limits = scenario.limits
    notes += _unsaid(limits.joint not in _STOPS, f'joint limits "{limits.joint}"; they are flagged')
    start = Start(
        q=scenario.q,
        qd=scenario.qd,
        tau=torque.tau or (0.0,) * 6,
        gravity=scenario.gravity or data.gravity,
        payload=scenario.payload or Payload(),
        drives=scenario.drives,
        mode=_KNOWN[mode],
        frequency=(controller.frequency if controller else 15.0,) * 6,
        damping=controller.damping if controller else 1.0,
        limits=_STOPS.get(limits.joint, 1),
        limit_torque=limits.torque,
        limit_speed=limits.speed,
        method=_METHODS.get(scenario.solver.method, 1),
        step=_step(scenario.solver),
    )
    made = Options(start, part, scenario.duration, scenario.output_step, scenario.name, compiler)
    return made, notes


def _unsaid(there: bool, what: str) -> list[str]:
    return [f"the FMU leaves out {what}"] if there else []


def _step(solver: SolverSpec) -> float:
    """The scenario's fixed step, within what solver.step allows; 1 ms without one."""
    return min(max(solver.step or 1e-3, 1e-6), 0.1)
