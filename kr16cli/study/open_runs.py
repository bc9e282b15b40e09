"""Runs of scenarios that no controller answers, many at once by the compiled solvers.

The simulator steps one robot at a time and finds every event; `rollout` steps them all, each with
its own numbers, and says nothing of energy or limits. Here those figures are made from its
samples: limits are passed where the cubic through two samples passes them, and the work lost in
friction is Gauss's sum of three points between two samples.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli.api import Robot
from kr16cli.arrays import Array
from kr16cli.kernels import engine_name
from kr16cli.kernels.columns import ARRAYS, ColumnEngine
from kr16cli.kernels.parameters import unpack
from kr16cli.kernels.quantities import QUANTITIES
from kr16cli.kernels.rollout import Method
from kr16cli.model.dynamics import friction
from kr16cli.robot import JointData, RobotData
from kr16cli.rollout import numbers_of, rollout
from kr16cli.simulate.integrate import sample_times
from kr16cli.simulate.scenario import Scenario
from kr16cli.study.crowd import crowd_of
from kr16cli.tolerances import TOLERANCES

_METHODS: Mapping[str, Method] = {"auto": "dopri5", "RK45": "dopri5", "RK4": "rk4"}
"""Solvers of a scenario that the compiled ones stand for: of RK45 and RK4 they are the same."""

_STATES_AT_ONCE = 1 << 18
"""States that are kept in memory together: 25 MB."""

_NODES = np.array([0.5 - 0.15**0.5, 0.5, 0.5 + 0.15**0.5])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


class Case(NamedTuple):
    """One run: a robot and what happens to it."""

    data: RobotData
    scenario: Scenario

    @property
    def placed(self) -> RobotData:
        """The robot under the scenario's gravity."""
        gravity = self.scenario.gravity
        return self.data if gravity is None else self.data.with_gravity(gravity)


def answered(scenario: Scenario) -> str | None:
    """What answers the motion, so that the torque is not given beforehand; None if nothing does."""
    limits = scenario.limits
    if scenario.controller is not None:
        return "a controller answers the motion"
    if scenario.wrench is not None:
        return "a wrench pushes the flange"
    if limits.joint != "report" or limits.torque or limits.speed:
        return "the limits act on the motion"
    if scenario.torque.kind not in ("zero", "constant"):
        return f"the torque is of kind {scenario.torque.kind}"
    return None


def unserved(scenario: Scenario) -> str | None:
    """Why the compiled solvers cannot take the simulator's place; None if they can."""
    method = scenario.solver.method
    if method not in _METHODS:
        return f"the scenario asks for {method}"
    return answered(scenario)


@dataclass(frozen=True)
class Figures:
    """Figures of n runs by name; `complete` (n,) tells which lasted as long as they were to."""

    columns: dict[str, Array]
    complete: npt.NDArray[np.bool_]


def figures(cases: Sequence[Case]) -> Figures:
    """Figures of runs that are served, by name of `sweep.FIGURES`.

    Robots of one geometry that are integrated alike go through the solver together.

    Raises:
        InputError: a robot has no inertial data.
    """
    groups: dict[Any, list[int]] = defaultdict(list)
    for i, case in enumerate(cases):
        groups[_alike(case)].append(i)
    columns: dict[str, Array] = {}
    complete = np.zeros(len(cases), dtype=bool)
    for rows in groups.values():
        for part in _cut(rows, cases[rows[0]].scenario):
            told, complete[part] = _together([cases[i] for i in part])
            for name, values in told.items():
                if name not in columns:
                    columns[name] = np.full((len(cases), *values.shape[1:]), np.nan)
                columns[name][part] = values
    return Figures(columns, complete)


def _alike(case: Case) -> Any:
    """Equal for cases that one call of the solver can take."""
    s = case.scenario
    return case.data.geometry, s.drives, s.solver, s.duration, s.output_step


