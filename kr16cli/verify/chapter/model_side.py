"""What the model says of the quantities the chapter's equations speak of, in the base b.

The only part of the audit that imports `kr16cli.model`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import ParamSpec, TypeVar

from kr16cli.model import (
    chain,
    coriolis,
    dynamics,
    energy,
    forward,
    inertia,
    inverse,
    jacobian,
    orientation,
)
from kr16cli.model.inertia import Body
from kr16cli.model.scalars import ZERO, Scalar
from kr16cli.model.scalars import Functions as ModelFunctions
from kr16cli.robot import Geometry, LinkData, Provenance
from kr16cli.verify.chapter.arm import (
    Matrix,
    Point,
    Vector,
    flat,
    transpose,
)

Links = tuple[Body, ...]
"""The six moving links."""

_NOBODY = Provenance("estimated", ())
_MANY = 256

_Arguments = ParamSpec("_Arguments")
_Answer = TypeVar("_Answer")
_FORGET: list[Callable[[], None]] = []


def remembered(f: Callable[_Arguments, _Answer]) -> Callable[_Arguments, _Answer]:
    """Keep what the model answers until `forget`: many statements ask the same of a point."""
    kept = lru_cache(_MANY)(f)
    _FORGET.append(kept.cache_clear)
    return kept  # type: ignore[return-value]  # lru_cache loses the arguments


def forget() -> None:
    """Ask the model anew: it may have been changed since."""
    for clear in _FORGET:
        clear()


def plain(v: Scalar) -> Scalar:
    """A number for the model's structural zero."""
    return 0 if v is ZERO else v


def geometry(p: Point) -> Geometry:
    """The arm's lengths, on the point's own numbers."""
    return Geometry(*(p.values[name] for name in Geometry._fields))


def joints(p: Point) -> list[tuple[Scalar, Scalar]]:
    """(cos, sin) of the joint angles."""
    return [p.angles[f"q{i}"] for i in range(1, 7)]


def rpy(p: Point) -> list[tuple[Scalar, Scalar]]:
    """(cos, sin) of phi, theta, psi."""
    return [p.angles[name] for name in ("phi", "theta", "psi")]


def in_base(v: Sequence[Scalar]) -> Vector:
    """A vector of robroot's axes in those of b: p_robroot = Rz(-90 deg) p_b."""
    return [-plain(v[1]), plain(v[0]), plain(v[2])]


def in_robroot(v: Sequence[Scalar]) -> tuple[Scalar, Scalar, Scalar]:
    """A vector of the axes of b in those of robroot."""
    return v[1], -v[0], v[2]


@remembered
def frames(p: Point) -> list[Matrix]:
    """Frames 0 to 6 in b by `chain.frames`."""
    links = chain.frames(joints(p), geometry(p), chain.CHAPTER_BASE)
    return [[[plain(x) for x in row] for row in frame.rows()[:3]] for frame in links]


@remembered
def closed_form(p: Point) -> Matrix:
    """Frame 6 in b (3x4) by `forward.flange`: its x and y are the flange's reversed."""
    f = forward.flange(joints(p), geometry(p))
    columns = [in_base([-v for v in f.x]), in_base([-v for v in f.y]), in_base(f.z), in_base(f.p)]
    return transpose(columns)


def pose(p: Point) -> list[Matrix]:
    """Frame 6 in b (3x4), by both of the model's forms."""
    return [frames(p)[6], closed_form(p)]


@remembered
def r36(p: Point) -> Matrix:
    """R of (3.22)."""
    return forward.r36(joints(p))


@remembered
def wrist(p: Point) -> Vector:
    """Wrist centre by the closed form and by (3.8) from the flange's pose."""
    a = forward.arm(joints(p), geometry(p))
    f = forward.flange(joints(p), geometry(p))
    back = inverse.wrist_centre([row[:3] for row in f.rows()[:3]], f.p, geometry(p))
    return [*in_base(a.wrist), *in_base(back)]


def _base_rows(rows: Matrix) -> Matrix:
    columns = [(*in_base(c[:3]), *in_base(c[3:])) for c in zip(*rows, strict=True)]
    return transpose([list(c) for c in columns])


def jacobian_of(p: Point, point: Sequence[Scalar], link: int) -> Matrix:
    """Jacobian (6x6, axes b) of a point given in b and fixed to `link`."""
    a = forward.arm(joints(p), geometry(p))
    return _base_rows(jacobian.jacobian(a, in_robroot(point), link))


