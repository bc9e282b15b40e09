"""A wanted motion as points that the trajectory source plays: fitted, as C, as bytes.

Between two points every angle is the polynomial of degree 5 through q, qd and qdd of both ends,
which is exact for rests, trapezoids, quintic moves and splines; paths of the flange are cut
until it is close enough. fmu/track/track.c evaluates the same.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from itertools import pairwise
from math import ulp
from typing import NamedTuple

from kr16cli.errors import InputError
from kr16cli.simulate.core import Reference

MARK = b"kr16 track table"
CAPACITY = 512
"""Points that a library has room for."""

TOLERANCES = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5)
"""Allowed deviations of an angle, rad, tried in order; of a speed 10, an acceleration 1e4 times."""

_ASIDE = 1e-6
_INSTANT = 1e-12
_SHORTEST = 1e-4
_PLACES = (0.25, 0.5, 0.75)

Row = tuple[float, ...]
"""q, qd, qdd of six joints."""


class Track(NamedTuple):
    """A motion: `points` are (time, row) with rising times, twice the same where qdd jumps.

    `tolerance` (rad) is what it was fitted to.
    """

    points: tuple[tuple[float, Row], ...]
    tolerance: float


def fit(reference: Reference) -> Track:
    """The track of a reference.

    Raises:
        InputError: it needs more points than there is room for.
    """
    for tolerance in TOLERANCES:
        points: list[tuple[float, Row]] = []
        for point in _points(reference, tolerance):
            points.append(point)
            if len(points) > CAPACITY:
                break
        else:
            return Track(tuple(points), tolerance)
    raise InputError(
        f"the reference of {reference.duration:g} s needs more than {CAPACITY} points to "
        f"{TOLERANCES[-1]:g} rad; make it shorter or simpler"
    )


def _points(reference: Reference, tolerance: float) -> Iterator[tuple[float, Row]]:
    """The ends of pieces between which the fit is close enough."""
    breaks = {b for b in reference.breaks if 0.0 < b < reference.duration}
    last = (0.0, _row(reference, 0.0))
    yield last
    for a, b in pairwise([0.0, *sorted(breaks), reference.duration]):
        if b - a <= 3.0 * _ASIDE:
            continue
        first = (a, _beside(reference, a, 1.0))
        if _gap(last[1], first[1]) <= 1e4 * tolerance:
            first = last
        else:
            own = _row(reference, a)
            if _gap(own, first[1]) > _gap(own, last[1]):  # at the jump the old side still holds
                first = (a + max(_INSTANT, 2.0 * ulp(a)), first[1])
            yield first
        for last in _cut(reference, first, (b, _beside(reference, b, -1.0)), tolerance):
            yield last


def _gap(a: Row, b: Row) -> float:
    """The largest difference of accelerations."""
    return max(abs(v - w) for v, w in zip(a[12:], b[12:], strict=True))


def _cut(
    reference: Reference, a: tuple[float, Row], b: tuple[float, Row], tolerance: float
) -> Iterator[tuple[float, Row]]:
    """Ends of the pieces from a to b, a not among them."""
    h = b[0] - a[0]
    if h < _SHORTEST or all(_close(reference, a, b, u, tolerance) for u in _PLACES):
        yield b
        return
    t = a[0] + 0.5 * h
    middle = (t, _row(reference, t))
    yield from _cut(reference, a, middle, tolerance)
    yield from _cut(reference, middle, b, tolerance)


def _close(
    reference: Reference, a: tuple[float, Row], b: tuple[float, Row], u: float, tolerance: float
) -> bool:
    wanted, found = _row(reference, a[0] + u * (b[0] - a[0])), between(a, b, u)
    return all(
        abs(w - f) <= tolerance * (1.0, 10.0, 1e4)[k // 6]
        for k, (w, f) in enumerate(zip(wanted, found, strict=True))
    )


def between(a: tuple[float, Row], b: tuple[float, Row], u: float) -> Row:
    """The row at the part u of the time from point a to point b.

    q = a + u (v0 + u (w0 / 2 + u (c3 + u (c4 + u c5)))) with v0 = h qd and w0 = h^2 qdd of a;
    c3, c4, c5 follow from the row of b.
    """
    h = b[0] - a[0]
    q, qd, qdd = [], [], []
    for i in range(6):
        d = b[1][i] - a[1][i]
        v0, v1 = h * a[1][6 + i], h * b[1][6 + i]
        w0, w1 = h * h * a[1][12 + i], h * h * b[1][12 + i]
        c3 = 10.0 * d - 6.0 * v0 - 4.0 * v1 - 1.5 * w0 + 0.5 * w1
        c4 = -15.0 * d + 8.0 * v0 + 7.0 * v1 + 1.5 * w0 - w1
        c5 = 6.0 * d - 3.0 * (v0 + v1) - 0.5 * (w0 - w1)
        q.append(a[1][i] + u * (v0 + u * (0.5 * w0 + u * (c3 + u * (c4 + u * c5)))))
        qd.append((v0 + u * (w0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h)
        qdd.append((w0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (h * h))
    return (*q, *qd, *qdd)


def _row(reference: Reference, t: float) -> Row:
    target = reference.joint(t)
    return (*target.q, *target.qd, *target.qdd)


def _beside(reference: Reference, t: float, side: float) -> Row:
    """The row at a break, accelerations as they are right after (side 1) or before it (-1)."""
    near, far = (reference.joint(t + k * side * _ASIDE).qdd for k in (1.0, 2.0))
    qdd = tuple(2.0 * a - b for a, b in zip(near, far, strict=True))
    return (*_row(reference, t)[:12], *qdd)


def as_c(track: Track, token: str, sources: str) -> str:
    """The table as a definition in C.

    Args:
        track: the motion.
        token: GUID of the FMU.
        sources: SHA-256 of the C that goes with it.
    """
    lines = [
        "/* Written by kr16cli: one motion. */",
        "const kr16_track_table kr16_track = {",
        f"    .mark = {{{', '.join(repr(chr(b)) for b in MARK)}}},",
        f'    .sources = "{sources}",',
        f'    .token = "{token}",',
        f"    .points = {len(track.points)},",
        "    .time = {" + ", ".join(repr(t) for t, _ in track.points) + "},",
        "    .row = {",
    ]
    lines += ["        {" + ", ".join(map(repr, row)) + "}," for _, row in track.points]
    return "\n".join([*lines, "    },", "};", ""])


def as_bytes(track: Track, token: str, sources: str) -> bytes:
    """The table as it lies in a library: little-endian, no padding."""
    count = len(track.points)
    times = [t for t, _ in track.points] + [0.0] * (CAPACITY - count)
    values = [v for _, row in track.points for v in row] + [0.0] * (18 * (CAPACITY - count))
    head = MARK + sources.encode().ljust(80, b"\0") + token.encode().ljust(64, b"\0")
    return head + struct.pack(f"<2i{19 * CAPACITY}d", count, 0, *times, *values)
