"""Long batches are answered in blocks: the same rows, words and codes as one by one, faster."""

from __future__ import annotations

import csv
import io
import json
import math
import random
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from command_line import Outcome, complains, kr16
from joint_tables import HEADER, WIDE, csv_of, rows_of
from kr16cli.cli import blocks, rows

_RATES = ",".join(f"{group}{i}" for group in ("qd", "qdd") for i in range(1, 7))


def _joints(count: int, seed: int = 5) -> list[list[float]]:
    """Random configurations, every fifth of round angles and every seventh beyond a limit."""
    draw = random.Random(seed)
    found = [[draw.uniform(lo, hi) for lo, hi in WIDE] for _ in range(count)]
    for i in range(0, count, 5):
        found[i] = [90.0 * round(v / 90.0) for v in found[i]]
    for row in found[3::7]:
        row[1] = 40.0
    return found


def _bad(text: str) -> str:
    """The same with rows that cannot be used."""
    lines = text.splitlines()
    width = lines[0].count(",")
    for at, line in ((9, "1,2,x"), (17, "1," * width + "nan"), (40, "1," * width + "1_0"),
                     (63, "7," * (width + 1) + "7"), (64, "," * width)):  # fmt: skip
        lines[at] = line
    return "\n".join(lines) + "\n"


