"""Joint-space dynamics on floats: the identities of section 3.5 and what drives and loads add."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kr16cli
import oracles
import strategies as sg
from kr16cli import Payload
from kr16cli.model import inertia

LOAD = Payload(16.0, (0.05, -0.08, 0.12), (0.36, 0.30, 0.25, 0.02, -0.03, 0.01))
TILTED = (2.0, -3.0, -9.0)

ARMS = {
    "kr16_2": kr16cli.Arm(kr16cli.load_data()),
    "chapter3": kr16cli.Arm(kr16cli.load_data("chapter3")),
    "loaded": kr16cli.Arm(kr16cli.load_data(), payload=LOAD),
    "driven": kr16cli.Arm(kr16cli.load_data(), payload=LOAD, drives=True),
    "tilted": kr16cli.Arm(kr16cli.load_data("chapter3").with_gravity(TILTED), payload=LOAD),
}
arms = st.sampled_from(sorted(ARMS))
REL = 1e-13  # of the largest term: some hundred operations on doubles


def oracle(name: str) -> tuple[object, list[oracles.Body], tuple[float, ...]]:
    """Geometry, bodies and gravity for the oracles (without drives)."""
    arm = ARMS[name]
    g = arm.geometry
    return g, oracles.bodies(g, arm.data.links, arm.payload), arm.data.gravity


def size(*terms: object) -> float:
    """Scale of rounding: the largest number that enters a sum, at least 1."""
    return 1.0 + max(float(np.abs(np.asarray(term, dtype=float)).max()) for term in terms)


# Mass matrix --------------------------------------------------------------------------------


@given(name=arms, q=sg.everywhere)
def test_mass_matrix_is_the_sum_over_links(name: str, q: list[float]) -> None:
    """(3.38), and J G^2 on the diagonal with drives."""
    g, bodies, _ = oracle(name)
    expected = oracles.mass_matrix(g, bodies, *oracles.turns(q))
    if ARMS[name].drives:
        ratios = [125, 125, 125, 74.444, 42.222, 24.117]
        motors = [1.3e-3, 1.3e-3, 1.3e-3, 1.6e-4, 1.8e-4, 4.3e-5]
        expected = expected + np.diag(np.square(ratios) * motors)
    ours = np.array(ARMS[name].mass_matrix(q))
    assert np.abs(ours - expected).max() <= REL * size(expected)


@given(name=arms, q=sg.everywhere)
def test_mass_matrix_is_symmetric_and_positive_definite(name: str, q: list[float]) -> None:
    M = np.array(ARMS[name].mass_matrix(q))
    assert (M == M.T).all()
    assert np.linalg.eigvalsh(M)[0] > 1e-5  # A6 of the bare arm: 3e-4 kg m2


@given(name=arms, q=sg.everywhere, q1=sg.angle, qd=sg.rates)
def test_mass_and_coriolis_do_not_know_a1(
    name: str, q: list[float], q1: float, qd: list[float]
) -> None:
    turned = [q1, *q[1:]]
    arm = ARMS[name]
    assert arm.mass_matrix(q) == arm.mass_matrix(turned)
    assert arm.coriolis_matrix(q, qd) == arm.coriolis_matrix(turned, qd)


@given(q=sg.everywhere, q1=sg.angle)
def test_gravity_along_z_does_not_know_a1(q: list[float], q1: float) -> None:
    G = ARMS["loaded"].gravity(q)
    assert ARMS["loaded"].gravity([q1, *q[1:]]) == G
    assert abs(G[0]) <= REL * size(G)


# Coriolis matrix ----------------------------------------------------------------------------


@given(name=arms, q=sg.everywhere, qd=sg.rates)
def test_coriolis_matrix_is_christoffels(name: str, q: list[float], qd: list[float]) -> None:
    """(3.41) from complex-step derivatives of the summed M."""
    g, bodies, _ = oracle(name)
    symbols = oracles.christoffel(g, bodies, *oracles.turns(q))
    ours = np.array(ARMS[name].coriolis_matrix(q, qd))
    expected = np.einsum("kij,i->kj", symbols, qd)
    assert np.abs(ours - expected).max() <= REL * size(symbols) * size(qd)
    assert np.abs(np.array(ARMS[name].christoffel(q)) - symbols).max() <= REL * size(symbols)


@given(name=arms, q=sg.everywhere, qd=sg.rates, x=sg.loads)
def test_mass_rate_less_twice_coriolis_is_skew(
    name: str, q: list[float], qd: list[float], x: list[float]
) -> None:
    g, bodies, _ = oracle(name)
    rate = oracles.slope(partial(oracles.mass_matrix, g, bodies), *oracles.turns(q), np.array(qd))
    C = np.array(ARMS[name].coriolis_matrix(q, qd))
    odd = rate - 2 * C
    assert np.abs(odd + odd.T).max() <= REL * size(rate, C)
    assert abs(x @ odd @ x) <= 36 * REL * size(rate, C) * size(x) ** 2


@given(name=arms, q=sg.everywhere, qd=sg.rates)
def test_christoffel_contracts_to_coriolis(name: str, q: list[float], qd: list[float]) -> None:
    """(3.40): row k of C is qd^T C_k, and every C_k is symmetric."""
    symbols = np.array(ARMS[name].christoffel(q))
    C = np.array(ARMS[name].coriolis_matrix(q, qd))
    assert np.abs(np.einsum("kij,i->kj", symbols, qd) - C).max() <= REL * size(C)
    assert np.abs(symbols - symbols.transpose(0, 2, 1)).max() <= REL * size(symbols)


@given(name=arms, q=sg.everywhere, qd=sg.rates, factor=st.floats(-3, 3))
def test_coriolis_is_linear_in_the_speeds(
    name: str, q: list[float], qd: list[float], factor: float
) -> None:
    C = np.array(ARMS[name].coriolis_matrix(q, qd))
    scaled = np.array(ARMS[name].coriolis_matrix(q, [factor * v for v in qd]))
    assert np.abs(scaled - factor * C).max() <= REL * size(C)


def test_coriolis_elements_of_the_chapter() -> None:
    """C_66 = 0 and C_55 = q6' sin(2 q6) (Ixx - Iyy) / 2 with the chapter's diagonal links.

    The printed C_55 has the sign of Ixx - Iyy of the link's own frame; ours is compared with
    the oracle, here the magnitude only.
    """
    rng = np.random.default_rng(5)
    ixx, iyy = ARMS["chapter3"].data.links[5].inertia[:2]
    for q, qd in rng.uniform(-3, 3, (20, 2, 6)):
        C = ARMS["chapter3"].coriolis_matrix(q, qd)
        assert C[5][5] == pytest.approx(0, abs=1e-15)
        printed = 0.5 * qd[5] * np.sin(2 * q[5]) * (ixx - iyy)
        assert abs(C[4][4]) == pytest.approx(abs(printed), abs=1e-14)


# Torques ------------------------------------------------------------------------------------


@given(name=arms, q=sg.everywhere, qd=sg.rates, qdd=sg.rates)
def test_inverse_dynamics_is_mass_coriolis_gravity_and_friction(
    name: str, q: list[float], qd: list[float], qdd: list[float]
) -> None:
    arm = ARMS[name]
    M, C = np.array(arm.mass_matrix(q)), np.array(arm.coriolis_matrix(q, qd))
    expected = M @ qdd + C @ qd + arm.gravity(q) + arm.friction(qd)
    assert np.abs(np.array(arm.inverse_dynamics(q, qd, qdd)) - expected).max() <= REL * size(
        M, C, expected
    ) * size(qd, qdd)


@given(
    name=st.sampled_from(["kr16_2", "chapter3", "tilted"]),
    q=sg.everywhere,
    qd=sg.rates,
    qdd=sg.rates,
)
def test_inverse_dynamics_is_lagranges(
    name: str, q: list[float], qd: list[float], qdd: list[float]
) -> None:
    expected = oracles.inverse_dynamics(*oracle(name), *oracles.turns(q), (qd, qdd)).astype(float)
    ours = np.array(ARMS[name].inverse_dynamics(q, qd, qdd))
    assert np.abs(ours - expected).max() <= 1e-12 * size(expected)


@given(name=arms, q=sg.everywhere, qd=sg.rates, qdd=sg.rates)
def test_forward_dynamics_undoes_inverse_dynamics(
    name: str, q: list[float], qd: list[float], qdd: list[float]
) -> None:
    arm = ARMS[name]
    tau = arm.inverse_dynamics(q, qd, qdd)
    condition = np.linalg.cond(np.array(arm.mass_matrix(q)))
    gap = np.abs(np.array(arm.forward_dynamics(q, qd, tau)) - qdd).max()
    assert gap <= 1e-15 * condition * size(tau)


@given(name=arms, q=sg.everywhere)
def test_gravity_is_the_gradient_of_potential_energy(name: str, q: list[float]) -> None:
    """(3.42), by central differences of the package's energy and complex step of the oracle's."""
    arm, h = ARMS[name], 1e-5
    zeros = [0.0] * 6

    def potential(angles: np.ndarray) -> float:
        return arm.energy(angles.tolist(), zeros)[1]

    slope = [
        (potential(np.array(q) + unit) - potential(np.array(q) - unit)) / (2 * h)
        for unit in h * np.eye(6)
    ]
    ours = np.array(arm.gravity(q))
    assert np.abs(ours - slope).max() <= 1e-6
    expected = oracles.gravity_torque(*oracle(name), *oracles.turns(q)).astype(float)
    assert np.abs(ours - expected).max() <= REL * size(expected)


@given(name=arms, q=sg.everywhere, qd=sg.rates)
def test_energy_is_the_sum_over_links(name: str, q: list[float], qd: list[float]) -> None:
    kinetic, potential = ARMS[name].energy(q, qd)
    M = np.array(ARMS[name].mass_matrix(q))
    assert kinetic == pytest.approx(0.5 * np.array(qd) @ M @ qd, rel=1e-12, abs=1e-12)
    expected = oracles.potential(*oracle(name), *oracles.turns(q))
    assert potential == pytest.approx(expected, rel=REL, abs=1e-10)


@given(
    name=st.sampled_from(["kr16_2", "chapter3", "loaded", "tilted"]),
    q=sg.everywhere,
    qd=sg.rates,
    qdd=sg.rates,
)
def test_power_of_the_torques_is_the_rate_of_energy(
    name: str, q: list[float], qd: list[float], qdd: list[float]
) -> None:
    """d(T + V)/dt = qd . tau, the rate of the oracle's energy."""
    g, bodies, field = oracle(name)
    turns, speed = oracles.turns(q), np.array(qd)
    rate = oracles.slope(partial(oracles.mass_matrix, g, bodies), *turns, speed)
    lift = oracles.slope(partial(oracles.potential, g, bodies, field), *turns, speed)
    M = oracles.mass_matrix(g, bodies, *turns)
    power = speed @ M @ qdd + speed @ rate @ speed / 2 + lift
    tau = ARMS[name].inverse_dynamics(q, qd, qdd)
    assert np.dot(qd, tau) == pytest.approx(power, rel=1e-11, abs=1e-9)


