"""The README's examples do what the README shows; the runner itself can fail."""

from __future__ import annotations

from pathlib import Path

import pytest

import examples

_PATH = Path(__file__).resolve().parent.parent / "README.md"
_README = _PATH.read_text(encoding="utf-8") if _PATH.exists() else ""
_CONSOLE = examples.console_examples(_README)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for the whole document: an example may read what another wrote."""
    return tmp_path_factory.mktemp("readme")


def test_shows_enough_examples() -> None:
    assert len(_CONSOLE) >= 4


def test_every_prompt_line_is_an_example() -> None:
    prompts = [line for line in _README.splitlines() if line.startswith("$ ")]
    codes = [line for line in prompts if line == "$ echo $?"]
    assert len(_CONSOLE) == len(prompts) - len(codes)


@pytest.mark.parametrize("example", _CONSOLE, ids=lambda example: f"line{example.line}")
def test_console_example(example: examples.Example, folder: Path) -> None:
    examples.check(example, folder)


def test_python_blocks(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    examples.run_python(_README, str(_PATH))


_DOCUMENT = """
```console
$ printf 'one\\ntwo\\nthree 3.14\\n'
one
...
three ...
$ false
$ echo $?
1
$ printf '%s\\n' a \\
    b > made.txt
```
Text.
```console
$ cat made.txt
a
b
```
"""


def test_runner_reads_commands_outputs_codes_and_lines() -> None:
    found = examples.console_examples(_DOCUMENT)
    assert [(one.command.split()[0], one.code, one.line) for one in found] == [
        ("printf", 0, 3),
        ("false", 1, 7),
        ("printf", 0, 10),
        ("cat", 0, 15),
    ]
    assert found[0].output == "one\n...\nthree ..."
    assert found[2].output == ""


def test_runner_accepts_what_is_shown(tmp_path: Path) -> None:
    for example in examples.console_examples(_DOCUMENT):
        examples.check(example, tmp_path)


@pytest.mark.parametrize(
    "wrong",
    [
        "$ echo 1\n2",
        "$ echo 1",
        "$ true\n1",
        "$ printf '1\\n2\\n'\n1",
        "$ printf '1\\n2\\n'\n...\n1",
        "$ false",
        "$ false\n$ echo $?\n2",
        "$ true\n$ echo $?\n1",
    ],
)
def test_runner_rejects_what_is_not_shown(wrong: str, tmp_path: Path) -> None:
    (example,) = examples.console_examples(f"```console\n{wrong}\n```\n")
    with pytest.raises(AssertionError, match=r"line 2: \$ "):
        examples.check(example, tmp_path)


def test_python_runner_reports_a_wrong_value_with_its_line() -> None:
    good = "```python\nx = 2\n```\n\n```python\n>>> x + 1\n3\n\n```\n"
    examples.run_python(good, "page.md")
    with pytest.raises(AssertionError, match=r"page\.md.*line 6"):
        examples.run_python(good.replace("\n3\n", "\n4\n"), "page.md")
    with pytest.raises(ZeroDivisionError):
        examples.run_python("```python\n1 / 0\n```\n", "page.md")


def test_help_commands_are_found() -> None:
    page = "Usage: kr16 fk\n\n  $ kr16 fk 0 -90 90 0 0 0\n  kr16 is a command\n  $ ls\n"
    assert examples.help_commands(page) == ["kr16 fk 0 -90 90 0 0 0"]
