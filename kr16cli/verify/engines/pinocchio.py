"""Pinocchio: spatial algebra in C++ (LAAS/INRIA)."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli.robot import Payload, RobotData
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import bodies
from kr16cli.verify.independent.rotations import Array


class Pinocchio:
    """A model built link by link at the zero pose."""

    def __init__(self, data: RobotData, payload: Payload | None) -> None:
        import pinocchio  # type: ignore[import-untyped, import-not-found, unused-ignore]

        self.pin: Any = pinocchio
        pin = self.pin
        g = data.geometry
        self.model = pin.Model()
        parent, last = 0, np.zeros(3)
        links = zip(poe.AXES, poe.points(g), bodies(data, payload), strict=True)
        for i, (axis, point, body) in enumerate(links):
            joint = pin.JointModelRevoluteUnaligned(axis)
            parent = self.model.addJoint(parent, joint, pin.SE3(np.eye(3), point - last), f"A{i}")
            inertia = pin.Inertia(body.mass, body.centre - point, body.inertia)
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
            last = point
        tip = poe.zero_flange(g)
        tip[:3, 3] -= last
        frame = pin.Frame("flange", parent, 0, pin.SE3(tip), pin.FrameType.OP_FRAME)
        self.flange = self.model.addFrame(frame)
        self.model.gravity.linear = np.array(data.gravity)
        self.data = self.model.createData()
        self.axes = pin.LOCAL_WORLD_ALIGNED

    def fk(self, q: Array) -> Array:
        """T_robroot_flange."""
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return np.array(self.data.oMf[self.flange].homogeneous)

    def jacobian(self, q: Array) -> Array:
        """Flange, robroot axes."""
        arguments = (self.model, self.data, q, self.flange, self.axes)
        return np.array(self.pin.computeFrameJacobian(*arguments))

    def jacobian_dot(self, q: Array, qd: Array) -> Array:
        """Its rate."""
        self.pin.computeJointJacobiansTimeVariation(self.model, self.data, q, qd)
        self.pin.updateFramePlacements(self.model, self.data)
        arguments = (self.model, self.data, self.flange, self.axes)
        return np.array(self.pin.getFrameJacobianTimeVariation(*arguments))

    def mass_matrix(self, q: Array) -> Array:
        """Composite bodies; only the upper triangle is promised."""
        upper = np.triu(self.pin.crba(self.model, self.data, q))
        return np.asarray(upper + np.triu(upper, 1).T)

    def coriolis_torque(self, q: Array, qd: Array) -> Array:
        """C qd by Pinocchio's own factorisation."""
        return np.array(self.pin.computeCoriolisMatrix(self.model, self.data, q, qd) @ qd)

    def coriolis_matrix(self, q: Array, qd: Array) -> Array:
        """C: Pinocchio's is the Christoffel matrix too."""
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

    def energy(self, q: Array, qd: Array) -> Array:
        """(kinetic, potential)."""
        kinetic = self.pin.computeKineticEnergy(self.model, self.data, q, qd)
        return np.array([kinetic, self.pin.computePotentialEnergy(self.model, self.data, q)])

    def base_wrench(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Reaction on the base about robroot's origin, from the centroidal momentum's rate."""
        arguments = (self.model, self.data, q, qd, qdd)
        rate = self.pin.computeCentroidalMomentumTimeVariation(*arguments)
        mass, centre = self.pin.computeTotalMass(self.model), np.array(self.data.com[0])
        force = rate.linear - mass * self.model.gravity.linear
        return np.concatenate([force, rate.angular + np.cross(centre, force)])


def build(data: RobotData, payload: Payload | None) -> Pinocchio:
    """Pinocchio with the robot's numbers."""
    return Pinocchio(data, payload)