# Loads, rotors, friction --------------------------------------------------------------------


@pytest.mark.parametrize("zero", [Payload(), Payload(0.0, (0.1, 0.2, 0.3))])
@given(q=sg.everywhere, qd=sg.rates, qdd=sg.rates)
def test_zero_payload_changes_nothing(
    zero: Payload, q: list[float], qd: list[float], qdd: list[float]
) -> None:
    bare, loaded = ARMS["kr16_2"], kr16cli.Arm(ARMS["kr16_2"].data, payload=zero)
    assert loaded.inverse_dynamics(q, qd, qdd) == bare.inverse_dynamics(q, qd, qdd)
    assert loaded.mass_matrix(q) == bare.mass_matrix(q)
    assert loaded.energy(q, qd) == bare.energy(q, qd)
    assert loaded.mass_centres(q) == bare.mass_centres(q)


@given(sg.everywhere, sg.rates, sg.rates)
def test_a_point_load_adds_its_own_weight_and_inertia(
    q: list[float], qd: list[float], qdd: list[float]
) -> None:
    """tau grows by Jv^T m (a - g) of the load's point: Newton, with the flange Jacobian."""
    mass, at = 7.0, (0.1, -0.2, 0.3)
    arm = kr16cli.Arm(ARMS["kr16_2"].data, payload=Payload(mass, at))
    J = np.array(arm.jacobian(q, point=at))[:3]
    rate = np.array(arm.jacobian_dot(q, qd, point=at))[:3]
    push = mass * (J @ qdd + rate @ qd - np.array(arm.data.gravity))
    bare = np.array(ARMS["kr16_2"].inverse_dynamics(q, qd, qdd))
    ours = np.array(arm.inverse_dynamics(q, qd, qdd))
    assert np.abs(ours - bare - J.T @ push).max() <= 1e-12 * size(ours)


