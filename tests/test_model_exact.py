"""The model on fractions: what is an identity holds exactly, with no tolerance at all.

Angles are rational points of the unit circle, the robot's numbers small fractions. The other
side is the oracle's: product of exponentials, sums over links, dual numbers.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import duals
import oracles
from kr16cli.model import chain, coriolis, dynamics, energy, inertia
from kr16cli.robot import Geometry, LinkData, Payload, Provenance

few = settings(max_examples=8)  # exact arithmetic is slow, and one counterexample refutes

number = st.fractions(-2, 2, max_denominator=6)
positive = st.fractions(Fraction(1, 4), 3, max_denominator=6)
six = st.tuples(*[number] * 6)
three = st.tuples(*[number] * 3)
turns = st.tuples(*[st.fractions(-3, 3, max_denominator=4).map(oracles.rational_turn)] * 6)
geometries = st.builds(Geometry, *[number] * 6)
links = st.tuples(
    *[
        st.builds(
            LinkData,
            mass=positive,
            com=three,
            inertia=six,
            frame=st.sampled_from(["zero-pose", "dh"]),
            provenance=st.just(Provenance("estimated", ())),
        )
    ]
    * 6
)
payloads = st.builds(Payload, mass=positive, com=three, inertia=six)


def arrays(cs: Any) -> tuple[np.ndarray, np.ndarray]:
    c, s = zip(*cs, strict=True)
    return np.array(c, dtype=object), np.array(s, dtype=object)


def exact(ours: Any, expected: Any) -> None:
    """Equal numbers, and fractions on our side: no float has crept in."""
    a, b = (np.array(v, dtype=object).ravel() for v in (ours, expected))
    assert len(a) == len(b)
    for x, y in zip(a, b, strict=True):
        value = x if isinstance(x, Fraction | int) else int(float(x))
        assert isinstance(x, Fraction | int) or (float(x) == 0.0 and not isinstance(x, float))
        assert value == y


@few
@given(turns, geometries, links, payloads)
def test_mass_matrix_equals_the_sum_over_links(cs: Any, g: Any, parts: Any, load: Any) -> None:
    """(3.38), by composite bodies of regrouped parameters; symmetric to the last digit."""
    bodies = inertia.robot_bodies(parts, load, g)
    expected = oracles.mass_matrix(g, oracles.bodies(g, parts, load), *arrays(cs))
    for chosen in (bodies, inertia.regroup(bodies, g)):
        ours = dynamics.mass_matrix(cs, chosen, g)
        exact(ours, expected)
        exact(ours, [list(column) for column in zip(*ours, strict=True)])


@settings(max_examples=4)
@given(turns, geometries, links)
def test_coriolis_equals_the_christoffel_symbols(cs: Any, g: Any, parts: Any) -> None:
    """(3.41): every C_k(i, j), from dual-number derivatives of the summed mass matrix."""
    bodies = inertia.regroup(inertia.robot_bodies(parts, None, g), g)
    expected = oracles.christoffel(g, oracles.bodies(g, parts), *arrays(cs))
    exact(coriolis.christoffel(cs, bodies, g), expected)


@few
@given(turns, six, geometries, links, payloads)
def test_mass_rate_less_twice_coriolis_is_skew(
    cs: Any, qd: Any, g: Any, parts: Any, load: Any
) -> None:
    """M' = C + C^T with the rate of the package's own M, differentiated by dual numbers."""
    bodies = inertia.regroup(inertia.robot_bodies(parts, load, g), g)
    moving = list(zip(*duals.dual_turns(*arrays(cs), qd), strict=True))
    rate = duals.eps(
        [[v + duals.Dual(0) for v in row] for row in dynamics.mass_matrix(moving, bodies, g)]
    )
    C = np.array(coriolis.coriolis_matrix(cs, qd, bodies, g), dtype=object) + Fraction(0)
    exact(rate, C + C.T)


@few
@given(turns, six, six, geometries, links, three)
def test_torques_equal_mass_coriolis_gravity(
    cs: Any, qd: Any, qdd: Any, g: Any, parts: Any, field: Any
) -> None:
    bodies = inertia.regroup(inertia.robot_bodies(parts, None, g), g)
    M = np.array(dynamics.mass_matrix(cs, bodies, g), dtype=object) + Fraction(0)
    C = np.array(coriolis.coriolis_matrix(cs, qd, bodies, g), dtype=object) + Fraction(0)
    G = np.array(dynamics.gravity_torque(cs, bodies, g, field), dtype=object) + Fraction(0)
    ours = dynamics.inverse_dynamics(cs, qd, qdd, bodies, g, field)
    exact(ours, M @ np.array(qdd) + C @ np.array(qd) + G)
    exact(dynamics.bias(cs, qd, bodies, g, field), C @ np.array(qd) + G)


@few
@given(turns, six, six, geometries, links, three)
def test_regrouping_keeps_every_torque(
    cs: Any, qd: Any, qdd: Any, g: Any, parts: Any, field: Any
) -> None:
    bodies = inertia.robot_bodies(parts, None, g)
    full = dynamics.inverse_dynamics(cs, qd, qdd, bodies, g, field)
    exact(dynamics.inverse_dynamics(cs, qd, qdd, inertia.regroup(bodies, g), g, field), full)


@few
@given(turns, geometries, links, payloads, three)
def test_gravity_is_the_gradient_of_potential_energy(
    cs: Any, g: Any, parts: Any, load: Any, field: Any
) -> None:
    """(3.42) with both sides the package's: energy of the full bodies, torque of the lean ones."""
    bodies = inertia.robot_bodies(parts, load, g)
    gradient = []
    for unit in np.eye(6, dtype=int).tolist():
        moving = list(zip(*duals.dual_turns(*arrays(cs), unit), strict=True))
        value = energy.potential(chain.frames(moving, g), bodies, g, field)
        gradient.append((value + duals.Dual(0)).eps)
    exact(dynamics.gravity_torque(cs, inertia.regroup(bodies, g), g, field), gradient)
    other = oracles.potential(g, oracles.bodies(g, parts, load), field, *arrays(cs))
    exact([energy.potential(chain.frames(cs, g), bodies, g, field)], [other])


