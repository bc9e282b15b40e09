"""Suite `engines`: the model against other people's engines, built from the same numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from kr16cli import Robot
from kr16cli.kernels.engine import has_native
from kr16cli.kernels.quantities import QUANTITIES, Quantity
from kr16cli.verify import sampling
from kr16cli.verify.engines import SOURCES, Engine, engine, integrated
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array
from kr16cli.verify.measure import finding, gap, largest, relative
from kr16cli.verify.records import Finding, Setting, SkipCase
from kr16cli.verify.registry import case, using_engine
from kr16cli.verify.suites.dynamics.common import Motion


class _Comparison(NamedTuple):
    title: str
    symbol: str
    unit: str
    tolerance: float
    ours: Callable[[Robot, Motion], Array]
    theirs: Callable[[Any, Array, Array, Array], Array]
    equations: tuple[str, ...]
    function: str


def _coriolis_torque(robot: Robot, m: Motion) -> Array:
    return np.asarray((robot.coriolis_matrix(m.q, m.qd) @ m.qd[..., None])[..., 0])


_COMPARISONS = {
    "fk": _Comparison(
        "flange pose", "T_robroot_flange", "m, 1", 1e-13,
        lambda r, m: r.fk(m.q), lambda e, q, v, a: e.fk(q),
        ("3.3", "3.4", "3.5", "3.6"), "fk",
    ),
    "jacobian": _Comparison(
        "Jacobian", "J", "m, 1", 1e-13,
        lambda r, m: r.jacobian(m.q), lambda e, q, v, a: e.jacobian(q),
        ("3.30", "3.31", "3.32"), "jacobian",
    ),
    "jacobian-dot": _Comparison(
        "rate of the Jacobian", "J'", "m/s, rad/s", 1e-12,
        lambda r, m: r.jacobian_dot(m.q, m.qd), lambda e, q, v, a: e.jacobian_dot(q, v),
        ("3.47", "3.48", "3.49", "3.50", "3.51"), "jacobian_dot",
    ),
    "mass-matrix": _Comparison(
        "mass matrix", "M", "relative", 1e-11,
        lambda r, m: r.mass_matrix(m.q), lambda e, q, v, a: e.mass_matrix(q),
        ("3.38",), "mass_matrix",
    ),
    "coriolis-torque": _Comparison(
        "Coriolis torques", "C qd", "relative", 1e-11,
        _coriolis_torque, lambda e, q, v, a: e.coriolis_torque(q, v),
        ("3.40", "3.41"), "coriolis_matrix",
    ),
    "coriolis-matrix": _Comparison(
        "Coriolis matrix", "C", "relative", 1e-11,
        lambda r, m: r.coriolis_matrix(m.q, m.qd), lambda e, q, v, a: e.coriolis_matrix(q, v),
        ("3.40", "3.41"), "coriolis_matrix",
    ),
    "gravity": _Comparison(
        "gravity torques", "G", "relative", 1e-11,
        lambda r, m: r.gravity(m.q), lambda e, q, v, a: e.gravity(q),
        ("3.42",), "gravity",
    ),
    "inverse-dynamics": _Comparison(
        "inverse dynamics", "tau", "relative", 1e-11,
        lambda r, m: r.inverse_dynamics(*m), lambda e, q, v, a: e.inverse_dynamics(q, v, a),
        ("3.38", "3.40", "3.42"), "inverse_dynamics",
    ),
    "forward-dynamics": _Comparison(
        "forward dynamics", "qdd", "relative", 1e-9,
        lambda r, m: r.forward_dynamics(m.q, m.qd, 100.0 * m.qdd),
        lambda e, q, v, a: e.forward_dynamics(q, v, 100.0 * a),
        ("3.38", "3.40", "3.42"), "forward_dynamics",
    ),
    "energy": _Comparison(
        "energies", "T, P", "relative", 1e-11,
        lambda r, m: np.stack(r.energy(m.q, m.qd), axis=-1), lambda e, q, v, a: e.energy(q, v),
        ("3.43",), "energy",
    ),
    "base-wrench": _Comparison(
        "foundation reaction", "force, moment", "relative", 1e-11,
        lambda r, m: r.base_wrench(*m), lambda e, q, v, a: e.base_wrench(q, v, a),
        (), "base_wrench",
    ),
}  # fmt: skip

_ONLY = {"coriolis-matrix": ("pinocchio",), "energy": ("pinocchio",), "base-wrench": ("pinocchio",)}
_KINEMATIC = ("fk", "jacobian", "jacobian-dot")


def _variants(setting: Setting, name: str) -> Iterator[tuple[Robot, Engine]]:
    """The robot bare, and on a slope with a payload, each beside the engine."""
    data = setting.robot.data
    sampling.need_links(data)
    for load, field in ((None, data.gravity), (sampling.LOAD, sampling.TILTED)):
        own = data.with_gravity(field)
        yield Robot(own, payload=load), engine(name, own, load, quick=setting.quick)


def _register(name: str, key: str, quantity: _Comparison) -> None:
    source = SOURCES[name]
    absolute = key in _KINEMATIC

    @case(
        f"engines.{name}.{key}",
        title=f"{source.title}: {quantity.title}",
        statement=f"{quantity.symbol} of kr16cli = {quantity.symbol} of {source.title}",
        regime="all of joint space, random motions; bare, and on a slope with a payload",
        method=f"{source.title} built from the same parameter file, not through kr16cli.model",
        grade="A",
        tolerance=quantity.tolerance,
        unit=quantity.unit,
        reason="rounding of both; MuJoCo turns inertia tensors to principal axes"
        if name == "mujoco"
        else "rounding of both; the condition of M, up to 1e5, for accelerations",
        equations=quantity.equations,
        functions=(f"kr16cli.Robot.{quantity.function}",),
        engine=name,
    )
    def compare(setting: Setting) -> Finding:
        rng = sampling.random(setting, key)
        n = setting.samples(200 if source.slow else 1000, 50)
        m = Motion(sampling.generic(rng, n), sampling.rates(rng, n), sampling.rates(rng, n))
        errors = []
        for robot, other in _variants(setting, name):
            own = quantity.ours(robot, m)
            theirs = np.array([quantity.theirs(other, *row) for row in zip(*m, strict=True)])
            axes = own.ndim - 1
            errors.append(gap(own, theirs, axes) if absolute else relative(own, theirs, axes))
        return finding(largest(*errors), f"{n} motions, twice", **m._asdict())


for _name in SOURCES:
    for _key, _quantity in _COMPARISONS.items():
        if _name in _ONLY.get(_key, (_name,)):
            _register(_name, _key, _quantity)


def _flat(value: Any) -> Array:
    """A quantity (or several) of n configurations as (n, k)."""
    parts = value if isinstance(value, tuple) else (value,)
    return np.concatenate([np.reshape(part, (len(part), -1)) for part in parts], axis=1)


def _compiled(robot: Robot) -> Robot:
    """The same robot on the compiled kernels."""
    if not has_native():
        raise SkipCase("the compiled kernels are not built here: NumPy serves all batches")
    with using_engine("native"):
        return Robot(robot.data, payload=robot.payload, drives=robot.drives)


def _native(name: str, quantity: Quantity) -> None:
    angles = name == "ik"

    @case(
        f"engines.native.{name.replace('_', '-')}",
        title=f"Compiled kernels: {name.replace('_', ' ')}",
        statement="the compiled kernel gives what the model's source gives, on one thread and two",
        regime="all of joint space (ik: 1e-2 off the singular families), random motions; bare, and "
        "on a slope with a payload and drives",
        method="C printed from the model's source and compiled, against the source on NumPy",
        grade="D",
        tolerance=1e-9 if name in ("ik", "forward_dynamics") else 1e-11,
        unit="rad" if angles else "relative",
        reason="compilers may fuse and reorder; ik near singularities and M's condition add to it"
        if name in ("ik", "forward_dynamics")
        else "compilers may fuse and reorder operations",
        functions=(f"kr16cli.Robot.{name}",),
    )
    def compare(setting: Setting) -> Finding:
        data = setting.robot.data
        sampling.need_links(data)
        rng, n = sampling.random(setting, f"native-{name}"), setting.samples(20000, 300)
        q = sampling.regular(rng, n, data) if angles else sampling.generic(rng, n)
        given = {"q": q, "qd": sampling.rates(rng, n), "qdd": sampling.rates(rng, n)}
        given |= {"tau": 100.0 * sampling.rates(rng, n), "near": sampling.generic(rng, n)}
        given["T"] = poe.flange(data.geometry, q)
        inputs = [given[key] for key in quantity.inputs]
        errors = []
        for load, field, drives in (
            (None, data.gravity, False),
            (sampling.LOAD, sampling.TILTED, True),
        ):
            robot = Robot(data.with_gravity(field), payload=load, drives=drives)
            fast = _compiled(robot)
            expected = _flat(getattr(robot, name)(*inputs))
            for found in (
                getattr(fast, name)(*inputs),
                *(getattr(fast, name)(*inputs, **more) for more in _threads(name)),
            ):
                errors.append(_apart(_flat(found), expected, angles=angles))
        return finding(largest(*errors), f"{n} samples, two robots", q=q)


def _threads(name: str) -> list[dict[str, int]]:
    """More options to ask with, where the quantity takes them."""
    return [] if name in ("singularity", "task_space") else [{"threads": 2}]


def _apart(found: Array, expected: Array, *, angles: bool) -> Array:
    if not angles:
        return relative(found, expected)
    there = np.isfinite(expected)
    off = np.remainder(np.where(there, found - expected, 0.0) + np.pi, 2 * np.pi) - np.pi
    missing = (np.isfinite(found) != there).any(axis=1)
    return np.where(missing, np.inf, np.abs(off).max(axis=1))


for _name, _of in QUANTITIES.items():
    if hasattr(Robot, _name):
        _native(_name, _of)


def _fall(robot: Robot, q: Array, qd: Array, tau: Array, times: Array) -> Array:
    """Joint angles under constant torques, by the model and SciPy's DOP853."""

    def accelerate(*state: Array) -> Array:
        return np.array(robot.arm.forward_dynamics(*(v.tolist() for v in state)))

    return integrated(accelerate, q, qd, tau, times)


