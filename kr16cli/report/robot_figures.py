"""Drawings of the arm: centre lines, axes with their sense, lengths, mass centres, envelope."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from kr16cli.report.style import BLUE, INK, MUTED, ORANGE, SHADE

_LINK: dict[str, Any] = {
    "color": "#8a97a8",
    "lw": 5.0,
    "solid_capstyle": "round",
    "solid_joinstyle": "round",
}
_MEASURE: dict[str, Any] = {"arrowstyle": "<|-|>", "lw": 0.7, "color": MUTED, "shrinkA": 0,
                            "shrinkB": 0, "mutation_scale": 6}  # fmt: skip
_ARROW: dict[str, Any] = {"arrowstyle": "-|>", "lw": 1.2, "shrinkA": 0, "shrinkB": 0}


def side_view(axis: Axes, points: Any, *, muted: bool = False) -> None:
    """The centre line (7, 2) with joints as dots and the flange as a square."""
    p = np.asarray(points)
    look = _LINK | ({"lw": 2.5, "color": "#c3cad3"} if muted else {})
    axis.plot(p[:, 0], p[:, 1], zorder=2, **look)
    joints = p[1:-1]
    axis.plot(joints[:, 0], joints[:, 1], "o", color="white", mec=INK, ms=5 if muted else 6,
              ls="", zorder=3)  # fmt: skip
    axis.plot(p[-1, 0], p[-1, 1], "s", color=INK, ms=4, zorder=3)
    axis.plot(p[0, 0] + np.array([-0.18, 0.18]), [p[0, 1]] * 2, color=INK, lw=2.5, zorder=3)
    axis.set_aspect("equal")


def joint_axes(axis: Axes, places: Any, directions: Any, names: Sequence[str]) -> None:
    """Joint axes in the x-z plane: an arrow, or a ring with a cross or dot across the plane.

    Turning is positive by the right hand about the arrow; a cross points away from the reader.
    """
    offsets = {"A1": (9, 10), "A2": (-22, 9), "A3": (8, 10), "A4": (0, 9), "A5": (-19, 9),
               "A6": (6, 9)}  # fmt: skip
    for place, direction, name in zip(np.asarray(places), np.asarray(directions), names,
                                      strict=True):  # fmt: skip
        x, z = place[0], place[2]
        if abs(direction[1]) > 0.5:
            axis.plot(x, z, "o", ms=13, mfc="none", mec=ORANGE, mew=1.4, zorder=4)
            sign = "x" if direction[1] > 0 else "o"
            axis.plot(x, z, sign, ms=6 if sign == "x" else 3, color=ORANGE, mew=1.4, zorder=5)
        else:
            tip = (x + 0.21 * direction[0], z + 0.21 * direction[2])
            axis.annotate("", tip, (x, z), arrowprops=_ARROW | {"color": ORANGE}, zorder=5)
        axis.annotate(name, (x, z), offsets.get(name, (6, 6)), textcoords="offset points",
                      color=ORANGE, fontsize=9, fontweight="bold", zorder=6)  # fmt: skip


def dimension(
    axis: Axes, start: tuple[float, float], end: tuple[float, float], text: str,
    shift: tuple[float, float], place: str = "above",
) -> None:  # fmt: skip
    """A measured length: a double arrow from start to end, moved by `shift`, with its value.

    `place` of the value: above the arrow, left of it (turned), right of it, or after its end.
    """
    a = (start[0] + shift[0], start[1] + shift[1])
    b = (end[0] + shift[0], end[1] + shift[1])
    for p, q in ((start, a), (end, b)):
        axis.plot([p[0], q[0]], [p[1], q[1]], color=MUTED, lw=0.5, zorder=1)
    axis.annotate("", b, a, arrowprops=_MEASURE)
    middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
    offset, across, up, turn = {
        "above": ((0, 3), "center", "bottom", 0),
        "left": ((-4, 0), "right", "center", 90),
        "right": ((6, 0), "left", "center", 0),
        "after": ((4, 0), "left", "center", 0),
    }[place]
    anchor = b if place == "after" else middle
    axis.annotate(text, anchor, offset, textcoords="offset points", ha=across, va=up,
                  fontsize=8, rotation=turn)  # fmt: skip


def triad(axis: Axes, at: tuple[float, float], names: tuple[str, str], length: float) -> None:
    """Two axes of the drawing plane, from `at` to the right and up."""
    for k, (dx, dz) in enumerate(((length, 0.0), (0.0, length))):
        tip = (at[0] + dx, at[1] + dz)
        axis.annotate("", tip, at, arrowprops=_ARROW | {"color": BLUE})
        axis.annotate(names[k], tip, (4, -3) if k == 0 else (-3, 4), textcoords="offset points",
                      color=BLUE, fontsize=9)  # fmt: skip


def branch(axis: Axes, drawing: Mapping[str, Any], k: int, span: tuple[Any, Any]) -> None:
    """One solution in the oblique view, with the A5 axis as an arrow."""
    floor = np.asarray(drawing["floor"])
    axis.plot(floor[:, 0], floor[:, 1], color=MUTED, lw=0.7)
    axis.axis("off")
    axis.set_xlim(*span[0])
    axis.set_ylim(*span[1])
    axis.set_aspect("equal")
    if not drawing["found"][k]:
        axis.text(0.5, 0.5, "no solution", transform=axis.transAxes, ha="center", fontsize=8)
        return
    p = np.asarray(drawing["points"][k])
    axis.plot(p[:, 0], p[:, 1], zorder=2, **(_LINK | {"lw": 3.5}))
    axis.plot(p[1:-1, 0], p[1:-1, 1], "o", color="white", mec=INK, ms=4, ls="", zorder=3)
    axis.plot(p[-1, 0], p[-1, 1], "s", color=INK, ms=4, zorder=4)
    a, b = np.asarray(drawing["a5_ends"][k])
    axis.annotate("", b, a, arrowprops=_ARROW | {"color": ORANGE}, zorder=5)


def mass_view(axis: Axes, arm: Mapping[str, Any], up: int, labels: tuple[str, str]) -> None:
    """Mass centres in a view: x against z (up = 2) or y (up = 1); areas go with mass."""
    p, c = np.asarray(arm["points"]), np.asarray(arm["centres"])
    mass = np.asarray(arm["mass"])
    axis.plot(p[:, 0], p[:, up], **(_LINK | {"color": "#d5dae1"}), zorder=1)
    axis.scatter(c[:, 0], c[:, up], s=6.0 * mass + 10, color=BLUE, alpha=0.35, lw=0, zorder=2)
    axis.plot(c[:, 0], c[:, up], "+", color=INK, ms=6, zorder=3)
    total = np.asarray(arm["total"])
    axis.plot(total[0], total[up], "x", color=ORANGE, ms=9, mew=2, zorder=4)
    spread_labels(axis, c[:, [0, up]], [f"{i}" for i in range(1, len(c) + 1)])
    axis.set_aspect("equal")
    axis.set_xlabel(labels[0], labelpad=1)
    axis.set_ylabel(labels[1], labelpad=1)


def spread_labels(axis: Axes, places: Any, names: Sequence[str]) -> None:
    """A label above or below each place by turns, so that neighbours keep apart."""
    order = np.argsort(np.asarray(places)[:, 0], kind="stable")
    for turn, k in enumerate(order):
        up = 15 if turn % 2 == 0 else -22
        axis.annotate(
            names[k], places[k], (0, up), textcoords="offset points", ha="center", fontsize=8,
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": MUTED, "shrinkB": 3, "shrinkA": 0},
        )  # fmt: skip


def section(axis: Axes, drawing: Mapping[str, Any]) -> None:
    """The section of the workspace with its edges and the arm at home."""
    x, z = np.asarray(drawing["x"]), np.asarray(drawing["z"])
    inside = np.asarray(drawing["inside"], dtype=float)
    middles = [(edges[1:] + edges[:-1]) / 2 for edges in (x, z)]
    axis.contourf(*middles, inside, levels=[0.5, 1.5], colors=[SHADE], zorder=0)
    dashes = ("-", (0, (6, 2)), (0, (1.5, 1.5)), "-.", (0, (9, 2, 2, 2)))
    for k, (name, line) in enumerate(drawing["edges"].items()):
        p = np.asarray(line)
        axis.plot(p[:, 0], p[:, 1], color=BLUE if k < 4 else ORANGE, ls=dashes[k], label=name)
    side_view(axis, drawing["arm"], muted=True)
    axis.set_xlabel("x, m (A1 axis at 0)")
    axis.set_ylabel("z, m (floor at 0)")
