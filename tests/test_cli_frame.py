"""The command line's frame: arguments, errors, exit codes, files, start-up, completion."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import examples
from command_line import complains, kr16
from kr16cli import __version__
from kr16cli.cli import entry
from kr16cli.cli.app import COMMANDS, available

_HOME = "0 -90 90 0 0 0"
_MINE = ("info", "fk", "ik", "jacobian", "dynamics", "robot")


def _process(*words: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "kr16cli", *words]
    settings: dict[str, object] = {"capture_output": True, "text": True, "timeout": 60}
    return subprocess.run(command, check=False, **(settings | options))  # type: ignore[call-overload,no-any-return]


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
    after = kr16(f"fk {_HOME} {words} --json").json()
    before = kr16(f"fk {words} {_HOME} --json").json()
    joined = kr16(f"fk --tool=-1,-2,-3,-4,-5,-6 {_HOME} --json").json()
    assert after == before == joined
    assert after["input"]["tool"] == [-1, -2, -3, -4, -5, -6]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (f"fk {_HOME} --jsn", ("unknown option --jsn", "did you mean --json")),
        (f"fk {_HOME} --tol 1", ("unknown option --tol", "--tool")),
        (f"fk {_HOME} -x", ("unknown option -x",)),
        ("--robt x fk", ("--robt",)),
        ("fkk", ("unknown command fkk", "did you mean fk")),
        ("fk", ("fk needs six numbers", "--input", "--help")),
        ("fk 1 2 3 4 5", ("fk takes 6 numbers", "got 5")),
        ("fk 1 2 3 4 5 6 7", ("fk takes 6 numbers", "got 7")),
        ("fk 1 2 3 4 5 six", ("A6 is 'six'", "number")),
        ("fk 1 2 nan 4 5 6", ("A3 is nan", "finite")),
        ("ik 1 2 -inf 4 5 6", ("Z is -inf", "finite")),
        ("fk 1 2 3 4 5 1e400", ("A6 is 1e400", "finite")),
        (f"fk {_HOME} --tool 1 2 3", ("--tool takes 6 numbers", "got 3")),
        (f"fk {_HOME} --tool 1 2 3 4 5 x", ("--tool takes 6 numbers", "got 5")),
        (f"fk {_HOME} --tool", ("--tool needs X Y Z A B C",)),
        (f"fk {_HOME} --tool --json", ("--tool needs X Y Z A B C",)),
        (f"fk {_HOME} --json=yes", ("--json takes no value",)),
        (f"fk {_HOME} --frames some", ("--frames is some", "all, robroot, chapter")),
        (f"fk {_HOME} --format xml", ("--format is xml", "table, json, csv, npz")),
        (f"fk {_HOME} --json --format csv", ("--json", "csv", "exclude")),
        (f"fk {_HOME} --format npz", ("npz", "-o FILE.npz")),
        (f"fk {_HOME} -o result.doc", ("result.doc", ".json", "--format")),
        (f"fk {_HOME} --robot nowhere.toml", ("nowhere.toml",)),
        (f"fk {_HOME} --robot kr17", ("kr17", "kr16_2")),
        ("fk --krl {A1", ("character",)),
        ("fk --krl {X:1}", ("character",)),
        ("ik 1 2 3 4 5 6 --status 8", ("--status is 8", "0 to 7")),
        ("ik 1 2 3 4 5 6 --turn x", ("--turn is x", "0 to 63")),
        (f"dynamics {_HOME} --payload 1 2 3", ("--payload takes 4 or 7 numbers", "got 3")),
        (f"dynamics {_HOME} --payload 1 2 3 4 5", ("--payload takes 4 or 7 numbers", "got 5")),
        (f"dynamics {_HOME} --payload -1 0 0 0", ("mass is -1 kg",)),
        (f"dynamics {_HOME} --payload 1 0 0 0 --load-data {{M:1}}", ("exclude",)),
        (f"dynamics {_HOME} --qd 1e300 0 0 0 0 0", ("not finite", "too large")),
        ("robot", ("kr16 robot needs a command", "check, template")),
        ("fk - --input x.csv", ("-", "--input", "exclude")),
        ("robot check", ("FILE",)),
        ("robot chek x", ("unknown robot command chek", "did you mean check")),
        ("export foo", ("unknown export command foo", "known: mjcf, urdf")),
        (
            f"fk {_HOME} --tool 1,5 2 3 4 5 6",
            ("--tool takes 6 numbers (X Y Z A B C), got 7 in '1,5 2 3 4 5 6'", "has a point"),
        ),
        (f"fk {_HOME} --tool 1,2,3", ("--tool takes 6 numbers (X Y Z A B C), got 3",)),
        (f"fk {_HOME} --tool 1,2,3,4,5,x", ("--tool C is 'x'",)),
        (f"dynamics {_HOME} --payload 1,5 0 0 9", ("4 or 7 numbers (M X Y Z [IX IY IZ]), got 5",)),
    ],
)
def test_what_is_wrong_is_said_in_one_line(words: str, expected: tuple[str, ...]) -> None:
    complains(kr16(words), *expected)


@pytest.mark.parametrize("option", ["--robot", "--input", "--krl", "--tool", "--output", "-o"])
def test_an_empty_option_is_not_an_option_left_out(option: str) -> None:
    """As a shell makes of an unset variable, before and after the numbers."""
    name = "--output" if option == "-o" else option
    home = _HOME.split()
    complains(kr16("fk", *home, option, ""), f"{name} is empty")
    complains(kr16("fk", option, " ", *home), f"{name} is empty")
    if option != "-o":
        complains(kr16("fk", *home, f"{option}="), f"{name} is empty")


def test_an_empty_option_of_a_group_is_not_left_out() -> None:
    complains(kr16("--robot", "", "fk", *_HOME.split()), "--robot is empty", "FILE")
    complains(kr16("robot", "template", "-o", ""), "--output is empty")


def test_a_file_may_have_a_name_that_looks_like_an_option(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert kr16(f"fk {_HOME} --json --output=--").code == 0
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


# Output files -----------------------------------------------------------------------------------


def test_files_are_written_whole_in_the_format_of_their_suffix(tmp_path: Path) -> None:
    for suffix, start in ((".json", "{"), (".csv", "x,y,z"), (".txt", "flange"), (".npz", "PK")):
        path = tmp_path / f"out{suffix}"
        done = kr16(f"fk {_HOME} -o {path}")
        assert (done.code, done.out) == (0, "")
        assert path.read_bytes().decode("latin-1").startswith(start)
    assert len(list(tmp_path.iterdir())) == 4


def test_format_option_beats_the_suffix_and_dash_is_stdout(tmp_path: Path) -> None:
    path = tmp_path / "out.dat"
    assert kr16(f"fk {_HOME} -o {path} --json").code == 0
    assert path.read_text().startswith("{")
    assert kr16(f"fk {_HOME} -o - --json").out == path.read_text()


def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "out.json", tmp_path / "link.json"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    assert kr16(f"fk {_HOME} -o {link}").code == 0
    assert link.is_symlink()
    assert path.read_text().startswith("{")
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_new_files_obey_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        assert kr16(f"fk {_HOME} -o {tmp_path / 'out.json'}").code == 0
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "out.json").stat().st_mode) == 0o640


def test_unwritable_outputs_are_refused_before_the_work(tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("no header\n")
    # The output is tried first, so the input is not even read.
    complains(kr16(f"fk --input {bad} -o {tmp_path / 'no' / 'out.csv'}"), "out.csv", "No such file")
    complains(kr16(f"fk {_HOME} --json -o {tmp_path}"), "is a directory")


def test_a_failed_run_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "out.json"
    path.write_text("old")
    complains(kr16(f"fk 1 2 3 4 5 x -o {path}"), "A6")
    complains(kr16(f"fk --input {tmp_path / 'none.csv'} -o {path}"), "none.csv")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_devices_are_written_to() -> None:
    assert kr16(f"fk {_HOME} -o /dev/null").code == 0
    done = kr16(f"fk {_HOME} -o /dev/full --json")
    complains(done, "/dev/full", "No space left")


# Whatever happens -------------------------------------------------------------------------------


def test_our_bugs_are_one_line_and_code_70(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> int:
        raise ZeroDivisionError("some\nthing")

    monkeypatch.setattr(entry, "_run", fail)
    complains(kr16("fk"), "our bug", "ZeroDivisionError: some thing", "--debug", code=70)
    with pytest.raises(ZeroDivisionError):
        kr16("fk", "--debug")
    monkeypatch.setenv("KR16_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        kr16("fk")


def test_interrupt_is_one_line_and_code_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(_: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(entry, "_run", interrupt)
    done = kr16("fk")
    assert (done.code, done.out) == (130, "")
    assert done.err == "kr16: interrupted; nothing more was written\n"


@pytest.mark.parametrize(
    ("sent", "code", "said"),
    [
        (signal.SIGINT, 130, "kr16: interrupted; nothing more was written\n"),
        (signal.SIGTERM, 143, "kr16: terminated; nothing more was written\n"),
    ],
)
def test_interrupted_batch_leaves_nothing_behind(
    tmp_path: Path, sent: signal.Signals, code: int, said: str
) -> None:
    rows = "0,-90,90,0,10,0\n" * 200_000
    (tmp_path / "q.csv").write_text("a1,a2,a3,a4,a5,a6\n" + rows)
    command = [sys.executable, "-m", "kr16cli", "fk", "--input", "q.csv", "-o", "out.csv"]
    # A parent in the background ignores SIGINT, and its children would inherit that.
    with subprocess.Popen(
        command,
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        until = time.monotonic() + 30
        while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < until:
            time.sleep(0.02)  # until the temporary file is there
        process.send_signal(sent)
        _, err = process.communicate(timeout=60)
    assert process.returncode == code
    assert err == said
    assert [path.name for path in tmp_path.iterdir()] == ["q.csv"]


def test_a_callers_own_handling_of_sigterm_is_left_alone() -> None:
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert kr16(f"fk {_HOME}").code == 0
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    seen: list[object] = []

    def theirs(number: int, frame: object) -> None:
        seen.append(number)

    def killed(_: object) -> int:
        signal.raise_signal(signal.SIGTERM)
        return 0

    signal.signal(signal.SIGTERM, theirs)
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(entry, "_run", killed)
            assert kr16("fk").code == 0
        assert signal.getsignal(signal.SIGTERM) is theirs
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    assert seen == [signal.SIGTERM]


def test_commands_run_in_a_thread_without_signals() -> None:
    outcomes: list[int] = []
    thread = threading.Thread(target=lambda: outcomes.append(kr16(f"fk {_HOME}").code))
    thread.start()
    thread.join(timeout=60)
    assert outcomes == [0]


def test_a_reader_that_stops_early_is_no_error(tmp_path: Path) -> None:
    (tmp_path / "q.csv").write_text("a1,a2,a3,a4,a5,a6\n" + "0,-90,90,0,10,0\n" * 3000)
    program = f"{sys.executable} -m kr16cli fk --input q.csv --json"
    shell = f"set -o pipefail; {program} | head -n 1"
    done = subprocess.run(
        ["bash", "-c", shell], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "{\n", "")


@pytest.mark.parametrize(
    ("redirection", "why"), [(">&-", "is closed"), ("> /dev/full", "No space left")]
)
def test_stdout_that_cannot_be_written_is_said(redirection: str, why: str) -> None:
    shell = f"{sys.executable} -m kr16cli fk {_HOME} {redirection}"
    done = subprocess.run(
        ["bash", "-c", shell], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert why in done.stderr


def test_stdin_is_argv() -> None:
    done = _process("fk", "-", "--format", "csv", input="a1,a2,a3,a4,a5,a6\n1,-2,3,-4,5,-6\n")
    assert done.returncode == 0
    single = _process("fk", "1", "-2", "3", "-4", "5", "-6", "--format", "csv")
    batch_row = done.stdout.splitlines()[1].split(",")
    assert batch_row[:8] == single.stdout.splitlines()[1].split(",")[:8]


def test_stdin_is_not_read_unasked() -> None:
    read_end, write_end = os.pipe()  # never written, never closed: reading would hang
    try:
        done = _process("fk", *_HOME.split(), stdin=read_end)
    finally:
        os.close(read_end)
        os.close(write_end)
    assert done.returncode == 0


# Start-up ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        f"fk {_HOME}",
        "ik 1088 0 1320 0 90 0 --json",
        f"jacobian {_HOME} --json",
        f"dynamics {_HOME} --qdd 1 2 3 4 5 6",
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
        f"main({f'fk {_HOME}'.split()!r})\n"
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
    assert _process(env=environment | words).stdout.split() == ["jacobian"]
    words = {"COMP_WORDS": "kr16 ik --tu", "COMP_CWORD": "2"}
    assert _process(env=environment | words).stdout.split() == ["--turns", "--turn"]


def test_completion_script_can_be_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    done = _process("--show-completion", env={**os.environ, "SHELL": "/bin/bash"})
    assert "_KR16_COMPLETE" in done.stdout or "not supported" in done.stderr.lower()


# robot check and template -----------------------------------------------------------------------


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
    complains(kr16(f"fk {_HOME} --robot {path}"), str(path))
