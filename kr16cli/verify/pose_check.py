"""`kr16 verify poses FILE.csv`: somebody's recorded joint angles and poses against the model.

The recorded pose is taken as T_base_robroot fk(q) T_flange_tool with one unknown base and one
unknown tool (the robot-world/hand-eye problem): both are fitted, and what is left is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kr16cli import kuka, units
from kr16cli.errors import InputError
from kr16cli.robot import RobotData
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.rotations import Array, pose_gap
from kr16cli.verify.records import Outcome, Result

POSITION_MM = 1.0
ORIENTATION_DEG = 0.1
"""What is left after the fit may be this much: about the absolute accuracy of such an arm."""

_LEVER = 0.5  # m: weighs a rotation error as what it moves half a metre away
_LEAST = 4
_LEAST_ANGLE = units.rad(ORIENTATION_DEG)
_VARIED = 1e-3  # singular value, over the largest, below which base and tool cannot be told apart


@dataclass(frozen=True)
class PoseReport:
    """What recorded poses say: results, the fit, and one row a pose, in mm and degrees or SI."""

    results: list[Result]
    base: list[float]
    tool: list[float]
    recorded: dict[str, float]
    rows: list[dict[str, Any]]


@dataclass(frozen=True)
class _Shown:
    """In which units results are told."""

    length: str
    angle: str

    @property
    def si(self) -> bool:
        return self.length == "m"

    def gaps(self, prefix: str, position: float, angle: float) -> dict[str, float]:
        """A distance (m) and an angle (rad) by names that say their units."""
        names = (f"{prefix}position_{self.length}", f"{prefix}orientation_{self.angle}")
        values = (position, angle) if self.si else (units.mm(position), units.deg(angle))
        return dict(zip(names, map(float, values), strict=True))

    def limits(self) -> tuple[tuple[str, str, float, str], ...]:
        """(key, title, tolerance, unit) of what is judged after the fit."""
        limits = (POSITION_MM, ORIENTATION_DEG)
        if self.si:
            limits = (units.metres(POSITION_MM), units.rad(ORIENTATION_DEG))
        return (
            ("position", "Positions after the best fit of base and tool", limits[0], self.length),
            ("orientation", "Orientations after the best fit", limits[1], self.angle),
        )


def check(data: RobotData, q: Array, poses: Array, *, si: bool = False) -> PoseReport:
    """Judge recorded pairs.

    Args:
        data: the robot.
        q: joint angles (n, 6), rad.
        poses: recorded poses (n, 4, 4), m, of any tool in any base.
        si: whether results are told in m and rad, else in mm and degrees.

    Raises:
        InputError: too few pairs, or pairs from which base and tool cannot be told apart.
    """
    if len(q) < _LEAST:
        raise InputError(f"{len(q)} recorded poses; a fit of base and tool needs {_LEAST} or more")
    made = poe.flange(data.geometry, q)
    as_recorded = pose_gap(made, poses)
    keep = np.ones(len(q), dtype=bool)
    base, tool = _fit(made, poses, _closed_form(made, poses), robust=True)
    for _ in range(5):
        gaps = pose_gap(base @ made @ tool, poses)
        again = ~(_far(gaps[0], units.metres(POSITION_MM)) | _far(gaps[1], _LEAST_ANGLE))
        if again.sum() < _LEAST or (again == keep).all():
            break
        keep = again
        base, tool = _fit(made[keep], poses[keep], (base, tool), robust=False)
    position, angle = pose_gap(base @ made @ tool, poses)
    shown = _Shown("m", "rad") if si else _Shown("mm", "deg")
    rows = [
        {
            "row": i + 1,
            **shown.gaps("", position[i], angle[i]),
            **shown.gaps("recorded_", as_recorded[0][i], as_recorded[1][i]),
            "outlier": not bool(keep[i]),
        }
        for i in range(len(q))
    ]
    return PoseReport(
        results=_judged(q, rows, shown),
        base=kuka.pose_from_matrix(base.tolist(), si=si),
        tool=kuka.pose_from_matrix(tool.tolist(), si=si),
        recorded=shown.gaps("", as_recorded[0].max(), as_recorded[1].max()),
        rows=rows,
    )


def _far(gaps: Array, least: float) -> Array:
    """Residuals more than five robust standard deviations out, and more than `least`."""
    middle = float(np.median(gaps))
    spread = 1.4826 * float(np.median(np.abs(gaps - middle)))
    return np.asarray(gaps > max(middle + 5.0 * spread, least))


def _closed_form(made: Array, poses: Array) -> tuple[Array, Array]:
    """Base and tool that satisfy R_B R_i = R'_i R_T^T, linear in both; then the shifts.

    Raises:
        InputError: the orientations do not vary enough.
    """
    R, recorded = made[:, :3, :3], poses[:, :3, :3]
    blocks = []
    for a, b in zip(R, recorded, strict=True):
        blocks.append(np.hstack([np.kron(np.eye(3), a.T), -np.kron(b, np.eye(3))]))
    _, sigma, vectors = np.linalg.svd(np.vstack(blocks))
    if sigma[-2] < _VARIED * sigma[0]:
        raise InputError(
            "the recorded orientations do not tell base from tool; record poses that turn "
            "the flange about two or more axes"
        )
    one, other = vectors[-1][:9].reshape(3, 3), vectors[-1][9:].reshape(3, 3)
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3] = _rotation(one * np.sign(np.linalg.det(one)))
    tool[:3, :3] = _rotation(other * np.sign(np.linalg.det(other))).T
    # p'_i = R_B (R_i t_T + p_i) + t_B
    rows = np.vstack([np.hstack([base[:3, :3] @ a, np.eye(3)]) for a in R])
    right = (poses[:, :3, 3] - made[:, :3, 3] @ base[:3, :3].T).ravel()
    shifts = np.linalg.lstsq(rows, right, rcond=None)[0]
    tool[:3, 3], base[:3, 3] = shifts[:3], shifts[3:]
    return base, tool


def _rotation(matrix: Array) -> Array:
    """The rotation nearest to a matrix."""
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v)


def _fit(
    made: Array, poses: Array, start: tuple[Array, Array], *, robust: bool
) -> tuple[Array, Array]:
    """Least squares over both frames; a robust loss lets single wrong rows pull little."""
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    def frames(x: Array) -> tuple[Array, Array]:
        both = []
        for begin, part in zip(start, (x[:6], x[6:]), strict=True):
            frame = begin.copy()
            frame[:3, :3] = Rotation.from_rotvec(part[:3] / _LEVER).as_matrix() @ begin[:3, :3]
            frame[:3, 3] += part[3:]
            both.append(frame)
        return both[0], both[1]

    def residuals(x: Array) -> Array:
        base, tool = frames(x)
        found = base @ made @ tool
        turn = np.swapaxes(found[:, :3, :3], -1, -2) @ poses[:, :3, :3]
        angles = Rotation.from_matrix(turn).as_rotvec() * _LEVER
        return np.concatenate([(found[:, :3, 3] - poses[:, :3, 3]).ravel(), angles.ravel()])

    loss = {"loss": "cauchy", "f_scale": 1e-3} if robust else {}
    solved = least_squares(residuals, np.zeros(12), x_scale=1.0, xtol=1e-14, ftol=1e-14, **loss)
    return frames(solved.x)


def _judged(q: Array, rows: Sequence[dict[str, Any]], shown: _Shown) -> list[Result]:
    kept = [row for row in rows if not row["outlier"]]
    outliers = [row["row"] for row in rows if row["outlier"]]
    named = ", ".join(map(str, outliers)) or "none"
    found = [("outliers", "No row stands out", float(len(outliers)), 0.5, "rows",
              "five robust standard deviations, and beyond the tolerances below",
              f"rows that stand out: {named}", {"rows": outliers})]  # fmt: skip
    why = "about the absolute accuracy of such an arm; ours, as no figure is published"
    for key, title, limit, unit in shown.limits():
        values = [row[f"{key}_{unit}"] for row in kept]
        worst = kept[int(np.argmax(values))]
        angles = [units.deg(v) for v in q[worst["row"] - 1].tolist()]
        where = {"row": worst["row"], "command": f"kr16 fk {' '.join(map(repr, angles))}"}
        rms = float(np.sqrt(np.mean(np.square(values))))
        text = f"{len(kept)} of {len(rows)} rows; root mean square {rms:.3g} {unit}"
        found.append((key, title, max(values), limit, unit, why, text, where))
    return [_result(len(rows), *entry) for entry in found]


def _result(
    samples: int, name: str, title: str, error: float, tolerance: float, unit: str, reason: str,
    evidence: str, worst: dict[str, Any],
) -> Result:  # fmt: skip
    status: Outcome = "passed" if error <= tolerance else "failed"
    return Result(
        id=f"poses.{name}",
        group="poses",
        title=title,
        statement="T_recorded = T_base fk(q) T_tool for one base and one tool",
        regime="the recorded rows",
        method="least squares over base and tool, on the product of exponentials",
        grade="A",
        error=error,
        tolerance=tolerance,
        unit=unit,
        reason=reason,
        status=status,
        samples=samples,
        seed=0,
        worst=worst,
        evidence=evidence,
    )
