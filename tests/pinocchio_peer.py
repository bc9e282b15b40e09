"""Pinocchio's own model of the arm, built from the bodies of the oracles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from duals import Array
from oracles import AXES, Body, points, zero_flange


class Pinocchio:
    """Pinocchio's model of the same numbers, built link by link at the zero pose.

    Args:
        g: geometry. links: from `bodies`. field: gravity vector, robroot, m/s2.
    """

    def __init__(self, g: Any, links: Sequence[Body], field: Sequence[float]) -> None:
        import pinocchio as pin

        self.pin = pin
        self.model = pin.Model()
        parent, last = 0, np.zeros(3)
        for i, (axis, point, body) in enumerate(zip(AXES, points(g), links, strict=True)):
            place = pin.SE3(np.eye(3), point - last)
            joint = pin.JointModelRevoluteUnaligned(axis.astype(float))
            parent = self.model.addJoint(parent, joint, place, f"A{i + 1}")
            inertia = pin.Inertia(body.mass, body.centre - point, body.inertia)
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
            last = point
        zero = zero_flange(g)
        zero[:3, 3] -= last
        frame = pin.Frame("flange", parent, 0, pin.SE3(zero), pin.FrameType.OP_FRAME)
        self.flange = self.model.addFrame(frame)
        self.model.gravity.linear = np.array(field, dtype=float)
        self.data = self.model.createData()

    def fk(self, q: Array) -> Array:
        """T_robroot_flange."""
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMf[self.flange].homogeneous)

    def jacobian(self, q: Array) -> Array:
        """Flange Jacobian in robroot axes."""
        axes = self.pin.LOCAL_WORLD_ALIGNED
        return np.array(self.pin.computeFrameJacobian(self.model, self.data, q, self.flange, axes))

    def jacobian_dot(self, q: Array, qd: Array) -> Array:
        """Its rate."""
        self.pin.computeJointJacobiansTimeVariation(self.model, self.data, q, qd)
        self.pin.updateFramePlacements(self.model, self.data)
        axes = self.pin.LOCAL_WORLD_ALIGNED
        return np.array(
            self.pin.getFrameJacobianTimeVariation(self.model, self.data, self.flange, axes)
        )

    def mass_matrix(self, q: Array) -> Array:
        """M by composite bodies."""
        upper = np.triu(self.pin.crba(self.model, self.data, q))
        return upper + np.triu(upper, 1).T

    def coriolis_matrix(self, q: Array, qd: Array) -> Array:
        """C of Pinocchio's own factorisation."""
        return np.array(self.pin.computeCoriolisMatrix(self.model, self.data, q, qd))

    def gravity(self, q: Array) -> Array:
        """G."""
        return np.array(self.pin.computeGeneralizedGravity(self.model, self.data, q))

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Newton-Euler."""
        return np.array(self.pin.rnea(self.model, self.data, q, qd, qdd))

    def forward_dynamics(self, q: Array, qd: Array, tau: Array) -> Array:
        """Articulated bodies."""
        return np.array(self.pin.aba(self.model, self.data, q, qd, tau))

    def energy(self, q: Array, qd: Array) -> tuple[float, float]:
        """(kinetic, potential)."""
        kinetic = self.pin.computeKineticEnergy(self.model, self.data, q, qd)
        return float(kinetic), float(self.pin.computePotentialEnergy(self.model, self.data, q))

    def base_wrench(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Force and moment about robroot's origin, from the rate of the centroidal momentum."""
        pin = self.pin
        rate = pin.computeCentroidalMomentumTimeVariation(self.model, self.data, q, qd, qdd)
        mass, centre = pin.computeTotalMass(self.model), np.array(self.data.com[0])
        force = rate.linear - mass * self.model.gravity.linear
        return np.concatenate([force, rate.angular + np.cross(centre, force)])

    def regressor(self, q: Array, qd: Array, qdd: Array) -> Array:
        """6 x 60: torques per inertial parameter."""
        return np.array(self.pin.computeJointTorqueRegressor(self.model, self.data, q, qd, qdd))