@given(sg.everywhere)
def test_payload_joins_the_sixth_mass_centre(q: list[float]) -> None:
    g, bodies, _ = oracle("loaded")
    move = oracles.motions(g, *oracles.turns(q))[6]
    expected = move[:3, :3] @ bodies[5].centre + move[:3, 3]
    assert np.abs(np.array(ARMS["loaded"].mass_centres(q)[5]) - expected).max() <= 2e-15


@given(name=arms, q=sg.everywhere)
def test_mass_centres_are_where_the_links_are(name: str, q: list[float]) -> None:
    g, bodies, _ = oracle(name)
    moves = oracles.motions(g, *oracles.turns(q))[1:]
    expected = [m[:3, :3] @ b.centre + m[:3, 3] for m, b in zip(moves, bodies, strict=True)]
    assert np.abs(np.array(ARMS[name].mass_centres(q)) - expected).max() <= 3e-15


@given(sg.everywhere)
def test_mass_centres_of_3_29_as_printed(q: list[float]) -> None:
    """On the lines of the chapter, in its base, with the r_i of chapter3.toml."""
    f = oracles.dh_frames(ARMS["chapter3"].geometry, *oracles.turns(q))
    o5, r4, r5 = f[5][:3, 3], f[4][:3, :3], f[5][:3, :3]
    expected = [
        np.array([0, 0, 0.400]),
        f[1][:3, 3] + 0.270 * f[2][:3, 0],
        o5 + 0.560 * r4[:, 1],
        o5 + 0.120 * r4[:, 1],
        o5 - 0.040 * r5[:, 2],
        o5 - 0.130 * r5[:, 2],
    ]
    ours = np.array(ARMS["chapter3"].mass_centres(q, base="chapter"))
    assert np.abs(ours - expected).max() <= 3e-15


