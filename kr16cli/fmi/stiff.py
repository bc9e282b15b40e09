"""A step for friction and joint stops, which are stiff: Rosenbrock's method. Plain floats."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from kr16cli.model.dynamics import solve_symmetric
from kr16cli.simulate.plant import Plant

GAMMA = 1.0 - math.sqrt(0.5)
"""Makes the method L-stable: what is infinitely stiff is gone after one step."""

STEP = 1e-6
"""Of differences (rad, rad/s): small beside the speed friction is regularised with."""

Six = Sequence[float]
Solve = Callable[[list[list[float]], Sequence[float]], list[float]]


def rosenbrock_step(
    plant: Plant, t: float, state: Sequence[float], h: float, solve: Solve = solve_symmetric
) -> list[float]:
    """One step of ROS2, order 2 whatever the Jacobian (Verwer et al. 1999, a W-method).

    (1 - g h A) k1 = F(y), (1 - g h A) k2 = F(y + h k1) - 2 k1, y' = y + h (3 k1 + k2) / 2. Of
    the Jacobian A only what is stiff is taken: friction and stops, -M^-1 (K dq + D dqd), with
    diagonal K and D. Each stage then costs one symmetric 6x6 solution:
    (M + g h D + (g h)^2 K) k_v = M r_v - g h K r_q, and k_q = r_q + g h k_v.

    Args:
        plant: the equations of motion.
        t: time, s.
        state: q (rad) and qd (rad/s).
        h: step, s.
        solve: x of A x = b for a symmetric positive definite matrix.

    Returns:
        The state at t + h.
    """
    q, qd = state[:6], state[6:12]
    M, gh = plant.arm.mass_matrix(q), GAMMA * h
    K, D = _stiffness(plant, q, qd)
    left = [list(row) for row in M]
    for i in range(6):
        left[i][i] += gh * (D[i] + gh * K[i])

    def solved(r: Sequence[float]) -> list[float]:
        u, v, w, x, y, z = r[6:]
        pushed = [a * u + b * v + c * w + d * x + e * y + f * z for a, b, c, d, e, f in M]
        right = [m - gh * k * s for m, k, s in zip(pushed, K, r[:6], strict=True)]
        k_v = solve(left, right)
        return [*[s + gh * k for s, k in zip(r[:6], k_v, strict=True)], *k_v]

    k1 = solved(plant.rates(t, state))
    there = plant.rates(t + h, [y + h * k for y, k in zip(state, k1, strict=True)])
    k2 = solved([f - 2.0 * k for f, k in zip(there, k1, strict=True)])
    return [y + 0.5 * h * (3.0 * a + b) for y, a, b in zip(state, k1, k2, strict=True)]


def _stiffness(plant: Plant, q: Six, qd: Six) -> tuple[list[float], list[float]]:
    """Diagonals of the stops' stiffness K (N m/rad) and of all damping D (N m s/rad)."""
    stops = plant.limits.joint == "contact"

    def resisting(dq: float, dqd: float) -> list[float]:
        rates = [v + dqd for v in qd]
        friction = plant.arm.friction(rates)
        if not stops:
            return friction
        contact = plant.contact([v + dq for v in q], rates)
        return [a - b for a, b in zip(friction, contact, strict=True)]

    def slope(dq: float, dqd: float) -> list[float]:
        pairs = zip(resisting(dq, dqd), resisting(-dq, -dqd), strict=True)
        return [max(0.0, (a - b) / (2.0 * STEP)) for a, b in pairs]

    # Each joint resists by its own angle and speed alone, so all six slopes come at once.
    return slope(STEP, 0.0) if stops else [0.0] * 6, slope(0.0, STEP)
