"""Floats against the same model at 50 digits, in units in the last place; inverse kinematics too.

One unit (ulp) is 2^-52 of the largest number of a result, or of what it is made from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from mpmath import mp, mpf

import kr16cli
import oracles
import strategies as sg
from kr16cli.model import coriolis, dynamics, forward, inertia, inverse
from kr16cli.model.scalars import FLOATS, Functions
from kr16cli.model.view import View
from kr16cli.robot import Geometry, LinkData

DIGITS = 50
ULP = 2.0**-52
DATA = kr16cli.load_data()
few = settings(max_examples=25)


@pytest.fixture(autouse=True, scope="module")
def _fifty_digits() -> Any:
    with mpmath.workdps(DIGITS):
        yield


def functions() -> Functions:
    """The functions of mpmath numbers, at the precision in force."""
    return Functions(
        sqrt=mp.sqrt,
        sin=mp.sin,
        cos=mp.cos,
        atan2=mp.atan2,
        where=lambda condition, a, b: a if condition else b,
        pi=+mp.pi,
    )


def precise(values: Any) -> Any:
    """The same doubles as 50-digit numbers, exactly."""
    return [mpf(v) for v in values]


def robot_parts(to: Callable[[float], Any]) -> tuple[Geometry, tuple[inertia.Body, ...], list[Any]]:
    """Geometry, base bodies and gravity in numbers of another kind."""
    g = Geometry(*map(to, DATA.geometry))

    def link(one: LinkData) -> LinkData:
        com, six = (tuple(map(to, v)) for v in (one.com, one.inertia))
        return replace(one, mass=to(one.mass), com=com, inertia=six)  # type: ignore[arg-type]

    bodies = inertia.robot_bodies([link(one) for one in DATA.links], None, g)
    return g, inertia.regroup(bodies, g), [to(v) for v in DATA.gravity]


def gap(ours: Any, exact: Any, scale: float) -> float:
    """Largest difference in units in the last place of `scale`, itself formed at 50 digits."""
    a, b = (np.array(v, dtype=object).ravel() for v in (ours, exact))
    differences = [abs(mpf(float(x)) - mpf(_number(y))) for x, y in zip(a, b, strict=True)]
    return float(max(differences)) / (scale * ULP)


def _number(value: Any) -> Any:
    return value if isinstance(value, mpf | int) else float(value)


def largest(*values: Any) -> float:
    return max(abs(float(v)) for value in values for v in np.array(value, dtype=object).ravel())


@few
@given(sg.everywhere)
def test_pose_is_good_to_eight_ulps(q: list[float]) -> None:
    g, _, _ = robot_parts(mpf)
    exact = forward.flange(functions().trig(precise(q)), g).rows()
    ours = forward.flange(FLOATS.trig(q), DATA.geometry).rows()
    assert gap(ours, exact, 1.0) <= 8


@few
@given(sg.everywhere)
def test_pose_at_50_digits_is_the_oracles(q: list[float]) -> None:
    g, _, _ = robot_parts(mpf)
    cs = functions().trig(precise(q))
    c, s = (np.array(v, dtype=object) for v in zip(*cs, strict=True))
    expected = oracles.flange(g, c, s)
    ours = np.array(forward.flange(cs, g).rows(), dtype=object)
    assert max(abs(v) for v in (ours - expected)[:3].ravel()) <= mpf(10) ** -48


@few
@given(sg.everywhere, sg.rates)
def test_jacobians_are_good_to_ten_ulps(q: list[float], qd: list[float]) -> None:
    g, _, _ = robot_parts(mpf)
    cs, rates = functions().trig(precise(q)), precise(qd)
    trig = FLOATS.trig(q)
    assert gap(View(DATA.geometry).jacobian(trig), View(g).jacobian(cs), 1.0) <= 10
    rate = gap(View(DATA.geometry).jacobian_dot(trig, qd), View(g).jacobian_dot(cs, rates), 1.0)
    assert rate <= 10 * (1 + sum(map(abs, qd)))


@few
@given(sg.everywhere, sg.rates, sg.rates)
def test_dynamics_is_good_to_thirty_ulps_of_its_largest_term(
    q: list[float], qd: list[float], qdd: list[float]
) -> None:
    g, bodies, field = robot_parts(mpf)
    g_f, bodies_f, field_f = robot_parts(float)
    cs, trig = functions().trig(precise(q)), FLOATS.trig(q)
    speed, push = precise(qd), precise(qdd)

    M = dynamics.mass_matrix(cs, bodies, g)
    C = coriolis.coriolis_matrix(cs, speed, bodies, g)
    G = dynamics.gravity_torque(cs, bodies, g, field)
    assert gap(dynamics.mass_matrix(trig, bodies_f, g_f), M, largest(M)) <= 30
    scale = 100 * (1e-300 + sum(map(abs, qd)))  # kg m2: moments of the arm, at most
    assert gap(coriolis.coriolis_matrix(trig, qd, bodies_f, g_f), C, scale) <= 30
    weight = 171.6 * 9.81 * 1.6
    assert gap(dynamics.gravity_torque(trig, bodies_f, g_f, field_f), G, weight) <= 30

    tau = dynamics.inverse_dynamics(cs, speed, push, bodies, g, field)
    ours = dynamics.inverse_dynamics(trig, qd, qdd, bodies_f, g_f, field_f)
    scale = weight + 100 * (sum(map(abs, qdd)) + sum(v * v for v in qd) * 6)
    assert gap(ours, tau, scale) <= 30


@few
@given(sg.everywhere, sg.rates, sg.loads)
def test_forward_dynamics_is_good_to_the_condition_of_the_mass_matrix(
    q: list[float], qd: list[float], tau: list[float]
) -> None:
    g, bodies, field = robot_parts(mpf)
    g_f, bodies_f, field_f = robot_parts(float)
    trig = FLOATS.trig(q)
    exact = dynamics.forward_dynamics(
        functions().trig(precise(q)), precise(qd), precise(tau), bodies, g, field
    )
    ours = dynamics.forward_dynamics(trig, qd, tau, bodies_f, g_f, field_f)
    M = np.array(dynamics.mass_matrix(trig, bodies_f, g_f), dtype=object).astype(float)
    scale = 1e3 + largest(exact) * float(np.linalg.cond(M))
    assert gap(ours, exact, scale) <= 30


@few
@given(sg.everywhere, sg.rates, sg.rates)
def test_dynamics_at_50_digits_holds_its_identities(
    q: list[float], qd: list[float], qdd: list[float]
) -> None:
    """C qd + G + M qdd against Newton-Euler, and back through the solver, to 45 digits."""
    g, bodies, field = robot_parts(mpf)
    cs, speed, push = functions().trig(precise(q)), precise(qd), precise(qdd)
    zero = mpf(0)
    M, C = (
        np.array(m, dtype=object) + zero
        for m in (
            dynamics.mass_matrix(cs, bodies, g),
            coriolis.coriolis_matrix(cs, speed, bodies, g),
        )
    )
    G = np.array(dynamics.gravity_torque(cs, bodies, g, field), dtype=object) + zero
    tau = dynamics.inverse_dynamics(cs, speed, push, bodies, g, field)
    expected = M @ np.array(push) + C @ np.array(speed) + G
    assert max(abs(a - b) for a, b in zip(tau, expected, strict=True)) <= mpf(10) ** -44
    back = dynamics.forward_dynamics(cs, speed, tau, bodies, g, field)
    assert max(abs(a - b) for a, b in zip(back, push, strict=True)) <= mpf(10) ** -40


@few
@given(sg.everywhere)
def test_inverse_kinematics_closes_at_50_digits(q: list[float]) -> None:
    """To 40 digits; on a singularity to the distance that counts as on it (1e-10)."""
    g, _, _ = robot_parts(mpf)
    ns = functions()
    pose = forward.flange(ns.trig(precise(q)), g).rows()
    solution = inverse.solve(
        [row[:3] for row in pose[:3]], [row[3] for row in pose[:3]], g, precise(q), ns
    )
    found = [row for row in solution.angles if not any(mp.isnan(v) for v in row)]
    assert found
    singular = solution.on_axis or any(solution.straight_wrist) or any(solution.folded)
    limit = mpf(10) ** -9 if singular else mpf(10) ** -40
    beyond = min(abs(abs(cosine) - 1) for _, cosine in solution.reach)
    if beyond <= mpf(10) ** -11:
        limit = mpf(10) ** -9  # an elbow within rounding of straight is taken as straight
    for row in found:
        made = forward.flange(ns.trig(row), g).rows()
        error = max(
            abs(a - b)
            for x, y in zip(made[:3], pose[:3], strict=True)
            for a, b in zip(x, y, strict=True)
        )
        assert error <= limit


@few
@given(sg.regular)
def test_float_solutions_are_good_to_the_condition_of_the_pose(q: list[float]) -> None:
    """All rows against 50 digits, the same branches there and missing."""
    g, _, _ = robot_parts(mpf)
    ns = functions()
    pose = oracles.flange(DATA.geometry, *oracles.turns(q)).tolist()
    sharp = [precise(row) for row in pose[:3]]
    exact = inverse.solve([r[:3] for r in sharp], [r[3] for r in sharp], g, precise([0.0] * 6), ns)
    ours = kr16cli.Arm(DATA).ik(pose).angles
    for row, other in zip(ours, exact.angles, strict=True):
        values = [float(v) for v in other]
        assert np.isnan(row).any() == np.isnan(values).any()
        if not np.isnan(values).any():
            weakest = np.linalg.svd(
                oracles.jacobian(DATA.geometry, *oracles.turns(values)), compute_uv=False
            )[-1]
            assert oracles.angle_gap(row, values) <= 30 * ULP / min(weakest, 1e-1)


def test_pose_at_round_angles_is_the_50_digit_value_rounded() -> None:
    """At quarter turns every entry is a plain sum of lengths: right to two ulps of 2 m."""
    for q_deg in ([0, -90, 90, 0, 0, 0], [0] * 6, [90, 0, -90, 90, 90, 180]):
        g, _, _ = robot_parts(lambda v: mpf(repr(v)))
        cs = [(mp.cos(a), mp.sin(a)) for a in (mp.pi * v / 180 for v in q_deg)]
        exact = forward.flange(cs, g).rows()
        ours = kr16cli.Arm(DATA).fk(np.radians(q_deg).tolist())
        assert gap(ours, exact, 2.0) <= 2
