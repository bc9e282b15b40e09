"""Robotics Toolbox for Python (Corke): a DH robot from Table 3.1's rows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kr16cli.robot import Payload, RobotData
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import bodies
from kr16cli.verify.independent.rotations import Array

_HALF = math.pi / 2


class Toolbox:
    """Six standard DH links; row 0 of the table is kept outside, as T_robroot_0."""

    def __init__(self, data: RobotData, payload: Payload | None) -> None:
        import roboticstoolbox  # type: ignore[import-untyped, import-not-found, unused-ignore]

        rtb: Any = roboticstoolbox
        g = data.geometry
        rows = (
            (-g.d1, g.a1, _HALF, 0.0),
            (0.0, g.a2, 0.0, 0.0),
            (0.0, g.a3, -_HALF, _HALF),
            (-g.d4, 0.0, _HALF, 0.0),
            (0.0, 0.0, -_HALF, 0.0),
            (-g.d6, 0.0, math.pi, math.pi),
        )
        frames = [poe.ROBROOT_OF_BASE @ frame for frame in poe.dh_frames(g, np.zeros(6))]
        links = []
        for (d, a, alpha, offset), body, frame in zip(
            rows, bodies(data, payload), frames[1:], strict=True
        ):
            R, p = frame[:3, :3], frame[:3, 3]
            inertia, centre = R.T @ body.inertia @ R, R.T @ (body.centre - p)
            links.append(
                rtb.RevoluteDH(
                    d=d, a=a, alpha=alpha, offset=offset, m=body.mass, r=centre, I=inertia, Jm=0.0
                )
            )
        self.base, self.half_turn = frames[0], np.diag([-1.0, -1.0, 1.0, 1.0])
        self.robot: Any = rtb.DHRobot(links)
        # The toolbox has changed what sign its gravity has: its default, g downwards, tells.
        sign = -np.sign(self.robot.gravity[2])
        self.field = self.base[:3, :3].T @ (sign * np.array(data.gravity))

    def fk(self, q: Array) -> Array:
        """T_robroot_flange."""
        return np.asarray(self.base @ self.robot.fkine(q).A @ self.half_turn)

    def _turned(self, rows: Array) -> Array:
        R = self.base[:3, :3]
        return np.concatenate([R @ rows[:3], R @ rows[3:]])

    def jacobian(self, q: Array) -> Array:
        """Flange, robroot axes."""
        return self._turned(np.asarray(self.robot.jacob0(q)))

    def jacobian_dot(self, q: Array, qd: Array) -> Array:
        """Its rate."""
        return self._turned(np.asarray(self.robot.jacob0_dot(q, qd)))

    def mass_matrix(self, q: Array) -> Array:
        """M by columns of Newton-Euler."""
        zero = np.zeros(6)
        return np.array([self._rne(q, zero, unit, np.zeros(3)) for unit in np.eye(6)]).T

    def coriolis_torque(self, q: Array, qd: Array) -> Array:
        """Newton-Euler without gravity and acceleration."""
        return self._rne(q, qd, np.zeros(6), np.zeros(3))

    def gravity(self, q: Array) -> Array:
        """Newton-Euler at rest."""
        return self._rne(q, np.zeros(6), np.zeros(6), self.field)

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Newton-Euler."""
        return self._rne(q, qd, qdd, self.field)

    def forward_dynamics(self, q: Array, qd: Array, tau: Array) -> Array:
        """M of the toolbox solved for the accelerations."""
        rest = self._rne(q, qd, np.zeros(6), self.field)
        return np.asarray(np.linalg.solve(self.mass_matrix(q), tau - rest))

    def _rne(self, q: Array, qd: Array, qdd: Array, gravity: Array) -> Array:
        return np.asarray(self.robot.rne(q, qd, qdd, gravity=gravity))


def build(data: RobotData, payload: Payload | None) -> Toolbox:
    """The toolbox's robot with the same numbers."""
    return Toolbox(data, payload)
