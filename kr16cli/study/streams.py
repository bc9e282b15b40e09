"""Random numbers that depend on the seed and the row alone, not on how rows are cut up.

Philox is counter-based (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, 2011): row i
takes the numbers at positions i d to (i + 1) d of one stream, wherever it is computed.
"""

from __future__ import annotations

import numpy as np

from kr16cli.arrays import Array

_BLOCK = 4  # numbers that Philox makes at a time


def uniforms(seed: int, kind: int, start: int, stop: int, width: int) -> Array:
    """Numbers in (0, 1), (stop - start, width): rows `start` to `stop` of an endless table.

    Args:
        seed: whole number, 0 or more.
        kind: which of the tables of a seed.
        start: first row.
        stop: the row after the last.
        width: numbers in a row.
    """
    key = np.random.SeedSequence(seed, spawn_key=(kind,)).generate_state(2, np.uint64)
    first = start * width
    generator = np.random.Philox(key=key)
    generator.advance(first // _BLOCK)
    skip = first % _BLOCK
    raw = generator.random_raw(skip + (stop - start) * width)[skip:]
    # 52 bits and a half: never 0 and never 1, so that every inverse distribution is finite.
    table: Array = ((raw >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52
    return table.reshape(stop - start, width)
