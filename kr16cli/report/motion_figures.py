"""Pictures of a motion: what `kr16 simulate --plot` writes. Runs in, figures out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from kr16cli.errors import MissingPartError
from kr16cli.robot import JointData
from kr16cli.simulate.run import Run
from kr16cli.study.bands import Bands
from kr16cli.units import RAD_PER_DEG, mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_A4 = (8.27, 11.69)
_INK, _WANTED, _LIMIT = "#1f3b73", "#c8501e", "#9a9a9a"
_BAND: dict[str, Any] = {"color": _INK, "alpha": 0.22, "lw": 0}
_STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "axes.formatter.useoffset": False,
    "pdf.fonttype": 42,
}
_NEAR = 0.6
"""A limit is drawn where the motion uses this part of the range, or where it is passed."""


def require_matplotlib() -> None:
    """MissingPartError where matplotlib is not installed."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise MissingPartError("matplotlib", "report")


@contextmanager
def _styled() -> Iterator[None]:
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):
        yield


def motion_pdf(run: Run, joints: Sequence[JointData], bands: Bands | None = None) -> bytes:
    """A PDF of two pages: the joints, and the flange with errors and energies.

    Its bytes depend on what is given alone: it carries no date.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    name = str(run.scenario["name"])
    about = {"Title": f"{name}, {run.robot}", "Creator": "kr16 simulate", "CreationDate": None}
    out = BytesIO()
    with _styled(), PdfPages(out, metadata=about) as pages:
        for figure in (joint_figure(run, joints, bands), flange_figure(run)):
            pages.savefig(figure)
    return out.getvalue()


def joint_figure(run: Run, joints: Sequence[JointData], bands: Bands | None = None) -> Figure:
    """Angle, speed and torque of each joint over time, with reference and limits.

    Args:
        run: the motion.
        joints: the robot's.
        bands: of the torque; their words stand below the figure.
    """
    with _styled():
        figure = _page()
        figure.suptitle(_heading(run), fontsize=10.0)
        axes = figure.subplots(6, 3, sharex=True)
        half = None if bands is None else bands.half
        for i, joint in enumerate(joints):
            angle, speed, torque = axes[i]
            angle.set_ylabel(joint.name, rotation=0, ha="right", va="center", fontweight="bold")
            _angles(angle, run, i, joint)
            _curve(speed, run.time, run.qd[:, i] / RAD_PER_DEG)
            _settle(speed)
            _limits(speed, _degrees(joint.speed))
            _curve(torque, run.time, run.tau[:, i])
            if half is not None:
                low, high = run.tau[:, i] - half[:, i], run.tau[:, i] + half[:, i]
                torque.fill_between(run.time, low, high, **_BAND)
            _settle(torque)
            _limits(torque, joint.torque)
            _mark_events(axes[i], run, joint.name)
        for axis, title in zip(axes[0], ("angle, deg", "speed, deg/s", "torque, N m"), strict=True):
            axis.set_title(title)
        for axis in axes[-1]:
            axis.set_xlabel("time, s")
        words = None if bands is None else fill(bands.words, 120)
        figure.legend(*_legend(run, banded=half is not None), loc="outside lower center",
                      ncols=5, title=words, title_fontsize=7.5)  # fmt: skip
    return figure


def flange_figure(run: Run) -> Figure:
    """The flange's path from above and from the side, errors over time, and energies."""
    with _styled():
        figure = _page()
        figure.suptitle(_heading(run), fontsize=10.0)
        axes = figure.subplots(3, 2)
        x, y, z = (mm(1.0) * run.pose[:, k] for k in range(3))
        _path(axes[0, 0], (x, y), ("x, mm", "y, mm"), "flange from above")
        if np.ptp(y) > np.ptp(x):
            _path(axes[0, 1], (y, z), ("y, mm", "z, mm"), "flange from behind")
            axes[0, 1].invert_xaxis()  # y is to the left of who looks forward
        else:
            _path(axes[0, 1], (x, z), ("x, mm", "z, mm"), "flange from the side")
        _place(axes[1, 0], run, (x, y, z))
        _errors(axes[1, 1], run)
        _energies(axes[2, 0], run)
        _drift(axes[2, 1], run)
    return figure


def _page() -> Figure:
    """An empty A4 page with margins."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    margins = (0.03, 0.02, 0.94, 0.96)  # left, bottom, width, height
    return Figure(figsize=_A4, layout=ConstrainedLayoutEngine(rect=margins))


def _heading(run: Run) -> str:
    state = "" if run.complete else f"; INCOMPLETE: {run.failure or run.stopped}"
    name = run.scenario["name"]
    return f"{name} - {run.robot}, model {run.model_sha256[:12]}, {run.time[-1]:g} s{state}"


def _degrees(value: float | None) -> float | None:
    return None if value is None else value / RAD_PER_DEG


def _curve(axis: Axes, time: Any, values: Any, **style: Any) -> None:
    axis.plot(time, values, color=style.pop("color", _INK), **style)


def _settle(axis: Axes) -> None:
    """Time to its ends; and curves that only round must not look like a motion."""
    axis.margins(x=0.0)
    low, high = axis.get_ylim()
    least = 1e-3 * max(1.0, abs(low), abs(high))
    if high - low < 2.0 * least:
        middle = 0.5 * (low + high)
        axis.set_ylim(middle - least, middle + least)


def _angles(axis: Axes, run: Run, i: int, joint: JointData) -> None:
    """One joint's angle, its reference on top, and the limits it comes near."""
    _curve(axis, run.time, run.q[:, i] / RAD_PER_DEG)
    if run.q_ref is not None:
        _curve(axis, run.time, run.q_ref[:, i] / RAD_PER_DEG, color=_WANTED, ls=(0, (4, 3)))
    _settle(axis)
    reach = run.q[:, i]
    middle, half = 0.5 * (joint.lower + joint.upper), 0.5 * (joint.upper - joint.lower)
    for limit, used in (
        (joint.lower, (middle - reach.min()) / half),
        (joint.upper, (reach.max() - middle) / half),
    ):
        if used > _NEAR:
            axis.axhline(limit / RAD_PER_DEG, color=_LIMIT, ls=":", lw=1.2)


