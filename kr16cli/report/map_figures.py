"""Pictures of maps: what `kr16 map --plot` writes. A finished map in, bytes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from kr16cli.report.style import INK, LINES, MUTED, styled
from kr16cli.study.map_sections import Outline, Section, outline, sections
from kr16cli.study.maps import MAIN, MapWork
from kr16cli.study.store import Store

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LABELS = {
    "branches": "branches within limits",
    "best": "best |det J|, m³",
    "condition_best": "condition number of J, best branch",
    "load_best": "largest static torque / limit, best branch",
    "mass_best": "payload that can be held at rest, best branch, kg",
}
_MOST_CONDITION = 100.0
"""Beyond this a posture is singular for every use; the colours end here."""
_PAGE, _SINGLE = (11.0, 8.4), (8.4, 6.8)


def drawn(work: MapWork, store: Store, result: Mapping[str, Any], name: str) -> bytes:
    """The picture of a map as PDF or PNG, by the suffix of `name`.

    Its bytes depend on the map alone: it carries no date.
    """
    out = BytesIO()
    with styled():
        figure = map_figure(work, sections(work, store), outline(work), result)
        if Path(name).suffix.lower() == ".png":
            figure.savefig(out, format="png", metadata={"Software": None})
        else:
            about = {"Title": _title(work), "Creator": "kr16 map", "CreationDate": None}
            figure.savefig(out, format="pdf", metadata=about)
    return out.getvalue()


def map_figure(
    work: MapWork,
    layers: Sequence[Section],
    edges: Outline,
    result: Mapping[str, Any],
) -> Figure:
    """Sections of a map; three of them get a view in space beside them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=_PAGE if len(layers) > 1 else _SINGLE, layout="constrained")
    figure.suptitle(_title(work), fontsize=11.0)
    width = 160 if len(layers) > 1 else 105
    figure.supxlabel(fill(_caption(work, result), width), fontsize=8.0, color=MUTED)
    values = [s.values[np.isfinite(s.values)] for s in layers]
    known = np.concatenate(values) if values else np.zeros(0)
    if not len(known):
        axis = figure.subplots()
        axis.set_axis_off()
        why = "nothing is reached in these sections" if layers else "a line has no section"
        axis.text(0.5, 0.5, why, ha="center", color=MUTED, transform=axis.transAxes)
        return figure
    scale = _Scale(work, known)
    places = [221, 222, 223] if len(layers) > 1 else [111]
    axes = [figure.add_subplot(place) for place in places]
    for axis, layer in zip(axes, layers, strict=True):
        _section(axis, layer, scale)
        if layer.normal == "y" and abs(layer.at) < 1e-9:
            _edges(axis, layer, edges)
    if len(layers) > 1:
        _space(figure.add_subplot(224, projection="3d"), layers, scale)
    bar = figure.colorbar(scale.mappable(), ax=axes, shrink=0.8, pad=0.02, location="left",
                          extend="max" if scale.clipped else "neither")  # fmt: skip
    bar.set_label(_LABELS[MAIN[work.quantity]])
    bar.outline.set_linewidth(0.5)
    scale.ticks(bar)
    return figure


class _Scale:
    """The colours of a picture: steps for counts, else a range that outliers do not stretch.

    `clipped`: some values lie above the range and have its last colour.
    """

    def __init__(self, work: MapWork, known: Any) -> None:
        from matplotlib import colormaps
        from matplotlib.colors import BoundaryNorm, LogNorm, Normalize

        self.counts = np.unique(known).astype(int) if work.quantity == "reach" else None
        self.clipped, self.logarithmic = False, work.quantity == "condition"
        if self.counts is not None:
            most = len(self.counts)
            ends = [0.5, *(self.counts[:-1] + self.counts[1:]) / 2, self.counts[-1] + 0.5]
            self.colours = colormaps["cividis"].resampled(most)
            self.norm: Any = BoundaryNorm(ends, most)
            return
        low, high = float(known.min()), float(np.percentile(known, 99.5))
        self.colours = colormaps["cividis"]
        if self.logarithmic:
            high = min(high, _MOST_CONDITION)
            self.norm = LogNorm(low, max(high, 1.01 * low))
        else:
            self.norm = Normalize(low, high if high > low else low + 1.0)
        self.clipped = bool(known.max() > self.norm.vmax)

    def mappable(self) -> Any:
        from matplotlib.cm import ScalarMappable

        return ScalarMappable(self.norm, self.colours)

    def ticks(self, bar: Any) -> None:
        if self.counts is not None:
            ends = self.norm.boundaries
            bar.set_ticks((ends[:-1] + ends[1:]) / 2, labels=[str(n) for n in self.counts])
        elif self.logarithmic:
            low, high = self.norm.vmin, self.norm.vmax
            some = [n * 10**k for k in range(13) for n in (1, 2, 5) if low <= n * 10**k <= high]
            bar.set_ticks(some, labels=[f"{n:g}" for n in some])
        bar.ax.minorticks_off()
        bar.ax.grid(visible=False)


