"""The package as users get it: built, installed in a clean environment, run from elsewhere."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

import kr16cli

_ROOT = Path(__file__).resolve().parent.parent

# What belongs to a checkout and not to a copy of the project: git, environments, caches.
_LEFT_BEHIND = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "*.egg-info")

_HOME = ("fk", "0", "-90", "90", "0", "0", "0", "--json")

_Install = Callable[..., Path]

_HAS_COMPILER = any(shutil.which(name) for name in ("cc", "gcc", "clang"))


def _run(*command: str | Path, cwd: Path, env: dict[str, str] | None = None) -> str:
    """Stdout of a command; AssertionError with all it said if it fails."""
    done = subprocess.run(
        list(map(str, command)), cwd=cwd, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clean copy of the project, so that nothing here writes into the checkout."""
    copy = tmp_path_factory.mktemp("source") / "kr16cli"
    shutil.copytree(_ROOT, copy, ignore=_LEFT_BEHIND)
    return copy


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built as pip builds it."""
    folder = tmp_path_factory.mktemp("wheel")
    _run(sys.executable, "-m", "pip", "wheel", "--no-deps", "-w", folder, source, cwd=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture
def install(tmp_path: Path) -> _Install:
    """Install into a fresh environment; returns its bin folder."""

    def into_fresh_environment(*what: str | Path, env: dict[str, str] | None = None) -> Path:
        venv.create(tmp_path / "venv", with_pip=True)
        bin_folder = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
        _run(bin_folder / "python", "-m", "pip", "install", *what, cwd=tmp_path, env=env)
        return bin_folder

    return into_fresh_environment


def _check_commands(bin_folder: Path, cwd: Path, *, native: bool = _HAS_COMPILER) -> None:
    """The installed command answers, from a folder that is not the checkout."""
    engine = json.loads(_run(bin_folder / "kr16", "info", "--json", cwd=cwd))["result"]["engine"]
    assert engine["arrays"] == ("native" if native else "numpy")
    home = json.loads(_run(bin_folder / "kr16", *_HOME, cwd=cwd))
    pose = home["result"]["pose"]
    expected = {"x": 1088, "y": 0, "z": 1320, "b": 90}
    assert {key: pose[key] for key in expected} == pytest.approx(expected, abs=1e-9)
    assert (pose["s"], pose["t"]) == (2, 2)
    assert "KR 16" in _run(bin_folder / "kr16", "info", cwd=cwd)
    assert kr16cli.__version__ in _run(bin_folder / "kr16", "--version", cwd=cwd)


def _without(*programs: str) -> dict[str, str]:
    """The environment with a PATH on which none of the programs is found."""
    folders = os.environ["PATH"].split(os.pathsep)
    free = [f for f in folders if not any(shutil.which(name, path=f) for name in programs)]
    return {**os.environ, "PATH": os.pathsep.join(free)}


def test_version_is_the_same_everywhere() -> None:
    citation = (_ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (_ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"\nversion: {kr16cli.__version__}\n" in citation
    assert re.search(rf"\b{re.escape(kr16cli.__version__)}\b", changes)


def test_extras_are_as_promised() -> None:
    project = tomllib.loads((_ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(project["optional-dependencies"]) == {
        *("fmu", "cross", "report", "cluster", "tables", "engines", "test", "all")
    }
    needed = [re.split(r"[^\w-]", line)[0] for line in project["dependencies"]]
    assert needed == ["mpmath", "numpy", "scipy", "typer"]
    everything = [
        *project["dependencies"],
        *(line for extra in project["optional-dependencies"].values() for line in extra),
    ]
    assert [line for line in everything if ">=" not in line] == [
        "kr16cli[fmu,cross,report,cluster,tables]"
    ]


@pytest.mark.packaging
def test_wheel_holds_the_package_and_the_assets(wheel: Path, source: Path) -> None:
    assert wheel.name.startswith(f"kr16cli-{kr16cli.__version__}-cp3")
    shipped = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    places = {
        "kr16cli": "kr16cli",
        "data": "kr16cli/assets/data",
        "fmu": "kr16cli/assets/fmu",
        "reports": "kr16cli/assets/reports",
    }
    expected = {
        f"{place}/{path.relative_to(source / folder).as_posix()}"
        for folder, place in places.items()
        for path in (source / folder).rglob("*")
        if path.is_file() and not {"__pycache__", "native"} & set(path.parts)
    }
    compiled = {name for name in shipped if name.startswith("kr16cli/kernels/_native.c")}
    assert len(compiled) == _HAS_COMPILER
    assert shipped - compiled == {n for n in expected if not n.endswith((".so", ".pyd"))}
    assert {"kr16cli/py.typed", "kr16cli/assets/data/kr16_2.toml"} <= shipped


@pytest.mark.packaging
def test_wheel_runs_from_another_folder(wheel: Path, install: _Install, tmp_path: Path) -> None:
    _check_commands(install(wheel), tmp_path)


@pytest.mark.packaging
def test_editable_install_runs_from_another_folder(
    source: Path, install: _Install, tmp_path: Path
) -> None:
    bin_folder = install("--editable", source)
    _check_commands(bin_folder, tmp_path)
    where = _run(
        bin_folder / "python", "-c", "import kr16cli; print(kr16cli.__file__)", cwd=tmp_path
    )
    assert Path(where.strip()) == source / "kr16cli" / "__init__.py"


@pytest.mark.packaging
def test_source_install_needs_no_compiler_and_no_build_tool(
    source: Path, install: _Install, tmp_path: Path
) -> None:
    tools = ("cc", "gcc", "c++", "g++", "clang", "cmake", "ninja", "make")
    env = _without(*tools)
    assert not any(shutil.which(name, path=env["PATH"]) for name in tools)
    env = {key: value for key, value in env.items() if key not in {"CC", "CXX"}}
    _check_commands(install(source, env=env), tmp_path, native=False)
