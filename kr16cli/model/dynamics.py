"""Joint-space dynamics by recursion: inverse dynamics, mass matrix, forward dynamics.

Newton-Euler and composite bodies in joint frames (Featherstone, Rigid Body Dynamics
Algorithms, 2008, chapters 5 and 6), in place of the expanded sums of (3.38)-(3.43); equal to
them by `verify` and the tests. Bodies may be a full set or a regrouped one: structural zeros
cost nothing. Rotor inertia is six diagonal numbers, reflected to the link side.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from kr16cli.model.inertia import NOWHERE, Body, Step, steps, turn_in, turn_out
from kr16cli.model.scalars import (
    ZERO,
    Functions,
    Scalar,
    Trig,
    Vector,
    add,
    cross,
    quarter_turn,
    sum_of,
)
from kr16cli.robot import Geometry
from kr16cli.tolerances import TOLERANCES

Matrix3 = tuple[Vector, Vector, Vector]
Wrench = tuple[Vector, Vector]
"""(force, moment about the frame's origin)."""

AT_REST: tuple[Scalar, ...] = (ZERO,) * 6

_BASE = Step(NOWHERE, 0, 0)


def joint_steps(g: Geometry, cs: Trig) -> list[tuple[Step, Scalar, Scalar]]:
    """For each joint: the step that leads to its frame, and (cos, sin) of its DH angle."""
    chain = (_BASE, *steps(g))
    return [(s, *quarter_turn(p, s.offset)) for s, p in zip(chain, cs, strict=True)]


def base_acceleration(gravity: Sequence[Scalar]) -> Vector:
    """Gravity (robroot, m/s2) as the upward acceleration of a base at rest, in frame 0's axes.

    Frame 0 has x forward, y right and z down.
    """
    return -gravity[0], gravity[1], gravity[2]


def motion_matrix(omega: Vector, omega_dot: Vector) -> Matrix3:
    """U = [omega_dot]x + [omega]x [omega]x: U r is the acceleration of r relative to the origin."""
    x, y, z = omega
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    ax, ay, az = omega_dot
    return (
        (-(yy + zz), xy - az, xz + ay),
        (xy + az, -(xx + zz), yz - ax),
        (xz - ay, yz + ax, -(xx + yy)),
    )


def _times(u: Matrix3, r: Vector) -> Vector:
    x, y, z = (row[0] * r[0] + row[1] * r[1] + row[2] * r[2] for row in u)
    return x, y, z


def body_wrench(b: Body, u: Matrix3, acceleration: Vector) -> Wrench:
    """Force and moment (about the origin) that move a body: Newton and Euler.

    f = m a + U h and n = J omega_dot + omega x J omega + h x a. The first two terms of n are
    written as int r x (U r) dm: U holds the products of omega already.
    """
    force = _times(u, b.h)
    if b.m is not ZERO:
        force = add(force, (b.m * acceleration[0], b.m * acceleration[1], b.m * acceleration[2]))
    # int r x (U r) dm, with the second moments k on the diagonal and -J_xy, ... off it.
    kx, ky, kz = _second_moments(b)
    (uxx, uxy, uxz), (uyx, uyy, uyz), (uzx, uzy, uzz) = u
    own = (
        ky * uzy - kz * uyz + b.xz * uyx - b.xy * uzx + b.yz * (uyy - uzz),
        kz * uxz - kx * uzx + b.xy * uzy - b.yz * uxy + b.xz * (uzz - uxx),
        kx * uyx - ky * uxy + b.yz * uxz - b.xz * uyz + b.xy * (uxx - uyy),
    )
    return force, add(own, cross(b.h, acceleration))


def _second_moments(b: Body) -> Vector:
    """Integrals of x^2, y^2, z^2 dm from the inertia tensor's diagonal."""
    half = (b.xx + b.yy + b.zz) / 2
    return half - b.xx, half - b.yy, half - b.zz


class Motion(NamedTuple):
    """How a link moves, in its joint frame: omega, U (`motion_matrix`), the origin's acceleration.

    rad/s, 1/s2, m/s2; the acceleration counts gravity as one of the base upward.
    """

    omega: Vector
    u: Matrix3
    acceleration: Vector


def motions(
    trail: Sequence[tuple[Step, Scalar, Scalar]],
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    base: Vector,
) -> Iterator[Motion]:
    """The motion of each link, from the base outward along `joint_steps`."""
    omega, omega_dot, acceleration = NOWHERE, NOWHERE, base
    u: Matrix3 = (NOWHERE, NOWHERE, NOWHERE)
    for (step, c, s), rate, rate_dot in zip(trail, qd, qdd, strict=True):
        acceleration = turn_in(add(acceleration, _times(u, step.shift)), step.alpha, c, s)
        omega, omega_dot = (turn_in(v, step.alpha, c, s) for v in (omega, omega_dot))
        omega_dot = (
            omega_dot[0] + omega[1] * rate,
            omega_dot[1] - omega[0] * rate,
            omega_dot[2] + rate_dot,
        )
        omega = (omega[0], omega[1], omega[2] + rate)
        u = motion_matrix(omega, omega_dot)
        yield Motion(omega, u, acceleration)


def joint_wrenches(
    trail: Sequence[tuple[Step, Scalar, Scalar]], moving: Iterable[Motion], bodies: Sequence[Body]
) -> list[Wrench]:
    """What each joint passes on to the links beyond it, in its joint frame."""
    own = [body_wrench(b, m.u, m.acceleration) for m, b in zip(moving, bodies, strict=True)]
    force, moment = own[5]
    result = [(force, moment)]
    for i in range(4, -1, -1):
        force, moment = wrench_out(force, moment, *trail[i + 1])
        force, moment = add(force, own[i][0]), add(moment, own[i][1])
        result.insert(0, (force, moment))
    return result


def newton_euler(
    cs: Trig,
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    base: Vector,
) -> tuple[list[Scalar], Wrench]:
    """Joint torques (N m), and the wrench on link 1 in joint frame 1 (N, N m).

    `base` is the acceleration of the base (`base_acceleration`).
    """
    trail = joint_steps(g, cs)
    wrenches = joint_wrenches(trail, motions(trail, qd, qdd, base), bodies)
    return [moment[2] for _, moment in wrenches], wrenches[0]


def wrench_out(force: Vector, moment: Vector, step: Step, c: Scalar, s: Scalar) -> Wrench:
    """A wrench of the child's frame in the parent's, about the parent's origin."""
    force = turn_out(force, step.alpha, c, s)
    return force, add(turn_out(moment, step.alpha, c, s), cross(step.shift, force))


def inverse_dynamics(
    cs: Trig,
    qd: Sequence[Scalar],
    qdd: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    gravity: Sequence[Scalar],
    rotors: Sequence[Scalar] = AT_REST,
) -> list[Scalar]:
    """tau = M qdd + C qd + G of the rigid arm with rotors, N m (no friction)."""
    torque, _ = newton_euler(cs, qd, qdd, bodies, g, base_acceleration(gravity))
    return [t + j * a for t, j, a in zip(torque, rotors, qdd, strict=True)]


def bias(
    cs: Trig,
    qd: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    gravity: Sequence[Scalar],
) -> list[Scalar]:
    """C qd + G, N m."""
    return newton_euler(cs, qd, AT_REST, bodies, g, base_acceleration(gravity))[0]


def gravity_torque(
    cs: Trig, bodies: Sequence[Body], g: Geometry, gravity: Sequence[Scalar]
) -> list[Scalar]:
    """G of (3.42), N m."""
    return bias(cs, AT_REST, bodies, g, gravity)


def rotated(b: Body, alpha: int, c: Scalar, s: Scalar) -> Body:
    """A body of the child's frame in the parent's axes (about the same origin)."""
    h = turn_out(b.h, alpha, c, s)
    k = s * (b.xx - b.yy) + (c + c) * b.xy
    t = s * k
    xx, yy, xy = b.xx - t, b.yy + t, c * k - b.xy
    xz, yz = c * b.xz - s * b.yz, s * b.xz + c * b.yz
    if alpha % 4 == 1:  # y -> -z, z -> y
        return Body(b.m, h, xx, b.zz, yy, -xz, xy, -yz)
    if alpha % 4 == 3:  # y -> z, z -> -y
        return Body(b.m, h, xx, b.zz, yy, xz, -xy, -yz)
    return Body(b.m, h, xx, yy, b.zz, xy, xz, yz)


def shifted(b: Body, d: Vector) -> Body:
    """A body seen from an origin from which its own lies at d (same axes)."""
    hx, hy, hz = b.h
    m = b.m
    px, py, pz = d[0] * hx, d[1] * hy, d[2] * hz
    qx, qy, qz = (2 * p + m * (v * v) for p, v in zip((px, py, pz), d, strict=True))
    return Body(
        m,
        (hx + m * d[0], hy + m * d[1], hz + m * d[2]),
        b.xx + (qy + qz),
        b.yy + (qx + qz),
        b.zz + (qx + qy),
        b.xy - (d[0] * hy + d[1] * hx + m * (d[0] * d[1])),
        b.xz - (d[0] * hz + d[2] * hx + m * (d[0] * d[2])),
        b.yz - (d[1] * hz + d[2] * hy + m * (d[1] * d[2])),
    )


def mass_matrix(
    cs: Trig, bodies: Sequence[Body], g: Geometry, rotors: Sequence[Scalar] = AT_REST
) -> list[list[Scalar]]:
    """M of (3.38) by composite bodies, kg m2; the two triangles are the same scalars."""
    trail = joint_steps(g, cs)
    matrix: list[list[Scalar]] = [[ZERO] * 6 for _ in range(6)]
    composite = bodies[5]
    for i in range(5, -1, -1):
        force: Vector = (-composite.h[1], composite.h[0], ZERO)
        moment: Vector = (composite.xz, composite.yz, composite.zz)
        matrix[i][i] = moment[2] + rotors[i]
        for j in range(i, 0, -1):
            force, moment = wrench_out(force, moment, *trail[j])
            matrix[i][j - 1] = matrix[j - 1][i] = moment[2]
        if i:
            step, c, s = trail[i]
            composite = shifted(rotated(composite, step.alpha, c, s), step.shift) + bodies[i - 1]
    return matrix


class Factors(NamedTuple):
    """A = L D L^T of a symmetric positive definite matrix: L below its diagonal of ones, 1/D."""

    lower: Sequence[Sequence[Scalar]]
    inverse_d: Sequence[Scalar]


def factored(matrix: Sequence[Sequence[Scalar]]) -> Factors:
    """L D L^T of a symmetric positive definite matrix: no square root, no branch."""
    n = len(matrix)
    lower = [[ZERO] * n for _ in range(n)]
    inverse_d: list[Scalar] = []
    for i in range(n):
        scaled: list[Scalar] = []
        for j in range(i):
            v = matrix[i][j] - sum_of(scaled[k] * lower[j][k] for k in range(j))
            scaled.append(v)
            lower[i][j] = v * inverse_d[j]
        pivot = matrix[i][i] - sum_of(scaled[k] * lower[i][k] for k in range(i))
        inverse_d.append(1 / pivot)
    return Factors(lower, inverse_d)


def solved(a: Factors, right: Sequence[Scalar]) -> list[Scalar]:
    """x of A x = b."""
    n = len(right)
    x: list[Scalar] = []
    for i in range(n):
        x.append(right[i] - sum_of(a.lower[i][k] * x[k] for k in range(i)))
    x = [v * d for v, d in zip(x, a.inverse_d, strict=True)]
    for i in range(n - 1, -1, -1):
        x[i] = x[i] - sum_of(a.lower[k][i] * x[k] for k in range(i + 1, n))
    return x


def solve_symmetric(matrix: Sequence[Sequence[Scalar]], right: Sequence[Scalar]) -> list[Scalar]:
    """x of A x = b for symmetric positive definite A."""
    return solved(factored(matrix), right)


def forward_dynamics(
    cs: Trig,
    qd: Sequence[Scalar],
    tau: Sequence[Scalar],
    bodies: Sequence[Body],
    g: Geometry,
    gravity: Sequence[Scalar],
    rotors: Sequence[Scalar] = AT_REST,
) -> list[Scalar]:
    """qdd of M qdd + C qd + G = tau, rad/s2 (friction already taken from tau)."""
    rest = [t - b for t, b in zip(tau, bias(cs, qd, bodies, g, gravity), strict=True)]
    return solve_symmetric(mass_matrix(cs, bodies, g, rotors), rest)


def friction(
    qd: Sequence[Scalar], coulomb: Sequence[Scalar], viscous: Sequence[Scalar], ns: Functions
) -> list[Scalar]:
    """Friction torque opposing qd, N m: viscous qd + coulomb qd / sqrt(qd^2 + v^2).

    The step of Coulomb friction is regularised at the speed v of `tolerances.coulomb_speed`.
    """
    v2 = TOLERANCES.coulomb_speed**2
    return [
        kv * rate + kc * (rate / ns.sqrt(rate * rate + v2))
        for rate, kc, kv in zip(qd, coulomb, viscous, strict=True)
    ]


def friction_slope(
    qd: Sequence[Scalar], coulomb: Sequence[Scalar], viscous: Sequence[Scalar], ns: Functions
) -> list[Scalar]:
    """d friction / d qd, N m s: viscous + coulomb v^2 / sqrt(qd^2 + v^2)^3."""
    v2 = TOLERANCES.coulomb_speed**2
    slopes = []
    for rate, kc, kv in zip(qd, coulomb, viscous, strict=True):
        square = rate * rate + v2
        slopes.append(kv + kc * (v2 / (square * ns.sqrt(square))))
    return slopes
