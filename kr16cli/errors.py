"""The errors a user can meet, each with its exit code and the numbers that explain it.

Every message is one line: what is wrong, the value, the limit or rule, and what to do.
Exit codes: 1 the answer is no, 2 usage or unreadable input or unwritable output, 3 no
physical answer, 4 an optional part is missing; 70 is kept for our own bugs.
"""

from __future__ import annotations

from pathlib import Path


class Kr16Error(Exception):
    """Root of all errors that are not our bug; `exit_code` is what the command ends with."""

    exit_code = 70


class InputError(Kr16Error, ValueError):
    """An argument, option or text that cannot be used."""

    exit_code = 2


class ShapeError(InputError):
    """An array of the wrong shape.

    Attributes: `name` of the argument, `shape` found, `expected` as text.
    """

    def __init__(self, name: str, shape: tuple[int, ...], expected: str) -> None:
        self.name, self.shape, self.expected = name, shape, expected
        super().__init__(f"{name} has shape {shape}; expected {expected}")


class NonFiniteError(InputError):
    """NaN or infinity where a number is needed.

    Attributes: `name` of the argument, `index` of the first bad element, `value`.
    """

    def __init__(self, name: str, index: tuple[int, ...], value: float) -> None:
        self.name, self.index, self.value = name, index, value
        where = f"{name}[{', '.join(map(str, index))}]" if index else name
        super().__init__(f"{where} is {value}; every number must be finite")


class FileError(Kr16Error):
    """A file that cannot be read, written or understood.

    Attributes: `path`, `reason`.
    """

    exit_code = 2

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path, self.reason = str(path), reason
        super().__init__(f"{path}: {reason}")


class ParameterError(FileError):
    """A value in a TOML file (robot or scenario) that breaks a rule.

    Attributes: `path`, `key` (dotted, joints and links counted from 1), `value`, `rule`.
    """

    def __init__(self, path: str | Path, key: str, value: object, rule: str) -> None:
        self.key, self.value, self.rule = key, value, rule
        shown = "missing" if value is None else f"= {value!r}"
        super().__init__(path, f"{key} {shown}: {rule}")


class NoAnswerError(Kr16Error):
    """A question without a physical answer: unreachable, or only outside the limits."""

    exit_code = 3


class CheckFailedError(Kr16Error):
    """It ran, and the answer is no."""

    exit_code = 1


class MissingPartError(Kr16Error):
    """An optional part is not installed.

    Attributes: `part`, `extra` (the pip extra that brings it, or None), `remedy`.
    """

    exit_code = 4

    def __init__(self, part: str, extra: str | None, remedy: str | None = None) -> None:
        self.part, self.extra = part, extra
        self.remedy = remedy or f"run: pip install 'kr16cli[{extra}]'"
        super().__init__(f"{part} is not installed; {self.remedy}")
