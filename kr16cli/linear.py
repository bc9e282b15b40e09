"""Two small-matrix routines on floats, for single queries that import no NumPy."""

from __future__ import annotations

import math
from collections.abc import Sequence

from kr16cli.errors import NoAnswerError

_SWEEPS = 60


def inverse(rows: Sequence[Sequence[float]]) -> list[list[float]]:
    """Inverse by Gauss-Jordan with partial pivoting; NoAnswerError if exactly singular."""
    n = len(rows)
    work = [
        [*map(float, row), *(1.0 if i == j else 0.0 for j in range(n))]
        for i, row in enumerate(rows)
    ]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(work[k][i]))
        if work[pivot][i] == 0.0:
            raise NoAnswerError("the matrix is singular: it has no inverse here")
        work[i], work[pivot] = work[pivot], work[i]
        work[i] = [v / work[i][i] for v in work[i]]
        for k in range(n):
            if k != i and work[k][i] != 0.0:
                factor = work[k][i]
                work[k] = [a - factor * b for a, b in zip(work[k], work[i], strict=True)]
    return [row[n:] for row in work]


def singular_values(rows: Sequence[Sequence[float]]) -> list[float]:
    """Singular values, largest first, by one-sided Jacobi (Hestenes 1958)."""
    columns = [list(map(float, column)) for column in zip(*rows, strict=True)]
    for _ in range(_SWEEPS):
        turned = False
        for i in range(len(columns)):
            for j in range(i + 1, len(columns)):
                a, b = columns[i], columns[j]
                aa, bb = _dot(a, a), _dot(b, b)
                ab = _dot(a, b)
                if abs(ab) <= 1e-16 * math.sqrt(aa * bb) or ab == 0.0:
                    continue
                turned = True
                zeta = (bb - aa) / (2.0 * ab)
                t = math.copysign(1.0, zeta) / (abs(zeta) + math.hypot(1.0, zeta))
                c = 1.0 / math.hypot(1.0, t)
                s = c * t
                columns[i] = [c * x - s * y for x, y in zip(a, b, strict=True)]
                columns[j] = [s * x + c * y for x, y in zip(a, b, strict=True)]
        if not turned:
            break
    return sorted((math.sqrt(_dot(v, v)) for v in columns), reverse=True)


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return math.fsum(x * y for x, y in zip(a, b, strict=True))
