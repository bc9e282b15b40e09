"""A sweep as a tidy table, a row for each run: npz, CSV with units in its header, or Parquet."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping
from io import TextIOWrapper
from pathlib import Path
from typing import IO, Any

import numpy as np

from kr16cli.errors import MissingPartError
from kr16cli.study.session import write_npz
from kr16cli.study.store import Store, whole_file
from kr16cli.study.sweep import SweepWork, flat_columns

SUFFIXES = (".npz", ".csv", ".parquet")


def require(path: str | Path) -> None:
    """MissingPartError where a file of this suffix cannot be written."""
    if Path(path).suffix.lower() == ".parquet":
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise MissingPartError("pyarrow", "tables") from None


def write(path: str | Path, work: SweepWork, store: Store, answer: Mapping[str, Any]) -> None:
    """Write a finished sweep, a chunk in memory at a time.

    Args:
        path: its suffix, one of `SUFFIXES`, says the format.
        work: the sweep.
        store: complete.
        answer: kept in npz and Parquet as `metadata`.

    Raises:
        FileError: it cannot be written; the chunks are kept.
        MissingPartError: Parquet without pyarrow.
    """
    suffix = Path(path).suffix.lower()
    require(path)
    with whole_file(Path(path), f"all {store.total} chunks are kept in {store.folder}") as file:
        if suffix == ".csv":
            _csv(file, work, store)
        elif suffix == ".parquet":
            _parquet(file, work, store, answer)
        else:
            write_npz(file, store, (work.rows,), {}, answer)


def _csv(file: IO[bytes], work: SweepWork, store: Store) -> None:
    text = TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
    writer = csv.writer(text, lineterminator="\n")
    units = {name: column.unit for name, column in work.columns().items()}
    begun = False
    for chunk in store.chunks():
        columns = flat_columns(work, chunk)
        if not begun:
            writer.writerow([_headed(name, units) for name in columns])
            begun = True
        writer.writerows(zip(*(map(_cell, v.tolist()) for v in columns.values()), strict=True))
    text.flush()
    text.detach()


def _headed(name: str, units: Mapping[str, str]) -> str:
    unit = units.get(name) or units.get(name.rpartition("_")[0])
    return f"{name} [{unit}]" if unit else name


def _cell(value: Any) -> str:
    """Full precision; nothing where there is no number."""
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value + 0.0)
    return str(value)


def _parquet(file: IO[bytes], work: SweepWork, store: Store, answer: Mapping[str, Any]) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    about = {"metadata": json.dumps(answer, allow_nan=False, ensure_ascii=False)}
    writer = None
    for chunk in store.chunks():
        columns = {
            name: pa.array(values, mask=np.isnan(values) if values.dtype.kind == "f" else None)
            for name, values in flat_columns(work, chunk).items()
        }
        table = pa.table(columns)
        if writer is None:
            writer = parquet.ParquetWriter(file, table.schema.with_metadata(about))
        writer.write_table(table.replace_schema_metadata(about))
    if writer is not None:
        writer.close()
