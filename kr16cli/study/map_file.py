"""A map as a file: npz with a column per measure in the shape of the grid, and its axes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kr16cli.study.maps import MapWork
from kr16cli.study.session import write_npz
from kr16cli.study.store import Store, whole_file


def write(path: str | Path, work: MapWork, store: Store, answer: Mapping[str, Any]) -> None:
    """Write a finished map.

    The arrays have shape (x, y, z), with a list of orientations (x, y, z, orientation). `x`,
    `y`, `z` (m) and `rotations` (k, 3, 3) say where; `metadata` is the JSON answer as text.

    Raises:
        FileError: it cannot be written; the chunks are kept.
    """
    extra = {**work.axes(), "rotations": work.grid.rotations}
    with whole_file(Path(path), f"all {store.total} chunks are kept in {store.folder}") as file:
        write_npz(file, store, work.grid.shape, extra, answer)