def _both(monkeypatch: pytest.MonkeyPatch, *words: object, stdin: str | bytes) -> list[Outcome]:
    """What is answered row by row, and in small blocks."""
    outcomes = []
    for few, size in ((10**9, 1 << 20), (10, 1 << 12)):
        monkeypatch.setattr(rows, "FEW", few)
        monkeypatch.setattr(rows, "_HEAD", size)
        monkeypatch.setattr(blocks, "_BYTES", size // 4)
        monkeypatch.setattr(blocks, "_ROWS", 37)
        outcomes.append(kr16(*words, stdin=stdin))
    return outcomes


def _same(one: str, other: str) -> None:
    """The same words in the same cells, the same numbers to rounding."""
    first, second = (list(csv.reader(io.StringIO(text))) for text in (one, other))
    assert len(first) == len(second)
    for mine, theirs in zip(first, second, strict=True):
        assert len(mine) == len(theirs)
        for cell, found in zip(mine, theirs, strict=True):
            if cell != found:
                assert math.isclose(float(cell), float(found), rel_tol=1e-8, abs_tol=1e-8)


_POSES = "x,y,z,a,b,c,units,status,reason"
_ASKED = [
    "fk",
    "fk --tool 10 20 120 10 20 30 --base 100 0 50 0 0 90 --mass-centres",
    "fk --frames all",
    "jacobian",
    "jacobian --link 4 --point com --axes flange --qd 1 2 3 4 5 6",
    "dynamics",
    "dynamics --payload 20 0 0 120 --drives --tau 1 2 3 4 5 6",
    "dynamics --gravity 1 2 -9 --qd 1 2 3 4 5 6 --qdd 9 8 7 6 5 4",
]


@pytest.mark.parametrize("asked", _ASKED)
def test_blocks_answer_as_rows_do(asked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    words = (*asked.split(), "-", "--format", "csv")
    one, other = _both(monkeypatch, *words, stdin=_bad(csv_of(_joints(150))))
    assert (one.code, other.code) == (1, 1)
    assert one.err == other.err
    assert "row 9: " in one.err
    _same(one.out, other.out)


def test_rates_of_the_rows_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    text = _bad(csv_of([[*q, *q, *q] for q in _joints(80)], f"{HEADER},{_RATES}"))
    one, other = _both(monkeypatch, "dynamics", "-", "--format", "csv", stdin=text)
    assert "torque_1" in one.out.partition("\n")[0]
    assert (one.code, one.err) == (other.code, other.err)
    _same(one.out, other.out)


def _poses() -> str:
    """Poses in every state: reachable, singular, out of reach, of joints beyond limits, bad."""
    done = kr16("fk", "-", "--format", "csv", stdin=csv_of(_joints(120)))
    far = "9000,0,500,0,90,0,mm deg,ok,\n300,0,300,0,0,0,mm deg,ok,\n"
    table = [line.split(",") for line in done.out.splitlines()]
    kept = [",".join([*line[:6], *line[8:]]) for line in table]
    return _bad("\n".join(kept) + "\n" + far)


@pytest.mark.parametrize(
    "options",
    ["", "--near 10 -60 80 100 20 -200 --tool 0 0 100 0 30 0", "--status 2", "--turn 2", "--turns",
     "--base 100 50 0 10 0 0 --track"],
)  # fmt: skip
def test_blocks_of_poses_are_solved_as_rows_are(
    options: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, other = _both(monkeypatch, "ik", "-", "--format", "csv", *options.split(), stdin=_poses())
    assert (one.code, other.code) == (1, 1)
    assert one.err == other.err
    words = {row["status"] for row in rows_of(one.out)}
    assert words >= {"ok", "bad", "unreachable"}
    _same(_residuals_left_out(one.out), _residuals_left_out(other.out))


def _residuals_left_out(text: str) -> str:
    """Residuals are rounding itself."""
    table = rows_of(text)
    for row in table:
        assert not row["residual"] or float(row["residual"]) < 1e-9
        del row["residual"]
    out = io.StringIO()
    writer = csv.DictWriter(out, table[0].keys())
    writer.writeheader()
    writer.writerows(table)
    return out.getvalue()


@pytest.mark.parametrize("asked", ["fk --mass-centres", "jacobian", "dynamics --christoffel", "ik"])
@pytest.mark.parametrize("source", ["csv", "npz"])
def test_npz_of_blocks_is_that_of_rows(
    asked: str, source: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if asked == "ik":
        text = _poses()
        T = np.tile(np.eye(4), (50, 1, 1))
        T[:, :3, 3] = [1.2, 0.1, 0.9]
        T[3, 0, 0] = 1.1
        T[:, 2, 3] += 0.001 * np.arange(50)
        arrays = {"T": T}
    else:
        text, arrays = _bad(csv_of(_joints(80))), {"q": np.array(_joints(80))}
        arrays["q"][5, 2] = np.nan
    given, out = tmp_path / "in.npz", tmp_path / "out.npz"
    np.savez(given, **arrays)  # type: ignore[arg-type]
    words = ["--input", given] if source == "npz" else ["-"]
    found = []
    for few in (10**9, 10):
        monkeypatch.setattr(rows, "FEW", few)
        monkeypatch.setattr(blocks, "_ROWS", 37)
        assert kr16(*asked.split(), *words, "-o", out, stdin=text).code == 1
        with np.load(out) as archive:
            found.append(dict(archive))
    one, other = found
    assert list(one) == list(other)
    for name, array in one.items():
        assert array.dtype == other[name].dtype
        if array.dtype.kind == "f":
            np.testing.assert_allclose(array, other[name], rtol=1e-8, atol=1e-8)
        else:
            np.testing.assert_array_equal(array, other[name])


@pytest.mark.parametrize(
    "dialect",
    [
        lambda text: text.replace(",", ";").replace(".", ","),
        lambda text: text.replace(",", "\t"),
        lambda text: "\ufeff" + text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: text.replace("\n", "\n  \n", 3),
        lambda text: text.replace("a6", 'a6,"what"').replace(",5.5\n", ',5.5,"x\ny"\n'),
    ],
    ids=["semicolons", "tabs", "windows", "cr", "blanks", "quotes"],
)  # fmt: skip
def test_every_dialect_reads_the_same(dialect: object, monkeypatch: pytest.MonkeyPatch) -> None:
    text = csv_of([[*q[:5], 5.5] for q in _joints(200)])
    one, other = _both(monkeypatch, "fk", "-", "--format", "csv", stdin=dialect(text))  # type: ignore[operator]
    assert (one.code, one.err) == (other.code, other.err)
    _same(one.out, other.out)
    assert one.out.count(",ok,") == 200


def test_json_and_tables_of_long_files_are_as_of_short(monkeypatch: pytest.MonkeyPatch) -> None:
    text = _bad(csv_of(_joints(70)))
    one, other = _both(monkeypatch, "fk", "-", "--json", stdin=text)
    first, second = (json.loads(done.out) for done in (one, other))
    assert first["input"] == second["input"]
    assert [row["status"] for row in first["result"]["rows"]] == [
        row["status"] for row in second["result"]["rows"]
    ]
    tables = _both(monkeypatch, "fk", "-", stdin=text)
    assert tables[0].out == tables[1].out


def test_what_is_wrong_far_down_is_told_and_nothing_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    out = tmp_path / "out.csv"
    out.write_text("before")
    text = csv_of(_joints(150))
    cases: list[tuple[bytes, tuple[object, ...], tuple[str, ...]]] = [
        (_bad(text).encode(), ("--strict",), ("row 9", "5 such rows", "nothing is written")),
        (text.encode() + b"1,2,3,\xff,5,6\n", (), (f"not UTF-8 text at byte {len(text) + 6}",)),
        (f"units,{text}".replace("\n", "\ndeg,").encode() + b"1,2,3,4,5,6\nrad,1,2,3,4,5,6\n", (),
         ("in rad", "give --si")),
    ]  # fmt: skip
    for content, options, words in cases:
        for done in _both(monkeypatch, "fk", "-", "-o", out, *options, stdin=content):
            complains(done, *words)
        assert out.read_text() == "before"
        assert list(tmp_path.iterdir()) == [out]


def test_blocks_without_a_sound_row(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lines = [f"{HEADER}", *["1,2,3,4,5,"] * 400, "0,-90,90,0,0,0", *["1,2,3,4,x,6"] * 400]
    one, other = _both(monkeypatch, "fk", "-", "--format", "csv", stdin="\n".join(lines))
    assert one == other
    assert one.out.count(",bad,") == 800
    np.savez(tmp_path / "q.npz", q=np.full((300, 6), np.nan))
    done = kr16("fk", "--input", tmp_path / "q.npz", "--format", "csv")
    assert done.code == 1
    assert done.out.count(",bad,a number is not finite") == 300


def test_a_payload_beyond_the_rating_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    text = csv_of([[0.0, -90.0, 90.0, 10.0, 20.0, 30.0]] * 50)
    words = ("dynamics", "-", "--payload", 99, 0, 0, 0, "--format", "csv")
    one, other = _both(monkeypatch, *words, stdin=text)
    assert "rows 1, 2, 3 and 47 more: payload 99 kg exceeds" in one.err
    assert one.err == other.err


def test_huge_numbers_are_told_row_by_row(monkeypatch: pytest.MonkeyPatch) -> None:
    header = f"{HEADER},{','.join(f'qd{i}' for i in range(1, 7))}"
    table = [[*q, *([1e200] * 6 if i == 20 else q)] for i, q in enumerate(_joints(40))]
    one, other = _both(monkeypatch, "dynamics", "-", "--format", "csv", stdin=csv_of(table, header))
    assert (one.code, one.err) == (other.code, other.err)
    assert "row 21: the result is not finite" in one.err
    _same(one.out, other.out)


def test_memory_does_not_grow_with_the_rows(tmp_path: Path) -> None:
    """Four times the rows, the same memory: a block of text, numbers, and the spool."""
    peaks = []
    for count in (20_000, 80_000):
        table = tmp_path / f"{count}.csv"
        line = "10.123456789,-80.123456789,95.123456789,1.5,-45.123456789,30.123456789\n"
        table.write_text(f"{HEADER}\n{line * count}")
        tracemalloc.start()
        try:
            assert kr16("fk", "--input", table, "-o", tmp_path / "out.csv").code == 0
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    with (tmp_path / "out.csv").open() as lines:
        assert sum(1 for _ in lines) == 80_001
    assert peaks[1] < 40e6


@pytest.mark.slow
def test_twenty_thousand_rows_take_little_more_than_their_text(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Beside reading and writing the same numbers as text, and beside row by row."""
    table = tmp_path / "joints.csv"
    table.write_text(csv_of(_joints(20_000)))

    def text_alone() -> None:
        with table.open() as lines:
            numbers = np.loadtxt(lines, delimiter=",", skiprows=1)
        "\n".join(map(",".join, zip(*(map(repr, c) for c in numbers.T.tolist()), strict=True)))

    def asked(few: int, source: Path) -> None:
        monkeypatch.setattr(rows, "FEW", few)
        assert kr16("fk", "--input", source, "-o", tmp_path / "poses.csv").code == 0

    def seconds(act: object, *arguments: object) -> float:
        times = []
        for _ in range(3):
            start = time.process_time()
            act(*arguments)  # type: ignore[operator]
            times.append(time.process_time() - start)
        return min(times)

    short = tmp_path / "short.csv"
    short.write_text(csv_of(_joints(2_000)))
    quick, text = seconds(asked, 200, table), seconds(text_alone)
    assert quick < 4.0 * text
    assert quick < 0.3 * 10 * seconds(asked, 10**9, short)
