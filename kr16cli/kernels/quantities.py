"""What can be asked of the model in batches, each once, for every engine.

The NumPy engine runs these functions on columns; the generator runs them on symbols and prints
C. A function takes the parameters, its inputs as lists of scalars (angles as (cos, sin) pairs),
and the functions of the scalars, and yields its results row by row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from kr16cli.kernels.parameters import Parameters
from kr16cli.model import (
    branches,
    chain,
    coriolis,
    derivatives,
    dynamics,
    energy,
    forward,
    inverse,
    jacobian,
)
from kr16cli.model.scalars import Functions, Scalar

Flat = Iterable[Scalar]

ANGLES = frozenset({"q", "near"})
"""Inputs that enter as pairs (cos, sin)."""

WIDTH = {"T": 16, "limits": 12}
"""Numbers of an input where they are not six."""


class Quantity(NamedTuple):
    """One quantity: its inputs, the shape of its result, its function.

    `gravity`, `drives`: whether kernels of their own for vertical gravity and for the rigid arm
    save enough operations; else one serves for any gravity, and counts friction if it matters.
    """

    inputs: tuple[str, ...]
    shape: tuple[int, ...]
    results: Callable[..., Flat]
    gravity: bool = False
    drives: bool = False


def flat(rows: Iterable[Iterable[Scalar]]) -> Flat:
    """The elements of row lists, row by row."""
    return (value for row in rows for value in row)


def _fk(k: Parameters, cs: Any, _: Functions) -> Flat:
    return flat(forward.flange(cs, k.geometry).rows())


def _frames(k: Parameters, cs: Any, _: Functions) -> Flat:
    links = chain.frames(cs, k.geometry)
    yield from flat(row for frame in links for row in frame.rows())
    yield from flat(chain.flange_of_frame6(links[6]).rows())
    yield from links[4].p
    yield from flat(forward.r36(cs))


def _ik(k: Parameters, t: Any, near: Any, ns: Functions) -> Flat:
    rotation = [t[0:3], t[4:7], t[8:11]]
    p = (t[3], t[7], t[11])
    return flat(inverse.solve_near(rotation, p, k.geometry, near, ns).angles)


def _branches(k: Parameters, t: Any, limits: Any, ns: Functions) -> Flat:
    rotation = [t[0:3], t[4:7], t[8:11]]
    return branches.judge(rotation, (t[3], t[7], t[11]), k.geometry, limits[:6], limits[6:], ns)


def _jacobian(k: Parameters, cs: Any, _: Functions) -> Flat:
    a = forward.arm(cs, k.geometry)
    return flat(jacobian.jacobian(a, a.flange_p))


def _jacobian_dot(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    a = forward.arm(cs, k.geometry)
    return flat(jacobian.jacobian_dot(a, a.flange_p, qd))


def _singularity(k: Parameters, cs: Any, _: Functions) -> Flat:
    yield jacobian.shoulder_factor(cs, k.geometry)
    yield jacobian.elbow_factor(cs, k.geometry)
    yield jacobian.wrist_factor(cs)
    yield jacobian.determinant(cs, k.geometry)


def _mass_centres(k: Parameters, cs: Any, _: Functions) -> Flat:
    return flat(energy.mass_centres(chain.frames(cs, k.geometry), k.full, k.geometry))


def _mass_centre_jacobians(k: Parameters, cs: Any, _: Functions) -> Flat:
    a = forward.arm(cs, k.geometry)
    centres = energy.mass_centres(chain.frames(cs, k.geometry), k.full, k.geometry)
    for link, centre in enumerate(centres, 1):
        yield from flat(jacobian.jacobian(a, centre, link))


def _mass_matrix(k: Parameters, cs: Any, _: Functions) -> Flat:
    return flat(dynamics.mass_matrix(cs, k.base, k.geometry, k.rotors))


def _coriolis_matrix(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    return flat(coriolis.coriolis_matrix(cs, qd, k.base, k.geometry))


def _christoffel(k: Parameters, cs: Any, _: Functions) -> Flat:
    return flat(flat(ck) for ck in coriolis.christoffel(cs, k.base, k.geometry))


def _gravity(k: Parameters, cs: Any, _: Functions) -> Flat:
    return dynamics.gravity_torque(cs, k.base, k.geometry, k.gravity)


def _equation(k: Parameters, cs: Any, qd: Any, ns: Functions) -> Flat:
    yield from _mass_matrix(k, cs, ns)
    yield from _coriolis_matrix(k, cs, qd, ns)
    yield from _gravity(k, cs, ns)


def _friction(k: Parameters, qd: Any, ns: Functions) -> list[Scalar]:
    return dynamics.friction(qd, k.coulomb, k.viscous, ns)


def _bias(k: Parameters, cs: Any, qd: Any, ns: Functions) -> Flat:
    torque = dynamics.bias(cs, qd, k.base, k.geometry, k.gravity)
    if not k.coulomb:
        return torque
    return [t + f for t, f in zip(torque, _friction(k, qd, ns), strict=True)]


def _inverse_dynamics(k: Parameters, cs: Any, qd: Any, qdd: Any, ns: Functions) -> Flat:
    tau = dynamics.inverse_dynamics(cs, qd, qdd, k.base, k.geometry, k.gravity, k.rotors)
    if not k.coulomb:
        return tau
    return [t + f for t, f in zip(tau, _friction(k, qd, ns), strict=True)]


def _forward_dynamics(k: Parameters, cs: Any, qd: Any, tau: Any, ns: Functions) -> Flat:
    if k.coulomb:
        tau = [t - f for t, f in zip(tau, _friction(k, qd, ns), strict=True)]
    return dynamics.forward_dynamics(cs, qd, tau, k.base, k.geometry, k.gravity, k.rotors)


def _inverse_dynamics_derivatives(k: Parameters, cs: Any, qd: Any, qdd: Any, ns: Functions) -> Flat:
    by_q, by_qd, by_qdd = derivatives.inverse_dynamics_derivatives(
        cs, qd, qdd, k.base, k.geometry, k.gravity, k.rotors
    )
    if k.coulomb:
        for i, slope in enumerate(dynamics.friction_slope(qd, k.coulomb, k.viscous, ns)):
            by_qd[i][i] = by_qd[i][i] + slope
    return flat((*by_q, *by_qd, *by_qdd))


def _forward_dynamics_derivatives(k: Parameters, cs: Any, qd: Any, tau: Any, ns: Functions) -> Flat:
    slopes = dynamics.AT_REST
    if k.coulomb:
        tau = [t - f for t, f in zip(tau, _friction(k, qd, ns), strict=True)]
        slopes = tuple(dynamics.friction_slope(qd, k.coulomb, k.viscous, ns))
    by_q, by_qd, by_tau = derivatives.forward_dynamics_derivatives(
        cs, qd, tau, k.base, k.geometry, k.gravity, k.rotors, slopes
    )
    return flat((*by_q, *by_qd, *by_tau))


def _energy(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    m = dynamics.mass_matrix(cs, k.base, k.geometry, k.rotors)
    yield energy.kinetic(m, qd)
    yield energy.potential(chain.frames(cs, k.geometry), k.full, k.geometry, k.gravity)


def _base_wrench(k: Parameters, cs: Any, qd: Any, qdd: Any, _: Functions) -> Flat:
    force, moment = energy.base_wrench(cs, qd, qdd, k.full, k.geometry, k.gravity)
    return (*force, *moment)


QUANTITIES: dict[str, Quantity] = {
    "fk": Quantity(("q",), (4, 4), _fk),
    "frames": Quantity(("q",), (140,), _frames),
    "ik": Quantity(("T", "near"), (8, 6), _ik),
    "branches": Quantity(("T", "limits"), (6,), _branches),
    "jacobian": Quantity(("q",), (6, 6), _jacobian),
    "jacobian_dot": Quantity(("q", "qd"), (6, 6), _jacobian_dot),
    "singularity": Quantity(("q",), (4,), _singularity),
    "mass_centres": Quantity(("q",), (6, 3), _mass_centres),
    "mass_centre_jacobians": Quantity(("q",), (6, 6, 6), _mass_centre_jacobians),
    "mass_matrix": Quantity(("q",), (6, 6), _mass_matrix),
    "coriolis_matrix": Quantity(("q", "qd"), (6, 6), _coriolis_matrix),
    "christoffel": Quantity(("q",), (6, 6, 6), _christoffel),
    "gravity": Quantity(("q",), (6,), _gravity, gravity=True),
    "equation": Quantity(("q", "qd"), (78,), _equation, gravity=True),
    "energy": Quantity(("q", "qd"), (2,), _energy, gravity=True),
    "base_wrench": Quantity(("q", "qd", "qdd"), (6,), _base_wrench, gravity=True),
    "bias": Quantity(("q", "qd"), (6,), _bias, gravity=True, drives=True),
    "inverse_dynamics": Quantity(
        ("q", "qd", "qdd"), (6,), _inverse_dynamics, gravity=True, drives=True
    ),
    "forward_dynamics": Quantity(
        ("q", "qd", "tau"), (6,), _forward_dynamics, gravity=True, drives=True
    ),
    # Kernels of their own for vertical gravity and the rigid arm would save these 3 and 6 %.
    "inverse_dynamics_derivatives": Quantity(
        ("q", "qd", "qdd"), (3, 6, 6), _inverse_dynamics_derivatives
    ),
    "forward_dynamics_derivatives": Quantity(
        ("q", "qd", "tau"), (3, 6, 6), _forward_dynamics_derivatives
    ),
}


def variant(name: str, *, vertical: bool, drives: bool) -> str:
    """The name of the kernel that serves a quantity for a robot of this kind."""
    q = QUANTITIES[name]
    return name + "_vertical" * (q.gravity and vertical) + "_drives" * (q.drives and drives)