def _cut(rows: Sequence[int], scenario: Scenario) -> Iterator[Sequence[int]]:
    each = (scenario.duration / scenario.output_step + 2.0) * (4 if scenario.drives else 1)
    size = max(1, int(_STATES_AT_ONCE / each))
    for low in range(0, len(rows), size):
        yield rows[low : low + size]


def _together(cases: Sequence[Case]) -> tuple[dict[str, Array], npt.NDArray[np.bool_]]:
    """Figures of cases that are alike, and which are complete."""
    s, solver = cases[0].scenario, cases[0].scenario.solver_used()
    times = sample_times(s.duration, s.output_step)
    nodes = _with_nodes(times) if s.drives else times
    robots = [case.placed for case in cases]
    first = Robot(robots[0], drives=s.drives)
    crowd = crowd_of(robots, [case.scenario.payload for case in cases], drives=s.drives)
    motion = rollout(
        first,
        np.array([case.scenario.q for case in cases]),
        np.array([case.scenario.qd for case in cases]),
        duration=s.duration,
        times=nodes,
        method=_METHODS[s.solver.method],
        step=solver.step,
        rtol=solver.rtol,
        atol=solver.atol,
        max_steps=solver.max_steps,
        tau=_torques(cases),
        variation=crowd,
    )
    every = 4 if s.drives else 1
    q, qd = (np.ascontiguousarray(v[:, ::every]) for v in (motion.q, motion.qd))
    # What did not last is the simulator's to explain; until then it moves nobody.
    lasted = motion.complete & np.isfinite(q).all(axis=(1, 2)) & np.isfinite(qd).all(axis=(1, 2))
    q[~lasted] = qd[~lasted] = 0.0
    told = _told(cases, times, q, qd)
    work = np.einsum("nsj,nj->ns", q - q[:, :1], _torques(cases))
    told["work_torque"] = work[:, -1]
    lost = _lost(cases, times, motion.qd) if s.drives else np.zeros_like(work)
    kinetic, potential = _energies(numbers_of(first, crowd, len(cases)), q, qd)
    told["energy_kinetic_max"] = kinetic.max(axis=1)
    energy = kinetic + potential
    told["energy_drift"] = np.abs(energy - energy[:, :1] - work + lost).max(axis=1)
    return told, lasted


def _torques(cases: Sequence[Case]) -> Array:
    return np.array([case.scenario.torque.tau or (0.0,) * 6 for case in cases])


def _told(cases: Sequence[Case], times: Array, q: Array, qd: Array) -> dict[str, Array]:
    """Figures of the motion and of the torque."""
    n, tau = len(cases), np.abs(_torques(cases))
    limits = np.array([[j.torque or np.nan for j in case.data.joints] for case in cases])
    share = np.fmax.reduce(tau / limits, axis=1)
    shape = Robot(cases[0].data)  # of one geometry
    return {
        "time_end": np.full(n, times[-1]),
        "q_end": q[:, -1],
        "qd_max": np.abs(qd).max(axis=1),
        "tau_max": tau,
        "tau_share": share,
        "position_end": shape.fk(np.ascontiguousarray(q[:, -1]))[:, :3, 3],
        "error_position": np.full(n, np.nan),
        "error_angle": np.full(n, np.nan),
        "limits_passed": passages([case.data.joints for case in cases], times, q, qd),
    }


def _energies(numbers: Array, q: Array, qd: Array) -> tuple[Array, Array]:
    """Kinetic and potential energy of n robots at m samples each, (n, m) J."""
    quantity, made = QUANTITIES["energy"], np.empty((*q.shape[:2], 2))
    for row, angles, speeds, out in zip(numbers.tolist(), q, qd, made, strict=True):
        own = unpack(row, vertical=False, drives=False)
        if engine_name() == "native":
            from kr16cli.kernels.native_engine import NativeKernels

            NativeKernels(own)["energy"](angles, speeds, out, 1)
        else:
            ColumnEngine().run(quantity, own, (angles, speeds), out)
    return made[..., 0], made[..., 1]


