"""The order of every integrator whose step can be fixed."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.simulate import evidence
from kr16cli.verify.measure import finding
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.simulation.common import numbers

_QUICK: dict[str, Sequence[int]] = {
    "SemiImplicitEuler": (8, 16), "RK4": (4, 8), "RK45": (4, 8), "DOP853": (4, 6)
}  # fmt: skip

NAMES = {"SemiImplicitEuler": "Euler", "RK4": "Runge-Kutta"}
"""What reports call the methods; the others by their own name."""


@case(
    "simulation.order",
    title="Fixed steps have the order they claim",
    statement="error of a motion ~ h for Euler's steps, h^4 for Runge and Kutta's, h^5 for RK45, "
    "h^8 for DOP853",
    regime="a fall of 0.3 s from a moving start; two or three step sizes",
    method="slope of log error over log step, against DOP853 at rtol 1e-12",
    grade="C",
    tolerance=0.15,
    unit="difference of order, relative",
    reason="the next term of the error bends the line; errors of DOP853 end near rounding",
    functions=(
        "kr16cli.simulate.core.rk4_step",
        "kr16cli.simulate.core.euler_step",
        "kr16cli.simulate.integrate.Integration",
    ),
)
def order(setting: Setting) -> Finding:
    """Convergence."""
    data, duration = numbers(setting), 0.3
    exact = evidence.fall_end(data, duration)
    figures: dict[str, list[float]] = {}
    off, slopes = [], []
    for method in evidence.ORDERS:
        counts = _QUICK[method] if setting.quick else None
        found = evidence.convergence(data, method, duration, counts=counts, exact=exact)
        name = NAMES.get(method, method)
        figures[f"{name} step"], figures[f"{name} error"] = found.steps, found.errors
        figures[f"{name} order"] = [found.slope, float(found.expected)]
        off.append(abs(found.slope / found.expected - 1.0))
        slopes.append(f"{name} {found.slope:.2f} for {found.expected}")
    return finding(off, f"orders: {', '.join(slopes)}", figures=figures)
