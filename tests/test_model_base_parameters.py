"""Base (minimal) inertial parameters: how many there are, and that regrouping changes no torque."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given

import kr16cli
import oracles
import strategies as sg
from kr16cli import Payload
from kr16cli.model import dynamics, inertia
from kr16cli.model.inertia import Body
from kr16cli.model.scalars import FLOATS
from kr16cli.robot import Geometry
from pinocchio_peer import Pinocchio

DATA = kr16cli.load_data()
G = DATA.geometry
LOAD = Payload(16.0, (0.05, -0.08, 0.12), (0.36, 0.30, 0.25, 0.02, -0.03, 0.01))
FULL = inertia.robot_bodies(DATA.links, LOAD, G)


def generic_bodies() -> tuple[Body, ...]:
    """Six sets of ten parameters, none of them zero or related to another."""
    rng = np.random.default_rng(4)
    rows = rng.uniform(0.5, 2.0, (6, 10)).tolist()
    return tuple(Body(r[0], (r[1], r[2], r[3]), *r[4:]) for r in rows)


def numbers(bodies: tuple[Body, ...]) -> Iterator[float]:
    for body in bodies:
        yield from (float(v) for v in (body.m, *body.h, *body[2:]))


def torques(
    bodies: tuple[Body, ...],
    motion: tuple[list[float], list[float], list[float]],
    gravity: tuple[float, ...],
    g: Geometry = G,
) -> np.ndarray:
    q, qd, qdd = motion
    tau = dynamics.inverse_dynamics(FLOATS.trig(q), qd, qdd, bodies, g, gravity)
    return np.array([float(t) for t in tau])


@given(sg.everywhere, sg.rates, sg.rates, sg.gravities)
def test_regrouped_arm_has_the_torques_of_the_full_one(
    q: list[float], qd: list[float], qdd: list[float], gravity: tuple[float, ...]
) -> None:
    for bodies in (FULL, generic_bodies()):
        full = torques(bodies, (q, qd, qdd), gravity)
        lean = torques(inertia.regroup(bodies, G), (q, qd, qdd), gravity)
        assert np.abs(full - lean).max() <= 1e-12 * (1 + np.abs(full).max())


@given(sg.everywhere)
def test_regrouped_arm_has_the_mass_matrix_of_the_full_one(q: list[float]) -> None:
    cs = FLOATS.trig(q)
    full, lean = (
        np.array(dynamics.mass_matrix(cs, bodies, G), dtype=object).astype(float)
        for bodies in (FULL, inertia.regroup(FULL, G))
    )
    assert np.abs(full - lean).max() <= 1e-13 * np.abs(full).max()


def test_thirty_eight_numbers_stay() -> None:
    lean = inertia.regroup(generic_bodies(), G)
    assert sum(v != 0 for v in numbers(lean)) == 38
    assert sum(v != 0 for v in numbers(inertia.sparse(lean))) == 38
    per_link = [sum(v != 0 for v in numbers((body,))) for body in lean]
    assert per_link == [3, 7, 7, 7, 7, 7]


def test_regrouping_twice_changes_nothing_more() -> None:
    once = inertia.regroup(generic_bodies(), G)
    assert list(numbers(inertia.regroup(once, G))) == pytest.approx(list(numbers(once)), abs=1e-15)


def test_two_of_the_thirty_eight_are_unseen_when_gravity_is_along_z() -> None:
    """The first moment of link 1, h_x and h_y: A1 is vertical then."""
    lean = inertia.regroup(generic_bodies(), G)
    without = (lean[0]._replace(h=(0.0, 0.0, 0.0)), *lean[1:])
    rng = np.random.default_rng(6)
    for _ in range(20):
        q, qd, qdd = rng.uniform(-3, 3, (3, 6)).tolist()
        upright = [torques(b, (q, qd, qdd), (0.0, 0.0, -9.81)) for b in (lean, without)]
        tilted = [torques(b, (q, qd, qdd), (1.0, 2.0, -9.81)) for b in (lean, without)]
        assert np.abs(upright[0] - upright[1]).max() <= 1e-12
        assert np.abs(tilted[0] - tilted[1]).max() > 1e-3


def rank(rows: np.ndarray) -> int:
    """Numerical rank; the gap between what counts and what does not must be wide."""
    values = np.linalg.svd(rows, compute_uv=False)
    values = values / values[0]
    count = int((values > 1e-8).sum())
    assert values[count - 1] > 1e-6
    assert count == len(values) or values[count] < 1e-12
    return count


@pytest.mark.parametrize(("general", "count"), [(True, 38), (False, 36)])
def test_rank_of_the_torque_regressor(general: bool, count: int) -> None:
    """60 numbers enter linearly; columns from unit parameters, motions drawn at random."""
    rng = np.random.default_rng(7)
    units = [
        tuple(
            Body(row[0], (row[1], row[2], row[3]), *row[4:])
            for row in np.eye(60)[k].reshape(6, 10).tolist()
        )
        for k in range(60)
    ]
    rows = []
    for _ in range(40):
        q, qd, qdd = rng.uniform(-3, 3, (3, 6)).tolist()
        gravity = tuple(rng.uniform(-10, 10, 3)) if general else (0.0, 0.0, -9.81)
        rows.append(np.array([torques(unit, (q, qd, qdd), gravity) for unit in units]).T)
    assert rank(np.vstack(rows)) == count


@pytest.mark.parametrize(("general", "count"), [(True, 38), (False, 36)])
def test_rank_of_pinocchios_regressor(general: bool, count: int) -> None:
    """The same count from another engine's regressor."""
    pytest.importorskip("pinocchio")
    rng = np.random.default_rng(8)
    rows = []
    other = Pinocchio(G, oracles.bodies(G, DATA.links), DATA.gravity)
    for _ in range(40):
        if general:
            other.model.gravity.linear = rng.uniform(-10, 10, 3)
        rows.append(other.regressor(*rng.uniform(-3, 3, (3, 6))))
    assert rank(np.vstack(rows)) == count


def test_shapes_of_arms_with_zero_lengths_regroup_too() -> None:
    """An arm with a1 = a3 = 0 keeps its torques; some parameters merely coincide."""
    g = Geometry(0.4, 0.0, 0.5, 0.0, 0.3, 0.0)
    rng = np.random.default_rng(9)
    bodies = generic_bodies()
    for _ in range(20):
        motion = tuple(rng.uniform(-3, 3, (3, 6)).tolist())
        full = torques(bodies, motion, (1.0, 2.0, -9.0), g)
        lean = torques(inertia.regroup(bodies, g), motion, (1.0, 2.0, -9.0), g)
        assert np.abs(full - lean).max() <= 1e-12 * np.abs(full).max()
