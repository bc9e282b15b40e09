"""Dynamics by Lagrange: kinetic energy summed over links, differentiated by complex steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kr16cli.robot import LinkData, Payload, RobotData
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, cross, derivative, gradient, skew


@dataclass(frozen=True)
class Body:
    """A link at the zero pose, in robroot: mass, mass centre, inertia about the mass centre."""

    mass: float
    centre: Array
    inertia: Array


def tensor(six: Sequence[float]) -> Array:
    """(Ixx, Iyy, Izz, Ixy, Ixz, Iyz) as a matrix."""
    xx, yy, zz, xy, xz, yz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def bodies(data: RobotData, payload: Payload | None = None) -> list[Body]:
    """The six links at the zero pose; a payload (in flange axes) is merged into the last."""
    g = data.geometry
    frames = [poe.ROBROOT_OF_BASE @ frame for frame in poe.dh_frames(g, np.zeros(6))]
    places = []
    for i, link in enumerate(data.links, 1):
        place = np.eye(4)
        place[:3, 3] = poe.points(g)[i - 1]
        places.append(frames[i] if link.frame == "dh" else place)
    result = [_placed(place, link) for place, link in zip(places, data.links, strict=True)]
    if payload is not None and payload.mass:
        result[5] = merged(result[5], _placed(poe.zero_flange(g), payload))
    return result


def _placed(place: Array, body: LinkData | Payload) -> Body:
    rotation = place[:3, :3]
    centre = rotation @ np.array(body.com) + place[:3, 3]
    return Body(body.mass, centre, rotation @ tensor(body.inertia) @ rotation.T)


def merged(a: Body, b: Body) -> Body:
    """Two bodies as one: common mass centre, inertias by Steiner's theorem."""
    mass = a.mass + b.mass
    centre = (a.mass * a.centre + b.mass * b.centre) / mass
    inertia = np.zeros((3, 3))
    for body in (a, b):
        lever = skew(body.centre - centre)
        inertia += body.inertia + body.mass * (lever @ lever.T)
    return Body(mass, centre, inertia)