def jacobian_rate(p: Point, point: Sequence[Scalar], link: int) -> Matrix:
    """Its rate along the joint rates."""
    a = forward.arm(joints(p), geometry(p))
    return _base_rows(jacobian.jacobian_dot(a, in_robroot(point), p.rates, link))


def determinant(p: Point) -> Vector:
    """det J by (3.37) as the model has it."""
    return [jacobian.determinant(joints(p), geometry(p))]


def factors(p: Point) -> Vector:
    """Shoulder, elbow and wrist factor."""
    cs, g = joints(p), geometry(p)
    shoulder, elbow = jacobian.shoulder_factor(cs, g), jacobian.elbow_factor(cs, g)
    return [shoulder, elbow, jacobian.wrist_factor(cs)]


def bodies(p: Point, coms: Sequence[Sequence[Scalar]]) -> Links:
    """The six links, mass centres given in frames 1 to 6 of Table 3.1."""
    links = []
    for k, c in enumerate(coms, 1):
        i = p.inertia(k)
        tensor = (i[0][0], i[1][1], i[2][2], i[0][1], i[0][2], i[1][2])
        data = LinkData(p.values[f"m{k}"], (c[0], c[1], c[2]), tensor, "dh", _NOBODY)
        links.append(inertia.link_body(data, k, geometry(p)))
    return tuple(links)


def mass_centres(p: Point, full: Links) -> list[Vector]:
    """p_c1..p_c6 in b."""
    links = chain.frames(joints(p), geometry(p), chain.CHAPTER_BASE)
    found = energy.mass_centres(links, full, geometry(p))
    return [[plain(x) for x in v] for v in found]


def mass_matrix(p: Point, full: Links) -> Vector:
    """M by composite bodies, of the full and of the regrouped links."""
    g, cs = geometry(p), joints(p)
    both = (full, inertia.regroup(full, g))
    return [plain(v) for b in both for v in flat(dynamics.mass_matrix(cs, b, g))]


def coriolis_matrix(p: Point, full: Links) -> Vector:
    """C by recursion, of the regrouped links."""
    g = geometry(p)
    return [
        plain(v)
        for v in flat(coriolis.coriolis_matrix(joints(p), p.rates, inertia.regroup(full, g), g))
    ]


def christoffel(p: Point, full: Links) -> Vector:
    """All C_k(i, j), k first."""
    return [plain(v) for ck in coriolis.christoffel(joints(p), full, geometry(p)) for v in flat(ck)]


def torque(p: Point, full: Links) -> Vector:
    """M qdd + C qd by Newton and Euler without gravity, for qdd = qd."""
    still = (ZERO, ZERO, ZERO)
    found = dynamics.inverse_dynamics(joints(p), p.rates, p.rates, full, geometry(p), still)
    return [plain(v) for v in found]


def gravity(p: Point, full: Links) -> Vector:
    """G with gravity along -z."""
    down = (ZERO, ZERO, -p.values["g"])
    torque = dynamics.gravity_torque(joints(p), full, geometry(p), down)
    return [plain(v) for v in torque]


def potential(p: Point, full: Links) -> Vector:
    """P with gravity along -z."""
    links = chain.frames(joints(p), geometry(p))
    return [energy.potential(links, full, geometry(p), (ZERO, ZERO, -p.values["g"]))]


def rpy_rotation(p: Point) -> Matrix:
    """R of (3.44)."""
    return orientation.rotation_from_rpy(rpy(p))


@remembered
def rate_matrix(p: Point) -> Matrix:
    """B of (3.46)."""
    return [[plain(v) for v in row] for row in orientation.rate_matrix(rpy(p))]


def _functions(p: Point) -> ModelFunctions:
    f = p.functions
    if f is None:
        raise ValueError("angles need more than + - * /")
    return ModelFunctions(
        f.sqrt, f.sin, f.cos, f.atan2, lambda condition, a, b: a if condition else b, f.pi
    )


def rpy_of(p: Point, r: Matrix) -> Vector:
    """(phi, theta, psi) of a rotation."""
    return list(orientation.rpy_from_rotation(r, _functions(p)))


def solutions(p: Point, target: Matrix) -> list[Vector]:
    """The model's solutions (missing ones left out) for frame 6 at `target` (3x4 in b)."""
    columns = [in_robroot(c) for c in transpose(target)]
    half_turn = [[-v for v in columns[0]], [-v for v in columns[1]], list(columns[2])]
    near = [p.functions.number(0)] * 6 if p.functions else []
    found = inverse.solve(transpose(half_turn), columns[3], geometry(p), near, _functions(p))
    return [list(row) for row in found.angles if all(math.isfinite(v) for v in row)]
