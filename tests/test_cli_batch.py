"""Batches: CSV and npz in, every format out, order and status kept, bad rows apart."""

from __future__ import annotations

import json
import random
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from command_line import complains, kr16
from joint_tables import HEADER, WIDE, csv_of, rows_of
from kr16cli.assets import asset

_GOOD = f"{HEADER}\n0,-90,90,0,0,0\n10,20,-30,40,50,60\n"
_BAD = f"{HEADER}\n0,-90,90,0,0,0\n1,2,x,4,5,6\n10,20,-30,40,50,60\n1,2,3,4,5,\n"


def _random_joints(count: int) -> list[list[float]]:
    draw = random.Random(7)
    return [[draw.uniform(lo, hi) for lo, hi in WIDE] for _ in range(count)]


def test_a_thousand_poses_through_ik(tmp_path: Path) -> None:
    joints = tmp_path / "joints.csv"
    joints.write_text(csv_of(_random_joints(1000)))
    poses = tmp_path / "poses.csv"
    assert kr16("fk", "--input", joints, "-o", poses).code == 0
    done = kr16("ik", "--input", poses, "--json")
    assert done.code == 0
    rows = done.json()["result"]["rows"]
    assert len(rows) == 1000
    assert all(row["status"] == "ok" for row in rows)
    assert max(one["residual"] for row in rows for one in row["solutions"]) < 1e-9


def test_batch_is_the_loop() -> None:
    joints = _random_joints(20)
    rows = kr16("fk -", stdin=csv_of(joints)).code
    assert rows == 0
    batch = kr16("fk", "-", "--json", stdin=csv_of(joints)).json()["result"]["rows"]
    for q, row in zip(joints, batch, strict=True):
        single = kr16("fk", *q, "--json").result()
        assert {k: v for k, v in row.items() if k not in ("status", "reason")} == single
        assert (row["status"], row["reason"]) == ("ok", None)


@pytest.mark.parametrize("command", ["fk", "jacobian", "dynamics"])
def test_batch_envelopes_fit_their_schemas(command: str) -> None:
    envelope = kr16(command, "-", "--json", stdin=_BAD).json()
    schema = json.loads(asset(f"data/schemas/{command}.json").read_text(encoding="utf-8"))
    jsonschema.validate(envelope, schema)
    assert [row["status"] for row in envelope["result"]["rows"]] == ["ok", "bad", "ok", "bad"]


def test_ik_batch_fits_its_schema_whatever_the_row() -> None:
    text = "x,y,z,a,b,c\n1088,0,1320,0,90,0\n9000,0,0,0,0,0\n1,2,3,4,5,oops\n"
    done = kr16("ik", "-", "--json", stdin=text)
    envelope = done.json()
    jsonschema.validate(envelope, json.loads(asset("data/schemas/ik.json").read_text("utf-8")))
    assert [row["status"] for row in envelope["result"]["rows"]] == ["ok", "unreachable", "bad"]
    assert done.code == 1


@pytest.mark.parametrize(
    "text",
    [
        _GOOD,
        "A6,A5,A4,A3,A2,A1\n0,0,0,90,-90,0\n60,50,40,-30,20,10\n",
        "a1;a2;a3;a4;a5;a6\n0;-90;90;0;0;0\n10,0;20;-30;4,0e1;50;60\n",
        "a1\ta2\ta3\ta4\ta5\ta6\n0\t-90\t90\t0\t0\t0\n10\t20\t-30\t40\t50\t60\n",
        f"\ufeff{_GOOD}".replace("\n", "\r\n"),
        _GOOD.replace("\n", "\n  \n \t\n"),
        f"   \n{_GOOD}",
        "a1 [deg],a2 [deg],a3 [deg],a4[deg],a5 [ deg ],a6\n0,-90,90,0,0,0\n10,20,-30,40,50,60\n",
        'a1, "a2", a3, a4, a5, a6\n0, "-90", 90, 0, 0, 0\n\n10, 20, -30, 40, 50, 60',
        '"a1","a2","a3","a4","a5","a6"\n"0","-90","90","0","0","0"\n10,20,-30,40,50,60\n',
    ],
)
def test_every_csv_dialect_reads_the_same(text: str) -> None:
    want = kr16("fk", "-", "--json", stdin=_GOOD).json()["result"]
    done = kr16("fk", "-", "--json", stdin=text)
    assert done.code == 0
    assert done.json()["result"] == want
    assert done.json()["warnings"] == []


def test_columns_not_used_are_named() -> None:
    text = "name,a1,a2,a3,a4,a5,a6,status\nhome,0,-90,90,0,0,0,ok\n"
    assert kr16("fk", "-", "--json", stdin=text).json()["warnings"] == [
        "stdin: columns not used: name"
    ]


