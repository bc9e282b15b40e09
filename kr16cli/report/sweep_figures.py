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
_WORDS = {
    "time_end": "end",
    "q_end": "angle at the end",
    "qd_max": "largest speed",
    "tau_max": "largest torque",
    "tau_share": "largest torque / limit",
    "position_end": "flange at the end",
    "error_position": "largest distance\nfrom reference",
    "error_angle": "largest angle\nfrom reference",
    "energy_kinetic_max": "largest kinetic\nenergy",
    "work_torque": "work of torques",
    "energy_drift": "energy unexplained",
    "limits_passed": "times a limit is passed",
}


def sweep_drawn(answer: Mapping[str, Any], columns: Mapping[str, Any], name: str) -> bytes:
    """The picture of a sweep, PDF or PNG by the suffix of `name`; no date in it."""
    with styled():
        figure = sweep_figure(answer, columns)
        title = f"{answer['input']['scenario']['name']}, {answer['result']['runs']} runs"
        return saved(figure, name, title, "kr16 sweep")


def sweep_figure(answer: Mapping[str, Any], columns: Mapping[str, Any]) -> Figure:
    """Rows of figures that vary, columns of numbers that were varied."""
    from matplotlib.figure import Figure

    result, units = answer["result"], answer["units"]
    paths = list(result["vary"])[:_MOST_PARAMETERS]
    names = _chosen(result["figures"])
    good = columns["status"] == "ok"
    size = (1.6 + 2.6 * len(paths), 1.2 + 1.9 * len(names)) if names else (6.0, 1.6)
    figure = Figure(figsize=size, layout="constrained")
    runs = result["runs"]
    figure.suptitle(
        f"{answer['input']['scenario']['name']}: {answer['robot']}\n{runs} run{'s' * (runs > 1)}, "
        f"{result['design']}" + (f", {result['failed']} failed" if result["failed"] else ""),
        fontsize=10.0,
    )
    if not names:
        why = "no figure varies" if good.any() else "no run has figures"
        figure.text(0.5, 0.3, why, ha="center", color=MUTED)
        return figure
    axes = figure.subplots(len(names), len(paths), sharex="col", sharey="row", squeeze=False)
    meant = False
    for i, name in enumerate(names):
        for k, path in enumerate(paths):
            meant |= _against(axes[i, k], columns[path][good], columns[name][good])
            _ranked(axes[i, k], result["figures"][name]["rank_correlation"][path])
        axes[i, 0].set_ylabel(_labelled(name, units))
    for k, path in enumerate(paths):
        unit = units.get(path)
        axes[-1, k].set_xlabel(path + (f", {unit}" if unit else ""))
    marks = "a dot: a run; rank: Spearman's correlation"
    figure.supxlabel(marks + ("; line: the mean" if meant else ""), fontsize=7.5, color=MUTED)
    return figure


def _labelled(name: str, units: Mapping[str, str]) -> str:
    """A figure in words with its unit; q_end_2 is that of A2."""
    stem, _, part = name.rpartition("_")
    unit = units.get(name) or units.get(stem) or ""
    after = f", {unit}" if unit not in ("", "1") else ""
    if name in _WORDS:
        return _WORDS[name] + after
    which = "xyz"[int(part) - 1] if stem == "position_end" else f"A{part}"
    return f"{_WORDS[stem]},\n{which}{after}"


def _chosen(figures: Mapping[str, Any]) -> list[str]:
    """The figures that vary, the telling ones first."""
    varying = [name for name, told in figures.items() if told and told["varies"]]
    first = [name for name in _PREFERRED if name in varying]
    return (first + [name for name in varying if name not in first])[:_MOST_FIGURES]


def _against(axis: Axes, x: Any, y: Any) -> bool:
    """Draw the runs, and their mean where it makes a line; whether it does."""
    axis.plot(x, y, "o", color=BLUE, ms=3.0, alpha=0.5 if len(x) > 50 else 0.9, mec="none",
              rasterized=len(x) > 5000)  # fmt: skip
    levels = np.unique(x)
    if 1 < len(levels) <= _LEVELS or (len(levels) == len(x) <= 200 and _is_curve(x)):
        axis.plot(levels, [np.nanmean(y[x == v]) for v in levels], color=INK, lw=1.0)
        return True
    return False


def _is_curve(x: Any) -> bool:
    """Whether values rise in equal steps, as the levels of a single number do."""
    steps = np.diff(x)
    return bool((steps > 0.0).all() and np.allclose(steps, steps[0], rtol=1e-6))


def _ranked(axis: Axes, rank: float | None) -> None:
    if rank is not None:
        axis.annotate(f"rank {rank:+.2f}", (1.0, 1.0), xycoords="axes fraction", ha="right",
                      va="bottom", fontsize=7, color=MUTED)  # fmt: skip