def _section(axis: Axes, layer: Section, scale: _Scale) -> None:
    axis.pcolormesh(
        layer.u, layer.v, np.ma.masked_invalid(layer.values), norm=scale.norm,
        cmap=scale.colours, shading="nearest", rasterized=True,
    )  # fmt: skip
    axis.set(xlabel=f"{layer.across}, m", ylabel=f"{layer.up}, m", aspect="equal")
    axis.set_title(f"section {layer.normal} = {layer.at:.3g} m")
    axis.grid(visible=False)


def _edges(axis: Axes, layer: Section, edges: Outline) -> None:
    """The working envelope as lines, each with its own dashes; that behind the arm in thin ones."""
    for points in edges.behind.values():
        axis.plot(points[:, 0], points[:, 1], color="white", lw=1.6)
        axis.plot(points[:, 0], points[:, 1], color=INK, lw=0.6)
    for (name, points), dashes in zip(edges.front.items(), LINES, strict=False):
        axis.plot(points[:, 0], points[:, 1], color="white", lw=2.2)
        axis.plot(points[:, 0], points[:, 1], color=INK, ls=dashes, lw=1.0, label=name)
    axis.set_xlim(layer.u[0] - 0.05, layer.u[-1] + 0.05)
    axis.set_ylim(layer.v[0] - 0.05, layer.v[-1] + 0.05)
    whose = "envelope of this point" if edges.moved else "envelope of the wrist centre"
    half = ", A1 = 0; thin: A1 = 180 deg" if edges.behind else ", A1 = 0"
    axis.legend(title=whose + half, title_fontsize=7, fontsize=6.5, loc="upper center",
                bbox_to_anchor=(0.5, -0.13), ncols=3)  # fmt: skip


def _space(axis: Any, layers: Sequence[Section], scale: _Scale) -> None:
    """The same layers where they stand in space."""
    from matplotlib.ticker import MaxNLocator

    spans: dict[str, tuple[float, float]] = {}
    for layer in layers:
        stride = max(1, max(layer.values.shape) // 60)
        shown = layer.values[::stride, ::stride]
        u, v = np.meshgrid(layer.u[::stride], layer.v[::stride])
        places = {layer.across: u, layer.up: v, layer.normal: np.full_like(u, layer.at)}
        known = np.isfinite(shown)
        faces = scale.colours(scale.norm(np.where(known, shown, scale.norm.vmin or 0.0)))
        faces[~known] = (0, 0, 0, 0)
        axis.plot_surface(
            places["x"], places["y"], places["z"], facecolors=faces, shade=False,
            rstride=1, cstride=1, linewidth=0, antialiased=False, rasterized=True,
        )  # fmt: skip
        for name, place in places.items():
            low, high = spans.get(name, (np.inf, -np.inf))
            if known.any():
                low, high = min(low, place[known].min()), max(high, place[known].max())
            spans[name] = (float(low), float(high))
    for name, (low, high) in spans.items():
        axis.set(**{f"{name}lim": (low, high), f"{name}label": f"{name}, m"})
        getattr(axis, f"{name}axis").set_major_locator(MaxNLocator(4, prune="both"))
        axis.tick_params(axis=name, labelsize=7, pad=0)
    axis.set_title("the three sections in space")
    axis.set_box_aspect([max(high - low, 1e-3) for low, high in spans.values()], zoom=1.05)
    axis.view_init(24, -60)


def _title(work: MapWork) -> str:
    return f"{work.quantity.capitalize()} of {work.data.name}: {work.point}, {_orientation(work)}"


def _orientation(work: MapWork) -> str:
    count = len(work.grid.rotations)
    if work.grid.kind == "free":
        return f"best of {count} orientations"
    z = work.grid.rotations[0][:, 2]
    pointing = ", ".join(f"{v + 0.0:.2g}" for v in np.round(z, 6))
    first = "the first of several orientations, " if count > 1 else ""
    return f"{first}z axis along ({pointing})"


def _caption(work: MapWork, result: Mapping[str, Any]) -> str:
    parts = [
        f"{result['poses']} poses on a grid of {work.grid.step:g} m, "
        f"{100 * result['share']:.1f} % of the points reached within the joint limits, white: not"
    ]
    if work.quantity == "condition":
        parts.append(f"linear rows of J over a length of {work.length:g} m")
    if work.quantity == "payload":
        com = work.payload.com if work.payload else (0.0, 0.0, 0.0)
        parts.append("mass centre at ({:g}, {:g}, {:g}) m of the flange".format(*com))
        rated = work.data.ratings.get("payload_kg")
        parts.append(f"rated, in motion: {rated:g} kg" if rated else "at rest")
    if work.quantity == "torque":
        mass = work.payload.mass if work.payload else 0.0
        parts.append(f"at rest with {mass:g} kg")
    parts.append(f"model {work.data.sha256[:12]}")
    return "; ".join(parts)