def test_bad_rows_are_told_and_good_rows_written() -> None:
    done = kr16("fk", "-", "--format", "csv", stdin=_BAD)
    assert done.code == 1
    rows = rows_of(done.out)
    assert [row["status"] for row in rows] == ["ok", "bad", "ok", "bad"]
    assert rows[1]["x"] == rows[3]["x"] == ""
    assert float(rows[0]["x"]) == 1088
    assert rows[0]["units"] == "mm deg"
    assert "a3 is 'x'" in rows[1]["reason"]
    assert "row 2: a3 is 'x'" in done.err
    assert "row 4: a6 is empty" in done.err
    assert "nan" not in done.out


@pytest.mark.parametrize("cell", ["nan", "inf", "-Infinity", "1e999", "1_0", "0x10", "1,0", " "])
def test_a_cell_that_is_no_finite_number_spoils_its_row_only(cell: str) -> None:
    text = f'{HEADER}\n0,-90,90,0,0,0\n1,2,3,4,5,"{cell}"\n'
    done = kr16("fk", "-", "--json", stdin=text)
    assert done.code == 1
    assert [row["status"] for row in done.json()["result"]["rows"]] == ["ok", "bad"]


def test_too_many_and_too_few_cells() -> None:
    text = f"{HEADER}\n1,2,3,4,5,6,7\n1,2,3\n1,2,3,4,5,6\n"
    rows = kr16("fk", "-", "--json", stdin=text).json()["result"]["rows"]
    assert [row["status"] for row in rows] == ["bad", "bad", "ok"]
    assert "7 cells where the header has 6" in rows[0]["reason"]


def test_strict_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    out.write_text("before")
    done = kr16("fk", "-", "--strict", "-o", out, stdin=_BAD)
    complains(done, "row 2", "a3 is 'x'", "2 such rows", "nothing is written")
    assert out.read_text() == "before"
    assert list(tmp_path.iterdir()) == [out]
    assert kr16("fk", "-", "--strict", "-o", out, stdin=_GOOD).code == 0
    assert len(rows_of(out.read_text())) == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ("stdin", "empty", HEADER)),
        ("\n\n", ("stdin", "empty")),
        ("0,-90,90,0,0,0\n", ("stdin", "header lacks a1")),
        ("a1,a2,a3,a4,a5\n", ("lacks a6",)),
        ("a1,a2,a3,a4,a5,a6,a6\n", ("a6 twice",)),
        ("a1,a2,a3,a4,a5,a6,qd1\n", ("lacks qd2",)),
        (b"\xff\xfe\x00", ("not UTF-8",)),
        (b"PK\x03\x04 no zip", ("no readable npz",)),
    ],
)
def test_unusable_files_are_refused(text: str | bytes, words: tuple[str, ...]) -> None:
    complains(kr16("dynamics", "-", stdin=text), *words)


def test_a_header_alone_has_no_rows() -> None:
    done = kr16("fk", "-", "--json", stdin=HEADER + "\n")
    assert done.code == 0
    assert done.json()["result"] == {"rows": []}


def test_missing_file_and_folder(tmp_path: Path) -> None:
    complains(kr16("fk", "--input", tmp_path / "no.csv"), "no.csv", "No such file")
    complains(kr16("fk", "--input", tmp_path), "is a directory")


def test_inputs_exclude_each_other() -> None:
    complains(kr16("fk 1 2 3 4 5 6 --input x.csv"), "numbers", "--input", "exclude")
    complains(kr16("fk", "--krl", "{A1 1}", "--input", "x.csv"), "--krl", "--input")
    complains(kr16("ik 1 2 3 4 5 6 --track"), "--track", "--input")


def test_npz_in_and_out(tmp_path: Path) -> None:
    joints = np.array(_random_joints(30))
    np.savez(tmp_path / "q.npz", q=joints)
    assert kr16("fk", "--input", tmp_path / "q.npz", "-o", tmp_path / "T.npz").code == 0
    with np.load(tmp_path / "T.npz") as file:
        assert file["T"].shape == (30, 4, 4)
        assert file["pose"].shape == (30, 6)
        assert set(file["status"]) == {"ok"}
        assert json.loads(str(file["units"]))["matrix"] == "m"
    assert kr16("ik", "--input", tmp_path / "T.npz", "-o", tmp_path / "back.npz").code == 0
    with np.load(tmp_path / "back.npz") as file:
        assert file["Q"].shape == (30, 8, 6)
        gap = np.abs((file["Q"] - joints[:, None] + 180) % 360 - 180).max(axis=-1)
        assert np.nanmin(gap, axis=1).max() < 1e-6
        assert file["residual"].max() < 1e-9


