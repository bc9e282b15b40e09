"""Let a scenario happen to a robot: `simulate`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.robot import RobotData
from kr16cli.simulate.build import make_drive
from kr16cli.simulate.compiled import CompiledSolver
from kr16cli.simulate.core import Reference, Torque
from kr16cli.simulate.events import Event, LimitWatch, TargetWatch, Watch, Watches
from kr16cli.simulate.fast import quickest_arm
from kr16cli.simulate.integrate import Integration, Solution, sample_times
from kr16cli.simulate.loop import SampledLoop
from kr16cli.simulate.paths import tracking_error
from kr16cli.simulate.plant import WORK_TOLERANCE, WORKS, Plant
from kr16cli.simulate.run import WORK_NAMES, Run
from kr16cli.simulate.scenario import Scenario
from kr16cli.units import deg


def simulate(
    data: RobotData,
    scenario: Scenario,
    *,
    torque: Torque | None = None,
    on_step: Callable[[float], None] = lambda t: None,
) -> Run:
    """Simulate a scenario.

    Args:
        data: the robot, with inertial data.
        scenario: what happens.
        torque: drives the joints in place of the scenario's torque.
        on_step: told the time (s) after each step of the solver.

    Returns:
        The run; where the solver failed, the part before that, marked by `failure`.
        The same, marked by `stopped`, where a joint met a limit that ends the run.

    Raises:
        InputError: the robot has no inertial data.
        FileError: a file that the scenario names cannot be used.
        NoAnswerError: the reference leaves the workspace or the limits, or jumps a branch.
    """
    placed = data if scenario.gravity is None else data.with_gravity(scenario.gravity)
    robot = Robot(placed, payload=scenario.payload, drives=scenario.drives)
    _ = robot.arm.base_bodies  # complains now if there are none
    arm = quickest_arm(robot)
    drive, reference = (torque, None) if torque else make_drive(scenario, arm)
    plant = Plant(arm, drive, limits=scenario.limits, wrench=scenario.wrench)
    watches: list[Watch] = [LimitWatch(data.joints)]
    if reference is not None and reference.duration > 0.0:
        end = reference.duration
        watches.append(TargetWatch(end, reference.joint(end).q))
    stops = scenario.limits.joint == "stop"
    solver, weights = scenario.solver_used(), np.array([1.0] * 12 + [WORK_TOLERANCE] * WORKS)
    integration = Integration(
        plant,
        solver,
        weights,
        Watches(watches),
        on_step,
        on_break=_sampler(drive),
        ends=lambda event: stops and event.kind.startswith(("leave", "outside")),
        quick=CompiledSolver(robot, plant, solver, solver.atol * weights).stepper,
    )
    start = np.array([*scenario.q, *scenario.qd, *(0.0,) * WORKS])
    times = sample_times(scenario.duration, scenario.output_step)
    breaks = [*drive.breaks, *(scenario.wrench.breaks if scenario.wrench else ())]
    solution = integration.run(start, times, breaks)
    return _record(data, scenario, robot, plant, reference, solution)


def _sampler(drive: Torque) -> Callable[[float, Array], None]:
    """Tells a sampled controller of each break."""
    if not isinstance(drive, SampledLoop):
        return lambda t, y: None
    return lambda t, y: drive.sample(t, y[:6].tolist(), y[6:12].tolist())


def _record(
    data: RobotData,
    scenario: Scenario,
    robot: Robot,
    plant: Plant,
    reference: Reference | None,
    solution: Solution,
) -> Run:
    """The run that a solution amounts to."""
    tau = _torques(plant, solution)
    time, state = solution.time[: len(tau)], solution.state[: len(tau)]
    q, qd = (np.ascontiguousarray(state[:, k : k + 6]) for k in (0, 6))
    moments = list(zip(time.tolist(), q.tolist(), qd.tolist(), strict=True))
    other = np.array([_sum(plant.external(t, a), plant.contact(a, v)) for t, a, v in moments])
    T = robot.fk(q)
    kinetic, potential = robot.energy(q, qd)
    q_ref, error = _tracking(robot, reference, moments)
    works = {name: state[:, 12 + i].copy() for i, name in enumerate(WORK_NAMES)}
    return Run(
        time=time,
        q=q,
        qd=qd,
        qdd=robot.forward_dynamics(q, qd, tau + other),
        tau=tau,
        pose=np.hstack([T[:, :3, 3], robot.rpy(T)]),
        energy_kinetic=kinetic,
        energy_potential=potential,
        **works,
        events=tuple(solution.events),
        statistics=solution.statistics,
        failure=solution.failure,
        scenario=scenario.describe(),
        robot=data.name,
        model_sha256=data.sha256,
        q_ref=q_ref,
        error=error,
        stopped=_said(solution.stopped),
    )


def _torques(plant: Plant, solution: Solution) -> Array:
    """What the drives gave at each sample; a failed run may end where no torque is known."""
    known: list[list[float]] = []
    for t, y in zip(solution.time.tolist(), solution.state.tolist(), strict=True):
        try:
            known.append(plant.applied(plant.torque(t, y[:6], y[6:12]), y[6:12]))
        except (ArithmeticError, ValueError):
            if not known or solution.failure is None:
                raise
            break
    return np.array(known)


def _tracking(
    robot: Robot, reference: Reference | None, moments: list[tuple[float, list[float], list[float]]]
) -> tuple[Array | None, Array | None]:
    """Reference angles (n, 6) and the flange's distance (m) and angle (rad) from it (n, 2)."""
    if reference is None:
        return None, None
    q_ref = np.array([reference.joint(t).q for t, _, _ in moments])
    error = np.array([tracking_error(robot.arm, q, reference.task(t)) for t, q, _ in moments])
    return q_ref, error


def _sum(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [u + v for u, v in zip(a, b, strict=True)]


def _said(event: Event | None) -> str | None:
    """The event that ended a run, in words."""
    if event is None:
        return None
    return f"{event.joint} reaches its {event.kind.split('_')[1]} limit of {deg(event.value):g} deg"
