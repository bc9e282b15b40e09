"""Against Pinocchio, built from the parameter file's numbers without the package's model."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import kr16cli
import oracles
from kr16cli import Payload
from pinocchio_peer import Pinocchio

pytest.importorskip("pinocchio")

LOAD = Payload(16.0, (0.05, -0.08, 0.12), (0.36, 0.30, 0.25, 0.02, -0.03, 0.01))
GRAVITIES = [(0.0, 0.0, -9.81), (2.0, -3.0, -9.0), (0.0, 9.81, 0.0)]
CASES = [
    (name, load, gravity)
    for name in ("kr16_2", "chapter3")
    for load in (None, LOAD)
    for gravity in GRAVITIES
]
SAMPLES = 200


class Pair:
    """Our arm on arrays, Pinocchio's, and the same random motions for both."""

    def __init__(self, name: str, load: Payload | None, gravity: tuple[float, ...]) -> None:
        data = kr16cli.load_data(name).with_gravity(gravity)
        self.ours = kr16cli.Robot(data, payload=load)
        bodies = oracles.bodies(data.geometry, data.links, load)
        self.theirs = Pinocchio(data.geometry, bodies, gravity)
        rng = np.random.default_rng(20)
        self.q = rng.uniform(-np.pi, np.pi, (SAMPLES, 6))
        self.qd, self.qdd = rng.uniform(-4, 4, (2, SAMPLES, 6))
        self.tau = rng.uniform(-500, 500, (SAMPLES, 6))


@pytest.fixture(
    scope="module", params=CASES, ids=lambda c: f"{c[0]}-{'loaded' if c[1] else 'bare'}-g{c[2]}"
)
def pair(request: pytest.FixtureRequest) -> Iterator[Pair]:
    yield Pair(*request.param)


def worst(ours: np.ndarray, theirs: list[np.ndarray]) -> float:
    """Largest difference, relative to the largest number there is."""
    expected = np.array(theirs)
    assert ours.shape == expected.shape
    return float(np.abs(ours - expected).max() / np.abs(expected).max())


def test_flange_pose(pair: Pair) -> None:
    assert worst(pair.ours.fk(pair.q), [pair.theirs.fk(q) for q in pair.q]) <= 2e-15


def test_jacobian(pair: Pair) -> None:
    expected = [pair.theirs.jacobian(q) for q in pair.q]
    assert worst(pair.ours.jacobian(pair.q), expected) <= 2e-15


def test_jacobian_rate(pair: Pair) -> None:
    expected = [pair.theirs.jacobian_dot(q, v) for q, v in zip(pair.q, pair.qd, strict=True)]
    assert worst(pair.ours.jacobian_dot(pair.q, pair.qd), expected) <= 5e-15


def test_mass_matrix(pair: Pair) -> None:
    expected = [pair.theirs.mass_matrix(q) for q in pair.q]
    assert worst(pair.ours.mass_matrix(pair.q), expected) <= 5e-15


def test_coriolis_matrix(pair: Pair) -> None:
    """Pinocchio's factorisation is the Christoffel one for chains of revolute joints."""
    expected = [pair.theirs.coriolis_matrix(q, v) for q, v in zip(pair.q, pair.qd, strict=True)]
    assert worst(pair.ours.coriolis_matrix(pair.q, pair.qd), expected) <= 1e-14


def test_gravity(pair: Pair) -> None:
    assert worst(pair.ours.gravity(pair.q), [pair.theirs.gravity(q) for q in pair.q]) <= 1e-14


def test_inverse_dynamics(pair: Pair) -> None:
    rows = zip(pair.q, pair.qd, pair.qdd, strict=True)
    expected = [pair.theirs.inverse_dynamics(*row) for row in rows]
    assert worst(pair.ours.inverse_dynamics(pair.q, pair.qd, pair.qdd), expected) <= 1e-14


def test_forward_dynamics(pair: Pair) -> None:
    """Articulated bodies against a factorised mass matrix."""
    rows = zip(pair.q, pair.qd, pair.tau, strict=True)
    expected = [pair.theirs.forward_dynamics(*row) for row in rows]
    assert worst(pair.ours.forward_dynamics(pair.q, pair.qd, pair.tau), expected) <= 1e-12


def test_energy(pair: Pair) -> None:
    expected = np.array([pair.theirs.energy(q, v) for q, v in zip(pair.q, pair.qd, strict=True)])
    kinetic, potential = pair.ours.energy(pair.q, pair.qd)
    assert worst(kinetic, expected[:, 0]) <= 1e-14
    assert worst(potential, expected[:, 1]) <= 1e-14


def test_base_wrench(pair: Pair) -> None:
    """Foundation loads from the rate of the centroidal momentum."""
    rows = zip(pair.q, pair.qd, pair.qdd, strict=True)
    expected = [pair.theirs.base_wrench(*row) for row in rows]
    assert worst(pair.ours.base_wrench(pair.q, pair.qd, pair.qdd), expected) <= 1e-14


def test_rotors_are_pinocchios_armature() -> None:
    """Reflected inertia counted once: Pinocchio's armature is on the link side of the gear."""
    data = kr16cli.load_data()
    ours = kr16cli.Robot(data, drives=True)
    theirs = Pinocchio(data.geometry, oracles.bodies(data.geometry, data.links), data.gravity)
    motors = [1.3e-3, 1.3e-3, 1.3e-3, 1.6e-4, 1.8e-4, 4.3e-5]
    theirs.model.armature = motors * np.square([125, 125, 125, 74.444, 42.222, 24.117])
    rng = np.random.default_rng(21)
    for q, qd, x in rng.uniform(-3, 3, (50, 3, 6)):
        M = theirs.mass_matrix(q)
        assert worst(ours.mass_matrix(q), [*M]) <= 1e-14
        tau = ours.inverse_dynamics(q, qd, x) - ours.friction(qd)
        assert worst(tau, [*theirs.inverse_dynamics(q, qd, x)]) <= 1e-13
        qdd = ours.forward_dynamics(q, qd, 100 * x + ours.friction(qd))
        assert worst(qdd, [*theirs.forward_dynamics(q, qd, 100 * x)]) <= 1e-12
