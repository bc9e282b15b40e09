"""`Robot`: the array API. Angles in rad, lengths in m, robroot axes; leading axes broadcast.

Every method takes configurations (..., 6) and returns (..., shape) in float64. `out=` receives
the result where given; `threads=` spreads a batch. One configuration runs on plain floats,
a batch on the engine. A wrong shape or a non-finite input raises and names argument and index.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli import arrays
from kr16cli.arrays import Array
from kr16cli.kernels.columns import ARRAYS
from kr16cli.kinematics import Kinematics, Like, flat_rows, pose_rows
from kr16cli.model import chain, coriolis, dynamics, energy, inertia, orientation, task
from kr16cli.model.posture import status, turn
from kr16cli.model.scalars import Scalar
from kr16cli.robot import Inertia6, Payload, Vector3
from kr16cli.robot_file import load_data, parse_data


def load_robot(
    path: str | Path | None = None,
    *,
    payload: Payload | None = None,
    drives: bool = False,
    tool: Like | None = None,
) -> Robot:
    """The robot of a parameter file; None is the KUKA KR 16-2, a bare name a shipped file.

    The rigid arm: no payload, no rotor inertia, no friction unless asked.

    Raises:
        ParameterError, FileError: a file that is missing or breaks a rule.
    """
    return Robot(load_data(path), payload=payload, drives=drives, tool=tool)


class TaskSpaceArrays(NamedTuple):
    """Task-space dynamics: Mx, Cx (..., 6, 6), Gx (..., 6), analytic Jacobian and its rate."""

    mass_matrix: Array
    coriolis_matrix: Array
    gravity: Array
    jacobian: Array
    jacobian_dot: Array


class Robot(Kinematics):
    """A robot of the chapter's structure, ready for queries on arrays.

    Arguments as in `Kinematics`; get one from `load_robot` or `Robot.from_parameters`.
    """

    @classmethod
    def from_parameters(cls, table: Mapping[str, Any], **options: Any) -> Robot:
        """A robot from the table a parameter file would hold."""
        return cls(parse_data(table, "parameters"), **options)

    def with_payload(
        self,
        mass: float,
        com: Vector3 = (0.0, 0.0, 0.0),
        inertia: Inertia6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    ) -> Robot:
        """The same robot with this load (kg; m and kg m2 in flange axes) in place of any other."""
        load = Payload(float(mass), tuple(map(float, com)), tuple(map(float, inertia)))  # type: ignore[arg-type]
        return Robot(self.data, payload=load, drives=self.drives, tool=self.tool)

    def with_tool(self, tool: Like | None) -> Robot:
        """The same robot with T_flange_tool (4, 4); None takes the tool off."""
        return Robot(self.data, payload=self.payload, drives=self.drives, tool=tool)

    def with_gravity(self, gravity: Vector3) -> Robot:
        """The same robot under another gravity vector (m/s2, robroot axes)."""
        x, y, z = map(float, gravity)
        data = self.data.with_gravity((x, y, z))
        return Robot(data, payload=self.payload, drives=self.drives, tool=self.tool)

    def __repr__(self) -> str:
        load = f", payload {self.payload.mass} kg" if self.payload else ""
        return f"<Robot {self.data.name}{load}{', drives' if self.drives else ''}>"

    # Dynamics -------------------------------------------------------------------------------

    @property
    def _parts(self) -> tuple[tuple[inertia.Body, ...], Any, tuple[float, ...], tuple[float, ...]]:
        """Base bodies, geometry, gravity, rotors."""
        arm = self.arm
        return arm.base_bodies, self.data.geometry, arm.gravity_vector, arm.rotors

    def mass_matrix(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """M(q) of (3.38), (..., 6, 6), kg m2."""
        bodies, g, _, rotors = self._parts
        return self._evaluate(
            {"q": q},
            (6, 6),
            self.arm.mass_matrix,
            lambda cs: flat_rows(dynamics.mass_matrix(cs, bodies, g, rotors)),
            out,
            threads,
        )

    def coriolis_matrix(
        self, q: Like, qd: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """C(q, qd) of (3.40)-(3.41), (..., 6, 6), kg m2/s: M_dot - 2 C is skew."""
        bodies, g, _, _ = self._parts
        return self._evaluate(
            {"q": q, "qd": qd},
            (6, 6),
            self.arm.coriolis_matrix,
            lambda cs, rates: flat_rows(coriolis.coriolis_matrix(cs, rates, bodies, g)),
            out,
            threads,
        )

    def christoffel(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """The matrices C_k(i, j) of (3.41), (..., 6, 6, 6) with k first, kg m2."""
        bodies, g, _, _ = self._parts
        return self._evaluate(
            {"q": q},
            (6, 6, 6),
            self.arm.christoffel,
            lambda cs: (v for ck in coriolis.christoffel(cs, bodies, g) for v in flat_rows(ck)),
            out,
            threads,
        )

    def gravity(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """G(q) of (3.42), (..., 6), N m."""
        bodies, g, gravity, _ = self._parts
        return self._evaluate(
            {"q": q},
            (6,),
            self.arm.gravity,
            lambda cs: dynamics.gravity_torque(cs, bodies, g, gravity),
            out,
            threads,
        )

    def friction(self, qd: Like) -> Array:
        """Friction torque against qd, (..., 6), N m: 0 without drives, else regularised."""
        rates = arrays.checked("qd", qd, 6)
        return np.stack(self._friction([rates[..., i] for i in range(6)]), axis=-1)

    def _friction(self, rates: list[Scalar]) -> list[Scalar]:
        if not self.drives:
            return [rate * 0.0 for rate in rates]
        coulomb = [j.coulomb or 0.0 for j in self.data.joints]
        viscous = [j.viscous or 0.0 for j in self.data.joints]
        return dynamics.friction(rates, coulomb, viscous, ARRAYS)

    def inverse_dynamics(
        self, q: Like, qd: Like, qdd: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Torques M qdd + C qd + G (+ friction with drives), (..., 6), N m."""
        bodies, g, gravity, rotors = self._parts

        def kernel(cs: Any, rates: Any, accelerations: Any) -> Iterable[Scalar]:
            tau = dynamics.inverse_dynamics(cs, rates, accelerations, bodies, g, gravity, rotors)
            if not self.drives:
                return tau
            return [t + f for t, f in zip(tau, self._friction(rates), strict=True)]

        named = {"q": q, "qd": qd, "qdd": qdd}
        return self._evaluate(named, (6,), self.arm.inverse_dynamics, kernel, out, threads)

    def forward_dynamics(
        self, q: Like, qd: Like, tau: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Accelerations qdd for torques tau, (..., 6), rad/s2."""
        bodies, g, gravity, rotors = self._parts

        def kernel(cs: Any, rates: Any, torque: Any) -> Iterable[Scalar]:
            net = torque
            if self.drives:
                net = [t - f for t, f in zip(torque, self._friction(rates), strict=True)]
            return dynamics.forward_dynamics(cs, rates, net, bodies, g, gravity, rotors)

        named = {"q": q, "qd": qd, "tau": tau}
        return self._evaluate(named, (6,), self.arm.forward_dynamics, kernel, out, threads)

    def energy(self, q: Like, qd: Like, *, threads: int = 1) -> tuple[Array, Array]:
        """(kinetic, potential) energy, J, each (...); potential zero at robroot's origin."""
        bodies, g, gravity, rotors = self._parts
        full = self.arm.bodies

        def kernel(cs: Any, rates: Any) -> Iterable[Scalar]:
            yield energy.kinetic(dynamics.mass_matrix(cs, bodies, g, rotors), rates)
            yield energy.potential(chain.frames(cs, g), full, g, gravity)

        both = self._evaluate({"q": q, "qd": qd}, (2,), self.arm.energy, kernel, None, threads)
        return both[..., 0], both[..., 1]

    def base_wrench(
        self, q: Like, qd: Like, qdd: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Reaction of the foundation on the moving arm, (..., 6): force N, moment N m.

        Robroot axes, moment about robroot's origin. Without the fixed base's own weight; the
        load on the foundation is its negative. At rest the force is the weight, upward.
        """
        full, g = inertia.sparse(self.arm.bodies), self.data.geometry
        gravity = self.arm.gravity_vector

        def kernel(cs: Any, rates: Any, accelerations: Any) -> Iterable[Scalar]:
            force, moment = energy.base_wrench(cs, rates, accelerations, full, g, gravity)
            return (*force, *moment)

        named = {"q": q, "qd": qd, "qdd": qdd}
        return self._evaluate(named, (6,), self.arm.base_wrench, kernel, out, threads)

    def task_space(self, q: Like, qd: Like) -> TaskSpaceArrays:
        """Mx, Cx (..., 6, 6), Gx (..., 6), Ja, Ja' for x = (p, phi, theta, psi) of the flange.

        Section 3.6. Near a singularity, or theta = +-90 deg, the numbers grow without bound.

        Raises:
            NoAnswerError: for one configuration, exactly there.
        """
        angles, rates = arrays.checked("q", q, 6), arrays.checked("qd", qd, 6)
        lead = arrays.batch(["q", "qd"], [angles, rates], [1, 1])
        if not lead:
            one = self.arm.task_space(angles.tolist(), rates.tolist())
            mx, cx, gx, ja, ja_dot = (np.array(part, dtype=np.float64) for part in one)
            return TaskSpaceArrays(mx, cx, gx, ja, ja_dot)
        angles, rates = (np.broadcast_to(v, (*lead, 6)) for v in (angles, rates))
        flange = Robot(self.data, payload=self.payload, drives=self.drives)
        rpy = orientation.rpy_from_rotation(pose_rows(flange.fk(angles)), ARRAYS)
        result = task.task_space(
            (
                _matrix(flange.mass_matrix(angles)),
                _matrix(flange.coriolis_matrix(angles, rates)),
                _vector(flange.gravity(angles)),
            ),
            (_matrix(flange.jacobian(angles)), _matrix(flange.jacobian_dot(angles, rates))),
            ARRAYS.trig(rpy),
            _vector(rates),
            lambda rows: _matrix(np.linalg.inv(_stacked(rows, lead))),
        )
        gravity = _stacked([result.gravity], lead)[..., 0, :]
        matrices = (result.mass_matrix, result.coriolis_matrix)
        jacobians = (result.jacobian, result.jacobian_dot)
        mx, cx = (_stacked(m, lead) for m in matrices)
        ja, ja_dot = (_stacked(j, lead) for j in jacobians)
        return TaskSpaceArrays(mx, cx, gravity, ja, ja_dot)

    # KUKA -----------------------------------------------------------------------------------

    def status_turn(self, q: Like) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """KUKA's Status and Turn of configurations (..., 6), computed by rule, each (...)."""
        angles = arrays.checked("q", q, 6)
        rows = angles.reshape(-1, 6).tolist()
        shape = angles.shape[:-1]
        s = np.array([status(row, self.data.geometry) for row in rows], dtype=np.int64)
        t = np.array([turn(row) for row in rows], dtype=np.int64)
        return s.reshape(shape), t.reshape(shape)


def _vector(values: npt.NDArray[np.floating[Any]]) -> list[Scalar]:
    return [values[..., i] for i in range(values.shape[-1])]


def _matrix(values: npt.NDArray[np.floating[Any]]) -> list[list[Scalar]]:
    return [_vector(values[..., i, :]) for i in range(values.shape[-2])]


def _stacked(rows: list[list[Scalar]], lead: tuple[int, ...]) -> Array:
    """Rows of columns (structural zeros among them) as (..., m, n)."""
    out = np.empty((*lead, len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            out[..., i, j] = value
    return out
