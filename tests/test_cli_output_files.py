"""Output files: formats, suffixes, permissions, links, and nothing half-written."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from command_line import complains, kr16
from joint_tables import HOME


def test_files_are_written_whole_in_the_format_of_their_suffix(tmp_path: Path) -> None:
    for suffix, start in ((".json", "{"), (".csv", "x,y,z"), (".txt", "flange"), (".npz", "PK")):
        path = tmp_path / f"out{suffix}"
        done = kr16(f"fk {HOME} -o {path}")
        assert (done.code, done.out) == (0, "")
        assert path.read_bytes().decode("latin-1").startswith(start)
    assert len(list(tmp_path.iterdir())) == 4


def test_format_option_beats_the_suffix_and_dash_is_stdout(tmp_path: Path) -> None:
    path = tmp_path / "out.dat"
    assert kr16(f"fk {HOME} -o {path} --json").code == 0
    assert path.read_text().startswith("{")
    assert kr16(f"fk {HOME} -o - --json").out == path.read_text()


def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "out.json", tmp_path / "link.json"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    assert kr16(f"fk {HOME} -o {link}").code == 0
    assert link.is_symlink()
    assert path.read_text().startswith("{")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_new_files_obey_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        assert kr16(f"fk {HOME} -o {tmp_path / 'out.json'}").code == 0
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "out.json").stat().st_mode) == 0o640


def test_unwritable_outputs_are_refused_before_the_work(tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("no header\n")
    # The output is tried first, so the input is not even read.
    complains(kr16(f"fk --input {bad} -o {tmp_path / 'no' / 'out.csv'}"), "out.csv", "No such file")
    complains(kr16(f"fk {HOME} --json -o {tmp_path}"), "is a directory")


def test_a_failed_run_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    complains(kr16(f"fk 1 2 3 4 5 x -o {path}"), "A6")
    complains(kr16(f"fk --input {tmp_path / 'none.csv'} -o {path}"), "none.csv")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_devices_are_written_to() -> None:
    assert kr16(f"fk {HOME} -o /dev/null").code == 0
    done = kr16(f"fk {HOME} -o /dev/full --json")
    complains(done, "/dev/full", "No space left")
