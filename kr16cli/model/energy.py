"""Whole-arm quantities of the full bodies: mass centres (3.29), energies (3.43), base wrench."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.model.chain import Frame, joint_frames
from kr16cli.model.dynamics import Wrench, base_acceleration, newton_euler
from kr16cli.model.inertia import Body, turn_out
from kr16cli.model.scalars import ZERO, Scalar, Trig, Vector, add, cross, dot, matvec, scale, sum_of
from kr16cli.robot import Geometry


def mass_centres(links: Sequence[Frame], bodies: Sequence[Body], g: Geometry) -> list[Vector]:
    """The six mass centres p_c1..p_c6, m, in the base of `links` (chain.frames 0..6)."""
    return [
        frame.apply(scale(1 / body.m, body.h))
        for frame, body in zip(joint_frames(links, g), bodies, strict=True)
    ]


def potential(
    links: Sequence[Frame], bodies: Sequence[Body], g: Geometry, gravity: Sequence[Scalar]
) -> Scalar:
    """Potential energy of the moving links, J, zero at the robroot origin: -sum g . (m p_c).

    Equation (3.43) with the mass centre of link i (the printed index is 1 for all). `links` in
    robroot. With gravity (0, 0, -9.81) this is sum m_i 9.81 height_i.
    """
    moments = (
        add(scale(body.m, frame.p), frame.rotate(body.h))
        for frame, body in zip(joint_frames(links, g), bodies, strict=True)
    )
    return -sum_of(dot((gravity[0], gravity[1], gravity[2]), moment) for moment in moments)


def kinetic(mass_matrix: Sequence[Sequence[Scalar]], qd: Sequence[Scalar]) -> Scalar:
    """Kinetic energy qd^T M qd / 2, J (rotors included as far as M includes them)."""
    return sum_of(a * b for a, b in zip(qd, matvec(mass_matrix, qd), strict=True)) / 2


def base_wrench(
    cs: Trig,
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    gravity: Sequence[Scalar],
) -> Wrench:
    """Reaction of the foundation on the moving arm: force N, moment N m about robroot's origin.

    Robroot axes. The weight of the fixed base and the spin of the rotors are not in it; the
    load on the foundation is its negative. At rest the force is the weight, upward.
    """
    _, (force, moment) = newton_euler(cs, qd, qdd, bodies, g, base_acceleration(gravity))
    c, s = cs[0]
    (fx, fy, fz), (nx, ny, nz) = (turn_out(v, 0, c, s) for v in (force, moment))
    push: Vector = (fx, -fy, -fz)  # frame 0 (x forward, y right, z down) to robroot
    return push, add((nx, -ny, -nz), cross((ZERO, ZERO, g.d1), push))
