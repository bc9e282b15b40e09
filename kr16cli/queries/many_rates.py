"""Jacobians and dynamics of many configurations at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from kr16cli.queries.many import Array, Many, beyond_limits, columns_of, large, named, radians
from kr16cli.tolerances import TOLERANCES

if TYPE_CHECKING:
    from kr16cli.queries.torques import DynamicsQuestion
    from kr16cli.queries.velocity import JacobianQuestion


def velocity(question: JacobianQuestion, values: Mapping[str, Array]) -> Many:
    """Jacobians, their singular values, and their rates where speeds are given."""
    robot, q = question.robot, radians(question, values["q"])
    n = len(q)
    view: dict[str, Any] = {
        "link": question.link,
        "point": question.local([0.0] * 6),
        "axes": question.axes,
    }
    J = robot.jacobian(q, **view) + 0.0
    sigma = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    factors = robot.singularity(q)
    determinant = factors.determinant + 0.0 if question.link == 6 else np.zeros(n)
    manipulability = sigma.prod(axis=1)
    regular = sigma[:, 5] > 6 * np.spacing(sigma[:, 0])
    condition = sigma[:, 0] / np.where(regular, sigma[:, 5], np.nan)
    columns = {
        **named("j", J),
        "determinant": determinant,
        "condition": condition,
        "manipulability": manipulability,
        **named("sigma", sigma),
    }
    arrays = {
        "jacobian": J,
        "determinant": determinant,
        "singular_values": sigma,
        "manipulability": manipulability,
    }
    qd = _rates(question, values, question.qd, n)
    if qd is not None:
        arrays["jacobian_dot"] = robot.jacobian_dot(q, radians(question, qd), **view) + 0.0
        columns |= named("jd", arrays["jacobian_dot"])
    g = question.data.geometry
    forearm = float(np.hypot(g.a3, g.d4))
    sines = np.stack(
        [
            factors.shoulder / (g.a1 + g.a2 + forearm),
            factors.elbow / forearm,
            factors.wrist,
        ]
    )
    # A little beyond the threshold: the words are found row by row.
    near = np.asarray((np.abs(sines) < 1.001 * TOLERANCES.near_singular).any(axis=0))
    return Many(
        columns,
        arrays,
        large(values),
        near | beyond_limits(question, columns_of(q)),
        lambda i: question.warnings(q[i].tolist()),
    )


def dynamics(question: DynamicsQuestion, values: Mapping[str, Array]) -> Many:
    """M, C, G, torques or accelerations, energy, and the load on the foundation."""
    robot, q = question.robot, radians(question, values["q"])
    n = len(q)
    typed = {name: _rates(question, values, question.typed[name], n, name)
             for name in question.optional}  # fmt: skip
    qd = np.zeros((n, 6)) if typed["qd"] is None else radians(question, typed["qd"])
    qdd = np.zeros((n, 6))
    M, C, G = robot.equation_of_motion(q, qd)
    arrays: dict[str, Array] = {
        "mass_matrix": M + 0.0, "coriolis_matrix": C + 0.0, "gravity": G + 0.0
    }  # fmt: skip
    if question.drives:
        arrays["friction"] = robot.friction(qd) + 0.0
    if typed["tau"] is not None:
        qdd = robot.forward_dynamics(q, qd, typed["tau"])
        arrays["acceleration"] = qdd + 0.0
    if typed["qdd"] is not None:
        qdd = radians(question, typed["qdd"])
        arrays["torque"] = robot.inverse_dynamics(q, qd, qdd) + 0.0
    arrays["base_wrench"] = robot.base_wrench(q, qd, qdd) + 0.0
    if question.christoffel:
        arrays["christoffel"] = robot.christoffel(q) + 0.0
    kinetic, potential = robot.energy(q, qd)
    arrays |= {"energy_kinetic": kinetic + 0.0, "energy_potential": potential + 0.0}
    columns = named("gravity", arrays["gravity"])
    for name in ("friction", "torque", "acceleration"):
        if name in arrays:
            columns |= named(name, arrays[name])
    columns |= {name: arrays[name] for name in ("energy_kinetic", "energy_potential")}
    columns |= named("base_wrench", arrays["base_wrench"])
    columns |= named("m", arrays["mass_matrix"]) | named("c", arrays["coriolis_matrix"])
    finite = np.ones(n, dtype=bool)
    for array in arrays.values():
        finite &= np.isfinite(array.reshape(n, -1)).all(axis=1)
    torque = arrays.get("torque", np.zeros((n, 6)))
    rated = [j.torque if j.torque is not None else np.inf for j in question.data.joints]
    overloaded = np.asarray((np.abs(torque) > rated).any(axis=1))
    return Many(
        columns,
        arrays,
        large(values) | ~finite,
        beyond_limits(question, columns_of(q)) | overloaded | bool(question.load_warnings({})),
        lambda i: question.warnings(q[i].tolist(), {"torque": torque[i].tolist()}),
    )


def _rates(
    question: JacobianQuestion | DynamicsQuestion,
    values: Mapping[str, Array],
    asked: Any,
    count: int,
    name: str = "qd",
) -> Array | None:
    """A row's own numbers, else those of the option for every row, else None."""
    if name in values:
        return values[name]
    return None if asked is None else np.tile(np.array(asked, dtype=float), (count, 1))
