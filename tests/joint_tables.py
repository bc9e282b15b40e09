"""Joint angles in deg, as tests of the command line type them and write them into tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from hypothesis import strategies as st

from kr16cli import units

HOME = "0 -90 90 0 0 0"
GENERIC = (10.0, -70.0, 80.0, 35.0, -40.0, 200.0)
WIDE = ((-185, 185), (-155, 35), (-130, 154), (-350, 350), (-130, 130), (-350, 350))
JOINTS = st.tuples(*(st.one_of(st.floats(*r), st.integers(*r)) for r in WIDE))
HEADER = "a1,a2,a3,a4,a5,a6"


def radians(q: Sequence[float]) -> list[float]:
    """The same angles in rad."""
    return [units.rad(v) for v in q]


def csv_of(rows: list[list[float]], header: str = HEADER) -> str:
    """A table in CSV."""
    return "\n".join([header, *(",".join(map(repr, row)) for row in rows)]) + "\n"


def rows_of(text: str) -> list[dict[str, str]]:
    """The rows of a table in CSV, by the names of its columns."""
    return list(csv.DictReader(io.StringIO(text)))