@given(sg.everywhere, sg.rates, sg.rates)
def test_drives_add_rotors_and_friction_once(
    q: list[float], qd: list[float], qdd: list[float]
) -> None:
    """Rotor inertia times the ratio squared, friction on the link side, nothing else."""
    ratios = np.array([125, 125, 125, 74.444, 42.222, 24.117])
    motors = np.array([1.3e-3, 1.3e-3, 1.3e-3, 1.6e-4, 1.8e-4, 4.3e-5])
    coulomb = np.array([50, 62.5, 42, 21.8, 30.1, 10.9])
    viscous = np.array([12.7, 12.0, 5.5, 9.8, 1.0, 3.92])
    speed = np.array(qd)
    friction = viscous * speed + coulomb * speed / np.sqrt(speed**2 + 0.01**2)
    more = motors * ratios**2 * qdd + friction
    bare = np.array(ARMS["loaded"].inverse_dynamics(q, qd, qdd))
    ours = np.array(ARMS["driven"].inverse_dynamics(q, qd, qdd))
    assert np.abs(ours - bare - more).max() <= REL * size(ours, bare)
    assert ARMS["driven"].gravity(q) == ARMS["loaded"].gravity(q)
    assert ARMS["driven"].coriolis_matrix(q, qd) == ARMS["loaded"].coriolis_matrix(q, qd)


