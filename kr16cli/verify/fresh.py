"""Evaluate mutants in fresh processes: `python -m kr16cli.verify.fresh` answers jobs on stdin.

The process loads the libraries and no part of the model, and forks for each job, so that a job
costs no import of NumPy and nothing of one job is left for the next. Without fork it answers
one job and ends; whoever asks starts another. One JSON object per line, in and out.
"""

from __future__ import annotations

import ast
import faulthandler
import gc
import importlib
import importlib.util
import json
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from kr16cli import robot_file
from kr16cli.robot import RobotData
from kr16cli.verify import exact, registry, sampling
from kr16cli.verify.independent import exponentials, lagrange, roots
from kr16cli.verify.mutants import function_at
from kr16cli.verify.records import Case, Setting

_READY = (exact, sampling, exponentials, lagrange, roots)  # loaded once, used by the suites
_LIBRARIES = (
    "concurrent.futures.thread", "csv", "fractions", "mpmath", "scipy.integrate", "scipy.linalg",
    "scipy.spatial.transform",
)  # fmt: skip
_MODEL = Path(robot_file.__file__).resolve().parent / "model"
_NOTE = "__note_call__"

ERROR, TIMEOUT = "error", "timeout"


class _Changed(SourceFileLoader):
    """Loads a module from a changed tree, with names put into the module before."""

    def __init__(self, name: str, path: str, tree: ast.Module, names: Mapping[str, Any]) -> None:
        super().__init__(name, path)
        self._tree, self._names = tree, names

    def get_code(self, fullname: str) -> CodeType:
        code: CodeType = compile(self._tree, self.path, "exec", dont_inherit=True)
        return code

    def exec_module(self, module: ModuleType) -> None:
        vars(module).update(self._names)
        super().exec_module(module)


class _Finder(MetaPathFinder):
    """Finds modules of the model as `change` makes them; others as they are."""

    def __init__(self, change: Callable[[str, Path], _Changed | None]) -> None:
        self._change = change

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        package, _, name = fullname.rpartition(".")
        if package != "kr16cli.model":
            return None
        place = _MODEL / f"{name}.py"
        loader = self._change(fullname, place)
        if loader is None:
            return None
        return importlib.util.spec_from_file_location(fullname, place, loader=loader)


def first_failure(job: Mapping[str, Any]) -> dict[str, Any]:
    """What detects a mutant: the id of the first case that fails, or `error`; None if nothing.

    Args:
        job: `module` and `source` or `table` of the mutant, `cases` as (suite, id) in the order
            to run them, `seed`.

    Returns:
        {"by": ..., "says": the evidence of what failed}.
    """

    def change(name: str, path: Path) -> _Changed | None:
        same = name == job["module"]
        return _Changed(name, str(path), ast.parse(job["source"]), {}) if same else None

    sys.meta_path.insert(0, _Finder(change))
    try:
        setting = _setting(job)
        for suite, id in job["cases"]:
            case = next(c for c in registry.cases([suite]) if c.id == id)
            result = next(iter(registry.run([case], setting)))
            if result.status == "failed":
                return {"by": id, "says": result.evidence}
    except Exception as error:  # an import or a robot that fails is a detection too
        return {"by": ERROR, "says": f"{type(error).__name__}: {error}"}
    return {"by": None, "says": ""}


def baseline(job: Mapping[str, Any]) -> dict[str, Any]:
    """Run all cases on the model as it is.

    Returns:
        {"cases": [{suite, id, seconds, status, says, calls}]}: `seconds` with what its suite
        takes to import, `calls` the functions of the model that the case calls, file:function.
    """
    called: set[str] = set()

    def change(name: str, path: Path) -> _Changed:
        return _Changed(name, str(path), _noting(path), {_NOTE: called.add})

    sys.meta_path.insert(0, _Finder(change))
    _setting(job)  # imports what every case needs
    found = []
    for suite in job["suites"]:
        start = time.process_time()
        # Other people's engines are left out: the suites must see a fault without them.
        cases = [case for case in registry.cases([suite]) if case.engine is None]
        spent = time.process_time() - start
        for case in cases:
            result = _watched(case, job, called)
            found.append(result | {"seconds": spent + result["seconds"]})
    return {"cases": found}


def _noting(path: Path) -> ast.Module:
    """A module whose outermost functions and methods say that they are called."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    methods = [node.body for node in tree.body if isinstance(node, ast.ClassDef)]
    for node in [node for body in (tree.body, *methods) for node in body]:
        if isinstance(node, ast.FunctionDef):
            name = f"{path.name}:{function_at(tree, node.lineno)}"
            note = ast.parse(f"{_NOTE}({name!r})").body[0]
            node.body.insert(0, ast.fix_missing_locations(ast.copy_location(note, node.body[0])))
    return tree


def _watched(case: Case, job: Mapping[str, Any], called: set[str]) -> dict[str, Any]:
    _forget()
    called.clear()
    start = time.process_time()
    # A robot of its own: what it computes once is then seen with every case.
    result = next(iter(registry.run([case], _setting(job))))
    return {
        "suite": case.suite,
        "id": case.id,
        "seconds": time.process_time() - start,
        "status": result.status,
        "says": result.evidence,
        "calls": sorted(called),
    }


def _forget() -> None:
    """Drop what one case may find ready from another: a mutant's process has only the one."""
    from kr16cli.kernels import straight
    from kr16cli.verify.chapter.bench import shared_bench

    straight.functions.cache_clear()
    shared_bench.cache_clear()


@cache
def _shipped() -> RobotData:
    return robot_file.load_data()


def _setting(job: Mapping[str, Any]) -> Setting:
    from kr16cli.api import Robot

    table = job.get("table")
    data = robot_file.parse_data(table, f"{robot_file.DEFAULT}.toml") if table else _shipped()
    return Setting(Robot(data), job["seed"], quick=True)


def _answer(job: Mapping[str, Any]) -> dict[str, Any]:
    return baseline(job) if job["kind"] == "baseline" else first_failure(job)


def _limited(job: Mapping[str, Any], out: int) -> None:
    """Write the answer, or end the process after `limit` seconds."""
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(job["limit"], exit=True, file=nowhere)
        answer = _answer(job)
        faulthandler.cancel_dump_traceback_later()
    _write(out, answer)


def _write(out: int, answer: Mapping[str, Any]) -> None:
    data = (json.dumps(answer) + "\n").encode()
    while data:
        data = data[os.write(out, data) :]


def _forked(job: Mapping[str, Any], out: int) -> None:
    """Answer a job in a child; a child that dies has detected the mutant."""
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            _limited(job, out)
            code = 0
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    if status != 0:
        late = time.monotonic() - start >= job["limit"]
        _write(out, {"by": TIMEOUT if late else ERROR, "says": f"process ended with {status}"})


def main() -> None:
    """Answer jobs until stdin ends."""
    for name in _LIBRARIES:
        importlib.import_module(name)
    _shipped()
    gc.freeze()  # forks then share what is loaded
    out = os.dup(1)  # what the model prints must not end up among the answers
    os.dup2(2, 1)
    for line in sys.stdin:
        job = json.loads(line)
        if hasattr(os, "fork"):
            _forked(job, out)
        else:
            _limited(job, out)
            break


if __name__ == "__main__":
    main()
