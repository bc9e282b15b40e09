"""Free swings, one and many, against Pinocchio in SciPy and MuJoCo's own rollout."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from kr16cli.api import Robot
from kr16cli.bench.timing import least
from kr16cli.export.mjcf import mjcf
from kr16cli.export.urdf import urdf
from kr16cli.rollout import rollout

START = (0.0, -1.2, 1.0, 0.3, 0.5, 0.1)
"""The swing's start at rest, rad."""

TOLERANCE = 1e-9
STEP = 1e-3


class Figure(NamedTuple):
    """One line of the table: what, seconds here, seconds of each peer that is installed."""

    what: str
    seconds: float
    peers: dict[str, float]


def measure(robot: Robot, rounds: int = 5, duration: float = 10.0) -> list[Figure]:
    """A swing to a tolerance, a swing of fixed steps, and one step of one of many swings.

    Least time of `rounds`, the contenders taking turns; s.
    """
    many = np.random.default_rng(1).uniform(-1.0, 1.0, (800, 6))
    short = 0.25
    steps = len(many) * short / STEP
    one = {
        "": lambda: rollout(robot, START, duration=duration, rtol=TOLERANCE, atol=TOLERANCE),
        **_pinocchio(robot, duration),
    }
    fixed = {"": lambda: rollout(robot, START, duration=duration, method="rk4", step=STEP)}
    lanes = {
        "": lambda: rollout(robot, many, duration=short, method="rk4", step=STEP),
        **_mujoco(robot, many[:50], short),
    }
    found = [least(calls, rounds) for calls in (one, fixed, lanes)]
    per_step = {
        name: seconds / (steps if name == "" else 50 * short / STEP)
        for name, seconds in found[2].items()
    }
    return [
        Figure(what, times.pop(""), times)
        for what, times in (
            (f"{duration:g} s swing, tolerance {TOLERANCE:g}", found[0]),
            (f"{duration:g} s swing, RK4 {STEP:g} s", found[1]),
            ("RK4 step of one of many swings", per_step),
        )
    ]


def pinocchio_rates(robot: Robot) -> Callable[[float, Any], Any] | None:
    """Rates of a free swing by Pinocchio's articulated-body algorithm, if it is installed."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model = pin.buildModelFromXML(urdf(robot.data))
    data, torque, rate = model.createData(), np.zeros(6), np.empty(12)

    def rates(_: float, x: Any) -> Any:
        rate[:6] = x[6:]
        rate[6:] = pin.aba(model, data, x[:6], x[6:], torque)
        return rate

    return rates


def _pinocchio(robot: Robot, duration: float) -> dict[str, Callable[[], Any]]:
    from scipy.integrate import solve_ivp

    rates = pinocchio_rates(robot)
    if rates is None:
        return {}
    start = np.array([*START, *(0.0,) * 6])

    def call() -> Any:
        return solve_ivp(rates, (0.0, duration), start, rtol=TOLERANCE, atol=TOLERANCE)

    return {"Pinocchio in SciPy": call}


def _mujoco(robot: Robot, many: Any, duration: float) -> dict[str, Callable[[], Any]]:
    try:
        import mujoco
        from mujoco import rollout as peer
    except ImportError:
        return {}
    model = mujoco.MjModel.from_xml_string(mjcf(robot.data))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = STEP
    # No limits and no contacts, as here.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    states = np.zeros((len(many), mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    states[:, 1:7] = many

    def call() -> Any:
        return peer.rollout(model, data, states, nstep=round(duration / STEP))

    return {"MuJoCo rollout": call}
