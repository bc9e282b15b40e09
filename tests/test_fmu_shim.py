"""The shim in a host written in C: no Python in it, loaded twice, errors told and survived."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import fmpy
import pytest

import fmus
from kr16cli.fmi import compiling

_COMPILER = compiling.find_compiler()

pytestmark = pytest.mark.skipif(_COMPILER is None, reason="no C compiler for the shim")


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The host, compiled."""
    program = tmp_path_factory.mktemp("host") / "host"
    source = Path(__file__).with_name("host.c")
    subprocess.run([str(_COMPILER), "-o", str(program), str(source), "-ldl"], check=True)
    return program


@pytest.fixture
def unpacked(tmp_path: Path) -> Path:
    """The FMU, unpacked in a folder whose name must be escaped in a URI."""
    folder = tmp_path / "a b \u00e9%"
    shutil.unpack_archive(fmus.file(with_shim=True), folder, "zip")
    return folder


def _run(
    host: Path, folder: Path, resources: str, *, guid: str | None = None, **more: str
) -> tuple[int, str]:
    right = fmpy.read_model_description(str(fmus.file(with_shim=True))).guid
    done = subprocess.run(
        [host, folder / "binaries/linux64/KR16.so", guid or right, resources, "20"],
        capture_output=True, text=True, timeout=120, check=False,
        env={"PATH": os.environ["PATH"], **more},
    )  # fmt: skip
    return done.returncode, done.stdout


@pytest.mark.parametrize("form", ["null", "path", "uri", "uri with host", "short uri"])
def test_c_host_runs_the_fmu_twice_wherever_it_lies(host: Path, unpacked: Path, form: str) -> None:
    path = unpacked / "resources"
    uri = path.as_uri()
    resources = {
        "null": "-", "path": str(path), "uri": uri,
        "uri with host": uri.replace("file://", "file://localhost"),
        "short uri": uri.replace("file://", "file:"),
    }[form]  # fmt: skip
    code, said = _run(host, unpacked, resources)
    assert (code, said.splitlines()[-1]) == (0, "done"), said
    # Told once each round, as an error, though the host did not ask for a log.
    errors = [line for line in said.splitlines() if line.startswith("log ")]
    assert errors == ["log robot 3 logStatusError: communication step -1.0 s: must be a positive "
                      "number"] * 2  # fmt: skip


@pytest.mark.parametrize(
    ("resources", "guid", "environment", "words"),
    [
        ("/nowhere", None, {}, "/nowhere: the resources of the FMU are not there"),
        ("x" * 5000, None, {}, "too long"),
        ("-", "{other}", {}, "the GUID {other} is not that of this FMU"),
        ("-", None, {"KR16_LIBPYTHON": "/nowhere.so"}, "KR16_LIBPYTHON=/nowhere.so cannot be"),
    ],
)
def test_what_is_missing_is_told_in_the_log(
    host: Path, unpacked: Path, resources: str, guid: str | None, environment: dict[str, str],
    words: str,
) -> None:  # fmt: skip
    code, said = _run(host, unpacked, resources, guid=guid, **environment)
    assert code == 1
    assert "log robot 3 logStatusError: " in said
    assert words in said
