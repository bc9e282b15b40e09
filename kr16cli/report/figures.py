"""Curves, bars and maps: arrays in, Axes filled. Nothing is told by colour alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator, StrMethodFormatter

from kr16cli.report.style import BLUE, GREEN, INK, LINES, MUTED, ORANGE, PINK, RED

_HUES = (BLUE, ORANGE, GREEN, PINK, INK, "#56B4E9")
_MARKS = ("o", "s", "^", "D", "v", "P")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++")


def powers(axis: Axis) -> None:
    """Powers of ten on a log axis as plain words, which draw much faster than formulas."""

    def text(value: float, _: int) -> str:
        exponent = math.log10(value) if value > 0 else math.nan
        whole = math.isfinite(exponent) and abs(exponent - round(exponent)) < 1e-9
        return "10" + str(round(exponent)).translate(_RAISED) if whole else ""

    axis.set_major_formatter(FuncFormatter(text))
    axis.set_minor_formatter(NullFormatter())
    axis.set_minor_locator(NullLocator())


def margin_bars(
    axis: Axes, middles: Sequence[float], margins: Sequence[float | None], failed: Sequence[bool]
) -> None:
    """Bars of error over tolerance beside the rows of a table; y is in points of the page.

    A margin of zero has no bar; one that was not measured spans the axis.
    """
    low, high = 1e-9, 10.0
    share = np.array([high if m is None else m for m in margins])
    drawn, bad = share > 0, np.asarray(failed)
    for group, hatch, color in ((drawn & ~bad, None, BLUE), (drawn & bad, "////", RED)):
        axis.barh(
            np.asarray(middles)[group],
            np.clip(share[group], 1.6 * low, high) - low,
            left=low,
            height=5.5,
            color=color,
            hatch=hatch,
            edgecolor="white",
            linewidth=0,
        )
    axis.set_xscale("log")
    axis.set_xlim(low, high)
    axis.axvline(1.0, color=INK, lw=1.2)
    axis.set_yticks([])
    axis.set_xticks([1e-9, 1e-6, 1e-3, 1.0])
    powers(axis.xaxis)
    axis.tick_params(axis="x", labelsize=7)
    axis.spines["left"].set_visible(False)


def residual_histogram(
    axis: Axes, edges: Sequence[float], count: Sequence[int], tolerance: float, title: str
) -> None:
    """How many samples have which closing error, log-log, with the tolerance as a line."""
    start = np.asarray(edges, dtype=float)
    axis.bar(
        start, np.maximum(count, 0), width=0.5, align="edge", color=BLUE, edgecolor="white", lw=0.5
    )
    axis.set_yscale("log")
    axis.set_ylim(0.7, 3 * max(1, *count))
    axis.set_xlim(-17, max(-8.5, math.log10(tolerance) + 0.5))
    axis.axvline(math.log10(tolerance), color=INK, lw=1.2, ls=(0, (4, 2)))
    axis.set_title(title, fontsize=8, fontweight="normal")
    axis.set_xticks([-16, -14, -12, -10])
    axis.tick_params(labelsize=7)
    powers(axis.yaxis)


def counts(axis: Axes, values: Sequence[int], count: Sequence[int], label: str) -> None:
    """A bar for each whole number."""
    axis.bar(values, count, color=BLUE, width=0.7)
    for v, n in zip(values, count, strict=True):
        if n:
            axis.annotate(
                str(n), (v, n), (0, 2), textcoords="offset points", ha="center", fontsize=8
            )
    axis.set_xticks(list(values))
    axis.set_ylim(0, 1.18 * max(count))
    axis.set_xlabel(label)
    axis.set_ylabel("poses")
    axis.grid(visible=False, axis="x")


def difference_curve(
    axis: Axes, step: Sequence[float], error: Sequence[float], tolerance: float
) -> None:
    """Error of central differences against the step, with slopes 2 and -1 and the best step."""
    h, e = np.asarray(step), np.asarray(error)
    best = int(np.argmin(e))
    axis.loglog(h, e, "o-", color=BLUE, label="largest error")
    left, right = h >= h[best], h <= h[best]
    axis.loglog(h[left], e[0] * (h[left] / h[0]) ** 2, color=MUTED, ls=LINES[1],
                label="slope 2: truncation")  # fmt: skip
    axis.loglog(h[right], e[-1] * h[-1] / h[right], color=MUTED, ls=LINES[2],
                label="slope -1: rounding")  # fmt: skip
    axis.axhline(tolerance, color=INK, ls=(0, (4, 2)), lw=1.2)
    axis.annotate("tolerance of the best step", (h[0], tolerance), (0, 3),
                  textcoords="offset points", ha="right", fontsize=8)  # fmt: skip
    axis.annotate(f"best: {e[best]:.1e} at h = {h[best]:.0e}", (h[best], e[best]), (0, -24),
                  textcoords="offset points", ha="center", fontsize=8)  # fmt: skip
    axis.set_ylim(e[best] / 30, None)
    powers(axis.xaxis)
    powers(axis.yaxis)
    axis.set_xlabel("step h, rad")
    axis.set_ylabel("largest |difference - Jacobian|, m")
    axis.legend(loc="upper center")


def order_curves(axis: Axes, methods: Sequence[tuple[str, Any, Any, float]]) -> None:
    """Error against step for (name, steps, errors, expected order), with the expected slopes."""
    for k, (name, step, error, order) in enumerate(methods):
        h, e = np.asarray(step), np.asarray(error)
        axis.loglog(h, e, marker=_MARKS[k], ls="", color=_HUES[k], label=name)
        wide = np.array([h.max() * 1.15, h.min() / 1.15])
        axis.loglog(wide, e[0] * (wide / h[0]) ** order, color=_HUES[k], ls=LINES[k],
                    label=f"slope {order:g}, as claimed")  # fmt: skip
    axis.set_xticks(sorted({h for _, step, _, _ in methods for h in step}))
    powers(axis.yaxis)
    axis.minorticks_off()
    axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_xlabel("step, s")
    axis.set_ylabel("largest error of a joint at the end, rad")
    axis.legend(loc="lower right")


def history(
    axis: Axes, time: Sequence[float], curves: Sequence[tuple[str, Any]], tolerance: float,
    label: str,
) -> None:  # fmt: skip
    """Small errors over time on a log axis, with their tolerance; zeros are left out."""
    for k, (name, values) in enumerate(curves):
        y = np.where(np.asarray(values) > 0, values, np.nan)
        axis.semilogy(time, y, color=_HUES[k], ls=LINES[k], marker=_MARKS[k], ms=3, label=name)
    axis.axhline(tolerance, color=INK, ls=(0, (4, 2)), lw=1.2, label="tolerance")
    powers(axis.yaxis)
    axis.set_ylim(None, 3 * max(tolerance, axis.get_ylim()[1]))
    axis.set_xlabel("time, s")
    axis.set_ylabel(label)
    axis.legend(loc="upper right", bbox_to_anchor=(1.0, -0.13), ncols=3)


def torque_curves(
    axis: Axes, time: Any, tau: Any, limit: Any, names: Sequence[str], half: Any = None
) -> None:
    """Torque over limit of every joint, with the limits, and bands of these half widths."""
    share = np.asarray(tau) / np.asarray(limit)
    for k, name in enumerate(names):
        if half is not None:
            wide = np.asarray(half)[:, k] / np.asarray(limit)[k]
            axis.fill_between(time, share[:, k] - wide, share[:, k] + wide, color=_HUES[k],
                              alpha=0.22, lw=0)  # fmt: skip
        axis.plot(time, share[:, k], color=_HUES[k], ls=LINES[k], label=name)
        at = int(np.argmax(np.abs(share[:, k])))
        axis.plot(time[at], share[at, k], marker=_MARKS[k], color=_HUES[k])
    for value in (-1.0, 1.0):
        axis.axhline(value, color=INK, ls=(0, (4, 2)), lw=1.2)
    axis.annotate("limit", (time[-1], 1.0), (0, -11), textcoords="offset points", ha="right",
                  fontsize=8)  # fmt: skip
    axis.set_ylim(-1.25, 1.25)
    axis.set_xlim(time[0], time[-1])
    axis.set_xlabel("time, s")
    axis.set_ylabel("torque / limit")
    axis.legend(ncols=6, loc="upper center", bbox_to_anchor=(0.5, 1.11))


def heat_map(
    axis: Axes,
    x: Any,
    y: Any,
    values: Any,
    labels: tuple[str, str],
    title: str,
    *,
    log: bool = False,
    cut: tuple[float, float] | None = None,
) -> None:
    """A rasterised map with its own scale beside it."""
    from matplotlib.colors import LogNorm, Normalize

    shown = np.asarray(values, dtype=float)
    low, high = cut or (float(np.nanmin(shown)), float(np.nanmax(shown)))
    norm = LogNorm(low, high) if log else Normalize(low, high)
    image = axis.pcolormesh(
        x, y, np.clip(shown, low, high), norm=norm, shading="nearest", rasterized=True
    )
    axis.set_xlabel(labels[0], labelpad=2)
    axis.set_ylabel(labels[1], labelpad=2)
    axis.set_title(title, fontsize=8.5)
    axis.grid(visible=False)
    bar = axis.figure.colorbar(image, ax=axis, pad=0.03, fraction=0.06)
    bar.ax.tick_params(labelsize=7)
    if log:
        powers(bar.ax.yaxis)
    bar.outline.set_linewidth(0.5)


def zero_lines(axis: Axes, x: Any, y: Any, families: Mapping[str, Any]) -> None:
    """Where factors of the determinant vanish, a dash pattern for each family."""
    for k, values in enumerate(families.values()):
        if np.min(values) < 0 < np.max(values):
            axis.contour(x, y, values, levels=[0.0], colors=["white"], linewidths=[2.4])
            axis.contour(x, y, values, levels=[0.0], colors=["#D00000"], linewidths=[1.1],
                         linestyles=[LINES[k]])  # fmt: skip


def bars(
    axis: Axes, names: Sequence[str], groups: Mapping[str, Sequence[float]], limit: float
) -> None:
    """Groups of horizontal bars, told apart by hatch, with a limit."""
    height = 0.8 / len(groups)
    for k, (label, values) in enumerate(groups.items()):
        y = np.arange(len(names)) + (k - (len(groups) - 1) / 2) * height
        axis.barh(y, values, height=height * 0.9, color=_HUES[k], hatch=_HATCHES[k],
                  edgecolor="white", lw=0.4, label=label)  # fmt: skip
    axis.axvline(limit, color=INK, ls=(0, (4, 2)), lw=1.2)
    axis.set_yticks(np.arange(len(names)), names)
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    axis.set_xlim(0, 1.1 * limit)


def ratio_bars(
    axis: Axes, names: Sequence[str], ratios: Sequence[float], label: str, *, least: float = 0.0
) -> None:
    """A horizontal bar for each ratio, its value at the end, and a line at 1.

    Ratios below `least` are hatched and of another colour.
    """
    y = np.arange(len(names))
    slow = [r < least for r in ratios]
    axis.barh(y, ratios, height=0.62, color=[RED if s else BLUE for s in slow],
              hatch=["////" if s else "" for s in slow], edgecolor="white", lw=0)  # fmt: skip
    for k, ratio in enumerate(ratios):
        axis.annotate(f"{ratio:.3g}", (ratio, k), (3, 0), textcoords="offset points",
                      va="center", fontsize=8)  # fmt: skip
    axis.axvline(1.0, color=INK, ls=(0, (4, 2)), lw=1.0)
    axis.set_yticks(y, names, fontsize=7)
    axis.set_ylim(len(names) - 0.5, -0.5)
    axis.set_xlim(0, 1.12 * max(1.0, *ratios))
    axis.set_xlabel(label)
    axis.grid(visible=False, axis="y")


_EXACT = 1e-18
"""Where a deviation of zero stands on a log axis."""


def deviation_dots(
    axis: Axes,
    names: Sequence[str],
    deviations: Sequence[Mapping[str, float | None]],
    tolerances: Sequence[float],
    groups: Sequence[str],
) -> None:
    """Relative deviations of each row by group on a log axis, and each row's tolerance.

    Zero stands at the left end, what is not finite at the right end. Marks of a row stand one
    below the other, so that equal ones are all seen.
    """
    high = 10 * max(*tolerances, *(v or 0.0 for row in deviations for v in row.values()))
    apart = 0.8 / max(1, len(groups))
    for k, group in enumerate(groups):
        rows = [i for i, row in enumerate(deviations) if group in row]
        values = [deviations[i][group] for i in rows]
        x = [high if v is None else max(v, _EXACT) for v in values]
        y = [i + (k - (len(groups) - 1) / 2) * apart for i in rows]
        axis.plot(x, y, ls="", marker=_MARKS[k % 6], color=_HUES[k % 6], ms=4,
                  mfc=_HUES[k % 6] if k < 6 else "none", label=group, clip_on=False)  # fmt: skip
    middles = np.arange(len(names))
    axis.vlines(tolerances, middles - 0.45, middles + 0.45, color=INK, lw=1.2,
                ls=(0, (4, 2)), label="tolerance")  # fmt: skip
    axis.set_xscale("log")
    axis.set_xlim(_EXACT, high)
    axis.set_xticks([10.0**e for e in range(-18, round(math.log10(high)) + 1, 3)])
    powers(axis.xaxis)
    plain = axis.xaxis.get_major_formatter()
    axis.xaxis.set_major_formatter(
        FuncFormatter(lambda v, at: "0" if v <= 1.01 * _EXACT else plain(v, at))
    )
    axis.set_yticks(middles, names, fontsize=7)
    axis.set_ylim(len(names) - 0.5, -0.5)
    axis.set_xlabel("largest deviation / size of the quantity (0: none)")
    axis.grid(visible=False, axis="y")
    axis.legend(loc="upper center", bbox_to_anchor=(0.4, -32.0 / axis.bbox.height), ncols=8,
                handletextpad=0.3, columnspacing=1.2)  # fmt: skip