def _motion(name: str) -> None:
    source = SOURCES[name]
    own_steps = name == "mujoco"

    @case(
        f"engines.{name}.motion",
        title=f"{source.title}: a simulated motion",
        statement="q(t) from the same start under the same torques is the same",
        regime="from home with speeds of 0.5 rad/s, torques of gravity at the start; 2 s, or "
        "0.25 s where quick",
        method="MuJoCo's own Runge-Kutta steps of 0.5 ms"
        if own_steps
        else f"{source.title}'s accelerations integrated by DOP853 at 1e-9",
        grade="A",
        tolerance=1e-7,
        unit="rad",
        reason="errors of 1e-10 a step grow by two to three decades in 2 s of free motion",
        functions=("kr16cli.Robot.forward_dynamics",),
        engine=name,
    )
    def motion(setting: Setting) -> Finding:
        sampling.need_links(setting.robot.data)
        robot = Robot(setting.robot.data)
        other = engine(name, robot.data, None, quick=setting.quick)
        q, qd = np.radians([0.0, -90.0, 90.0, 0.0, 20.0, 0.0]), np.full(6, 0.5)
        tau = robot.gravity(q)
        times = np.arange(1, 3 if setting.quick else 17) * 0.125
        ours = _fall(robot, q, qd, tau, times)
        if own_steps:
            theirs = other.motion(q, qd, tau, times)  # type: ignore[attr-defined]
        else:
            theirs = integrated(other.forward_dynamics, q, qd, tau, times)
        figures = {"time": times.tolist(), "gap": gap(ours, theirs).tolist()}
        text = f"{times[-1]:g} s; the arm moved by up to {np.abs(ours - q).max():.2g} rad"
        return finding(gap(ours, theirs), text, figures=figures, q=ours)


for _name in ("pinocchio", "mujoco"):
    _motion(_name)
