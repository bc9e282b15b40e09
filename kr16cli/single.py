"""One configuration on plain floats: what quick queries run, without NumPy.

Joint angles in rad (KUKA's sign and zero), matrices as lists of rows, robroot axes unless
said otherwise. `api.Robot` is the same on arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from kr16cli import linear
from kr16cli.errors import InputError, NoAnswerError
from kr16cli.model import (
    chain,
    coriolis,
    dynamics,
    energy,
    forward,
    inertia,
    inverse,
    jacobian,
    orientation,
    task,
)
from kr16cli.model.scalars import FLOATS, Trig, structural
from kr16cli.model.view import Axes, View
from kr16cli.robot import Payload, RobotData
from kr16cli.tolerances import TOLERANCES

Matrix = list[list[float]]
Base = Literal["robroot", "chapter"]

_ZEROS = (0.0,) * 6
_BASES = {"robroot": chain.ROBROOT_BASE, "chapter": chain.CHAPTER_BASE}


@dataclass(frozen=True)
class Singularity:
    """Distance of one singular family, zero on it.

    `family` is "shoulder" (wrist centre on the A1 axis), "elbow" (arm stretched or folded) or
    "wrist" (A4 and A6 in line); `factor` its signed factor of the determinant (3.37) (m, m, 1);
    `sine` the factor over its largest value, dimensionless; `near` below the warning threshold.
    """

    family: str
    factor: float
    sine: float
    near: bool


class Arm:
    """A robot at one configuration at a time.

    Args:
        data: the robot's numbers.
        payload: load on the flange; joins link 6.
        drives: count rotor inertia (J G^2, once) and friction.
    """

    def __init__(
        self, data: RobotData, *, payload: Payload | None = None, drives: bool = False
    ) -> None:
        self.data, self.payload, self.drives = data, payload, drives
        self.geometry = data.geometry

    def require_inertia(self) -> None:
        """InputError where the file has no inertial data."""
        if not self.data.links:
            raise InputError(
                f"{self.data.name} ({self.data.path}) has no inertial data: 0 of 6 links; "
                "dynamics needs a file with six [[link]] groups"
            )

    @cached_property
    def bodies(self) -> tuple[inertia.Body, ...]:
        """The six links with the payload, full parameters, in joint frames."""
        self.require_inertia()
        return inertia.robot_bodies(self.data.links, self.payload, self.geometry)

    @cached_property
    def base_bodies(self) -> tuple[inertia.Body, ...]:
        """The same regrouped to base parameters, zeros made structural."""
        return inertia.sparse(inertia.regroup(self.bodies, self.geometry))

    @cached_property
    def rotors(self) -> tuple[float, ...]:
        """Rotor inertias at the joints, kg m2; zeros without drives."""
        return tuple(j.reflected_inertia for j in self.data.joints) if self.drives else _ZEROS

    @cached_property
    def gravity_vector(self) -> tuple[float, ...]:
        """Gravity in robroot, m/s2, zeros made structural."""
        return tuple(map(structural, self.data.gravity))

    # Kinematics -----------------------------------------------------------------------------

    def fk(self, q: Sequence[float], cs: Trig | None = None) -> Matrix:
        """T_robroot_flange, 4x4 (m). `cs` may give exact (cos, sin) pairs of q."""
        return _floats(forward.flange(cs or FLOATS.trig(q), self.geometry).rows())

    def frames(
        self, q: Sequence[float], base: Base = "robroot", cs: Trig | None = None
    ) -> dict[str, Matrix]:
        """Poses of frame0..frame6 of Table 3.1 and of the flange, 4x4, in `base`."""
        links = chain.frames(cs or FLOATS.trig(q), self.geometry, _BASES[base])
        named = {f"frame{i}": _floats(frame.rows()) for i, frame in enumerate(links)}
        named["flange"] = _floats(chain.flange_of_frame6(links[6]).rows())
        return named

    def wrist_centre(self, q: Sequence[float]) -> list[float]:
        """o_c of (3.8), m, robroot."""
        return _vector(forward.arm(FLOATS.trig(q), self.geometry).wrist)

    def r36(self, q: Sequence[float]) -> Matrix:
        """Rotation of frame 6 in frame 3, (3.22)."""
        return forward.r36(FLOATS.trig(q))

    def mass_centres(self, q: Sequence[float], base: Base = "robroot") -> Matrix:
        """The six mass centres (3.29), m; the payload counts to link 6."""
        links = chain.frames(FLOATS.trig(q), self.geometry, _BASES[base])
        return _floats(energy.mass_centres(links, self.bodies, self.geometry))

    def ik(
        self, pose: Sequence[Sequence[float]], near: Sequence[float] | None = None
    ) -> inverse.Solutions:
        """All eight solutions for T_robroot_flange (4x4 or 3x4, m); see `model.inverse`."""
        rotation = [row[:3] for row in pose[:3]]
        p = [row[3] for row in pose[:3]]
        return inverse.solve(rotation, p, self.geometry, near or _ZEROS, FLOATS)

    def closure(self, pose: Sequence[Sequence[float]], q: Sequence[float]) -> tuple[float, float]:
        """How far fk(q) is from `pose`: (position error in m, rotation angle in rad)."""
        return orientation.pose_distance(self.fk(q), pose, FLOATS)

    def jacobian(
        self,
        q: Sequence[float],
        *,
        link: int = 6,
        point: Sequence[float] | None = None,
        axes: Axes = "robroot",
    ) -> Matrix:
        """Geometric Jacobian, linear rows first (m, rad).

        `point` (m) is fixed to `link` (1..6) and given in its frame (frame i of Table 3.1; the
        flange for link 6); None is that frame's origin. `axes` are the axes of the rows.
        """
        if link == 6 and point is None and axes == "robroot":
            return self.flange_jacobian(q)
        view = View.of(self.geometry, link, point, axes)
        return _floats(view.jacobian(FLOATS.trig(q)))

    def flange_jacobian(self, q: Sequence[float]) -> Matrix:
        """`jacobian` of the flange in robroot axes."""
        view = View.of(self.geometry, 6, None, "robroot")
        return _floats(view.jacobian(FLOATS.trig(q)))

    def jacobian_dot(
        self,
        q: Sequence[float],
        qd: Sequence[float],
        *,
        link: int = 6,
        point: Sequence[float] | None = None,
        axes: Axes = "robroot",
    ) -> Matrix:
        """Rate of the robroot components along qd, shown in `axes` (which stand still)."""
        if link == 6 and point is None and axes == "robroot":
            return self.flange_jacobian_dot(q, qd)
        view = View.of(self.geometry, link, point, axes)
        return _floats(view.jacobian_dot(FLOATS.trig(q), qd))

    def flange_jacobian_dot(self, q: Sequence[float], qd: Sequence[float]) -> Matrix:
        """`jacobian_dot` of the flange in robroot axes."""
        view = View.of(self.geometry, 6, None, "robroot")
        return _floats(view.jacobian_dot(FLOATS.trig(q), qd))

    def determinant(self, q: Sequence[float]) -> float:
        """det J of the flange, m3, by (3.37)."""
        return float(jacobian.determinant(FLOATS.trig(q), self.geometry))

    def singularities(self, q: Sequence[float]) -> list[Singularity]:
        """The three singular families with their distances."""
        return [
            Singularity(name, factor, sine, abs(sine) < TOLERANCES.near_singular)
            for name, factor, sine in jacobian.singular_families(
                FLOATS.trig(q), self.geometry, FLOATS
            )
        ]

    # Dynamics -------------------------------------------------------------------------------

    def mass_matrix(self, q: Sequence[float]) -> Matrix:
        """M(q), kg m2."""
        return _floats(
            dynamics.mass_matrix(FLOATS.trig(q), self.base_bodies, self.geometry, self.rotors)
        )

    def coriolis_matrix(self, q: Sequence[float], qd: Sequence[float]) -> Matrix:
        """C(q, qd) with Christoffel symbols, kg m2/s."""
        return _floats(
            coriolis.coriolis_matrix(FLOATS.trig(q), qd, self.base_bodies, self.geometry)
        )

    def christoffel(self, q: Sequence[float]) -> list[Matrix]:
        """C_k(i, j) of (3.41), k first, kg m2."""
        return [
            _floats(ck)
            for ck in coriolis.christoffel(FLOATS.trig(q), self.base_bodies, self.geometry)
        ]

    def gravity(self, q: Sequence[float]) -> list[float]:
        """G(q), N m."""
        cs = FLOATS.trig(q)
        return _vector(
            dynamics.gravity_torque(cs, self.base_bodies, self.geometry, self.gravity_vector)
        )

    def friction(self, qd: Sequence[float]) -> list[float]:
        """Friction torque against qd, N m; zeros without drives."""
        if not self.drives:
            return list(_ZEROS)
        coulomb = [j.coulomb or 0.0 for j in self.data.joints]
        viscous = [j.viscous or 0.0 for j in self.data.joints]
        return dynamics.friction(qd, coulomb, viscous, FLOATS)

    def inverse_dynamics(
        self, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
    ) -> list[float]:
        """Joint torques M qdd + C qd + G + friction, N m."""
        tau = dynamics.inverse_dynamics(
            FLOATS.trig(q),
            qd,
            qdd,
            self.base_bodies,
            self.geometry,
            self.gravity_vector,
            self.rotors,
        )
        return [float(t) + f for t, f in zip(tau, self.friction(qd), strict=True)]

    def forward_dynamics(
        self, q: Sequence[float], qd: Sequence[float], tau: Sequence[float]
    ) -> list[float]:
        """Joint accelerations for torques tau (N m), rad/s2."""
        net = [t - f for t, f in zip(tau, self.friction(qd), strict=True)]
        return _vector(
            dynamics.forward_dynamics(
                FLOATS.trig(q),
                qd,
                net,
                self.base_bodies,
                self.geometry,
                self.gravity_vector,
                self.rotors,
            )
        )

    def energy(self, q: Sequence[float], qd: Sequence[float]) -> tuple[float, float]:
        """(kinetic, potential) energy, J; potential zero at robroot's origin."""
        links = chain.frames(FLOATS.trig(q), self.geometry)
        potential = energy.potential(links, self.bodies, self.geometry, self.gravity_vector)
        return float(energy.kinetic(self.mass_matrix(q), qd)), float(potential)

    def base_wrench(
        self, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
    ) -> list[float]:
        """Reaction of the foundation: force (N), moment about robroot's origin (N m)."""
        force, moment = energy.base_wrench(
            FLOATS.trig(q), qd, qdd, inertia.sparse(self.bodies), self.geometry, self.gravity_vector
        )
        return _vector((*force, *moment))

    def task_space(self, q: Sequence[float], qd: Sequence[float]) -> task.TaskSpace:
        """Mx, Cx, Gx for x = (p, phi, theta, psi) of the flange; NoAnswerError where singular."""
        rotation = [row[:3] for row in self.fk(q)[:3]]
        rpy = FLOATS.trig(orientation.rpy_from_rotation(rotation, FLOATS))
        if abs(rpy[1][0]) < TOLERANCES.pole:
            raise NoAnswerError(
                "task space: B = +-90 deg is singular for roll-pitch-yaw (cos B = "
                f"{rpy[1][0]:.1e}, limit {TOLERANCES.pole:.0e}); choose a configuration off it"
            )
        for s in self.singularities(q):
            if abs(s.sine) < TOLERANCES.wrist:
                raise NoAnswerError(
                    f"task space: the {s.family} singularity ({s.sine:.1e}, limit "
                    f"{TOLERANCES.wrist:.0e}) leaves the Jacobian without inverse; move off it"
                )
        parts = (self.mass_matrix(q), self.coriolis_matrix(q, qd), self.gravity(q))
        jacobians = (self.jacobian(q), self.jacobian_dot(q, qd))
        return task.task_space(parts, jacobians, rpy, qd, linear.inverse)


def _floats(rows: Sequence[Sequence[object]]) -> Matrix:
    """Structural zeros and ones as floats."""
    return [_vector(row) for row in rows]


def _vector(row: Sequence[object]) -> list[float]:
    return [float(v) for v in row]  # type: ignore[arg-type]  # scalars of the model
