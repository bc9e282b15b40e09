"""A finished uncertainty study in numbers: bands, both ways compared, and what matters most."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kr16cli.arrays import Array
from kr16cli.robot import RobotData
from kr16cli.study.open_runs import answered
from kr16cli.study.session import write_npz
from kr16cli.study.spread import standard, taken_as_exact
from kr16cli.study.store import Store, whole_file
from kr16cli.study.uncertainty import UncertaintyWork, shares, sobol, work_for
from kr16cli.study.work import Chunk, in_memory
from kr16cli.units import deg

SCHEMA = "kr16.uncertainty/1"
FEW = 100
"""Of fewer samples, the ends of a band are nearly the outermost ones."""

_BAND = (2.5, 50.0, 97.5)  # per cent of the samples: the 95 % band and its middle
_AGREEING = 0.1
_JOINTS = ("A1", "A2", "A3", "A4", "A5", "A6")


def answer(work: UncertaintyWork, store: Store | None = None) -> dict[str, Any]:
    """The JSON answer of `kr16 uncertainty`.

    Args:
        work: the study.
        store: complete; None computes the samples here.
    """
    result = _result(work, _columns(work, store))
    return {
        "schema": SCHEMA,
        "robot": work.data.name,
        "model_sha256": work.data.sha256,
        "units": {
            "gravity": "N m", "mass_matrix": "kg m2", "torque": "N m", "motion": "rad",
            "time": "s", "q_deg": "deg", "half": "relative, or SI",
        },
        "input": work.describe(),
        "result": result,
        "warnings": _warnings(work, result),
    }  # fmt: skip


def record(data: RobotData, samples: int = 1000) -> dict[str, Any]:
    """The answer for home and the forward stretched arm: what a report shows of any robot."""
    poses = np.radians([(0.0, -90.0, 90.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)])
    return answer(work_for(data, poses[::-1].copy(), samples))


def _columns(work: UncertaintyWork, store: Store | None) -> Chunk:
    """Whole columns; a sample takes some kilobytes."""
    names = [name for name in work.columns() if name != "deviation"]
    if store is not None:
        return {name: np.concatenate(list(store.column(name))) for name in names}
    parts = list(in_memory(work))
    return {name: np.concatenate([part[name] for part in parts]) for name in names}


def _result(work: UncertaintyWork, columns: Chunk) -> dict[str, Any]:
    sigma = standard(work.sources, work.distribution)
    slopes = work.slopes()
    nominal = work.answers(work.family(np.zeros((1, len(sigma)))))
    compared = {
        name: _compared(columns[name], nominal[name][0], slopes[name], sigma) for name in columns
    }
    indices = sobol(work)
    gravity = shares(slopes["gravity"][:, 0], sigma, ())
    table = [
        {
            "name": source.name,
            "half": source.half,
            "unit": source.unit,
            "gravity_first_order": gravity[i].tolist(),
            "gravity_sobol_first": indices["first"][:, i].tolist(),
            "gravity_sobol_total": indices["total"][:, i].tolist(),
        }
        for i, source in enumerate(work.sources)
    ]
    if "torque" in slopes:
        along = shares(slopes["torque"], sigma, (0,))
        for row, values in zip(table, along, strict=True):
            row["torque_first_order"] = values.tolist()
    leading = int(np.argmax(compared["gravity"]["sigma_first_order"][0]))
    table.sort(key=lambda row: -row["gravity_sobol_total"][leading])
    return {
        "samples": work.samples,
        "joints": list(_JOINTS),
        "poses_deg": [[deg(v) + 0.0 for v in pose] for pose in work.poses.tolist()],
        **{name: _plain(values) for name, values in compared.items()},
        "torque_time": None if work.motion is None else work.motion.time.tolist(),
        "motion_time": None if work.steps is None else work.steps.time.tolist(),
        "agree_until": _agreeing(work, compared),
        "leading_joint": _JOINTS[leading],
        "parameters": table,
    }


def _compared(samples: Array, nominal: Array, slopes: Array, sigma: Array) -> dict[str, Any]:
    """Nominal value, band and both standard deviations of a column, and how far they differ."""
    by_samples = samples.std(axis=0, ddof=1)
    first = np.sqrt(((slopes * sigma.reshape(-1, *[1] * (slopes.ndim - 1))) ** 2).sum(axis=0))
    low, middle, high = np.percentile(samples, _BAND, axis=0)
    largest = float(first.max())
    return {
        "nominal": nominal,
        "low": low,
        "median": middle,
        "high": high,
        "sigma": by_samples,
        "sigma_first_order": first,
        # Of the largest spread: where a value hardly varies, a ratio would be noise.
        "disagreement": float(np.abs(by_samples - first).max() / largest) if largest else 0.0,
    }


def _agreeing(work: UncertaintyWork, compared: dict[str, dict[str, Any]]) -> float | None:
    """The time (s) up to which both standard deviations of the motion differ by at most 10 %.

    Of the largest one at each time, and beyond what so few samples leave open (two standard
    errors, 1 / sqrt(2 (n - 1)) each); None without a motion.
    """
    if work.steps is None:
        return None
    found = compared["motion"]
    first = found["sigma_first_order"]
    gap = np.abs(found["sigma"] - first).max(axis=1)
    # At the start all robots are in one state, up to rounding.
    allowed = _AGREEING + 2.0 / np.sqrt(2.0 * (work.samples - 1))
    apart = np.flatnonzero(gap > allowed * first.max(axis=1) + 1e-12)
    last = len(gap) if not len(apart) else int(apart[0])
    return float(work.steps.time[max(0, last - 1)])


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    return {k: (np.asarray(v) + 0.0).tolist() for k, v in values.items()}


def _warnings(work: UncertaintyWork, result: dict[str, Any]) -> list[str]:
    texts = taken_as_exact(work.data, drives=work.drives)
    if work.samples < FEW:
        texts.append(f"{work.samples} robots drawn are few for bands of 95 %; draw {FEW} or more")
    if work.scenario is not None and work.steps is None:
        texts.append(
            f"{answered(work.scenario)}: its torque has bands, its path is taken as the nominal one"
        )
    until = result["agree_until"]
    if work.steps is not None and until < work.steps.time[-1]:
        when = f"from {until:.3g} s on" if until > 0.0 else "from the start"
        texts.append(
            f"first order misses the spread of the path by more than 10 % {when}; there the "
            "samples alone tell"
        )
    return texts


def write(
    path: str | Path, work: UncertaintyWork, store: Store, answer_: Mapping[str, Any]
) -> None:
    """Write every sample and the answer as npz: a column an array, samples first.

    Raises:
        FileError: it cannot be written; the chunks are kept.
    """
    extra: dict[str, Any] = {"poses": work.poses, "sources": [s.name for s in work.sources]}
    if work.motion is not None:
        extra["torque_time"] = work.motion.time
    if work.steps is not None:
        extra["motion_time"] = work.steps.time
    with whole_file(Path(path), f"all {store.total} chunks are kept in {store.folder}") as file:
        write_npz(file, store, (work.rows,), extra, answer_)