def _with_nodes(times: Array) -> Array:
    """Times (m,) with three between each two of them."""
    inner = times[:-1, None] + np.diff(times)[:, None] * np.array([0.0, *_NODES])
    return np.append(inner.reshape(-1), times[-1])


def _lost(cases: Sequence[Case], times: Array, qd: Array) -> Array:
    """Energy lost in friction until each of the times, (n, m) J; qd at `_with_nodes`."""
    n, m = len(cases), len(times)
    inner = qd[:, :-1].reshape(n, m - 1, 4, 6)[:, :, 1:]
    coulomb, viscous = (
        [np.array(c)[:, None, None] for c in zip(*per_case, strict=True)]
        for per_case in (
            [[j.coulomb or 0.0 for j in case.data.joints] for case in cases],
            [[j.viscous or 0.0 for j in case.data.joints] for case in cases],
        )
    )
    speeds = list(np.moveaxis(inner, -1, 0))
    power = sum(
        t * v for t, v in zip(friction(speeds, coulomb, viscous, ARRAYS), speeds, strict=True)
    )
    each = (power @ _WEIGHTS) * np.diff(times)
    lost = np.zeros((n, m))
    np.cumsum(each, axis=1, out=lost[:, 1:])
    return lost


def passages(joints: Sequence[Sequence[JointData]], times: Array, q: Array, qd: Array) -> Array:
    """How often joints leave their ranges, (n,); between samples the angle is a cubic.

    Args:
        joints: of each robot, n times six.
        times: (m,) s.
        q: (n, m, 6) angles, rad.
        qd: (n, m, 6) speeds, rad/s.
    """
    lower, upper = (
        np.array([[getattr(j, side) + sign * TOLERANCES.limit for j in six] for six in joints])
        for side, sign in (("lower", -1.0), ("upper", 1.0))
    )
    h = np.diff(times)[:, None]
    p0, p1, v0, v1 = q[:, :-1], q[:, 1:], h * qd[:, :-1], h * qd[:, 1:]
    # A cubic leaves the span of its ends by no more than 4/27 of its slopes.
    reach = 4.0 / 27.0 * (np.abs(v0) + np.abs(v1))
    low, high = np.minimum(p0, p1) - reach, np.maximum(p0, p1) + reach
    near = (low < lower[:, None]) & (high >= lower[:, None])
    near |= (low <= upper[:, None]) & (high > upper[:, None])
    run, _, joint = np.nonzero(near)
    a0, a1, b0, b1 = (v[near] for v in (p0, p1, v0, v1))
    angles = _extremes(a0, a1, b0, b1)
    left = np.zeros(len(run))
    for outside in (angles < lower[run, joint], angles > upper[run, joint]):
        left += (~outside[:-1] & outside[1:]).sum(axis=0)
    return np.bincount(run, weights=left, minlength=len(q)).astype(np.float64)


def _extremes(p0: Array, p1: Array, v0: Array, v1: Array) -> Array:
    """Ends and turning points in order of cubics by ends and slopes, (4, k)."""
    a, b = 3.0 * (2.0 * (p0 - p1) + v0 + v1), 2.0 * (3.0 * (p1 - p0) - 2.0 * v0 - v1)
    with np.errstate(all="ignore"):
        # The root with the larger sum first: no digits cancel.
        half = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * a * v0), b))
        roots = np.stack([half / a, v0 / half])
    u = np.sort(np.clip(np.nan_to_num(roots, nan=0.0, posinf=0.0, neginf=0.0), 0.0, 1.0), axis=0)
    w = 1.0 - u
    inner = w * w * ((1.0 + 2.0 * u) * p0 + u * v0) + u * u * ((1.0 + 2.0 * w) * p1 - w * v1)
    return np.vstack([p0, inner, p1])
