"""Every term of the equations of motion against Lagrange's equations."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli import Robot
from kr16cli.verify import sampling
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.measure import finding, gap, largest, relative
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.dynamics.common import (
    FROM_ROUNDING,
    LAGRANGE,
    VARIANTS,
    Motion,
    motion,
    other_arms,
    over_variants,
)

_TOLERANCE = 1e-12


@case(
    "dynamics.mass-matrix",
    title="Mass matrix",
    statement="M = sum m J_v^T J_v + J_w^T I J_w, (3.38)",
    regime=VARIANTS,
    method="sum over links with Jacobians of the product of exponentials",
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.38", "3.39"),
    functions=("kr16cli.Robot.mass_matrix", "kr16cli.model.dynamics.mass_matrix"),
)
def mass_matrix(setting: Setting) -> Finding:
    """M."""
    return over_variants(
        setting, "mass-matrix", (5000, 200),
        lambda r, o, m: relative(r.mass_matrix(m.q), o.mass_matrix(m.q), 2),
        "all 36 entries", "q",
    )  # fmt: skip


@case(
    "dynamics.coriolis",
    title="Coriolis matrix and Christoffel matrices",
    statement="C_k(i, j) = (dM_kj/dq_i + dM_ki/dq_j - dM_ij/dq_k) / 2 and C = sum_i qd_i C_k(i, .)",
    regime=VARIANTS,
    method=LAGRANGE,
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.40", "3.41"),
    functions=(
        "kr16cli.Robot.coriolis_matrix",
        "kr16cli.Robot.christoffel",
        "kr16cli.model.coriolis.coriolis_matrix",
    ),
)
def coriolis(setting: Setting) -> Finding:
    """C and its symbols, entry by entry."""

    def compare(robot: Robot, other: Lagrangian, m: Motion) -> sampling.Array:
        symbols = other.christoffel(m.q)
        C = np.einsum("nkij,ni->nkj", symbols, m.qd)
        return largest(
            relative(robot.christoffel(m.q), symbols, 3),
            relative(robot.coriolis_matrix(m.q, m.qd), C, 2),
        )

    text = "216 symbols and 36 entries"
    return over_variants(setting, "coriolis", (1500, 30), compare, text, "q qd")


@case(
    "dynamics.gravity",
    title="Gravity torques",
    statement="G = dP/dq, (3.42)",
    regime=VARIANTS,
    method=LAGRANGE,
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.42",),
    functions=("kr16cli.Robot.gravity", "kr16cli.model.dynamics.gravity_torque"),
)
def gravity(setting: Setting) -> Finding:
    """G."""
    return over_variants(
        setting, "gravity", (5000, 300),
        lambda r, o, m: relative(r.gravity(m.q), o.gravity(m.q), 1, 1.0), "six torques", "q",
    )  # fmt: skip


@case(
    "dynamics.inverse",
    title="Inverse dynamics",
    statement="tau = d/dt (dT/dqd) - dT/dq + dP/dq",
    regime=VARIANTS,
    method=LAGRANGE,
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.38", "3.40", "3.42"),
    functions=("kr16cli.Robot.inverse_dynamics", "kr16cli.model.dynamics.newton_euler"),
)
def inverse(setting: Setting) -> Finding:
    """Newton-Euler against Lagrange."""
    return over_variants(
        setting, "inverse", (2000, 50),
        lambda r, o, m: relative(r.inverse_dynamics(*m), o.inverse_dynamics(*m)), "six torques",
    )  # fmt: skip


@case(
    "dynamics.forward",
    title="Forward dynamics",
    statement="M qdd = tau - C qd - G",
    regime=VARIANTS,
    method="torques by Lagrange for known accelerations, which must come back",
    grade="B",
    tolerance=1e-10,
    unit="rad/s2",
    reason="M's condition number is up to 1e5; torques are good to 1e-15 of 1e3 N m",
    equations=("3.38", "3.40", "3.42"),
    functions=("kr16cli.Robot.forward_dynamics", "kr16cli.model.dynamics.solve_symmetric"),
)
def forward(setting: Setting) -> Finding:
    """Accelerations back."""
    return over_variants(
        setting, "forward", (2000, 50),
        lambda r, o, m: gap(r.forward_dynamics(m.q, m.qd, o.inverse_dynamics(*m)), m.qdd),
        "six accelerations",
    )  # fmt: skip


@case(
    "dynamics.energy",
    title="Kinetic and potential energy",
    statement="T = sum (m v^2 + w I w) / 2, P = -sum m g . p_c, (3.43)",
    regime=VARIANTS,
    method="velocities of mass centres by the product of exponentials",
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.43",),
    functions=("kr16cli.Robot.energy", "kr16cli.model.energy.potential"),
)
def energy(setting: Setting) -> Finding:
    """Energies."""
    return over_variants(setting, "energy", (5000, 200), _energy_gap, "two energies", "q qd")


def _energy_gap(robot: Robot, other: Lagrangian, m: Motion) -> sampling.Array:
    kinetic, potential = robot.energy(m.q, m.qd)
    T, P = other.kinetic(m.q, m.qd), other.potential(m.q)
    return largest(np.abs(kinetic / T - 1), np.abs(potential - P) / np.maximum(np.abs(P), 1e3))


@case(
    "dynamics.base-wrench",
    title="Reaction of the foundation",
    statement="(force, moment) = rate of momentum and angular momentum about robroot, less weight",
    regime=VARIANTS,
    method="momenta summed over links, complex step in time",
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason=FROM_ROUNDING,
    functions=("kr16cli.Robot.base_wrench", "kr16cli.model.energy.base_wrench"),
)
def base_wrench(setting: Setting) -> Finding:
    """Foundation loads."""
    return over_variants(
        setting, "base-wrench", (3000, 150),
        lambda r, o, m: relative(r.base_wrench(*m), o.base_wrench(*m)), "force and moment",
    )  # fmt: skip


@case(
    "dynamics.other-arms",
    title="All terms, for other arms of the same structure",
    statement="M, C, G, tau, energies and base wrench hold for any numbers, links given in frames "
    "of either kind, gravity along no axis",
    regime="random lengths, links (zero-pose and dh frames in turn), payload and motions",
    method=LAGRANGE,
    grade="B",
    tolerance=_TOLERANCE,
    unit="relative",
    reason="as for the KR 16-2; random numbers hide no zero and no symmetry",
    equations=("3.38", "3.40", "3.41", "3.42", "3.43"),
    functions=("kr16cli.Robot.inverse_dynamics", "kr16cli.model.inertia.link_body"),
)
def any_arm(setting: Setting) -> Finding:
    """Nothing leans on one robot's numbers."""
    errors, moving = [], []
    for robot, other, m in other_arms(setting, "other-arms"):
        errors.append(
            largest(
                relative(robot.mass_matrix(m.q), other.mass_matrix(m.q), 2),
                relative(robot.coriolis_matrix(m.q, m.qd), other.coriolis_matrix(m.q, m.qd), 2),
                relative(robot.gravity(m.q), other.gravity(m.q), 1, 1.0),
                relative(robot.inverse_dynamics(*m), other.inverse_dynamics(*m)),
                relative(robot.base_wrench(*m), other.base_wrench(*m)),
                _energy_gap(robot, other, m),
            )
        )
        moving.append(m)
    together: dict[str, Any] = {
        k: np.concatenate([getattr(m, k) for m in moving]) for k in Motion._fields
    }
    return finding(np.concatenate(errors), "all terms of all arms", **together)