def test_npz_rows_that_are_not_finite_are_bad(tmp_path: Path) -> None:
    joints = np.zeros((3, 6))
    joints[1, 2] = np.nan
    np.savez(tmp_path / "q.npz", q=joints)
    done = kr16("fk", "--input", tmp_path / "q.npz", "-o", tmp_path / "out.npz")
    assert done.code == 1
    with np.load(tmp_path / "out.npz") as file:
        assert list(file["status"]) == ["ok", "bad", "ok"]
        assert np.isnan(file["T"][1]).all()
        assert np.isfinite(file["T"][[0, 2]]).all()


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"x": np.zeros((2, 6))}, ("lacks the array q", "found: x")),
        ({"q": np.zeros((2, 5))}, ("q has shape (2, 5)", "(n, 6)")),
        ({"q": np.array(["a"] * 6)}, ("q has dtype", "real numbers")),
        ({"q": np.zeros((2, 6), dtype=complex)}, ("q has dtype complex128", "real numbers")),
        ({"q": np.array([None] * 6, dtype=object)}, ("no readable npz",)),
        ({"q": np.zeros((2, 6)), "qd": np.zeros((3, 6))}, ("qd has 3 rows, q has 2",)),
    ],
)
def test_unusable_npz_is_refused(
    tmp_path: Path, arrays: dict[str, np.ndarray], words: tuple[str, ...]
) -> None:
    np.savez(tmp_path / "q.npz", **arrays)  # type: ignore[arg-type]
    complains(kr16("dynamics", "--input", tmp_path / "q.npz"), *words)


def test_a_matrix_that_is_no_rotation_is_a_bad_row(tmp_path: Path) -> None:
    T = np.stack([np.eye(4), np.eye(4), np.eye(4), np.eye(4)])
    T[:, :3, 3] = (1.0, 0.0, 1.0)
    T[1, 0, 0], T[2, 3, 0] = 1.1, 0.1
    T[3, :3, :3] = np.diag([1.0, 1.0, -1.0])
    np.savez(tmp_path / "T.npz", T=T)
    rows = kr16("ik", "--input", tmp_path / "T.npz", "--json").json()["result"]["rows"]
    assert [row["status"] for row in rows] == ["ok", "bad", "bad", "bad"]
    assert "no rotation" in rows[1]["reason"]
    assert "last row" in rows[2]["reason"]


def test_track_follows_the_solution_before() -> None:
    """A4 turns past 180 deg; only --track keeps on turning."""
    joints = [[0.0, -90.0, 90.0, float(a4), 40.0, 0.0] for a4 in range(150, 260, 10)]
    poses = kr16("fk", "-", "--format", "csv", stdin=csv_of(joints)).out
    near = ("--near", *joints[0])

    def a4(*options: object) -> list[float]:
        done = kr16("ik", "-", *options, "--format", "csv", stdin=poses)
        assert done.code == 0
        return [float(row["a4"]) for row in rows_of(done.out)]

    assert a4(*near, "--track") == pytest.approx([row[3] for row in joints])
    assert max(a4()) < 180.0001


def test_speeds_and_torques_of_the_rows_come_first() -> None:
    names = ",".join([HEADER, *(f"qd{i}" for i in range(1, 7))])
    text = f"{names}\n0,-60,90,0,30,0,10,20,30,40,50,60\n"
    row = kr16("dynamics", "-", "--json", "--qd", 9, 9, 9, 9, 9, 9, stdin=text).json()
    single = kr16("dynamics 0 -60 90 0 30 0 --qd 10 20 30 40 50 60 --json").result()
    assert row["result"]["rows"][0]["coriolis_matrix"] == single["coriolis_matrix"]


@pytest.mark.parametrize("command", ["jacobian", "dynamics"])
def test_matrices_in_csv_have_a_column_each(command: str) -> None:
    done = kr16(command, "-", "--format", "csv", stdin=_GOOD)
    assert done.code == 0
    first, _ = rows_of(done.out)
    single = kr16(command, 0, -90, 90, 0, 0, 0, "--json").result()
    name, key = ("j_45", "jacobian") if command == "jacobian" else ("m_45", "mass_matrix")
    assert float(first[name]) == single[key][3][4]


def test_warnings_of_many_rows_are_gathered() -> None:
    text = csv_of([[0.0, 40.0, 0.0, 0.0, 5.0, 0.0]] * 5)
    (line,) = kr16("fk", "-", stdin=text).err.splitlines()
    assert "rows 1, 2, 3 and 2 more: A2 is 40 deg" in line


def test_table_of_a_batch_names_units_and_leaves_missing_cells_empty() -> None:
    done = kr16("fk", "-", stdin=_BAD)
    header, *lines = done.out.splitlines()
    assert "x mm" in header
    assert "a deg" in header
    assert len(lines) == 4
    assert lines[1].split()[0] == "bad"
    assert "nan" not in done.out
    assert "-0.0" not in done.out


def test_tabs_alone_are_a_blank_line_but_commas_alone_are_a_row() -> None:
    tabs = _GOOD.replace(",", "\t") + "\t\t\t\t\t\n"
    assert len(kr16("fk", "-", "--json", stdin=tabs).json()["result"]["rows"]) == 2
    done = kr16("fk", "-", "--json", stdin=f"{_GOOD},,,,,\n")
    assert [row["status"] for row in done.json()["result"]["rows"]] == ["ok", "ok", "bad"]
