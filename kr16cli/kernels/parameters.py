"""The robot's numbers as the model takes them, and as the one flat vector that C kernels take."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from kr16cli.model.inertia import EMPTY, Body
from kr16cli.model.scalars import ZERO, Scalar
from kr16cli.robot import Geometry

if TYPE_CHECKING:
    from kr16cli.single import Arm

_BASE_FIRST = ("hx", "hy", "zz")
_BASE = ("hx", "hy", "xx", "zz", "xy", "xz", "yz")
_FULL = ("m", "hx", "hy", "hz", "xx", "yy", "zz", "xy", "xz", "yz")

COUNT = 6 + 3 + 38 + 6 + 60 + 6 + 6
"""Length of the flat vector."""


class Parameters(NamedTuple):
    """What the model functions take, in scalars of any kind.

    `base` are regrouped bodies, `full` the links themselves; both empty for a robot without
    inertial data. `coulomb` and `viscous` are empty without drives.
    """

    geometry: Geometry
    gravity: Sequence[Scalar]
    base: Sequence[Body]
    rotors: Sequence[Scalar]
    full: Sequence[Body]
    coulomb: Sequence[Scalar]
    viscous: Sequence[Scalar]


def parameters(arm: Arm) -> Parameters:
    """The numbers of a robot as floats, exact zeros structural."""
    dynamic = bool(arm.data.links)
    joints = arm.data.joints if arm.drives else ()
    return Parameters(
        arm.geometry,
        arm.gravity_vector,
        arm.base_bodies if dynamic else (),
        arm.rotors,
        arm.bodies if dynamic else (),
        [0.0 if j.coulomb is None else j.coulomb for j in joints],
        [0.0 if j.viscous is None else j.viscous for j in joints],
    )


def pack(k: Parameters) -> list[float]:
    """The flat vector; inertial numbers are NaN where the robot has none."""
    return [float(v) for v in flatten(k)]


def flatten(k: Parameters) -> list[Scalar]:
    """The flat vector in scalars of any kind."""
    values: list[Scalar] = [*k.geometry, *k.gravity]
    for i in range(6):
        values += _fields(k.base, i, _BASE if i else _BASE_FIRST)
    values += [*k.rotors]
    for i in range(6):
        values += _fields(k.full, i, _FULL)
    values += k.coulomb or [0.0] * 6
    values += k.viscous or [0.0] * 6
    return values


def unpack(values: Sequence[Scalar], *, vertical: bool, drives: bool) -> Parameters:
    """The flat vector (numbers or symbols) as the model takes it.

    `vertical` makes gravity's x and y structural zeros; without `drives` there is no friction.
    """
    rest = iter(values)

    def take(count: int) -> list[Scalar]:
        return [next(rest) for _ in range(count)]

    geometry, gravity = Geometry(*take(6)), take(3)
    base = [_body(names, take(len(names))) for names in (_BASE_FIRST, *(_BASE,) * 5)]
    rotors = take(6)
    full = [_body(_FULL, take(10)) for _ in range(6)]
    coulomb, viscous = take(6), take(6)
    return Parameters(
        geometry,
        [ZERO, ZERO, gravity[2]] if vertical else gravity,
        base,
        rotors,
        full,
        coulomb if drives else (),
        viscous if drives else (),
    )


def _fields(bodies: Sequence[Body], i: int, names: Sequence[str]) -> list[Scalar]:
    if not bodies:
        return [math.nan] * len(names)
    b = bodies[i]
    return [b.h["xyz".index(n[1])] if n[0] == "h" else getattr(b, n) for n in names]


def _body(names: Sequence[str], values: Sequence[Scalar]) -> Body:
    known = dict(zip(names, values, strict=True))
    x, y, z = (known.get(f"h{axis}", ZERO) for axis in "xyz")
    return Body(known.get("m", ZERO), (x, y, z), *(known.get(n, ZERO) for n in EMPTY._fields[2:]))
