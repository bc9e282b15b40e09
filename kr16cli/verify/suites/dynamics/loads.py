"""Payloads, drives, and the regrouping to base parameters."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli import Robot
from kr16cli.kernels.columns import ARRAYS
from kr16cli.model import dynamics as model
from kr16cli.model import inertia
from kr16cli.model.scalars import ZERO
from kr16cli.verify import sampling
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.measure import COUNT, finding, gap, largest, relative, stacked
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case
from kr16cli.verify.suites.dynamics.common import FROM_ROUNDING, motion


@case(
    "dynamics.zero-payload",
    title="A payload of nothing changes nothing",
    statement="with_payload(0) gives bit for bit the same M, C, G and tau",
    regime="all of joint space",
    method="the same motions with and without",
    grade="C",
    tolerance=COUNT,
    unit="motions that differ",
    reason="bit for bit",
    functions=("kr16cli.Robot.with_payload",),
)
def zero_payload(setting: Setting) -> Finding:
    """Nothing added."""
    m = motion(setting, "zero-payload", 2000, 100)
    bare = Robot(setting.robot.data)
    empty = bare.with_payload(0.0, (0.1, 0.2, 0.3))
    differ = (bare.inverse_dynamics(*m) != empty.inverse_dynamics(*m)).any(axis=1)
    differ |= (bare.mass_matrix(m.q) != empty.mass_matrix(m.q)).any(axis=(1, 2))
    differ |= (bare.coriolis_matrix(m.q, m.qd) != empty.coriolis_matrix(m.q, m.qd)).any(axis=(1, 2))
    differ |= bare.energy(m.q, m.qd)[1] != empty.energy(m.q, m.qd)[1]
    return finding([float(differ.sum())], f"M, C, tau and P of {len(m.q)} motions")


@case(
    "dynamics.payload-weight",
    title="A payload's weight reaches the joints through the Jacobian",
    statement="G_loaded - G_bare = -J_p^T m g, J_p at the payload's mass centre",
    regime="all of joint space, gravity along no axis",
    method="principle of virtual work with the verified Jacobian",
    grade="C",
    tolerance=1e-13,
    unit="relative",
    reason=FROM_ROUNDING,
    equations=("3.42",),
    functions=("kr16cli.Robot.with_payload", "kr16cli.model.inertia.payload_body"),
)
def payload_weight(setting: Setting) -> Finding:
    """Statics."""
    m = motion(setting, "payload-weight", 5000, 300)
    bare = Robot(setting.robot.data.with_gravity(sampling.TILTED))
    J = bare.jacobian(m.q, point=sampling.LOAD.com)[:, :3]
    own = bare.gravity(m.q)
    errors = []
    for mass in (sampling.LOAD.mass, 1.0, 1e-3):
        loaded = bare.with_payload(mass, sampling.LOAD.com, sampling.LOAD.inertia)
        expected = -np.einsum("nxi,x->ni", J, mass * np.array(sampling.TILTED))
        errors.append(gap(loaded.gravity(m.q) - own, expected) / np.abs(own).max(axis=1))
    return finding(largest(*errors), "six torques; 16 kg, 1 kg and 1 g", q=m.q)


@case(
    "dynamics.drives",
    title="Rotor inertia and friction, each counted once",
    statement="drives add diag(J G^2) to M and viscous qd + coulomb qd / sqrt(qd^2 + v^2) to tau, "
    "v = 0.01 rad/s; C and G stay; forward dynamics undoes it",
    regime="all of joint space, speeds from 1e-6 to 3 rad/s",
    method="the formula evaluated on the file's numbers, beside Lagrange's torques",
    grade="B",
    tolerance=1e-12,
    unit="relative",
    reason=FROM_ROUNDING,
    functions=("kr16cli.Robot.friction", "kr16cli.model.dynamics.friction"),
)
def drives(setting: Setting) -> Finding:
    """What the motors add."""
    m = motion(setting, "drives", 2000, 100)
    data = setting.robot.data
    m.qd[::2] *= 10.0 ** -np.linspace(0, 6, len(m.qd[::2]))[:, None]
    bare, driven = Lagrangian(data, sampling.LOAD), Robot(data, payload=sampling.LOAD, drives=True)
    rotors = np.array([(j.rotor_inertia or 0.0) * (j.gear_ratio or 0.0) ** 2 for j in data.joints])
    coulomb, viscous = (
        np.array([getattr(j, name) or 0.0 for j in data.joints]) for name in ("coulomb", "viscous")
    )
    friction = viscous * m.qd + coulomb * np.sin(np.arctan2(m.qd, 0.01))
    M = bare.mass_matrix(m.q) + np.diag(rotors)
    tau = bare.inverse_dynamics(*m) + m.qdd * rotors + friction
    kinetic = bare.kinetic(m.q, m.qd) + (rotors * m.qd**2).sum(axis=1) / 2
    plain = Robot(data, payload=sampling.LOAD)
    error = largest(
        relative(driven.friction(m.qd), friction),
        relative(driven.mass_matrix(m.q), M, 2),
        relative(driven.inverse_dynamics(*m), tau),
        gap(driven.forward_dynamics(m.q, m.qd, tau), m.qdd) * 1e-2,
        np.abs(driven.energy(m.q, m.qd)[0] / kinetic - 1),
        relative(driven.coriolis_matrix(m.q, m.qd), plain.coriolis_matrix(m.q, m.qd), 2),
        gap(driven.gravity(m.q), plain.gravity(m.q)) / 1e3,
        gap(plain.friction(m.qd), 0 * m.qd),
    )
    return finding(error, "friction, M, tau, qdd, T, C and G", **m._asdict())


@case(
    "dynamics.regrouped",
    title="Base parameters give the torques of the full set",
    statement="M, C, tau from regrouped bodies = those from the six links as they are",
    regime="all of joint space, random links, gravity along no axis",
    method="the recursions run on both sets",
    grade="C",
    tolerance=1e-13,
    unit="relative",
    reason=FROM_ROUNDING,
    functions=("kr16cli.model.inertia.regroup", "kr16cli.model.inertia.robot_bodies"),
)
def regrouped(setting: Setting) -> Finding:
    """What a robot is loaded as."""
    from kr16cli.model.coriolis import coriolis_matrix

    m = motion(setting, "regrouped", 2000, 100)
    data = sampling.random_robot(sampling.random(setting, "regrouped-arm"), setting.robot.data)
    robot = Robot(data, payload=sampling.LOAD)
    full, g = robot.arm.bodies, data.geometry
    cs, qd, qdd = ARRAYS.trig(list(m.q.T)), list(m.qd.T), list(m.qdd.T)
    tau = np.stack(model.inverse_dynamics(cs, qd, qdd, full, g, data.gravity), axis=-1)
    M = stacked(model.mass_matrix(cs, full, g), len(m.q))
    C = stacked(coriolis_matrix(cs, qd, full, g), len(m.q))
    count = sum(v is not ZERO for b in robot.arm.base_bodies for v in (b.m, *b.h, *b[2:]))
    error = largest(
        relative(robot.inverse_dynamics(*m), tau),
        relative(robot.mass_matrix(m.q), M, 2),
        relative(robot.coriolis_matrix(m.q, m.qd), C, 2),
    )
    return finding(
        error if count <= 38 else np.full(len(error), np.inf),
        f"{count} base parameters stand for 60",
        **m._asdict(),
    )


@case(
    "dynamics.base-parameters",
    title="38 inertial parameters are all that torques see",
    statement="The torques' regressor in the 60 parameters has rank 38; 36 with vertical gravity",
    regime="random motions",
    method="columns by unit parameters through Newton-Euler; rank by singular values",
    grade="C",
    tolerance=COUNT,
    unit="wrong ranks",
    reason="singular values fall from 1e-2 to 1e-13 at the rank",
    functions=("kr16cli.model.dynamics.newton_euler", "kr16cli.model.inertia.regroup"),
)
def base_parameters(setting: Setting) -> Finding:
    """How many numbers could be identified."""
    m = motion(setting, "base-parameters", 200, 40)
    g = setting.robot.data.geometry
    cs, qd, qdd = ARRAYS.trig(list(m.q.T)), list(m.qd.T), list(m.qdd.T)
    ranks = []
    # Column i of the identity, down a new axis: 60 robots of one unit parameter each at once.
    numbers = np.eye(60).reshape(6, 10, 60, 1)
    links = [inertia.Body(v[0], (v[1], v[2], v[3]), *v[4:]) for v in numbers]
    for field in (sampling.TILTED, (0.0, 0.0, -9.81)):
        tau: Any = model.inverse_dynamics(cs, qd, qdd, links, g, field)
        regressor = np.stack([np.broadcast_to(t, (60, len(m.q))) for t in tau])
        sigma = np.linalg.svd(np.moveaxis(regressor, 1, -1).reshape(-1, 60), compute_uv=False)
        ranks.append(int((sigma > 1e-9 * sigma[0]).sum()))
    wrong = [float(r != e) for r, e in zip(ranks, (38, 36), strict=True)]
    return finding([sum(wrong)], f"ranks {ranks[0]} and {ranks[1]} from {len(m.q)} motions")