class Lagrangian:
    """Dynamics of a robot, rigid and frictionless; q, qd, qdd are (..., 6).

    Args:
        data: the robot's numbers; its gravity is used.
        payload: a load on the flange.
    """

    def __init__(self, data: RobotData, payload: Payload | None = None) -> None:
        self.g, self.field = data.geometry, np.array(data.gravity)
        self.bodies = bodies(data, payload)

    def mass_centres(self, q: Array) -> Array:
        """(..., 6, 3), m."""
        moves = poe.motions(self.g, q)[1:]
        placed = [poe.carried(m, b.centre) for m, b in zip(moves, self.bodies, strict=True)]
        return np.stack(placed, axis=-2)

    def mass_matrix(self, q: Array) -> Array:
        """M by the sum over links (3.38), (..., 6, 6)."""
        total = np.zeros((*q.shape, 6), dtype=q.dtype)
        for body, linear, angular, inertia in self._links(q):
            total = total + body.mass * (_t(linear) @ linear) + _t(angular) @ inertia @ angular
        return total

    def _links(self, q: Array) -> list[tuple[Body, Array, Array, Array]]:
        """Per link: its body, Jacobians of its mass centre, and its inertia, in robroot."""
        moves = poe.motions(self.g, q)
        z = np.stack([m[..., :3, :3] @ a for m, a in zip(moves, poe.AXES, strict=False)], -2)
        places = zip(moves, poe.points(self.g), strict=False)
        o = np.stack([poe.carried(m, point) for m, point in places], axis=-2)
        result = []
        for k, body in enumerate(self.bodies, 1):
            rotation, centre = moves[k][..., :3, :3], poe.carried(moves[k], body.centre)
            linear = np.zeros((*q.shape[:-1], 3, 6), dtype=q.dtype)
            angular = np.zeros_like(linear)
            linear[..., :k] = _t(cross(z[..., :k, :], centre[..., None, :] - o[..., :k, :]))
            angular[..., :k] = _t(z[..., :k, :])
            result.append((body, linear, angular, rotation @ body.inertia @ _t(rotation)))
        return result

    def kinetic(self, q: Array, qd: Array) -> Array:
        """Kinetic energy, J, summed over links from their velocities."""
        total = np.zeros(np.broadcast_shapes(q.shape, qd.shape)[:-1], dtype=q.dtype)
        for body, linear, angular, inertia in self._links(q):
            v, w = _apply(linear, qd), _apply(angular, qd)
            total = total + (body.mass * (v * v).sum(-1) + (w * _apply(inertia, w)).sum(-1)) / 2
        return total

    def _momentum(self, q: Array, qd: Array) -> Array:
        """dT/dqd = M qd, (..., 6), summed over links from their velocities."""
        total: Any = 0.0
        for body, linear, angular, inertia in self._links(q):
            push = _apply(_t(linear), body.mass * _apply(linear, qd))
            total = total + push + _apply(_t(angular), _apply(inertia, _apply(angular, qd)))
        return np.asarray(total)

    def potential(self, q: Array) -> Array:
        """-sum m g . p, J, zero at robroot's origin."""
        masses = np.array([body.mass for body in self.bodies])
        return np.asarray(-(self.mass_centres(q) @ self.field) @ masses)

    def gravity(self, q: Array) -> Array:
        """G = dP/dq."""
        return gradient(self.potential, q)

    def christoffel(self, q: Array) -> Array:
        """C_k(i, j) of (3.41) with the index of the last term corrected, (..., 6, 6, 6), k first.

        (dM_kj/dq_i + dM_ki/dq_j - dM_ij/dq_k) / 2.
        """
        d = gradient(self.mass_matrix, q)  # d[..., i, k, j] = dM_kj / dq_i
        over_i = np.swapaxes(d, -3, -2)  # [k, i, j] = dM_kj / dq_i
        over_j = np.swapaxes(over_i, -1, -2)  # [k, i, j] = dM_ki / dq_j
        return np.asarray((over_i + over_j - d) / 2)

    def coriolis_matrix(self, q: Array, qd: Array) -> Array:
        """C(q, qd)[k, j] = sum_i qd_i C_k(i, j)."""
        return np.asarray(np.einsum("...kij,...i->...kj", self.christoffel(q), qd))

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """d/dt (dT/dqd) - dT/dq + dP/dq."""
        momentum_rate = derivative(self._momentum, (q, qd), (qd, qdd))
        return np.asarray(
            momentum_rate
            - gradient(lambda a: self.kinetic(a, qd[..., None, :]), q)
            + self.gravity(q)
        )

    def base_wrench(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Force and moment about robroot's origin that the foundation exerts, (..., 6).

        The rate of momentum and angular momentum, less the weight and its moment.
        """

        def momenta(a: Array, rate: Array) -> Array:
            total = np.zeros(a.shape, dtype=a.dtype)
            centres = self.mass_centres(a)
            for k, (body, linear, angular, inertia) in enumerate(self._links(a)):
                p = body.mass * _apply(linear, rate)
                spin = cross(centres[..., k, :], p) + _apply(inertia, _apply(angular, rate))
                total = total + np.concatenate([p, spin], axis=-1)
            return total

        change = derivative(momenta, (q, qd), (qd, qdd))
        masses = np.array([body.mass for body in self.bodies])
        weight = np.broadcast_to(masses.sum() * self.field, (*q.shape[:-1], 3))
        turning = cross(np.einsum("...kx,k->...x", self.mass_centres(q), masses), self.field)
        return np.asarray(change - np.concatenate([weight, turning], axis=-1))


def _t(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)


def _apply(matrix: Array, vector: Array) -> Array:
    return np.asarray((matrix @ vector[..., None])[..., 0])
