"""A start, torques, and SciPy's own answer, that tests of rollouts share."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import kr16cli

START = np.array([0.0, -1.2, 1.0, 0.3, 0.5, 0.1])
TORQUE = np.array([500.0, 500.0, 300.0, 5.0, 5.0, 0.5])
SPEED = np.array([1.0, -1.0, 1.0, 2.0, -2.0, 3.0])


def peer(
    robot: kr16cli.Robot,
    q: Any,
    times: Any,
    torque: Any = None,
    stops: Any = (),
    qd: Any = (0.0,) * 6,
) -> Any:
    """States (m, 12) by SciPy's method of order 8; torque(t, q), smooth between `stops`."""

    def rates(t: float, x: Any) -> Any:
        tau = np.zeros(6) if torque is None else torque(t, x[:6])
        return np.concatenate([x[6:], robot.forward_dynamics(x[:6], x[6:], tau)])

    x, parts = np.concatenate([q, qd]), []
    edges = [0.0, *stops, times[-1]]
    for begin, end in pairwise(edges):
        inside = times[(times >= begin) & (times < end)]
        wanted = np.append(inside, end)
        last = np.nextafter(end, 0.0)
        found = solve_ivp(
            lambda t, x, last=last: rates(min(t, last), x),
            (begin, end),
            x,
            method="DOP853",
            rtol=1e-12,
            atol=1e-12,
            t_eval=wanted,
        )
        x = found.y[:, -1]
        parts.append(found.y[:, : len(inside)])
    return np.hstack([*parts, x[:, None]]).T
