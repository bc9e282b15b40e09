"""Pictures of sweeps: figures of the runs against the numbers that were varied."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from kr16cli.report.study_figures import saved
from kr16cli.report.style import BLUE, INK, MUTED, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_PARAMETERS = 4
_MOST_FIGURES = 5
_LEVELS = 12
"""Up to so many different values of a number are levels, whose mean and range are drawn."""
_PREFERRED = (
    "error_position", "tau_share", "tau_max_2", "tau_max_3", "tau_max_1", "qd_max_2",
    "energy_kinetic_max", "work_torque", "position_end_3", "q_end_2", "time_end",
)  # fmt: skip


def sweep_drawn(answer: Mapping[str, Any], columns: Mapping[str, Any], name: str) -> bytes:
    """The picture of a sweep, PDF or PNG by the suffix of `name`; no date in it."""
    with styled():
        figure = sweep_figure(answer, columns)
        title = f"{answer['input']['scenario']['name']}, {answer['result']['runs']} runs"
        return saved(figure, name, title, "kr16 sweep")


def sweep_figure(answer: Mapping[str, Any], columns: Mapping[str, Any]) -> Figure:
    """Rows of figures that vary, columns of numbers that were varied."""
    from matplotlib.figure import Figure

    result = answer["result"]
    paths = list(result["vary"])[:_MOST_PARAMETERS]
    names = _chosen(result["figures"])
    good = columns["status"] == "ok"
    across, down = max(1, len(paths)), max(1, len(names))
    figure = Figure(figsize=(1.6 + 2.6 * across, 1.0 + 1.9 * down), layout="constrained")
    figure.suptitle(
        f"{answer['input']['scenario']['name']}: {answer['robot']}\n{result['runs']} runs, "
        f"{result['design']}" + (f", {result['failed']} failed" if result["failed"] else ""),
        fontsize=10.0,
    )
    axes = figure.subplots(down, across, sharex="col", sharey="row", squeeze=False)
    if not names:
        axes[0, 0].text(0.5, 0.5, "no figure varies", ha="center", color=MUTED,
                        transform=axes[0, 0].transAxes)  # fmt: skip
    for i, name in enumerate(names):
        for k, path in enumerate(paths):
            _against(axes[i, k], columns[path][good], columns[name][good])
            _ranked(axes[i, k], result["figures"][name]["rank_correlation"][path])
        unit = answer["units"].get(name) or answer["units"].get(name.rpartition("_")[0]) or ""
        axes[i, 0].set_ylabel(f"{name}" + (f", {unit}" if unit not in ("", "1") else ""))
    for k, path in enumerate(paths):
        axes[-1, k].set_xlabel(path)
    return figure


def _chosen(figures: Mapping[str, Any]) -> list[str]:
    """The figures that vary, the telling ones first."""
    varying = [name for name, told in figures.items() if told and told["varies"]]
    first = [name for name in _PREFERRED if name in varying]
    return (first + [name for name in varying if name not in first])[:_MOST_FIGURES]


def _against(axis: Axes, x: Any, y: Any) -> None:
    axis.plot(x, y, "o", color=BLUE, ms=3.0, alpha=0.5 if len(x) > 50 else 0.9, mec="none",
              rasterized=len(x) > 5000)  # fmt: skip
    levels = np.unique(x)
    if 1 < len(levels) <= _LEVELS or (len(levels) == len(x) <= 200 and _is_curve(x)):
        axis.plot(levels, [np.nanmean(y[x == v]) for v in levels], color=INK, lw=1.0)


def _is_curve(x: Any) -> bool:
    """Whether values rise in equal steps, as the levels of a single number do."""
    steps = np.diff(x)
    return bool((steps > 0.0).all() and np.allclose(steps, steps[0], rtol=1e-6))


def _ranked(axis: Axes, rank: float | None) -> None:
    if rank is not None:
        axis.annotate(f"rank {rank:+.2f}", (1.0, 1.0), xycoords="axes fraction", ha="right",
                      va="bottom", fontsize=7, color=MUTED)  # fmt: skip
