"""The Jacobian of a chosen point on a chosen link in chosen axes, and its rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

from kr16cli.errors import InputError
from kr16cli.model import chain, forward, jacobian
from kr16cli.model.chain import Frame
from kr16cli.model.scalars import ZERO, Scalar, Trig, Vector
from kr16cli.robot import Geometry

Axes = Literal["robroot", "flange", "chapter"]
Rows = list[list[Scalar]]


class View(NamedTuple):
    """What a Jacobian speaks of.

    `point` (m) is fixed to `link` (1..6) and given in its frame: frame i of Table 3.1, the
    flange for link 6. None is that frame's origin. `axes` are those of the rows.
    """

    geometry: Geometry
    link: int = 6
    point: Sequence[Scalar] | None = None
    axes: Axes = "robroot"

    @classmethod
    def of(cls, geometry: Geometry, link: int, point: Sequence[Scalar] | None, axes: str) -> View:
        """A view with checked choices; InputError names the wrong one."""
        if link not in range(1, 7):
            raise InputError(f"link is {link}; expected 1 to 6")
        if axes not in get_args(Axes):
            raise InputError(f"axes is {axes!r}; expected one of {', '.join(get_args(Axes))}")
        return cls(geometry, link, point, axes)  # type: ignore[arg-type]  # checked above

    def jacobian(self, cs: Trig) -> Rows:
        """6x6, linear rows first (m, rad)."""
        a, p = self._place(cs)
        return self._turned(cs, jacobian.jacobian(a, p, self.link))

    def jacobian_dot(self, cs: Trig, qd: Sequence[Scalar]) -> Rows:
        """Rate along qd of the robroot components, shown in `axes` (which stand still)."""
        a, p = self._place(cs)
        return self._turned(cs, jacobian.jacobian_dot(a, p, qd, self.link))

    def _place(self, cs: Trig) -> tuple[forward.Arm, Vector]:
        a = forward.arm(cs, self.geometry)
        if self.point is None and self.link == 6:
            return a, a.flange_p
        x, y, z = self.point if self.point is not None else (ZERO, ZERO, ZERO)
        return a, self._link_frame(cs).apply((x, y, z))

    def _link_frame(self, cs: Trig) -> Frame:
        if self.link == 6:
            return forward.flange(cs, self.geometry)
        return chain.frames(cs, self.geometry)[self.link]

    def _turned(self, cs: Trig, rows: Rows) -> Rows:
        if self.axes == "robroot":
            return rows
        frame = chain.ROBROOT_BASE if self.axes == "chapter" else forward.flange(cs, self.geometry)
        halves = []
        for h in (0, 3):
            columns = [frame.unrotate((x, y, z)) for x, y, z in zip(*rows[h : h + 3], strict=True)]
            halves += [list(row) for row in zip(*columns, strict=True)]
        return halves
