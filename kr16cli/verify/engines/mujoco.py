"""MuJoCo: a physics simulator with its own algorithms and integrators (DeepMind)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kr16cli.robot import Payload, RobotData
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import Body, bodies
from kr16cli.verify.independent.rotations import Array

_ORDER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _text(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(v)) for v in values)


def _xml(data: RobotData, links: Sequence[Body]) -> str:
    """Bodies nested along the chain, all with robroot's axes at the zero pose."""
    g = data.geometry
    opening, last = [], np.zeros(3)
    for axis, point, body in zip(poe.AXES, poe.points(g), links, strict=True):
        six = [body.inertia[i, j] for i, j in _ORDER]
        opening.append(
            f'<body pos="{_text(point - last)}"><joint type="hinge" axis="{_text(axis)}"/>'
            f'<inertial pos="{_text(body.centre - point)}" mass="{body.mass!r}" '
            f'fullinertia="{_text(six)}"/>'
        )
        last = point
    tip = poe.zero_flange(g)
    site = (
        f'<site name="flange" pos="{_text(tip[:3, 3] - last)}" '
        f'xyaxes="{_text(tip[:3, :2].T.ravel())}"/>'
    )
    return (
        '<mujoco><compiler angle="radian"/>'
        f'<option gravity="{_text(data.gravity)}" integrator="RK4" timestep="0.0005"/>'
        f"<worldbody>{''.join(opening)}{site}{'</body>' * 6}</worldbody></mujoco>"
    )


class MuJoCo:
    """A model with the six bodies and a site on the flange."""

    def __init__(self, data: RobotData, payload: Payload | None) -> None:
        import mujoco  # type: ignore[import-untyped, import-not-found, unused-ignore]

        self.mj: Any = mujoco
        self.model = self.mj.MjModel.from_xml_string(_xml(data, bodies(data, payload)))
        self.data = self.mj.MjData(self.model)
        self.site = self.model.site("flange").id

    def _at(self, q: Array, qd: Array | None = None, tau: Array | None = None) -> None:
        self.data.qpos[:] = q
        self.data.qvel[:] = 0.0 if qd is None else qd
        self.data.qfrc_applied[:] = 0.0 if tau is None else tau
        self.mj.mj_forward(self.model, self.data)

    def fk(self, q: Array) -> Array:
        """T_robroot_flange."""
        self._at(q)
        pose = np.eye(4)
        pose[:3, :3] = self.data.site_xmat[self.site].reshape(3, 3)
        pose[:3, 3] = self.data.site_xpos[self.site]
        return pose

    def jacobian(self, q: Array) -> Array:
        """Flange, robroot axes."""
        self._at(q)
        rows = np.zeros((2, 3, 6))
        self.mj.mj_jacSite(self.model, self.data, rows[0], rows[1], self.site)
        return rows.reshape(6, 6)

    def jacobian_dot(self, q: Array, qd: Array) -> Array:
        """Its rate."""
        self._at(q, qd)
        rows, point = np.zeros((2, 3, 6)), self.data.site_xpos[self.site]
        body = int(self.model.site_bodyid[self.site])
        self.mj.mj_jacDot(self.model, self.data, rows[0], rows[1], point, body)
        return rows.reshape(6, 6)

    def mass_matrix(self, q: Array) -> Array:
        """M, column by column from MuJoCo's sparse inertia."""
        self._at(q)
        columns = np.zeros((6, 6))
        for column, unit in zip(columns, np.eye(6), strict=True):
            self.mj.mj_mulM(self.model, self.data, column, unit)
        return columns.T

    def coriolis_torque(self, q: Array, qd: Array) -> Array:
        """Bias force in motion less the one at rest."""
        rest = self.gravity(q)
        self._at(q, qd)
        return np.array(self.data.qfrc_bias) - rest

    def gravity(self, q: Array) -> Array:
        """Bias force at rest."""
        self._at(q)
        return np.array(self.data.qfrc_bias)

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """MuJoCo's inverse."""
        self._at(q, qd)
        self.data.qacc[:] = qdd
        self.mj.mj_inverse(self.model, self.data)
        return np.array(self.data.qfrc_inverse)

    def forward_dynamics(self, q: Array, qd: Array, tau: Array) -> Array:
        """MuJoCo's accelerations under applied torques."""
        self._at(q, qd, tau)
        return np.array(self.data.qacc)

    def motion(self, q: Array, qd: Array, tau: Array, times: Array) -> Array:
        """Joint angles at multiples of 0.5 ms, by MuJoCo's own Runge-Kutta steps."""
        self.mj.mj_resetData(self.model, self.data)
        self._at(q, qd, tau)
        rows, step = [], 0
        for time in times:
            while step < round(time / self.model.opt.timestep):
                self.mj.mj_step(self.model, self.data)
                step += 1
            rows.append(np.array(self.data.qpos))
        return np.array(rows)


def build(data: RobotData, payload: Payload | None) -> MuJoCo:
    """MuJoCo with the robot's numbers."""
    return MuJoCo(data, payload)
