"""Run `kr16` in this process, as quickly as a function call, or in one of its own."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from typing import Any, NamedTuple

from kr16cli.cli import main


class Outcome(NamedTuple):
    """Exit code and what was written to stdout and stderr."""

    code: int
    out: str
    err: str

    def json(self) -> dict[str, Any]:
        """stdout as JSON; NaN and Infinity are refused."""

        def refuse(word: str) -> None:
            raise AssertionError(f"{word} in JSON")

        value: dict[str, Any] = json.loads(self.out, parse_constant=refuse)
        return value

    def result(self) -> dict[str, Any]:
        """The `result` of the JSON envelope of a successful run."""
        assert self.code == 0, self.err
        value: dict[str, Any] = self.json()["result"]
        return value


def kr16(*arguments: object, stdin: str | bytes = "") -> Outcome:
    """Run the command line with these arguments; a number is written as Python writes it.

    One string with blanks is split like a simple shell line.
    """
    words = [str(argument) for argument in arguments]
    if len(words) == 1:
        words = words[0].split()
    out, err = io.StringIO(), io.StringIO()
    content = stdin.encode() if isinstance(stdin, str) else stdin
    before, sys.stdin = sys.stdin, io.TextIOWrapper(io.BytesIO(content), encoding="utf-8")
    try:
        with redirect_stdout(out), redirect_stderr(err):
            code = main(words)
    finally:
        sys.stdin = before
    return Outcome(code, out.getvalue(), err.getvalue())


def kr16_process(*words: str, **options: object) -> subprocess.CompletedProcess[str]:
    """Run the command line in a process of its own; options go to `subprocess.run`."""
    command = [sys.executable, "-m", "kr16cli", *words]
    settings: dict[str, object] = {"capture_output": True, "text": True, "timeout": 60}
    return subprocess.run(command, check=False, **(settings | options))  # type: ignore[call-overload,no-any-return]


def complains(outcome: Outcome, *words: str, code: int = 2) -> None:
    """Assert one line on stderr that names all the words, nothing on stdout, and the code."""
    assert outcome.code == code, outcome
    assert outcome.out == ""
    lines = outcome.err.splitlines()
    assert len(lines) == 1, outcome.err
    assert lines[0].startswith("kr16: error: ")
    for word in words:
        assert word in lines[0], lines[0]
