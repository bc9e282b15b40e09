"""Motions of the arm under given torques: one, or thousands at once, each with its own numbers.

M(q) qdd + C(q, qd) qd + G(q) + friction = tau + J^T w, integrated by compiled solvers where the
kernels are compiled, else on NumPy columns. For controllers, limits and events see `simulate`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from kr16cli import arrays
from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.errors import InputError
from kr16cli.kernels import engine_name
from kr16cli.kernels.parameters import COUNT, flatten, parameters
from kr16cli.kernels.rollout import METHODS, Method, Task, run
from kr16cli.model import inertia
from kr16cli.robot import Payload

Like = npt.ArrayLike


@dataclass(frozen=True)
class Variation:
    """What differs from one trajectory to the next; None: as the robot has it. SI units.

    Leading axes `...` broadcast with the start states.

    Attributes:
        payload_mass: (...), a load on the flange in place of the robot's own; 0 is none.
        payload_com: (..., 3) its mass centre from the flange origin, flange axes.
        payload_inertia: (..., 6) Ixx, Iyy, Izz, Ixy, Ixz, Iyz about its mass centre.
        link_mass: (..., 6) of the links, as the robot's file gives them, without payload.
        link_com: (..., 6, 3) their mass centres, each in the file's frame.
        link_inertia: (..., 6, 6) their inertia about the mass centres, entries as above.
        gravity: (..., 3) in robroot.
        rotor_inertia: (..., 6) of the drives, seen at the joints.
        coulomb: (..., 6) Coulomb friction, N m.
        viscous: (..., 6) viscous friction, N m s/rad.
    """

    payload_mass: Like | None = None
    payload_com: Like | None = None
    payload_inertia: Like | None = None
    link_mass: Like | None = None
    link_com: Like | None = None
    link_inertia: Like | None = None
    gravity: Like | None = None
    rotor_inertia: Like | None = None
    coulomb: Like | None = None
    viscous: Like | None = None


_TRAILING = {
    "payload_mass": (),
    "payload_com": (3,),
    "payload_inertia": (6,),
    "link_mass": (6,),
    "link_com": (6, 3),
    "link_inertia": (6, 6),
    "gravity": (3,),
    "rotor_inertia": (6,),
    "coulomb": (6,),
    "viscous": (6,),
}
_NOT_NEGATIVE = ("payload_mass", "link_mass", "rotor_inertia", "coulomb", "viscous")


@dataclass(frozen=True)
class Rollout:
    """Motions at requested times.

    Attributes:
        time: (m,) s.
        q, qd: (..., m, 6) angles and speeds; NaN from where a motion could not go on.
        reached: (...) time up to which there is a solution, s.
        steps, rejected: (...) steps made, and tried in vain for the tolerance.
        evaluations: (...) of the right-hand side.
        duration: asked for, s.
    """

    time: Array
    q: Array
    qd: Array
    reached: Array
    steps: npt.NDArray[np.int64]
    rejected: npt.NDArray[np.int64]
    evaluations: npt.NDArray[np.int64]
    duration: float

    @property
    def complete(self) -> npt.NDArray[np.bool_]:
        """(...) whether a motion lasted as long as it was to."""
        return np.asarray(self.reached >= self.duration)


def rollout(
    robot: Robot,
    q: Like,
    qd: Like = (0.0,) * 6,
    *,
    duration: float,
    times: Like | None = None,
    method: Method = "dopri5",
    step: float | None = None,
    rtol: float = 1e-9,
    atol: float = 1e-9,
    max_steps: int = 1_000_000,
    tau: Like = (0.0,) * 6,
    hold: float | None = None,
    wrench: Like | None = None,
    wrench_axes: Literal["robroot", "flange"] = "robroot",
    variation: Variation | None = None,
    threads: int = 1,
) -> Rollout:
    """Let arms move under given torques. Leading axes `...` broadcast: a trajectory each.

    Friction and rotor inertia count where the robot has its drives. The motion is chaotic:
    from nearby starts, or by other methods, it parts after seconds; the energy does not.

    Args:
        robot: the arm, with inertial data.
        q: (..., 6) angles at the start, rad.
        qd: (..., 6) speeds at the start, rad/s.
        duration: end of the motion, s, above 0.
        times: (m,) when its state is wanted, rising from 0 to `duration` at most; None: at both
            ends. Memory grows with these alone.
        method: "dopri5", Dormand and Prince's order 5(4) with steps to its tolerance and dense
            output of order 4; or "rk4", the classical order 4, between steps by cubics.
        step: rk4's step, s (the steps between two changes of torque are equal, and no longer);
            dopri5's longest, None for any.
        rtol: dopri5's tolerance of a step, relative to the state.
        atol: what it tolerates besides, rad and rad/s.
        max_steps: a trajectory that needs more steps than this is given up.
        tau: (..., 6) torques, N m; with `hold` (..., n, 6), each held for so many seconds and
            the last to the end.
        hold: time from one torque to the next, s; None for constant torques.
        wrench: (..., 6) force (N) and moment (N m) on the flange, at its origin; None for none.
        wrench_axes: the axes it keeps: robroot's, or the flange's.
        variation: numbers of the robot that differ from trajectory to trajectory.
        threads: threads of the compiled solvers.

    Returns:
        The motions. One that leaves the numbers, or needs too small steps, is NaN from then
        on, and does not touch others.

    Raises:
        InputError: a robot without inertial data, or an argument that cannot be used.
    """
    robot.arm.require_inertia()
    known = {"q": arrays.checked("q", q, 6), "qd": arrays.checked("qd", qd, 6)}
    known["tau"] = _torques(tau, hold)
    if wrench is not None:
        known["wrench"] = arrays.checked("wrench", wrench, 6)
    varied = {} if variation is None else _checked_variation(variation)
    ranks = [1, 1, 2, *(1 for name in known if name == "wrench")]
    ranks += [len(_TRAILING[name]) for name in varied]
    lead = arrays.batch([*known, *varied], [*known.values(), *varied.values()], ranks)
    end = _positive("duration", duration, "s")
    seconds = _times(times, end)
    n = int(np.prod(lead, dtype=int))
    state = np.empty((n, 12))
    state[:, :6], state[:, 6:] = (arrays.flat(known[name], lead, 1) for name in ("q", "qd"))
    numbers, vertical, drives = _numbers(robot, varied, lead)
    task = Task(
        method=_method(method),
        vertical=vertical,
        drives=drives,
        parameters=numbers,
        state=state,
        torque=_each(known["tau"], lead, 2),
        hold=end if hold is None else _positive("hold", hold, "s"),
        wrench=_each(known["wrench"], lead, 1) if wrench is not None else None,
        in_flange=_in_flange(wrench_axes),
        duration=end,
        step=_step(step, method, end, max_steps),
        rtol=_positive("rtol", rtol, ""),
        atol=_positive("atol", atol, "rad"),
        max_steps=_count(max_steps),
        times=seconds,
        out=np.empty((n, len(seconds), 12)),
        reached=np.zeros(n),
        tally=np.zeros((n, 3), dtype=np.int64),
    )
    run(task, native=engine_name() == "native", threads=arrays.checked_threads(threads))
    motion = task.out.reshape(*lead, len(seconds), 12)
    steps, rejected, evaluations = (task.tally[:, i].reshape(lead) for i in range(3))
    return Rollout(
        time=seconds,
        q=motion[..., :6],
        qd=motion[..., 6:],
        reached=task.reached.reshape(lead),
        steps=steps,
        rejected=rejected,
        evaluations=evaluations,
        duration=end,
    )


def numbers_of(robot: Robot, variation: Variation, count: int) -> Array:
    """The numbers of `count` robots as the kernels take them, `kernels.parameters.flatten`.

    Args:
        robot: what they have in common.
        variation: what differs, each field (count, ...).
        count: how many.

    Returns:
        (count, `kernels.parameters.COUNT`), SI units.

    Raises:
        InputError: as `rollout`.
    """
    numbers = _numbers(robot, _checked_variation(variation), (count,))[0]
    return np.broadcast_to(numbers, (count, COUNT))


# Arguments ------------------------------------------------------------------------------------


def _positive(name: str, value: float, unit: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {value!r}; expected a number above 0") from None
    if not 0.0 < number < np.inf:
        raise InputError(f"{name} is {number:g} {unit}".rstrip() + "; it must be above 0")
    return number


def _method(method: str) -> Method:
    for known in METHODS:
        if method == known:
            return known
    raise InputError(f"method is {method!r}; choose {' or '.join(METHODS)}")


def _in_flange(axes: str) -> bool:
    if axes not in ("robroot", "flange"):
        raise InputError(f"wrench_axes is {axes!r}; choose robroot or flange")
    return axes == "flange"


def _count(steps: object) -> int:
    if not isinstance(steps, (int, np.integer)) or isinstance(steps, bool) or steps < 1:
        raise InputError(f"max_steps is {steps!r}; expected a whole number of 1 or more")
    return int(steps)


def _step(step: float | None, method: str, duration: float, max_steps: int) -> float:
    if step is None:
        if method == "rk4":
            raise InputError("method rk4 needs a step, s; 0.001 suits this arm")
        return 0.0
    length = _positive("step", step, "s")
    if method == "rk4" and duration / length > max_steps:
        raise InputError(
            f"step is {length:g} s: {duration / length:.3g} steps in {duration:g} s; the limit is "
            f"max_steps = {max_steps}"
        )
    return length


def _times(times: Like | None, duration: float) -> Array:
    if times is None:
        return np.array([0.0, duration])
    seconds = np.ascontiguousarray(arrays.checked("times", times))
    if seconds.ndim != 1:
        raise InputError(f"times has shape {seconds.shape}; expected (m,)")
    if len(seconds) and (seconds[0] < 0.0 or seconds[-1] > duration):
        span = f"{seconds[0]:g} to {seconds[-1]:g} s"
        raise InputError(f"times are {span}; they must lie between 0 and duration = {duration:g} s")
    if (np.diff(seconds) < 0.0).any():
        at = int(np.argmax(np.diff(seconds) < 0.0)) + 1
        raise InputError(f"times[{at}] is {seconds[at]:g} s, before the time before it; sort them")
    return seconds


def _torques(tau: Like, hold: float | None) -> Array:
    """(..., samples, 6)."""
    if hold is None:
        return arrays.checked("tau", tau, 6)[..., None, :]
    table = arrays.checked("tau", tau, 6)
    if table.ndim < 2 or table.shape[-2] < 1:
        raise InputError(f"tau has shape {table.shape}; with hold expected (..., n, 6), n >= 1")
    return table


def _each(table: Array, lead: tuple[int, ...], rank: int) -> Array:
    """(1 or n, ...) contiguous: one group where all trajectories share it."""
    own = table.shape[table.ndim - rank :]
    if table.size == int(np.prod(own, dtype=int)):
        return np.ascontiguousarray(table.reshape(1, *own))
    return np.ascontiguousarray(np.broadcast_to(table, lead + own).reshape(-1, *own))


# The robot's numbers --------------------------------------------------------------------------


def _checked_variation(variation: Variation) -> dict[str, Array]:
    """The given fields as finite arrays that physics allows."""
    if not isinstance(variation, Variation):
        raise InputError(f"variation is a {type(variation).__name__}; expected a Variation")
    given = {f.name: getattr(variation, f.name) for f in fields(variation)}
    checked = {
        name: arrays.checked(f"variation.{name}", value, *_TRAILING[name])
        for name, value in given.items()
        if value is not None
    }
    if "payload_mass" not in checked:
        orphans = [name for name in checked if name.startswith("payload")]
        if orphans:
            raise InputError(f"variation.{orphans[0]} needs variation.payload_mass")
    for name in _NOT_NEGATIVE:
        if name in checked and (checked[name] < 0.0).any():
            least = checked[name].min()
            raise InputError(f"variation.{name} holds {least:g}; it must be 0 or more")
    for name in ("payload_inertia", "link_inertia"):
        if name in checked:
            _reject_tensors(f"variation.{name}", checked[name])
    return checked


def _reject_tensors(name: str, tensors: Array) -> None:
    """Raise for an inertia that no rigid body has; the limits of `robot_rules`."""
    xx, yy, zz, xy, xz, yz = np.moveaxis(tensors, -1, 0)
    matrices = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=-1)
    low, middle, high = np.moveaxis(
        np.linalg.eigvalsh(matrices.reshape(*tensors.shape[:-1], 3, 3)), -1, 0
    )
    bad = (low < -1e-12 * high) | (low + middle < high * (1.0 - 1e-12))
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        moments = f"{low[index]:.6g}, {middle[index]:.6g}, {high[index]:.6g}"
        label = f"{name}[{', '.join(map(str, index))}]" if index else name
        raise InputError(f"{label} has principal moments {moments} kg m2; no rigid body has that")


def _numbers(
    robot: Robot, varied: dict[str, Array], lead: tuple[int, ...]
) -> tuple[Array, bool, bool]:
    """Flat vector(s) of the kernels; whether gravity is along z, whether friction counts."""
    arm = robot.arm
    own = parameters(arm)
    drives = bool(own.coulomb) or "coulomb" in varied or "viscous" in varied
    vertical = not any(robot.data.gravity[:2]) and "gravity" not in varied
    if not varied:
        return np.array([float(v) for v in flatten(own)]), vertical, drives
    n = int(np.prod(lead, dtype=int))
    columns = {
        name: np.moveaxis(
            np.broadcast_to(v, lead + _TRAILING[name]).reshape(n, *_TRAILING[name]), 0, -1
        )
        for name, v in varied.items()
    }
    bodies = _bodies(robot, columns)
    numbers = own._replace(
        gravity=list(columns.get("gravity", own.gravity)),
        base=inertia.regroup(bodies, arm.geometry),
        rotors=list(columns.get("rotor_inertia", own.rotors)),
        full=bodies,
        coulomb=list(columns.get("coulomb", own.coulomb or [0.0] * 6)),
        viscous=list(columns.get("viscous", own.viscous or [0.0] * 6)),
    )
    table = np.empty((n, COUNT))
    for column, value in zip(table.T, flatten(numbers), strict=True):
        column[...] = value
    return table, vertical, drives


def _bodies(robot: Robot, columns: dict[str, Array]) -> tuple[inertia.Body, ...]:
    """The links in their joint frames, with their load; columns in place of floats."""
    links = []
    for i, link in enumerate(robot.data.links):
        changes = {
            name: tuple(v[i]) if v[i].ndim > 1 else v[i]
            for name in ("mass", "com", "inertia")
            if (v := columns.get(f"link_{name}")) is not None
        }
        links.append(replace(link, **changes))  # type: ignore[arg-type]  # columns as scalars
    if "payload_mass" not in columns:
        return inertia.robot_bodies(links, robot.payload, robot.data.geometry)
    mass = columns["payload_mass"]
    tensor = np.where(mass == 0.0, 0.0, columns.get("payload_inertia", np.zeros((6, 1))))
    load = Payload(
        mass,  # type: ignore[arg-type]  # columns as scalars
        tuple(columns.get("payload_com", np.zeros(3))),
        tuple(tensor),
    )
    *rest, last = inertia.robot_bodies(links, None, robot.data.geometry)
    return (*rest, last + inertia.payload_body(load, robot.data.geometry))
