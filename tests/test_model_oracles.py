"""The oracles themselves: independent of the package, right on cases done by hand, sensitive."""

from __future__ import annotations

import ast
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import duals
import kr16cli
import oracles
import strategies as sg

DATA = kr16cli.load_data()
G = DATA.geometry
BODIES = oracles.bodies(G, DATA.links)


@pytest.mark.parametrize("module", ["duals", "oracles", "pinocchio_peer", "strategies"])
def test_imports_nothing_of_the_package(module: str) -> None:
    tree = ast.parse((Path(__file__).parent / f"{module}.py").read_text(encoding="utf-8"))
    names = {
        name.split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
        )
    }
    assert "kr16cli" not in names
    assert names <= {
        "__future__", "collections", "duals", "functools", "hypothesis", "math", "numbers", "numpy",
        "oracles", "pinocchio", "typing",
    }  # fmt: skip


@given(st.fractions(-9, 9), st.fractions(-9, 9).filter(bool))
def test_dual_numbers_differentiate_rational_functions(x: Fraction, k: Fraction) -> None:
    """f = (k x^2 - x + 3) / (x^2 + 1), by the quotient rule."""
    v = duals.Dual(x, Fraction(1))
    f = (k * v * v - v + 3) / (v * v + 1)
    top, bottom = k * x * x - x + 3, x * x + 1
    assert f.real == top / bottom
    assert f.eps == ((2 * k * x - 1) * bottom - top * 2 * x) / bottom**2
    inverse = 1 / (v * v + 1) - (2 - v)
    assert inverse.eps == -2 * x / bottom**2 + 1


@given(sg.everywhere, sg.rates)
@settings(max_examples=10)
def test_complex_step_and_dual_numbers_give_the_same_slope(q: list[float], qd: list[float]) -> None:
    c, s = oracles.turns(q)
    function = partial(oracles.mass_matrix, G, BODIES)
    step = oracles.slope(function, c, s, np.array(qd))
    dual = oracles.slope(function, c.astype(object), s.astype(object), np.array(qd))
    assert np.abs(step - dual.astype(float)).max() <= 1e-12 * (1 + np.abs(step).max())


@given(sg.everywhere)
def test_the_two_chains_are_one(q: list[float]) -> None:
    """Product of exponentials and the literal table, which share no number but the lengths."""
    c, s = oracles.turns(q)
    table = oracles.ROBROOT_OF_BASE @ oracles.dh_frames(G, c, s)[6] @ np.diag([-1, -1, 1, 1])
    assert np.abs(table - oracles.flange(G, c, s)).max() <= 2e-15


def test_merged_bodies_of_two_points() -> None:
    """A dumbbell: masses 1 and 3 one metre apart on x."""
    point = np.zeros((3, 3))
    ends = [oracles.Body(m, np.array([x, 0.0, 0.0]), point) for m, x in ((1.0, 0.0), (3.0, 1.0))]
    body = oracles.merged(*ends)
    assert body.mass == 4.0
    assert body.centre.tolist() == [0.75, 0.0, 0.0]
    assert np.allclose(body.inertia, np.diag([0.0, 0.75, 0.75]), atol=1e-16)


def test_stretched_arm_holds_its_weight_by_hand() -> None:
    """Zero pose: torque on A2 is minus the sum of weight times lever, sign by KUKA's axis."""
    c, s = oracles.turns(np.zeros(6))
    lever = sum(b.mass * (b.centre[0] - G.a1) for b in BODIES[1:])
    torque = oracles.gravity_torque(G, BODIES, (0, 0, -9.81), c, s)
    assert torque[1] == pytest.approx(-9.81 * lever, rel=1e-14)


@pytest.mark.parametrize("key", ["d1", "a1", "a2", "a3", "d4", "d6"])
def test_a_millimetre_shows(key: str, arm: kr16cli.Arm) -> None:
    """Every length enters: the comparisons of the suite would not pass with a wrong one."""
    other = G._replace(**{key: getattr(G, key) + 1e-3})
    q = np.array([0.3, -1.1, 1.2, 0.4, 0.8, -0.2])
    gap = np.abs(oracles.flange(other, *oracles.turns(q)) - np.array(arm.fk(q.tolist()))).max()
    assert 1e-4 < gap < 2e-3


@pytest.mark.parametrize("link", range(6))
def test_every_inertial_number_shows(link: int, arm: kr16cli.Arm) -> None:
    """Raise one number of one link: mass, three coordinates, six tensor entries.

    Link 1 turns about the vertical alone, so its Ixx, Iyy and Ixy show nowhere.
    """
    c, s = oracles.turns([0.3, -1.1, 1.2, 0.4, 0.8, -0.2])
    motion = ([1.0, -2.0, 1.5, 3.0, -2.5, 2.0], [2.0, 1.0, -1.0, 2.0, 3.0, -2.0])
    field = (2.0, 3.0, -9.0)
    body = BODIES[link]
    unit = np.eye(3)
    changed = [body._replace(mass=body.mass * 1.01)]
    changed += [body._replace(centre=body.centre + 1e-2 * e) for e in unit]
    entries = ((2, 2), (0, 2), (1, 2), (0, 0), (1, 1), (0, 1))
    for i, j in entries[: 6 if link else 3]:
        more = np.zeros((3, 3))
        more[i, j] = more[j, i] = 1e-2
        changed.append(body._replace(inertia=body.inertia + more))
    before = oracles.base_wrench(G, BODIES, field, c, s, motion).astype(float)
    torque = oracles.inverse_dynamics(G, BODIES, field, c, s, motion)
    for other in changed:
        bodies = [*BODIES[:link], other, *BODIES[link + 1 :]]
        after = oracles.base_wrench(G, bodies, field, c, s, motion).astype(float)
        tau = oracles.inverse_dynamics(G, bodies, field, c, s, motion)
        assert max(np.abs(after - before).max(), np.abs(tau - torque).max()) > 1e-6
