"""Run the examples that documents show: `$ command` lines and Python blocks.

A ```` ```console ```` block holds commands after `$ ` (a trailing backslash continues one), each
followed by its output. In the output, `...` stands for any text, on a line of its own for any
lines. A command must end with code 0, unless the document goes on with `$ echo $?` and the code.
Examples of one document share a folder, so one may read what another wrote.
"""

from __future__ import annotations

import doctest
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_PROMPT = re.compile(r"^\s*\$ (?=kr16\b)", re.MULTILINE)


@dataclass(frozen=True)
class Example:
    """A command as typed, the output shown below it, and the exit code it must end with."""

    command: str
    output: str
    code: int
    line: int


def blocks(document: str, language: str) -> Iterator[tuple[int, str]]:
    """Line number and text of each fenced block in a language."""
    for found in _FENCE.finditer(document):
        if found[1] == language:
            yield document.count("\n", 0, found.start(2)) + 1, found[2]


def console_examples(document: str) -> list[Example]:
    """Every command of the document's console blocks, in order."""
    return [one for line, block in blocks(document, "console") for one in _read(block, line)]


def help_commands(page: str) -> list[str]:
    """The `$ kr16 ...` lines of a help page, which shows no output."""
    return [line.strip()[2:] for line in page.splitlines() if _PROMPT.match(line)]


def _read(block: str, first_line: int) -> list[Example]:
    """The examples of one console block; a `$ echo $?` sets the code of the one before it."""
    examples: list[Example] = []
    for found in re.finditer(r"^\$ ((?:.*\\\n)*.*)\n((?:(?!\$ ).*\n)*)", block, re.MULTILINE):
        command, output = found[1], found[2].rstrip("\n")
        if command == "echo $?":
            last = examples.pop()
            examples.append(Example(last.command, last.output, int(output), last.line))
        else:
            line = first_line + block.count("\n", 0, found.start())
            examples.append(Example(command, output, 0, line))
    return examples


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command as a reader would: kr16 on the PATH, no colour, stdout and stderr together."""
    environment = {
        **os.environ,
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
        "COLUMNS": "100",
        "NO_COLOR": "1",
        "TERM": "dumb",
    }
    return subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        timeout=120,
    )


def matches(shown: str, actual: str) -> bool:
    """Whether an output is the one shown; blanks at the end of a line or the text never count."""
    pattern = "".join(map(_line_pattern, shown.rstrip().splitlines()))
    text = "".join(f"{line.rstrip()}\n" for line in actual.rstrip().splitlines())
    return re.fullmatch(pattern, text) is not None


def _line_pattern(line: str) -> str:
    if line.strip() == "...":
        return r"(?:.*\n)*?"
    return ".*?".join(map(re.escape, line.rstrip().split("..."))) + r"\n"


def check(example: Example, folder: Path) -> None:
    """Run an example and compare; AssertionError shows both outputs."""
    done = run(example.command, folder)
    where = f"line {example.line}: $ {example.command}\n"
    assert done.returncode == example.code, (
        f"{where}ended with {done.returncode}, not {example.code}:\n{done.stdout}"
    )
    assert matches(example.output, done.stdout), (
        f"{where}--- shown\n{example.output}\n--- printed\n{done.stdout}"
    )


def run_python(document: str, name: str) -> None:
    """Run the document's python blocks in order, in one namespace; `>>>` ones as doctests."""
    namespace: dict[str, object] = {"__name__": "__main__"}
    for line, block in blocks(document, "python"):
        if not block.startswith(">>>"):
            exec(compile("\n" * (line - 1) + block, name, "exec"), namespace)
            continue
        test = doctest.DocTestParser().get_doctest(block, namespace, name, name, line - 1)
        report: list[str] = []
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
        runner.run(test, out=report.append, clear_globs=False)
        namespace = test.globs
        assert runner.summarize(verbose=False).failed == 0, "".join(report)