@given(sg.rates)
def test_friction_opposes_motion_and_is_odd(qd: list[float]) -> None:
    friction = np.array(ARMS["driven"].friction(qd))
    assert (friction * qd >= 0).all()
    assert ((friction == 0) == (np.array(qd) == 0)).all() or np.abs(qd).min() < 1e-300
    assert ARMS["driven"].friction([-v for v in qd]) == [-v for v in friction]
    assert ARMS["loaded"].friction(qd) == [0.0] * 6


def test_no_rotors_or_friction_unless_asked() -> None:
    zeros = [0.0] * 6
    ones = [1.0] * 6
    rigid = kr16cli.Arm(kr16cli.load_data())
    g, bodies, field = oracle("kr16_2")
    expected = oracles.inverse_dynamics(g, bodies, field, *oracles.turns(zeros), (ones, ones))
    assert np.array(rigid.inverse_dynamics(zeros, ones, ones)) == pytest.approx(
        expected.astype(float), rel=1e-13
    )


# Foundation ---------------------------------------------------------------------------------


@given(name=arms, q=sg.everywhere)
def test_base_wrench_at_rest_is_the_weight(name: str, q: list[float]) -> None:
    """Upward weight, and its moment about robroot's origin; for tilted gravity likewise."""
    _, bodies, field = oracle(name)
    zeros = [0.0] * 6
    wrench = np.array(ARMS[name].base_wrench(q, zeros, zeros))
    weights = -np.outer([b.mass for b in bodies], field)
    centres = np.array(ARMS[name].mass_centres(q))
    assert wrench[:3] == pytest.approx(weights.sum(axis=0), abs=1e-11)
    assert wrench[3:] == pytest.approx(np.cross(centres, weights).sum(axis=0), abs=1e-11)


@given(
    name=st.sampled_from(["kr16_2", "chapter3", "tilted"]),
    q=sg.everywhere,
    qd=sg.rates,
    qdd=sg.rates,
)
def test_base_wrench_is_the_rate_of_momentum(
    name: str, q: list[float], qd: list[float], qdd: list[float]
) -> None:
    expected = oracles.base_wrench(*oracle(name), *oracles.turns(q), (qd, qdd)).astype(float)
    ours = np.array(ARMS[name].base_wrench(q, qd, qdd))
    assert np.abs(ours - expected).max() <= 1e-12 * size(expected)


@given(sg.everywhere, sg.rates, sg.rates)
def test_base_wrench_about_a1_balances_its_torque(
    q: list[float], qd: list[float], qdd: list[float]
) -> None:
    """A1 turns about -z through the origin, so its torque is minus the moment about z."""
    tau = ARMS["tilted"].inverse_dynamics(q, qd, qdd)
    wrench = ARMS["tilted"].base_wrench(q, qd, qdd)
    assert wrench[5] == pytest.approx(-tau[0], abs=1e-12 * size(wrench))


# A solver of its own ------------------------------------------------------------------------


def test_bodies_of_a_link_in_either_frame_are_the_same() -> None:
    """A link given in zero-pose axes and the same link given in its DH frame."""
    from dataclasses import replace

    data = kr16cli.load_data()
    g = data.geometry
    zero = np.array([1.0] * 6), np.array([0.0] * 6)
    frames = [oracles.ROBROOT_OF_BASE @ f for f in oracles.dh_frames(g, *zero)]
    for i, (link, origin) in enumerate(zip(data.links, oracles.points(g), strict=True), 1):
        r, p = frames[i][:3, :3], frames[i][:3, 3]
        com = r.T @ (np.array(link.com) + origin - p)
        t = r.T @ oracles.tensor(link.inertia) @ r
        six = (t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2])
        other = replace(link, com=tuple(com), inertia=tuple(six), frame="dh")
        a, b = inertia.link_body(link, i, g), inertia.link_body(other, i, g)
        assert [float(v) for v in (a.m, *a.h, *a[2:])] == pytest.approx(
            [float(v) for v in (b.m, *b.h, *b[2:])], abs=1e-13
        )