@case(
    "dynamics.single",
    title="One configuration on floats",
    statement="Arm's dynamics equal Robot's, with a payload and drives",
    regime="all of joint space",
    method="single queries against a batch",
    grade="D",
    tolerance=1e-13,
    unit="relative",
    reason="the same formulas; sums may be ordered otherwise",
    functions=("kr16cli.Arm.inverse_dynamics", "kr16cli.Arm.mass_matrix", "kr16cli.Arm.energy"),
)
def single(setting: Setting) -> Finding:
    """The float path."""
    m = motion(setting, "single-dynamics", 100, 4)
    robot = Robot(setting.robot.data, payload=sampling.LOAD, drives=True)
    arm = robot.arm
    tau = robot.inverse_dynamics(*m)
    batch: tuple[Any, ...] = (
        robot.mass_matrix(m.q), robot.coriolis_matrix(m.q, m.qd), robot.christoffel(m.q),
        robot.gravity(m.q), tau, robot.forward_dynamics(m.q, m.qd, tau),
        np.stack(robot.energy(m.q, m.qd), axis=-1), robot.base_wrench(*m),
        robot.friction(m.qd), *robot.task_space(m.q, m.qd),
    )  # fmt: skip
    errors = []
    for i, (q, qd, qdd) in enumerate(zip(*(v.tolist() for v in m), strict=True)):
        one: tuple[Any, ...] = (
            arm.mass_matrix(q), arm.coriolis_matrix(q, qd), arm.christoffel(q), arm.gravity(q),
            arm.inverse_dynamics(q, qd, qdd), arm.forward_dynamics(q, qd, tau[i].tolist()),
            arm.energy(q, qd), arm.base_wrench(q, qd, qdd), arm.friction(qd),
        )  # fmt: skip
        gaps = [relative(a, b[i], b[i].ndim) for a, b in zip(one, batch, strict=False)]
        # Task space divides by the Jacobian twice: its condition number is let off.
        slack = 1.0 + np.linalg.cond(robot.jacobian(q)) ** 2
        for a, b in zip(arm.task_space(q, qd), batch[len(one) :], strict=True):
            numbers = np.array([[float(v) for v in np.atleast_1d(row)] for row in a])
            gaps.append(relative(numbers.reshape(b[i].shape), b[i], b[i].ndim) / slack)
        errors.append(float(np.max(gaps)))
    return finding(errors, "ten quantities and the task space", **m._asdict())
