"""The shape of the package: who may import whom, what stays light, how long a file may be."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import kr16cli
from kr16cli.cli.app import COMMANDS

_ROOT = Path(__file__).resolve().parent.parent
_PACKAGE = _ROOT / "kr16cli"
_FILES = sorted(_PACKAGE.rglob("*.py"))
_FACADE = _PACKAGE / "__init__.py"

# From the ground up: a part imports only from rows below its own, and from itself.
_ORDER = (
    {"errors", "tolerances", "units"},
    {"assets", "linear"},
    {"robot"},
    {"robot_rules"},
    {"robot_check"},
    {"robot_file"},
    {"model"},
    {"single", "arrays"},
    {"kernels"},
    {"kinematics"},
    {"api"},
    {"rollout"},
    {"krl"},
    {"kuka"},
    {"simulate", "export"},
    {"queries"},
    {"verify", "fmi"},
    {"study"},
    {"report"},
    {"bench"},
    {"cli"},
)
_RANK = {part: rank for rank, row in enumerate(_ORDER) for part in row}

# A library that only one part may import, so that all else runs without it.
_KEEPERS = {
    "matplotlib": "report",
    "pythonfmu": "fmi",
    "fmpy": "fmi",
    "distributed": "study",
    "pyarrow": "study",
}


def _part(path: Path) -> str:
    """The part of the package a file belongs to: `model` for kr16cli/model/chain.py."""
    return path.relative_to(_PACKAGE).parts[0].removesuffix(".py")


def _imports(tree: ast.AST, home: tuple[str, ...]) -> Iterator[str]:
    """Dotted names of all that is imported, at top level or nested, relative imports resolved."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = [*home[: len(home) - node.level + 1]] if node.level else []
            source = ".".join([*base, *([node.module] if node.module else [])])
            if source == "kr16cli":  # a part, or a public name that stands for its module
                yield from (f"kr16cli.{kr16cli._HOME.get(a.name, a.name)}" for a in node.names)
            else:
                yield source


def _imports_of(path: Path) -> set[str]:
    home = path.relative_to(_ROOT).parent.parts
    return set(_imports(ast.parse(path.read_text(encoding="utf-8")), home))


def _parts_imported(path: Path) -> set[str]:
    names = (name.split(".") for name in _imports_of(path))
    inside = {name[1] for name in names if name[0] == "kr16cli" and len(name) > 1}
    return inside - {"__version__"}


def _libraries(path: Path) -> set[str]:
    """Third-party packages a file imports."""
    tops = {name.split(".")[0] for name in _imports_of(path)}
    return tops - set(sys.stdlib_module_names) - {"kr16cli"}


def _name(path: Path) -> str:
    return str(path.relative_to(_ROOT))


def test_every_part_has_its_place_in_the_order() -> None:
    assert {_part(path) for path in _FILES} - {"__init__", "__main__"} <= set(_RANK)


@pytest.mark.parametrize("path", [f for f in _FILES if f != _FACADE], ids=_name)
def test_nothing_imports_upward(path: Path) -> None:
    part = _part(path)
    rank = _RANK.get(part, len(_ORDER))
    upward = {
        other
        for other in _parts_imported(path)
        if other != part and _RANK.get(other, len(_ORDER)) >= rank
    }
    assert not upward, f"{_name(path)} imports {sorted(upward)}, which stand no lower than {part}"


@pytest.mark.parametrize("path", sorted((_PACKAGE / "model").glob("*.py")), ids=_name)
def test_the_model_needs_only_the_robot_and_the_standard_library(path: Path) -> None:
    assert _parts_imported(path) <= {"errors", "tolerances", "units", "robot", "model"}
    assert not _libraries(path)


@pytest.mark.parametrize(("library", "keeper"), _KEEPERS.items())
def test_heavy_library_is_imported_by_its_keeper_only(library: str, keeper: str) -> None:
    users = {_name(path) for path in _FILES if library in _libraries(path)}
    assert {user for user in users if not user.startswith(f"kr16cli/{keeper}")} == set()


def test_import_reader_sees_every_form() -> None:
    source = """
import kr16cli.api
from kr16cli import Robot, errors, __version__
from .. import units
from ..model.chain import frames
from . import table
def late():
    import numpy.linalg as la
    if TYPE_CHECKING:
        from kr16cli.report import pages
"""
    assert set(_imports(ast.parse(source), ("kr16cli", "cli"))) == {
        "kr16cli.api",
        "kr16cli.errors",
        "kr16cli.__version__",
        "kr16cli.units",
        "kr16cli.model.chain",
        "kr16cli.cli",
        "numpy.linalg",
        "kr16cli.report",
    }


@pytest.mark.parametrize("path", _FILES, ids=_name)
def test_file_is_one_room(path: Path) -> None:
    lines = len(path.read_text(encoding="utf-8").splitlines())
    command = path.parent == _PACKAGE / "cli" and path.stem in COMMANDS
    assert lines < 60 if command else lines <= 400


@pytest.mark.parametrize("folder", ["data", "fmu", "reports"])
def test_asset_folder_is_no_package(folder: str) -> None:
    assert (_ROOT / folder).is_dir()
    assert not list((_ROOT / folder).rglob("__init__.py"))


@pytest.mark.parametrize(
    "module",
    ["kr16cli", "kr16cli.robot_file", "kr16cli.single", "kr16cli.kuka", "kr16cli.cli"],
)
def test_import_stays_light(module: str) -> None:
    heavy = "{'numpy', 'scipy', 'matplotlib'}"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {module}; print(sorted({heavy} & set(sys.modules)))"],
        cwd=_ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


def test_public_names_are_there_and_no_others() -> None:
    assert set(kr16cli._HOME) | {"__version__"} == set(kr16cli.__all__)
    for name, home in kr16cli._HOME.items():
        public = getattr(kr16cli, name)
        assert public.__name__ == name
        assert public.__module__.startswith(f"kr16cli.{home}")
    assert set(kr16cli.__all__) <= set(dir(kr16cli))
    with pytest.raises(AttributeError, match="'nothing'"):
        _ = kr16cli.nothing  # type: ignore[attr-defined]
