"""Derivatives of inverse and forward dynamics: exact by proof, and against other engines."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import duals
import kr16cli
import oracles
import strategies as sg
from kernel_cases import ROBOTS, inputs, numpy_engine
from kr16cli.kernels.parameters import parameters
from kr16cli.model import derivatives, dynamics, inertia
from kr16cli.model.derivatives import Derivatives
from kr16cli.model.scalars import FLOATS
from pinocchio_peer import Pinocchio

ENGINES = ["as installed", "numpy"]
PARTS = ("inverse_dynamics_derivatives", "forward_dynamics_derivatives")


def _robot(engine: str, **options: Any) -> kr16cli.Robot:
    robot = kr16cli.load_robot(**options)
    return numpy_engine(robot) if engine == "numpy" else robot


# Proof ----------------------------------------------------------------------------------------


def _fractions(source: random.Random, count: int, size: int = 30) -> list[Fraction]:
    return [Fraction(source.randint(-size, size), source.randint(1, size)) for _ in range(count)]


def _random_bodies(source: random.Random) -> list[inertia.Body]:
    """Ten numbers of any sign for each link: the identities ask for no physical body."""
    bodies = []
    for _ in range(6):
        m, x, y, z, *rest = _fractions(source, 10)
        bodies.append(inertia.Body(m, (x, y, z), *rest))
    return bodies


def _along(found: Derivatives, *directions: list[Any]) -> list[Any]:
    return [
        sum(
            sum(a * b for a, b in zip(row, way, strict=True))
            for row, way in zip(rows, directions, strict=True)
        )
        for rows in zip(*found, strict=True)
    ]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("regrouped", [False, True])
def test_directional_derivatives_hold_exactly(seed: int, regrouped: bool) -> None:
    """On fractions and dual numbers nothing is rounded: a false formula fails almost surely."""
    source = random.Random(seed)
    g = kr16cli.load_data().geometry._replace(
        **dict(zip(("d1", "a1", "a2", "a3", "d4", "d6"), _fractions(source, 6), strict=True))
    )
    bodies: Any = _random_bodies(source)
    if regrouped:
        bodies = inertia.regroup(bodies, g)
    cs = [oracles.rational_turn(t) for t in _fractions(source, 6)]
    qd, qdd, u, v, w, rotors = (_fractions(source, 6) for _ in range(6))
    fixed = (bodies, g, _fractions(source, 3), rotors)
    turned = duals.dual_turns(*(np.array(x, dtype=object) for x in zip(*cs, strict=True)), u)
    moved = (
        list(zip(*turned, strict=True)),
        [duals.Dual(a, b) for a, b in zip(qd, v, strict=True)],
        [duals.Dual(a, b) for a, b in zip(qdd, w, strict=True)],
    )
    tau = dynamics.inverse_dynamics(*moved, *fixed)
    change = [t.eps for t in tau]
    found = derivatives.inverse_dynamics_derivatives(cs, qd, qdd, *fixed)
    assert _along(found, u, v, w) == change
    answer = derivatives.forward_dynamics_derivatives(cs, qd, [t.real for t in tau], *fixed)
    assert _along(answer, u, v, change) == w


@given(sg.rates)
def test_slope_of_friction_is_its_derivative(qd: list[float]) -> None:
    """By a complex step."""
    k = parameters(kr16cli.load_robot(drives=True).arm)
    slopes = dynamics.friction_slope(qd, k.coulomb, k.viscous, FLOATS)
    step = [complex(v, 1e-30) for v in qd]
    complexes = kr16cli.model.scalars.Functions(
        **{**FLOATS.__dict__, "sqrt": lambda z: np.sqrt(complex(z))}
    )
    expected = [f.imag / 1e-30 for f in dynamics.friction(step, k.coulomb, k.viscous, complexes)]
    assert slopes == pytest.approx(expected, rel=1e-12)


# Other engines --------------------------------------------------------------------------------


def _worst(ours: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference over the largest element of its matrix."""
    size = np.abs(expected).max(axis=(-1, -2))
    return float((np.abs(ours - expected).max(axis=(-1, -2)) / size).max())


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("load", [None, ROBOTS["loaded"]["payload"]], ids=["bare", "loaded"])
@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (2.0, -3.0, -9.0)], ids=str)
def test_pinocchios_derivatives(
    engine: str, load: kr16cli.Payload | None, gravity: tuple[float, float, float]
) -> None:
    pin = pytest.importorskip("pinocchio")
    robot = kr16cli.load_robot(payload=load).with_gravity(gravity)
    robot = numpy_engine(robot) if engine == "numpy" else robot
    g = robot.data.geometry
    other = Pinocchio(g, oracles.bodies(g, robot.data.links, load), gravity)
    rng = np.random.default_rng(8)
    q, qd, qdd = rng.uniform(-3, 3, (3, 100, 6))
    tau = robot.inverse_dynamics(q, qd, qdd)

    def theirs(function: Any, last: np.ndarray) -> list[np.ndarray]:
        """Three arrays (n, 6, 6); of a symmetric matrix Pinocchio fills the upper triangle."""
        rows = []
        for motion in zip(q, qd, last, strict=True):
            by_q, by_qd, by_last = map(np.array, function(other.model, other.data, *motion))
            rows.append((by_q, by_qd, np.triu(by_last) + np.triu(by_last, 1).T))
        return [np.array(part) for part in zip(*rows, strict=True)]

    found = robot.inverse_dynamics_derivatives(q, qd, qdd)
    for ours, expected in zip(found, theirs(pin.computeRNEADerivatives, qdd), strict=True):
        assert _worst(ours, expected) <= 1e-13
    found = robot.forward_dynamics_derivatives(q, qd, tau)
    for ours, expected in zip(found, theirs(pin.computeABADerivatives, tau), strict=True):
        assert _worst(ours, expected) <= 1e-11


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", ROBOTS)
def test_differences_of_the_functions_themselves(engine: str, kind: str) -> None:
    """Central differences with one extrapolation, friction and rotors among them."""
    robot = _robot(engine, **ROBOTS[kind])
    for name in PARTS:
        function = getattr(robot, name.removesuffix("_derivatives"))
        point = inputs(name, 20, robot)
        if name.startswith("forward"):
            point[2] = robot.inverse_dynamics(*point[:2], point[2] / 200)
        for at, found in enumerate(getattr(robot, name)(*point)):
            columns = []
            for e in np.eye(6):
                slopes = []
                for h in (2e-4, 1e-4):
                    up, down = (
                        [*point[:at], point[at] + s * h * e, *point[at + 1 :]] for s in (1, -1)
                    )
                    slopes.append((function(*up) - function(*down)) / (2 * h))
                columns.append((4 * slopes[1] - slopes[0]) / 3)
            assert _worst(found, np.stack(columns, axis=-1)) <= 1e-7


