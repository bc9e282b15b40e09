"""The command line's frame: arguments, errors, help pages, start-up, completion."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import examples
from command_line import complains, kr16, kr16_process
from joint_tables import HOME
from kr16cli import __version__
from kr16cli.cli.app import COMMANDS, available

_MINE = ("info", "fk", "ik", "jacobian", "dynamics", "robot")

# Arguments --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        "fk -1 -2.5 -.5 -4e1 +5 6 --json",
        "fk --json -1 -2.5 -.5 -4e1 +5 6",
        "fk --json -- -1 -2.5 -.5 -4e1 +5 6",
        "fk -1,-2.5,-.5,-4e1,+5,6 --json",
        "fk -1 -2.5 --format json -.5 -4e1 +5 6",
        "fk -1 -2.5 -.5 -4e1 +5 6 --format=JSON",
    ],
)
def test_negative_numbers_are_values(words: str) -> None:
    want = kr16("fk", -1, -2.5, -0.5, -40, 5, 6, "--json").result()
    assert kr16(words).result() == want


def test_options_take_six_negative_numbers_anywhere() -> None:
    words = "--tool -1 -2 -3 -4 -5 -6"
    after = kr16(f"fk {HOME} {words} --json").json()
    before = kr16(f"fk {words} {HOME} --json").json()
    joined = kr16(f"fk --tool=-1,-2,-3,-4,-5,-6 {HOME} --json").json()
    assert after == before == joined
    assert after["input"]["tool"] == [-1, -2, -3, -4, -5, -6]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (f"fk {HOME} --jsn", ("unknown option --jsn", "did you mean --json")),
        (f"fk {HOME} --tol 1", ("unknown option --tol", "--tool")),
        (f"fk {HOME} -x", ("unknown option -x",)),
        ("--robt x fk", ("--robt",)),
        ("fkk", ("unknown command fkk", "did you mean fk")),
        ("fk", ("fk needs six numbers", "--input", "--help")),
        ("fk 1 2 3 4 5", ("fk takes 6 numbers", "got 5")),
        ("fk 1 2 3 4 5 6 7", ("fk takes 6 numbers", "got 7")),
        ("fk 1 2 3 4 5 six", ("A6 is 'six'", "number")),
        ("fk 1 2 nan 4 5 6", ("A3 is nan", "finite")),
        ("ik 1 2 -inf 4 5 6", ("Z is -inf", "finite")),
        ("fk 1 2 3 4 5 1e400", ("A6 is 1e400", "finite")),
        (f"fk {HOME} --tool 1 2 3", ("--tool takes 6 numbers", "got 3")),
        (f"fk {HOME} --tool 1 2 3 4 5 x", ("--tool takes 6 numbers", "got 5")),
        (f"fk {HOME} --tool", ("--tool needs X Y Z A B C",)),
        (f"fk {HOME} --tool --json", ("--tool needs X Y Z A B C",)),
        (f"fk {HOME} --json=yes", ("--json takes no value",)),
        (f"fk {HOME} --frames some", ("--frames is some", "all, robroot, chapter")),
        (f"fk {HOME} --format xml", ("--format is xml", "table, json, csv, npz")),
        (f"fk {HOME} --json --format csv", ("--json", "csv", "exclude")),
        (f"fk {HOME} --format npz", ("npz", "-o FILE.npz")),
        (f"fk {HOME} -o result.doc", ("result.doc", ".json", "--format")),
        (f"fk {HOME} --robot nowhere.toml", ("nowhere.toml",)),
        (f"fk {HOME} --robot kr17", ("kr17", "kr16_2")),
        ("fk --krl {A1", ("character",)),
        ("fk --krl {X:1}", ("character",)),
        ("ik 1 2 3 4 5 6 --status 8", ("--status is 8", "0 to 7")),
        ("ik 1 2 3 4 5 6 --turn x", ("--turn is x", "0 to 63")),
        (f"dynamics {HOME} --payload 1 2 3", ("--payload takes 4 or 7 numbers", "got 3")),
        (f"dynamics {HOME} --payload 1 2 3 4 5", ("--payload takes 4 or 7 numbers", "got 5")),
        (f"dynamics {HOME} --payload -1 0 0 0", ("mass is -1 kg",)),
        (f"dynamics {HOME} --payload 1 0 0 0 --load-data {{M:1}}", ("exclude",)),
        (f"dynamics {HOME} --qd 1e300 0 0 0 0 0", ("not finite", "too large")),
        ("robot", ("kr16 robot needs a command", "check, template")),
        ("fk - --input x.csv", ("-", "--input", "exclude")),
        ("robot check", ("FILE",)),
        ("robot chek x", ("unknown robot command chek", "did you mean check")),
        ("export foo", ("unknown export command foo", "known: mjcf, urdf")),
        (
            f"fk {HOME} --tool 1,5 2 3 4 5 6",
            ("--tool takes 6 numbers (X Y Z A B C), got 7 in '1,5 2 3 4 5 6'", "has a point"),
        ),
        (f"fk {HOME} --tool 1,2,3", ("--tool takes 6 numbers (X Y Z A B C), got 3",)),
        (f"fk {HOME} --tool 1,2,3,4,5,x", ("--tool C is 'x'",)),
        (f"dynamics {HOME} --payload 1,5 0 0 9", ("4 or 7 numbers (M X Y Z [IX IY IZ]), got 5",)),
    ],
)
def test_what_is_wrong_is_said_in_one_line(words: str, expected: tuple[str, ...]) -> None:
    complains(kr16(words), *expected)


@pytest.mark.parametrize("option", ["--robot", "--input", "--krl", "--tool", "--output", "-o"])
def test_an_empty_option_is_not_an_option_left_out(option: str) -> None:
    """As a shell makes of an unset variable, before and after the numbers."""
    name = "--output" if option == "-o" else option
    home = HOME.split()
    complains(kr16("fk", *home, option, ""), f"{name} is empty")
    complains(kr16("fk", option, " ", *home), f"{name} is empty")
    if option != "-o":
        complains(kr16("fk", *home, f"{option}="), f"{name} is empty")


def test_an_empty_option_of_a_group_is_not_left_out() -> None:
    complains(kr16("--robot", "", "fk", *HOME.split()), "--robot is empty", "FILE")
    complains(kr16("robot", "template", "-o", ""), "--output is empty")


def test_a_file_may_have_a_name_that_looks_like_an_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert kr16(f"fk {HOME} --json --output=--").code == 0
    assert (tmp_path / "--").read_text().startswith("{")


def test_no_arguments_prints_help_and_is_a_usage_error() -> None:
    done = kr16()
    assert done.code == 2
    assert done.out == ""
    assert "Usage: kr16" in done.err
    assert "jacobian" in done.err


def test_dash_on_a_terminal_prints_help_instead_of_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kr16cli.cli.rows.stdin_is_terminal", lambda: True)
    done = kr16("fk -")
    assert done.code == 2
    assert "$ kr16 fk" in done.err


def test_version_names_robot_and_model() -> None:
    done = kr16("--version")
    assert done.code == 0
    assert __version__ in done.out
    assert "KUKA KR 16-2" in done.out
    assert len(done.out.split()[-1]) == 64


def test_info_names_product_status_sources_conflicts_engine_and_versions() -> None:
    done = kr16("info")
    assert done.code == 0
    for word in ("KUKA KR 16-2", "agreed", "estimated", "S1", "0.158 or 0.115", "numpy", "engine"):
        assert word in done.out
    complains(kr16("info --format csv"), "--format is csv")


# Help pages -------------------------------------------------------------------------------------


def _pages() -> list[str]:
    return ["", *(name for name in available() if name in _MINE), "robot check", "robot template"]


@pytest.mark.parametrize("page", _pages())
def test_help_leads_with_two_examples(page: str) -> None:
    done = kr16(*page.split(), "--help")
    assert done.code == 0
    assert done.err == ""
    assert len(examples.help_commands(done.out)) == 2
    assert done.out.index("$ kr16") < done.out.index("Options:")


@pytest.mark.parametrize("page", _pages())
def test_examples_of_help_pages_run(page: str, tmp_path: Path) -> None:
    for command in examples.help_commands(kr16(*page.split(), "--help").out):
        done = examples.run(command.replace("kr16", f"{sys.executable} -m kr16cli", 1), tmp_path)
        assert done.returncode == 0, done.stdout
        assert done.stdout or "-o" in command


def test_every_command_listed_can_be_asked_for_help() -> None:
    listed = kr16("--help").out
    for name in available():
        assert f"  {name} " in listed
        assert name in COMMANDS
        assert kr16(name, "--help").code == 0


# Start-up ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        f"fk {HOME}",
        "ik 1088 0 1320 0 90 0 --json",
        f"jacobian {HOME} --json",
        f"dynamics {HOME} --qdd 1 2 3 4 5 6",
        "--version",
    ],
)
def test_a_single_query_imports_nothing_heavy(command: str) -> None:
    program = (
        "import sys\n"
        "from kr16cli.cli import main\n"
        f"code = main({command.split()!r})\n"
        "heavy = {'numpy', 'scipy', 'matplotlib', 'pydantic', 'rich'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
        "sys.exit(code)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr


def test_only_the_command_asked_for_is_imported() -> None:
    program = (
        "import sys\n"
        "from kr16cli.cli import main\n"
        f"main({f'fk {HOME}'.split()!r})\n"
        "print([n for n in sys.modules if n in ('kr16cli.cli.ik', 'kr16cli.cli.dynamics')])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stdout.splitlines()[-1] == "[]"


# Completion -------------------------------------------------------------------------------------


def test_completion_knows_commands_and_options() -> None:
    environment = {**os.environ, "_KR16_COMPLETE": "complete_bash"}
    words = {"COMP_WORDS": "kr16 jac", "COMP_CWORD": "1"}
    assert kr16_process(env=environment | words).stdout.split() == ["jacobian"]
    words = {"COMP_WORDS": "kr16 ik --tu", "COMP_CWORD": "2"}
    assert kr16_process(env=environment | words).stdout.split() == ["--turns", "--turn"]


def test_completion_script_can_be_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    done = kr16_process("--show-completion", env={**os.environ, "SHELL": "/bin/bash"})
    assert "_KR16_COMPLETE" in done.stdout or "not supported" in done.stderr.lower()
