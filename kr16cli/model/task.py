"""Task-space dynamics of section 3.6 for the state x = (p, Phi), Phi = (phi, theta, psi).

x' = Ja q' with Ja = diag(1, B^-1) J, the analytic Jacobian; then
  Mx = Ja^-T M Ja^-1,  Cx = (Ja^-T C - Mx Ja') Ja^-1,  Gx = Ja^-T G,
so that Mx x'' + Cx x' + Gx = Ja^-T tau. Undefined where J is singular or theta = +-90 deg.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from kr16cli.model.orientation import inverse_rate_matrix, rate_matrix_dot
from kr16cli.model.scalars import Scalar, Trig, matvec, sum_of

Matrix = list[list[Scalar]]


class TaskSpace(NamedTuple):
    """Mx, Cx, Gx, the analytic Jacobian Ja and its rate (robroot axes; m, rad)."""

    mass_matrix: Matrix
    coriolis_matrix: Matrix
    gravity: list[Scalar]
    jacobian: Matrix
    jacobian_dot: Matrix


def product(a: Sequence[Sequence[Scalar]], b: Sequence[Sequence[Scalar]]) -> Matrix:
    """Matrix product of row lists."""
    columns = transpose(b)
    return [[sum_of(x * y for x, y in zip(r, c, strict=True)) for c in columns] for r in a]


def transpose(a: Sequence[Sequence[Scalar]]) -> Matrix:
    """Transpose of row lists."""
    return [list(column) for column in zip(*a, strict=True)]


def analytic_jacobian(jacobian: Matrix, rpy: Trig) -> Matrix:
    """Ja = diag(1, B^-1) J; `rpy` are the (cos, sin) pairs of phi, theta, psi."""
    return jacobian[:3] + product(inverse_rate_matrix(rpy), jacobian[3:])


def analytic_jacobian_dot(
    jacobian: Matrix, jacobian_dot: Matrix, rpy: Trig, qd: Sequence[Scalar]
) -> Matrix:
    """Rate of Ja: angular rows B^-1 (J_w' - B' B^-1 J_w)."""
    inverse_b = inverse_rate_matrix(rpy)
    angular = product(inverse_b, jacobian[3:])
    turning = product(rate_matrix_dot(rpy, matvec(angular, qd)), angular)
    rest = [
        [a - b for a, b in zip(r, t, strict=True)]
        for r, t in zip(jacobian_dot[3:], turning, strict=True)
    ]
    return jacobian_dot[:3] + product(inverse_b, rest)


def task_space(
    dynamics: tuple[Matrix, Matrix, list[Scalar]],
    jacobians: tuple[Matrix, Matrix],
    rpy: Trig,
    qd: Sequence[Scalar],
    inverse: Callable[[Matrix], Matrix],
) -> TaskSpace:
    """Task-space forms from (M, C, G) and (J, J') of the flange; `inverse` inverts a 6x6."""
    m, c, g = dynamics
    ja = analytic_jacobian(jacobians[0], rpy)
    ja_dot = analytic_jacobian_dot(*jacobians, rpy, qd)
    back = inverse(ja)
    back_t = transpose(back)
    mx = product(back_t, product(m, back))
    moved = product(mx, ja_dot)
    held = product(back_t, c)
    cx = product(
        [[a - b for a, b in zip(r, s, strict=True)] for r, s in zip(held, moved, strict=True)], back
    )
    return TaskSpace(mx, cx, matvec(back_t, g), ja, ja_dot)
