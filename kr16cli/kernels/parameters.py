"""The robot's numbers as one flat vector: how kernels are told which robot they serve."""

from __future__ import annotations

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


class Parameters(NamedTuple):
    """What the model functions take, in scalars of any kind."""

    geometry: Geometry
    gravity: Sequence[Scalar]
    base: Sequence[Body]
    rotors: Sequence[Scalar]
    full: Sequence[Body]
    coulomb: Sequence[Scalar]
    viscous: Sequence[Scalar]


def _field(body: Body, name: str) -> Scalar:
    return body.h["xyz".index(name[1])] if name[0] == "h" else getattr(body, name)


def _body(names: Sequence[str], values: Sequence[Scalar]) -> Body:
    known = dict(zip(names, values, strict=True))
    h = tuple(known.get(f"h{axis}", ZERO) for axis in "xyz")
    return Body(
        known.get("m", ZERO), (h[0], h[1], h[2]), *(known.get(n, ZERO) for n in EMPTY._fields[2:])
    )


def pack(arm: Arm) -> list[float]:
    """The vector of a robot; inertial numbers are NaN where the file has none."""
    g = arm.geometry
    known = bool(arm.data.links)
    base = arm.base_bodies if known else ()
    full = arm.bodies if known else ()
    values: list[Scalar] = [*g, *arm.data.gravity]
    for i in range(6):
        names = _BASE if i else _BASE_FIRST
        values += [_field(base[i], n) if known else float("nan") for n in names]
    values += arm.rotors
    for i in range(6):
        values += [_field(full[i], n) if known else float("nan") for n in _FULL]
    drives = arm.data.joints if arm.drives else ()
    values += [j.coulomb or 0.0 for j in drives] or [0.0] * 6
    values += [j.viscous or 0.0 for j in drives] or [0.0] * 6
    return [float(v) for v in values]


def unpack(values: Sequence[Scalar], *, vertical: bool = False) -> Parameters:
    """The same as the model's arguments; `vertical` makes gravity's x and y structural zeros."""
    rest = iter(values)

    def take(count: int) -> list[Scalar]:
        return [next(rest) for _ in range(count)]

    geometry, gravity = Geometry(*take(6)), take(3)
    base = [_body(names, take(len(names))) for names in (_BASE_FIRST, *(_BASE,) * 5)]
    rotors = take(6)
    full = [_body(_FULL, take(10)) for _ in range(6)]
    if vertical:
        gravity = [ZERO, ZERO, gravity[2]]
    return Parameters(geometry, gravity, base, rotors, full, take(6), take(6))


COUNT = 6 + 3 + 38 + 6 + 60 + 6 + 6
"""Length of the vector."""
