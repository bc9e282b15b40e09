"""`Robot`: the array API. Angles in rad, lengths in m, robroot axes; leading axes broadcast.

Every method takes configurations (..., 6) and returns (..., shape) in float64. `out=` receives
the result where given; `threads=` spreads a batch. One configuration runs on plain floats,
a batch on the engine. A wrong shape or a non-finite input raises and names argument and index.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli import arrays
from kr16cli.arrays import Array
from kr16cli.kernels.columns import ARRAYS
from kr16cli.kinematics import Kinematics, Like, pose_rows
from kr16cli.model import dynamics, orientation, task
from kr16cli.model.posture import status, turn
from kr16cli.model.scalars import Scalar
from kr16cli.robot import Inertia6, Payload, RobotData, Vector3
from kr16cli.robot_file import load_data, parse_data
from kr16cli.robot_rules import checked_payload

if TYPE_CHECKING:
    from kr16cli.kernels.native_engine import NativeKernels


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


class EquationOfMotion(NamedTuple):
    """M qdd + C qd + G = tau: M, C (..., 6, 6) in kg m2 and kg m2/s, G (..., 6) in N m."""

    mass_matrix: Array
    coriolis_matrix: Array
    gravity: Array


class InverseDynamicsDerivatives(NamedTuple):
    """Change of torque i with joint value j, (..., 6, 6) each: N m/rad, N m s/rad, kg m2."""

    dtau_dq: Array
    dtau_dqd: Array
    dtau_dqdd: Array


class ForwardDynamicsDerivatives(NamedTuple):
    """Change of acceleration i with joint value j, (..., 6, 6) each: 1/s2, 1/s, 1/(kg m2)."""

    dqdd_dq: Array
    dqdd_dqd: Array
    dqdd_dtau: Array


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

    def __init__(
        self,
        data: RobotData,
        *,
        payload: Payload | None = None,
        drives: bool = False,
        tool: Like | None = None,
    ) -> None:
        super().__init__(data, payload=payload, drives=drives, tool=tool)
        if self._native is not None and type(self) is Robot:
            self._answer_directly(self._native)

    def _answer_directly(self, kernels: NativeKernels) -> None:
        """Put compiled callables before those methods that a kernel answers as they are."""
        from kr16cli.kernels.native_engine import ARM_METHODS, DYNAMIC_METHODS

        direct = ARM_METHODS if self.tool is None else {}
        for name, required in {**direct, **(DYNAMIC_METHODS if self.data.links else {})}.items():
            setattr(self, name, kernels.method(name, required, getattr(self, name)))

    def compiled(self, *names: str) -> tuple[Any, ...] | None:
        """The compiled kernels of these quantities, tool left out, or None without an extension."""
        return None if self._native is None else tuple(self._native[name] for name in names)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by what it was made of; the kernels are bound anew."""
        return _remade, (self.data, self.payload, self.drives, self.tool)

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
        """The same robot with this load in place of any other.

        Args:
            mass: kg, 0 or more.
            com: mass centre in flange axes from the flange origin, m.
            inertia: (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about the mass centre, kg m2.

        Raises:
            InputError: numbers that no rigid load has.
        """
        load = checked_payload(mass, com, inertia)
        return Robot(self.data, payload=load, drives=self.drives, tool=self.tool)

    def with_tool(self, tool: Like | None) -> Robot:
        """The same robot with T_flange_tool (4, 4); None takes the tool off."""
        return Robot(self.data, payload=self.payload, drives=self.drives, tool=tool)

    def with_gravity(self, gravity: Vector3) -> Robot:
        """The same robot under another gravity vector (m/s2, robroot axes)."""
        x, y, z = arrays.checked("gravity", np.reshape(gravity, -1), 3).tolist()
        data = self.data.with_gravity((x, y, z))
        return Robot(data, payload=self.payload, drives=self.drives, tool=self.tool)

    def __repr__(self) -> str:
        load = f", payload {self.payload.mass} kg" if self.payload else ""
        return f"<Robot {self.data.name}{load}{', drives' if self.drives else ''}>"

    # Dynamics -------------------------------------------------------------------------------

    def _dynamic(
        self, name: str, inputs: tuple[Like, ...], out: Array | None, threads: int
    ) -> Array:
        """A quantity that needs inertial data."""
        if not self.data.links:
            self.arm.require_inertia()
        return self._ask(name, inputs, out, threads)

    def mass_matrix(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """M(q) of (3.38), (..., 6, 6), kg m2."""
        return self._dynamic("mass_matrix", (q,), out, threads)

    def coriolis_matrix(
        self, q: Like, qd: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """C(q, qd) of (3.40)-(3.41), (..., 6, 6), kg m2/s: M_dot - 2 C is skew."""
        return self._dynamic("coriolis_matrix", (q, qd), out, threads)

    def christoffel(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """The matrices C_k(i, j) of (3.41), (..., 6, 6, 6) with k first, kg m2."""
        return self._dynamic("christoffel", (q,), out, threads)

    def gravity(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """G(q) of (3.42), (..., 6), N m."""
        return self._dynamic("gravity", (q,), out, threads)

    def bias(self, q: Like, qd: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """C qd + G (+ friction with drives), (..., 6), N m: `inverse_dynamics` at qdd = 0."""
        return self._dynamic("bias", (q, qd), out, threads)

    def equation_of_motion(
        self, q: Like, qd: Like, *, out: Array | None = None, threads: int = 1
    ) -> EquationOfMotion:
        """M, C and G of M qdd + C qd + G = tau in one pass, cheaper than one by one.

        They are views of one array (..., 78), row after row: `out` where given.
        """
        table = self._dynamic("equation", (q, qd), out, threads)
        square = (*table.shape[:-1], 6, 6)
        M, C = table[..., :36].reshape(square), table[..., 36:72].reshape(square)
        return EquationOfMotion(M, C, table[..., 72:])

    def friction(self, qd: Like) -> Array:
        """Friction torque against qd, (..., 6), N m: 0 without drives, else regularised."""
        rates = arrays.checked("qd", qd, 6)
        k = self._numbers
        if not k.coulomb:
            return np.zeros_like(rates)
        columns = [rates[..., i] for i in range(6)]
        return np.stack(dynamics.friction(columns, k.coulomb, k.viscous, ARRAYS), axis=-1)

    def inverse_dynamics(
        self, q: Like, qd: Like, qdd: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Torques M qdd + C qd + G (+ friction with drives), (..., 6), N m."""
        return self._dynamic("inverse_dynamics", (q, qd, qdd), out, threads)

    def forward_dynamics(
        self, q: Like, qd: Like, tau: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Accelerations qdd for torques tau, (..., 6), rad/s2."""
        return self._dynamic("forward_dynamics", (q, qd, tau), out, threads)

    def inverse_dynamics_derivatives(
        self, q: Like, qd: Like, qdd: Like, *, out: Array | None = None, threads: int = 1
    ) -> InverseDynamicsDerivatives:
        """Exact derivatives of `inverse_dynamics` with respect to q, qd and qdd.

        d tau / d qd = 2 C (+ the slope of friction with drives), d tau / d qdd = M with rotors;
        d tau / d q in closed form (`model.derivatives`). They are views of one array
        (..., 3, 6, 6): `out` where given.
        """
        table = self._dynamic("inverse_dynamics_derivatives", (q, qd, qdd), out, threads)
        return InverseDynamicsDerivatives(*_three(table))

    def forward_dynamics_derivatives(
        self, q: Like, qd: Like, tau: Like, *, out: Array | None = None, threads: int = 1
    ) -> ForwardDynamicsDerivatives:
        """Exact derivatives of `forward_dynamics` with respect to q, qd and tau.

        d qdd = M^-1 (d tau - d inverse dynamics), so d qdd / d tau = M^-1. They are views of one
        array (..., 3, 6, 6): `out` where given.
        """
        table = self._dynamic("forward_dynamics_derivatives", (q, qd, tau), out, threads)
        return ForwardDynamicsDerivatives(*_three(table))

    def energy(self, q: Like, qd: Like, *, threads: int = 1) -> tuple[Array, Array]:
        """(kinetic, potential) energy, J, each (...); potential zero at robroot's origin."""
        both = self._dynamic("energy", (q, qd), None, threads)
        return both[..., 0].copy(), both[..., 1].copy()

    def base_wrench(
        self, q: Like, qd: Like, qdd: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Reaction of the foundation on the moving arm, (..., 6): force N, moment N m.

        Robroot axes, moment about robroot's origin. Without the fixed base's own weight; the
        load on the foundation is its negative. At rest the force is the weight, upward.
        """
        return self._dynamic("base_wrench", (q, qd, qdd), out, threads)

    def task_space(self, q: Like, qd: Like) -> TaskSpaceArrays:
        """Mx, Cx (..., 6, 6), Gx (..., 6), Ja, Ja' for x = (p, phi, theta, psi) of the flange.

        Section 3.6. Near a singularity, or theta = +-90 deg, the numbers grow without bound; in a
        batch, rows without an inverse are NaN.

        Raises:
            NoAnswerError: for one configuration at such a place.
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
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            result = task.task_space(
                (
                    _matrix(flange.mass_matrix(angles)),
                    _matrix(flange.coriolis_matrix(angles, rates)),
                    _vector(flange.gravity(angles)),
                ),
                (_matrix(flange.jacobian(angles)), _matrix(flange.jacobian_dot(angles, rates))),
                ARRAYS.trig(rpy),
                _vector(rates),
                lambda rows: _matrix(_inverses(_stacked(rows, lead))),
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
        columns = [angles[..., i] for i in range(6)]
        s = np.asarray(status(columns, self.data.geometry, ARRAYS), dtype=np.int64)
        return s, np.asarray(turn(columns), dtype=np.int64)


def _remade(data: RobotData, payload: Payload | None, drives: bool, tool: Like | None) -> Robot:
    return Robot(data, payload=payload, drives=drives, tool=tool)


def _inverses(matrices: Array) -> npt.NDArray[np.floating[Any]]:
    """Inverses (..., n, n); NaN where a matrix has none."""
    whole = np.asarray(np.isfinite(matrices).all(axis=(-2, -1)))
    regular = whole & (np.linalg.det(np.where(whole[..., None, None], matrices, 0.0)) != 0.0)
    safe = np.where(regular[..., None, None], matrices, np.eye(matrices.shape[-1]))
    return np.where(regular[..., None, None], np.linalg.inv(safe), np.nan)


def _three(table: Array) -> tuple[Array, Array, Array]:
    """The three matrices of (..., 3, 6, 6), without the ellipsis where that is quicker."""
    if table.ndim == 3:
        return table[0], table[1], table[2]
    return table[..., 0, :, :], table[..., 1, :, :], table[..., 2, :, :]


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
