"""`kr16` as a process, whatever happens: our bugs, signals, threads, broken streams."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from command_line import complains, kr16, kr16_process
from joint_tables import HOME
from kr16cli.cli import entry


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
    assert kr16(f"fk {HOME}").code == 0
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
    thread = threading.Thread(target=lambda: outcomes.append(kr16(f"fk {HOME}").code))
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
    shell = f"{sys.executable} -m kr16cli fk {HOME} {redirection}"
    done = subprocess.run(
        ["bash", "-c", shell], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert why in done.stderr


def test_stdin_is_argv() -> None:
    done = kr16_process("fk", "-", "--format", "csv", input="a1,a2,a3,a4,a5,a6\n1,-2,3,-4,5,-6\n")
    assert done.returncode == 0
    single = kr16_process("fk", "1", "-2", "3", "-4", "5", "-6", "--format", "csv")
    batch_row = done.stdout.splitlines()[1].split(",")
    assert batch_row[:8] == single.stdout.splitlines()[1].split(",")[:8]


def test_stdin_is_not_read_unasked() -> None:
    read_end, write_end = os.pipe()  # never written, never closed: reading would hang
    try:
        done = kr16_process("fk", *HOME.split(), stdin=read_end)
    finally:
        os.close(read_end)
        os.close(write_end)
    assert done.returncode == 0