@few
@given(turns, six, six, geometries, links, three)
def test_power_is_the_rate_of_kinetic_and_potential_energy(
    cs: Any, qd: Any, qdd: Any, g: Any, parts: Any, field: Any
) -> None:
    full = inertia.robot_bodies(parts, None, g)
    bodies = inertia.regroup(full, g)
    moving = list(zip(*duals.dual_turns(*arrays(cs), qd), strict=True))
    speeds = [duals.Dual(v, a) for v, a in zip(qd, qdd, strict=True)]
    kinetic = energy.kinetic(dynamics.mass_matrix(moving, bodies, g), speeds)
    potential = energy.potential(chain.frames(moving, g), full, g, field)
    tau = dynamics.inverse_dynamics(cs, qd, qdd, bodies, g, field)
    power = sum((v * (t + Fraction(0)) for v, t in zip(qd, tau, strict=True)), Fraction(0))
    exact([power], [(kinetic + potential + duals.Dual(0)).eps])


@few
@given(turns, six, six, geometries, links, payloads, three)
def test_base_wrench_equals_the_rate_of_momentum(
    cs: Any, qd: Any, qdd: Any, g: Any, parts: Any, load: Any, field: Any
) -> None:
    bodies = inertia.robot_bodies(parts, load, g)
    force, moment = energy.base_wrench(cs, qd, qdd, bodies, g, field)
    others = oracles.bodies(g, parts, load)
    exact([*force, *moment], oracles.base_wrench(g, others, field, *arrays(cs), (qd, qdd)))


@few
@given(turns, geometries, links)
def test_mass_centres_equal_the_oracles(cs: Any, g: Any, parts: Any) -> None:
    bodies = inertia.robot_bodies(parts, None, g)
    moves = oracles.motions(g, *arrays(cs))[1:]
    others = oracles.bodies(g, parts)
    expected = [m[:3, :3] @ b.centre + m[:3, 3] for m, b in zip(moves, others, strict=True)]
    exact(energy.mass_centres(chain.frames(cs, g), bodies, g), expected)


@few
@given(st.lists(six, min_size=6, max_size=6), six)
def test_symmetric_solver_solves_exactly(rows: Any, x: Any) -> None:
    """L D L^T on A = R R^T + 1, which is positive definite whatever R is."""
    r = np.array(rows, dtype=object)
    a = r @ r.T + np.eye(6, dtype=int)
    exact(dynamics.solve_symmetric(a.tolist(), (a @ np.array(x)).tolist()), x)


@few
@given(turns, six, six, links, three)
def test_forward_dynamics_undoes_inverse_dynamics(
    cs: Any, qd: Any, qdd: Any, parts: Any, field: Any
) -> None:
    """On links whose inertia about the mass centre is a ball's, so that M can be inverted."""
    g = Geometry(*(Fraction(n, 10) for n in (7, 3, 7, 1, 7, 2)))
    parts = [replace(part, inertia=BALL) for part in parts]
    bodies = inertia.regroup(inertia.robot_bodies(parts, None, g), g)
    rotors = [Fraction(n, 9) for n in range(1, 7)]
    tau = dynamics.inverse_dynamics(cs, qd, qdd, bodies, g, field, rotors)
    exact(dynamics.forward_dynamics(cs, qd, tau, bodies, g, field, rotors), qdd)


BALL = (Fraction(1, 5),) * 3 + (Fraction(0),) * 3
