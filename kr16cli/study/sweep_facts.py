"""A finished sweep in a few numbers: extremes of every figure, and what moves it."""

from __future__ import annotations

from typing import Any

import numpy as np

from kr16cli.arrays import Array
from kr16cli.study.store import Store
from kr16cli.study.sweep import SweepWork, flat_columns

SCHEMA = "kr16.sweep/1"
VARIES = 1e-6
"""A figure whose spread is less than this part of it stands still: solvers' tolerance moves it."""
_SHOWN = 5


def whole(work: SweepWork, store: Store) -> dict[str, Array]:
    """Every column of a finished sweep, a number each; a run takes half a kilobyte."""
    parts = [flat_columns(work, chunk) for chunk in store.chunks()]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def answer(work: SweepWork, columns: dict[str, Array]) -> dict[str, Any]:
    """The JSON answer of `kr16 sweep`.

    Args:
        work: the sweep.
        columns: of `whole`.
    """
    from kr16cli.robot_file import parse_data

    data = parse_data(work.tables.robot, work.path)
    good = columns["status"] == "ok"
    units = {name: column.unit for name, column in work.columns().items() if column.unit}
    varied = [v.path for v in work.design.variables]
    names = [n for n in columns if n not in (*varied, "engine", "status")]
    engines, runs = np.unique(columns["engine"][columns["engine"] != ""], return_counts=True)
    return {
        "schema": SCHEMA,
        "robot": data.name,
        "model_sha256": data.sha256,
        "units": units,
        "input": work.describe(),
        "result": {
            "runs": work.rows,
            "failed": int((~good).sum()),
            "design": work.design.kind,
            "engines": dict(zip(engines.tolist(), runs.tolist(), strict=True)),
            "why_simulator": work.unserved,
            "vary": {
                path: {"least": float(columns[path].min()), "largest": float(columns[path].max())}
                for path in varied
            },
            "figures": {name: _told(columns, name, varied, good) for name in names},
            "failures": _failures(columns, varied, good),
        },
        "warnings": [],
    }


def _told(
    columns: dict[str, Array], name: str, varied: list[str], good: Any
) -> dict[str, Any] | None:
    """Least, mean, largest and standard deviation over the good runs, and rank correlations."""
    values = columns[name].astype(float)
    there = good & np.isfinite(values)
    if not there.any():
        return None
    known = values[there]
    return {
        "least": float(known.min()) + 0.0,
        "mean": float(known.mean()) + 0.0,
        "largest": float(known.max()) + 0.0,
        "sigma": float(known.std()) + 0.0,
        "varies": bool(np.ptp(known) > VARIES * np.abs(known).max()),
        "rank_correlation": {
            path: _rank_correlation(columns[path][there], known) for path in varied
        },
    }


def _rank_correlation(x: Array, y: Array) -> float | None:
    """Spearman's; None where one of them stands still but for rounding."""
    from scipy.stats import rankdata

    scale = max(float(np.abs(y).max()), 1e-300)
    if len(x) < 3 or np.ptp(x) == 0.0 or np.ptp(y) <= VARIES * scale:
        return None
    a, b = rankdata(x), rankdata(y)
    return float(np.corrcoef(a, b)[0, 1])


def _failures(columns: dict[str, Array], varied: list[str], good: Any) -> list[dict[str, Any]]:
    """The first few runs that failed, with their values."""
    return [
        {
            "run": int(i) + 1,
            "values": {path: float(columns[path][i]) for path in varied},
            "reason": str(columns["status"][i]),
        }
        for i in np.flatnonzero(~good)[:_SHOWN]
    ]
