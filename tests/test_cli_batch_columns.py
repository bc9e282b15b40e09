"""What CSV has columns for, and what is said of the rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from command_line import kr16
from joint_tables import HEADER, rows_of

_NO_COLUMNS = [
    ("fk", "--frames all", "--frames all; it is in json and npz"),
    ("dynamics", "--task", "--task; it is in json and npz"),
    ("dynamics", "--christoffel", "--christoffel; it is in json and npz"),
]


@pytest.mark.parametrize(("command", "options", "said"), _NO_COLUMNS)
def test_csv_says_what_it_has_no_columns_for(command: str, options: str, said: str) -> None:
    text = f"{HEADER}\n10,-70,80,35,-40,20\n"
    words = [command, *options.split()]
    single = kr16(*words, 10, -70, 80, 35, -40, 20, "--format", "csv")
    assert single.err == f"kr16: warning: csv has no columns for {said}\n"
    rows = kr16(*words, "-", "--format", "csv", stdin=text)
    assert rows.err == single.err
    assert rows.out == single.out
    assert f"table has no columns for {said}" in kr16(*words, "-", stdin=text).err
    assert kr16(*words, "-", "--json", stdin=text).json()["warnings"] == []
    assert kr16(command, "-", "--format", "csv", stdin=text).err == ""


def test_npz_holds_what_csv_has_no_columns_for(tmp_path: Path) -> None:
    file = tmp_path / "out.npz"
    for command, options, _ in _NO_COLUMNS:
        done = kr16(command, *options.split(), 10, -70, 80, 35, -40, 20, "-o", file)
        assert (done.code, done.err) == (0, "")
        with np.load(file) as archive:
            wanted = {"fk": "T_frame3", "dynamics": options[2:]}[command]
            assert any(name.startswith(wanted) for name in archive.files)


def test_variants_of_turns_are_in_json_only() -> None:
    done = kr16("ik 1200 100 900 0 120 0 --turns --format csv")
    assert done.err == (
        "kr16: warning: csv has no columns for the variants of --turns; they are in json\n"
    )
    assert len(rows_of(done.out)) == 1


def test_singular_values_and_friction_have_columns() -> None:
    q = (10, -70, 80, 35, -40, 20)
    (row,) = rows_of(kr16("jacobian", *q, "--format", "csv").out)
    result = kr16("jacobian", *q, "--json").result()
    assert [float(row[f"sigma_{i}"]) for i in range(1, 7)] == result["singular_values"]
    words = ("dynamics", *q, "--drives", "--qd", 10, -20, 30, -40, 50, 60)
    (row,) = rows_of(kr16(*words, "--format", "csv").out)
    result = kr16(*words, "--json").result()
    assert [float(row[f"friction_{i}"]) for i in range(1, 7)] == result["friction"]
    assert "friction_1" not in rows_of(kr16("dynamics", *q, "--format", "csv").out)[0]
