"""Pictures of sweeps and uncertainty: answers in, figures and bytes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kr16cli.report.style import BLUE, INK, MUTED, ORANGE, styled
from kr16cli.units import RAD_PER_DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_A4 = (8.27, 11.69)
_MOST_BARS = 10
_MOST_POSES = 3


def trust_drawn(answer: Mapping[str, Any], name: str) -> bytes:
    """The picture of `kr16 uncertainty`, PDF or PNG by the suffix of `name`; no date in it."""
    with styled():
        figure = trust_figure(answer)
        return saved(figure, name, f"Uncertainty, {answer['robot']}", "kr16 uncertainty")


def saved(figure: Figure, name: str, title: str, creator: str) -> bytes:
    """A figure as the bytes of a file, which depend on its content alone."""
    out = BytesIO()
    if Path(name).suffix.lower() == ".png":
        figure.savefig(out, format="png", metadata={"Software": None})
    else:
        about = {"Title": title, "Creator": creator, "CreationDate": None}
        figure.savefig(out, format="pdf", metadata=about)
    return out.getvalue()


def trust_figure(answer: Mapping[str, Any]) -> Figure:
    """Bands of gravity torque and what matters most; along a motion, bands of every joint."""
    from matplotlib.figure import Figure

    result = answer["result"]
    columns = [name for name in ("torque", "motion") if name in result]
    figure = Figure(figsize=_A4 if columns else (_A4[0], 4.6), layout="constrained")
    figure.suptitle(
        f"{answer['robot']}: {result['samples']} robots drawn from the tolerances, "
        f"{answer['input']['distribution']}",
        fontsize=10.5,
    )
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.0, 2.2)) if columns else [figure]
    left, right = parts[0].subplots(1, 2, width_ratios=(1.0, 1.25))
    gravity_bands(left, result)
    left.set_xlabel(_poses(result["poses_deg"]), fontsize=7.5, color=MUTED)
    # Below: marks may be anywhere within the axes.
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=7)
    importance_bars(right, result)
    if columns:
        axes = np.atleast_2d(parts[1].subplots(6, len(columns), sharex="col", squeeze=False))
        labels = {"torque": "torque that the nominal motion needs, N m", "motion": "path, deg"}
        for k, column in enumerate(columns):
            for j, joint in enumerate(result["joints"]):
                scale = 1.0 if column == "torque" else 1.0 / RAD_PER_DEG
                band(axes[j, k], result[f"{column}_time"], result[column], j, scale)
                axes[j, k].set_ylabel(joint, rotation=0, ha="right", va="center")
            axes[0, k].set_title(labels[column])
            axes[-1, k].set_xlabel("time, s")
        lines, labels_ = axes[0, 0].get_legend_handles_labels()
        parts[1].legend(lines, labels_, loc="outside lower center", ncols=3)
    return figure


def gravity_bands(axis: Axes, result: Mapping[str, Any]) -> None:
    """Nominal gravity torques with both 95 % bands, a mark for each pose; the legend is not set."""
    gravity, joints = result["gravity"], result["joints"]
    count = len(result["poses_deg"])
    for i in range(count):
        shift = (i - (count - 1) / 2) * 0.7 / count
        place = np.arange(6) + shift
        nominal, low, high = (np.array(gravity[k][i]) for k in ("nominal", "low", "high"))
        two = 2.0 * np.array(gravity["sigma_first_order"][i])
        axis.errorbar(place - 0.06, nominal, [nominal - low, high - nominal], fmt="o", ms=3.5,
                      color=BLUE, capsize=3, label="samples, 95 %" if i == 0 else None)  # fmt: skip
        axis.errorbar(place + 0.06, nominal, two, fmt="s", ms=3.5, color=ORANGE, capsize=3,
                      ls="none", label="first order, two sigma" if i == 0 else None)  # fmt: skip
    axis.axhline(0.0, color=MUTED, lw=0.6)
    axis.set_xticks(range(6), joints)
    axis.set_ylabel("N m")
    axis.set_title("gravity torque")


def _poses(poses: Sequence[Sequence[float]]) -> str:
    """Which angles the marks belong to."""
    words = [" ".join(f"{v:.4g}" for v in pose) for pose in poses[:_MOST_POSES]]
    more = "; ..." if len(poses) > _MOST_POSES else ""
    return ("left to right: " if len(words) > 1 else "at ") + "; ".join(words) + more + " deg"


def importance_bars(axis: Axes, result: Mapping[str, Any]) -> None:
    """Shares of the variance of the leading joint's gravity torque, largest first."""
    joint = result["joints"].index(result["leading_joint"])
    rows = [r for r in result["parameters"] if r["gravity_sobol_total"][joint] >= 0.001]
    rows = rows[:_MOST_BARS]
    place = np.arange(len(rows))
    kinds = (
        ("first_order", "first order", BLUE, ""),
        ("sobol_total", "Sobol, total", ORANGE, "////"),
    )
    for k, (key, label, colour, hatch) in enumerate(kinds):
        shares = [100.0 * r[f"gravity_{key}"][joint] for r in rows]
        bars = axis.barh(place + (k - 0.5) * 0.38, shares, height=0.34, color=colour, hatch=hatch,
                         edgecolor="white", lw=0.4, label=label)  # fmt: skip
        axis.bar_label(bars, fmt="%.1f", padding=2, fontsize=6.5, color=MUTED)
    axis.set_yticks(place, [_named(r) for r in rows])
    axis.invert_yaxis()
    axis.margins(x=0.12)
    axis.set_xlabel("share of the variance, %")
    axis.set_title(f"what moves the torque of {result['leading_joint']}")
    axis.grid(visible=False, axis="y")
    axis.legend(loc="lower right")


def _named(row: Mapping[str, Any]) -> str:
    """A parameter with its tolerance."""
    if row["unit"] == "relative":
        return f"{row['name']} ± {100.0 * row['half']:g} %"
    return f"{row['name']} ± {row['half']:g} {row['unit']}"


def band(axis: Axes, time: Sequence[float], column: Mapping[str, Any], joint: int, scale: float
         ) -> None:  # fmt: skip
    """A nominal curve with the band of the samples and the lines of first order."""
    nominal, low, high, sigma = (
        scale * np.array(column[k])[:, joint]
        for k in ("nominal", "low", "high", "sigma_first_order")
    )
    axis.fill_between(time, low, high, color=BLUE, alpha=0.25, lw=0, label="samples, 95 %")
    axis.plot(time, nominal, color=INK, lw=1.0, label="nominal")
    for side, label in ((-2.0, "first order, two sigma"), (2.0, None)):
        axis.plot(time, nominal + side * sigma, color=ORANGE, ls=(0, (4, 2)), lw=0.9, label=label)
    spread = float(np.ptp(np.concatenate([low, high])))
    margin = 0.15 * spread if spread > 1e-9 else 1.0
    axis.set_ylim(float(low.min()) - margin, float(high.max()) + margin)
    axis.margins(x=0.0)