# What they hold together ----------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", ROBOTS)
def test_parts_are_the_quantities_of_their_own_names(engine: str, kind: str) -> None:
    robot = _robot(engine, **ROBOTS[kind])
    q, qd, qdd = inputs("inverse_dynamics", 200, robot)
    tau = robot.inverse_dynamics(q, qd, qdd)
    M, C, G = robot.equation_of_motion(q, qd)
    friction = robot.friction(qd)
    bias = np.einsum("nij,nj->ni", C, qd) + G + friction
    assert np.abs(robot.bias(q, qd) - bias).max() <= 1e-12 * np.abs(bias).max()
    assert np.abs(robot.inverse_dynamics(q, qd, 0 * qdd) - bias).max() <= 1e-12 * np.abs(bias).max()
    for part, alone in (
        (M, robot.mass_matrix(q)), (C, robot.coriolis_matrix(q, qd)), (G, robot.gravity(q)),
    ):  # fmt: skip
        assert np.abs(part - alone).max() <= 1e-13 * np.abs(alone).max()
    by_q, by_qd, by_qdd = robot.inverse_dynamics_derivatives(q, qd, qdd)
    assert np.abs(by_qdd - M).max() <= 1e-13 * np.abs(M).max()
    slope = np.einsum("nii->ni", by_qd - 2 * C)
    assert np.abs(by_qd - 2 * C - slope[..., None] * np.eye(6)).max() <= 1e-13 * np.abs(C).max()
    assert (slope > 0).all() if kind == "drives" else np.abs(slope).max() < 1e-12
    for ours, theirs in zip(
        robot.forward_dynamics_derivatives(q, qd, tau), (-by_q, -by_qd, np.eye(6)), strict=True
    ):
        assert np.abs(M @ ours - theirs).max() <= 1e-10 * max(1.0, np.abs(theirs).max())
    inverse = robot.forward_dynamics_derivatives(q, qd, tau).dqdd_dtau
    assert (inverse == np.swapaxes(inverse, -1, -2)).all()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("name", "shape"),
    [("equation_of_motion", (78,)), ("bias", (6,)), *((name, (3, 6, 6)) for name in PARTS)],
)
@given(lead=st.lists(st.integers(0, 3), max_size=3).map(tuple))
def test_shapes_out_and_single_configurations(
    engine: str, name: str, shape: tuple[int, ...], lead: tuple[int, ...]
) -> None:
    robot = _robot(engine)
    point: list[np.ndarray] = [np.full((*lead, 6), 0.3), np.linspace(-1, 1, 6)]
    if name in PARTS:
        point.append(np.linspace(5, -5, 6))
    out = np.full((*lead, *shape), np.nan)
    found = getattr(robot, name)(*point, out=out)
    again = getattr(robot, name)(*point, threads=2)
    parts, others = (x if isinstance(x, tuple) else (x,) for x in (found, again))
    for part, other in zip(parts, others, strict=True):
        assert part.shape[: len(lead)] == lead
        assert np.array_equal(part, other)
        assert part.size == 0 or np.shares_memory(part, out)
    assert np.isfinite(out).all()
    for place in np.ndindex(*lead):
        one = getattr(robot, name)(*(p[place] if p.ndim > 1 else p for p in point))
        row = np.concatenate([np.ravel(x) for x in (one if isinstance(one, tuple) else (one,))])
        assert np.abs(row - out[place].ravel()).max() <= 1e-13 * np.abs(row).max()


@pytest.mark.parametrize("name", ["bias", "equation_of_motion", *PARTS])
def test_a_robot_without_inertia_says_so(name: str) -> None:
    robot = kr16cli.load_robot("kr16_l6")
    count = 3 if name in PARTS else 2
    with pytest.raises(kr16cli.InputError, match="no inertial data"):
        getattr(robot, name)(*[np.zeros(6)] * count)
