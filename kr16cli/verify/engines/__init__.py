"""Other people's engines, built from the same parameter file without `kr16cli.model`.

Each is imported when asked for; one that is missing skips its cases and names the extra.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple, Protocol

import numpy as np

from kr16cli.robot import Payload, RobotData
from kr16cli.verify.independent.rotations import Array
from kr16cli.verify.records import SkipCase


class Engine(Protocol):
    """What every engine answers for one configuration (6,), SI, robroot axes, flange point."""

    def fk(self, q: Array) -> Array:
        """T_robroot_flange."""

    def jacobian(self, q: Array) -> Array:
        """Linear rows first."""

    def jacobian_dot(self, q: Array, qd: Array) -> Array:
        """Its rate along qd."""

    def mass_matrix(self, q: Array) -> Array:
        """M."""

    def coriolis_torque(self, q: Array, qd: Array) -> Array:
        """C qd."""

    def gravity(self, q: Array) -> Array:
        """G."""

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Torques."""

    def forward_dynamics(self, q: Array, qd: Array, tau: Array) -> Array:
        """Accelerations."""


class _Source(NamedTuple):
    title: str
    package: str
    build: str
    slow: bool


SOURCES = {
    "pinocchio": _Source("Pinocchio", "pinocchio", "pinocchio", slow=False),
    "mujoco": _Source("MuJoCo", "mujoco", "mujoco", slow=False),
    "toolbox": _Source("roboticstoolbox", "roboticstoolbox", "toolbox", slow=True),
}
"""Name -> what it is called, the package it needs, the module here, and whether a quick run
leaves it out because its import alone takes seconds."""


def engine(name: str, data: RobotData, payload: Payload | None, *, quick: bool) -> Engine:
    """The engine, built from the robot's numbers.

    Raises:
        SkipCase: it is not installed, or left to the full run.
    """
    source = SOURCES[name]
    if quick and source.slow:
        raise SkipCase(f"{source.title} takes seconds to import: left to a run without --quick")
    if find_spec(source.package) is None:
        raise SkipCase(f"{source.title} is not installed; run: pip install 'kr16cli[engines]'")
    module = import_module(f"{__name__}.{source.build}")
    build: Callable[[RobotData, Payload | None], Engine] = module.build
    return build(data, payload)


def integrated(
    accelerate: Callable[..., Array], q: Array, qd: Array, tau: Array, times: Array
) -> Array:
    """Joint angles (n, 6) at `times` (s) under constant torques, by SciPy's DOP853 at 1e-9.

    Args:
        accelerate: accelerations for angles, speeds and torques, (6,) each.
        q: angles at the start, rad.
        qd: speeds at the start, rad/s.
        tau: torques, N m.
        times: ascending.
    """
    from scipy.integrate import solve_ivp

    def rate(_: float, state: Array) -> Array:
        return np.concatenate([state[6:], accelerate(state[:6], state[6:], tau)])

    start = np.concatenate([q, qd])
    span = (0.0, float(times[-1]))
    solved = solve_ivp(rate, span, start, "DOP853", times, rtol=1e-9, atol=1e-10)
    return np.asarray(solved.y[:6].T)
