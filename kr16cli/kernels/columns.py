"""The NumPy engine: model functions over columns, one array per scalar of the model.

Batches are cut into chunks whose temporaries stay in the cache; chunks may run in threads.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from kr16cli.kernels.parameters import Parameters
from kr16cli.kernels.quantities import ANGLES, Quantity
from kr16cli.model.scalars import Functions

Array = npt.NDArray[np.float64]
CHUNK = 4096
"""Configurations per chunk: long enough to hide NumPy's cost per call, short enough that the
temporaries stay in the core's cache (2048 and 8192 measured slower or equal)."""

ARRAYS = Functions(sqrt=np.sqrt, sin=np.sin, cos=np.cos, atan2=np.arctan2, where=np.where, pi=np.pi)
"""The functions of NumPy arrays."""


def _columns(block: Array, *, angles: bool) -> Sequence[Any]:
    columns = np.ascontiguousarray(block.T)
    if angles:
        return list(zip(np.cos(columns), np.sin(columns), strict=True))
    return list(columns)


class ColumnEngine:
    """Runs quantities over flat batches."""

    def run(
        self,
        quantity: Quantity,
        numbers: Parameters,
        inputs: Sequence[Array | None],
        out: Array,
        threads: int = 1,
    ) -> None:
        """Fill `out` (n, m) with the results of a quantity on inputs (n, k); None is zeros."""
        n, width = out.shape
        starts = range(0, n, CHUNK)

        def arguments(lo: int, hi: int) -> list[Sequence[Any]]:
            return [
                ((1.0, 0.0),) * 6 if v is None else _columns(v[lo:hi], angles=name in ANGLES)
                for name, v in zip(quantity.inputs, inputs, strict=True)
            ]

        def work(part: range) -> None:
            # Columns are gathered first: one transposed copy is twice as fast as strided stores.
            gathered = np.empty((width, min(CHUNK, n)))
            for lo in part:
                hi = min(lo + CHUNK, n)
                # Lanes that a `where` discards, and poses far out of reach, may overflow.
                with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                    results = quantity.results(numbers, *arguments(lo, hi), ARRAYS)
                    for row, column in zip(gathered, results, strict=True):
                        row[: hi - lo] = column
                out[lo:hi] = gathered[:, : hi - lo].T

        if threads <= 1 or len(starts) <= 1:
            work(starts)
            return
        with ThreadPoolExecutor(threads) as pool:
            for _ in pool.map(work, (starts[i::threads] for i in range(threads))):
                pass
