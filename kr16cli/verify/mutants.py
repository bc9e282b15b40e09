"""Faults to seed: changed source of the model, the chapter's misprints, changed parameters."""

from __future__ import annotations

import ast
import copy
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr16cli
from kr16cli.assets import asset
from kr16cli.robot_file import DEFAULT
from kr16cli.verify.edits import Edit, edits
from kr16cli.verify.misprints import MISPRINTS

_PACKAGE = Path(kr16cli.__file__).resolve().parent


@dataclass(frozen=True)
class Mutant:
    """One seeded fault.

    `where` is the function it stands in ("" at the top of a module), `change` the source line
    before and after. `module` and `source` give the mutated text of a module; for a number of
    the parameter file `table` is the whole changed file instead.
    """

    id: str
    file: str
    where: str
    kind: str
    change: str
    module: str = ""
    source: str = ""
    table: Mapping[str, Any] | None = None


def model_files() -> list[Path]:
    """The files of kr16cli/model, by name."""
    return sorted((_PACKAGE / "model").glob("*.py"))


def all_mutants() -> list[Mutant]:
    """Every mutant: the model's files, the chapter's misprints, the shipped parameter file."""
    found = [m for path in model_files() for m in source_mutants(path)]
    found += misprint_mutants()
    found += parameter_mutants(asset(f"data/{DEFAULT}.toml"))
    return found


def source_mutants(path: Path) -> list[Mutant]:
    """Every mutant of one file of the model."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    return [_mutant(path, text, tree, edit) for edit in edits(text, tree)]


def misprint_mutants() -> list[Mutant]:
    """The chapter's misprints put back where the model has the equation.

    Raises:
        ValueError: the model's text no longer has the line that a misprint replaces.
    """
    found = []
    for misprint in MISPRINTS:
        path = _PACKAGE / "model" / misprint.file
        text = path.read_text(encoding="utf-8")
        if text.count(misprint.right) != 1:
            raise ValueError(f"misprint of {misprint.equation}: {misprint.right!r} is not once in "
                             f"{misprint.file}")  # fmt: skip
        start = text.index(misprint.right)
        edit = Edit(start, start + len(misprint.right), misprint.printed, "misprint")
        mutant = _mutant(path, text, ast.parse(text), edit)
        change = f"{misprint.equation} as printed: {mutant.change}"
        found.append(Mutant(mutant.id, mutant.file, mutant.where, "misprint", change,
                            mutant.module, mutant.source))  # fmt: skip
    return found


def _mutant(path: Path, text: str, tree: ast.Module, edit: Edit) -> Mutant:
    changed = text[: edit.start] + edit.text + text[edit.end :]
    first = text.rfind("\n", 0, edit.start) + 1
    last = text.find("\n", edit.end)
    line = text.count("\n", 0, edit.start) + 1
    before = text[first:last]
    after = text[first : edit.start] + edit.text + text[edit.end : last]
    file = f"model/{path.name}"
    return Mutant(
        id=f"{file}:{line}:{edit.start - first + 1}:{edit.kind}:{edit.text.strip()}"
        if edit.kind != "misprint"
        else f"{file}:{line}:{edit.start - first + 1}:misprint",
        file=file,
        where=function_at(tree, line),
        kind=edit.kind,
        change=f"{' '.join(before.split())} -> {' '.join(after.split())}",
        module=f"kr16cli.model.{path.stem}",
        source=changed,
    )


def function_at(tree: ast.Module, line: int) -> str:
    """The outermost function or method around a line, "" where there is none."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and node.lineno <= line <= (node.end_lineno or 0):
            for method in node.body:
                if _holds(method, line):
                    return f"{node.name}.{method.name}"  # type: ignore[attr-defined]
        elif _holds(node, line):
            return str(node.name)  # type: ignore[attr-defined]
    return ""


def _holds(node: ast.stmt, line: int) -> bool:
    """Whether a function's body, beyond its signature, has the line."""
    return isinstance(node, ast.FunctionDef) and node.lineno <= line <= (node.end_lineno or 0)


def parameter_mutants(path: Path) -> Iterator[Mutant]:
    """Every number of a parameter file: lengths by 0.1 mm, others by 0.1 % (zeros by 0.001)."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    for keys in _numbers(table, ()):
        changed = copy.deepcopy(table)
        holder: Any = changed
        for key in keys[:-1]:
            holder = holder[key]
        old = holder[keys[-1]]
        length = keys[0] == "geometry" or "com" in keys
        holder[keys[-1]] = new = old + 1e-4 if length else old * 1.001 if old else 1e-3
        name = ".".join(str(key + 1 if isinstance(key, int) else key) for key in keys)
        file = f"data/{path.name}"
        yield Mutant(f"{file}:{name}", file, name, "parameter", f"{old!r} -> {new!r}",
                     table=changed)  # fmt: skip


def _numbers(node: Any, keys: tuple[str | int, ...]) -> Iterator[tuple[str | int, ...]]:
    if isinstance(node, Mapping):
        for key, value in node.items():
            yield from _numbers(value, (*keys, key))
    elif isinstance(node, Sequence) and not isinstance(node, str):
        for i, value in enumerate(node):
            yield from _numbers(value, (*keys, i))
    elif isinstance(node, int | float) and not isinstance(node, bool):
        yield keys
