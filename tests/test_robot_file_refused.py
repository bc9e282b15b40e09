"""What is no robot parameter file is refused in one line, whatever is in it."""

from __future__ import annotations

import copy
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kr16cli.errors import FileError, Kr16Error
from kr16cli.robot_file import load_data, parse_data, problems, template
from robot_tables import MISSING, leaves, put, shipped_table

# --- files that are no parameter files -----------------------------------------------------


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b" \n\t\n", "is empty"),
        (b'schema = "kr16.robot/1"\nname = \n', "at line 2"),
        (b"a = 1\na = 2\n", "Cannot overwrite a value"),
        (b"name = '\xff'", "not UTF-8 text at byte 8"),
        (b"a = " + b"[" * 100_000, "no TOML"),
        (b"a = " + b"1" * 5_000, "no TOML"),
    ],
)
def test_a_file_that_is_no_toml_is_one_line(content, reason, tmp_path):
    file = tmp_path / "robot.toml"
    file.write_bytes(content)
    for function in (load_data, problems):
        with pytest.raises(FileError) as caught:
            function(file)
        assert str(caught.value).startswith(f"{file}: ")
        assert reason in str(caught.value)
        assert "\n" not in str(caught.value)
        assert caught.value.exit_code == 2


def test_a_file_that_cannot_be_read_is_one_line(tmp_path):
    with pytest.raises(FileError, match="No such file"):
        load_data(tmp_path / "absent.toml")
    with pytest.raises(FileError, match="is a directory"):
        load_data(tmp_path)
    with pytest.raises(FileError, match="is a directory"):
        load_data("")
    with pytest.raises(FileError, match="cannot be read"):
        load_data("a\0b.toml")


def test_a_bare_name_is_a_shipped_robot_unless_a_file_has_that_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_data("kr16_l6").name == "KUKA KR 16 L6"
    with pytest.raises(FileError, match="shipped: chapter3, kr16_2, kr16_l6"):
        load_data("kr17")
    Path("kr16_l6").write_text(template(), encoding="utf-8")
    assert load_data("kr16_l6").name == "KUKA KR 16-2"


# --- any input -----------------------------------------------------------------------------

WAYS = [way for way, _ in leaves(shipped_table())]
WAYS += sorted({way[:n] for way in WAYS for n in range(1, len(way))}, key=str)
scalars = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.sampled_from([10**400, math.nan, math.inf, -0.0, 1e308, 5e-324])
    | st.floats()
    | st.text(max_size=5)
    | st.dates()
)
anything = st.recursive(
    scalars,
    lambda below: st.lists(below, max_size=6) | st.dictionaries(st.text(max_size=5), below),
    max_leaves=8,
)


@given(st.lists(st.tuples(st.sampled_from(WAYS), anything | st.just(MISSING)), max_size=3))
def test_no_table_raises_anything_but_our_errors(mutations):
    table = copy.deepcopy(shipped_table())
    for way, value in mutations:
        try:
            put(table, way, value)
        except (KeyError, IndexError, TypeError):
            continue  # an earlier mutation took the place away
    try:
        data = parse_data(table, "robot.toml")
    except Kr16Error as error:
        assert "\n" not in str(error)
        assert str(error).isprintable()
    else:
        assert all(math.isfinite(length) for length in data.geometry)
        assert len(data.sha256) == 64


@given(anything)
def test_no_value_in_place_of_the_table_raises_anything_but_our_errors(table):
    with pytest.raises(Kr16Error):
        parse_data(table, "robot.toml")