def _limits(axis: Axes, limit: float | None) -> None:
    """The limits +-`limit` that the curve comes near."""
    if limit is None:
        return
    low, high = axis.get_ylim()
    for value, used in ((-limit, -low / limit), (limit, high / limit)):
        if used > _NEAR:
            axis.axhline(value, color=_LIMIT, ls=":", lw=1.2)


def _mark_events(axes: Sequence[Axes], run: Run, name: str) -> None:
    for event in run.events:
        if event.joint in (name, "all"):
            for axis in axes:
                axis.axvline(event.time, color="#2c8c5a", lw=0.8)


def _legend(run: Run, *, banded: bool) -> tuple[list[Any], list[str]]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    known: list[tuple[str, Any]] = [("motion", Line2D([], [], color=_INK))]
    if run.q_ref is not None:
        known.append(("reference", Line2D([], [], color=_WANTED, ls=(0, (4, 3)))))
    if banded:
        known.append(("band", Patch(**_BAND)))
    known.append(("limit, where near", Line2D([], [], color=_LIMIT, ls=":")))
    if run.events:
        known.append(("limit passed, target reached", Line2D([], [], color="#2c8c5a", lw=0.8)))
    return [line for _, line in known], [text for text, _ in known]


def _path(axis: Axes, point: tuple[Any, Any], names: tuple[str, str], title: str) -> None:
    """A projection of the path, lengths to scale, start and end marked."""
    u, v = point
    axis.plot(u, v, color=_INK)
    axis.plot(u[0], v[0], "o", color=_INK, ms=5, label="start")
    axis.plot(u[-1], v[-1], "s", color=_WANTED, ms=5, label="end")
    axis.set(xlabel=names[0], ylabel=names[1], title=title)
    middle = [0.5 * (w.min() + w.max()) for w in (u, v)]
    half = max(0.55 * max(np.ptp(u), np.ptp(v)), 5.0)
    axis.set_xlim(middle[0] - half, middle[0] + half)
    axis.set_ylim(middle[1] - half, middle[1] + half)
    axis.set_aspect("equal")
    axis.legend()


def _place(axis: Axes, run: Run, place: tuple[Any, Any, Any]) -> None:
    lines = ("-", (0, (6, 2)), (0, (1, 1.2)))
    colours = (_INK, _WANTED, "#2c8c5a")
    for name, values, line, colour in zip("xyz", place, lines, colours, strict=True):
        _curve(axis, run.time, values - values[0], ls=line, color=colour, label=name)
    _settle(axis)
    axis.set(xlabel="time, s", ylabel="mm", title="flange, from where it started")
    axis.legend(ncols=3)


def _errors(axis: Axes, run: Run) -> None:
    """Distance and angle between the flange and its reference."""
    if run.error is None:
        axis.set_axis_off()
        axis.text(0.5, 0.5, "no reference", ha="center", color=_LIMIT, transform=axis.transAxes)
        return
    _curve(axis, run.time, mm(1.0) * run.error[:, 0], label="distance, mm")
    angle = 1000.0 * run.error[:, 1]
    _curve(axis, run.time, angle, color=_WANTED, ls=(0, (4, 3)), label="angle, mrad")
    _settle(axis)
    largest = max(mm(1.0) * run.error[:, 0].max(), angle.max())
    if largest < 1e-3:  # less is rounding and solver tolerance
        axis.set_ylim(0.0, 1e-3)
    else:
        axis.set_ylim(0.0, 1.08 * largest)
    axis.set(xlabel="time, s", title="flange, from its reference")
    axis.legend()


def _energies(axis: Axes, run: Run) -> None:
    gained = run.energy_potential - run.energy_potential[0]
    parts = [
        ("kinetic", run.energy_kinetic, "-", _INK),
        ("potential", gained, (0, (6, 2)), _WANTED),
        ("work of torques", run.work_torque, (0, (1, 1.2)), "#2c8c5a"),
        ("lost in friction", run.work_friction, "-.", "#7a5195"),
        ("work of the wrench", run.work_wrench, (0, (3, 1, 1, 1, 1, 1)), "#555555"),
        ("work of the stops", run.work_contact, (0, (5, 1)), "#b0892b"),
    ]
    for name, values, line, colour in parts:
        if name in ("kinetic", "potential") or np.any(values):
            _curve(axis, run.time, values, ls=line, color=colour, label=name)
    _settle(axis)
    axis.set(xlabel="time, s", ylabel="J", title="energies and works since the start")
    axis.legend()


def _drift(axis: Axes, run: Run) -> None:
    _curve(axis, run.time, run.drift)
    _settle(axis)
    largest = float(np.abs(run.drift).max())
    axis.set_ylim(*((-1.1 * largest, 1.1 * largest) if largest else (-1e-9, 1e-9)))
    axis.ticklabel_format(axis="y", scilimits=(-2, 3))
    solver = run.statistics
    accuracy = f"rtol {solver.rtol:g}" if solver.step is None else f"step {solver.step:g} s"
    axis.set(
        xlabel="time, s",
        ylabel="J",
        title=f"energy no work explains ({solver.method}, {accuracy})",
    )
