"""kr16 robot: the template, and the check of a parameter file."""

from __future__ import annotations

from pathlib import Path

from command_line import complains, kr16
from joint_tables import HOME


def test_template_is_a_sound_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    assert kr16(f"robot template -o {path} ").code in (0, 2)
    text = kr16("robot template").out
    path.write_text(text, encoding="utf-8")
    done = kr16(f"robot check {path}")
    assert done.code == 0
    assert "sound" in done.out


def test_check_of_one_problem_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(kr16("robot template").out.replace("mass = 76.0", "mass = -76.0"))
    complains(kr16(f"robot check {path}"), "mass")


def test_check_names_every_broken_rule(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    text = kr16("robot template").out
    path.write_text(text.replace("mass = 76.0", "mass = -76.0").replace("d4 = 0.670", "d5 = 0.670"))
    done = kr16(f"robot check {path}")
    assert done.code == 2
    assert done.out == ""
    *lines, last = done.err.splitlines()
    assert len(lines) == 3
    assert all(line.startswith(f"kr16: error: {path}: ") for line in lines)
    assert last == f"kr16: error: {path}: {len(lines)} problems"
    complains(kr16(f"fk {HOME} --robot {path}"), str(path))
