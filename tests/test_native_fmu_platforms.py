"""Native FMUs beside the simulator on every platform that this machine can run, and their names."""

from __future__ import annotations

import io
import re
import shutil
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

import exports
import kr16cli
import native_fmus as native
from fmus import BENT
from kr16cli.assets import asset
from kr16cli.fmi import choices, compiling, evidence, reading
from kr16cli.fmi.compare import Comparison
from kr16cli.fmi.native import build, library, toolchain
from kr16cli.fmi.platforms import Runner, UnusableError
from kr16cli.fmi.variables import Part, Start
from kr16cli.report import fmus as report

pytestmark = pytest.mark.skipif(compiling.find_compiler() is None, reason="no C compiler")
ZIG = pytest.mark.skipif(find_spec("ziglang") is None, reason="no zig")


def _functions() -> set[str]:
    """All that FMI 2.0 and 3.0 want of a library."""
    found: set[str] = set()
    for version in (2, 3):
        header = asset(f"fmu/native/include/fmi{version}Functions.h").read_text(encoding="utf-8")
        found |= set(re.findall(rf"\b(fmi{version}[A-Z]\w+)TYPE\s+fmi", header))
    assert len(found) > 100
    return found


@pytest.mark.parametrize("version", [2, 3])
def test_a_c_host_finds_the_simulators_numbers(version: int) -> None:
    fmu = reading.read(native.file(version, start=Start(q=BENT)))
    compared = Comparison(fmu, kr16cli.load_data())
    platform = toolchain.host()
    assert platform is not None
    with Runner() as runner:
        for kind in fmu.kinds:
            found = evidence.run(runner, platform, fmu, compared, kind)
            assert found.problems == []
            assert {d.group for d in found.deviations} >= {"q", "qd", "qdd", "pose", "energy"}
            assert max(d.relative for d in found.deviations) < 1e-11


def test_a_state_that_goes_on_otherwise_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    fmu = reading.read(native.file(2, start=Start(q=BENT)))
    compared = Comparison(fmu, kr16cli.load_data())
    platform = toolchain.host()
    assert platform is not None
    with Runner() as runner:
        right = runner.run

        def other(name: str, job: object) -> list[tuple[float, ...]]:
            rows = right(name, job)  # type: ignore[arg-type]
            return [(row[0] + 1e-15, *row[1:]) for row in rows] if job.save < 0 else rows  # type: ignore[attr-defined]

        monkeypatch.setattr(runner, "run", other)
        found = evidence.run(runner, platform, fmu, compared, "co-simulation")
    assert found.problems == ["a state serialized and set in another process does not go on alike"]


def test_platforms_that_cannot_run_say_why() -> None:
    with Runner() as runner, pytest.raises(UnusableError, match="nothing here runs its programs"):
        runner.prepare("macos-arm64")


def test_library_gives_away_the_functions_of_fmi_alone() -> None:
    with zipfile.ZipFile(io.BytesIO(native.content(2))) as archive:
        path = next(name for name in archive.namelist() if name.startswith("binaries/"))
        assert exports.names(archive.read(path)) == _functions()


@ZIG
@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_every_platforms_library_has_the_functions(version: int) -> None:
    data = kr16cli.load_data()
    usual, _ = choices.options(data, None, Part.ROBOT, None)
    names = library.platforms("all", version)
    content = build.build(data, build.Options(usual.start, version=version, platforms=names))
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        found = {n: archive.read(n) for n in archive.namelist() if n.startswith("binaries/")}
    assert len(found) == (4 if version == 2 else 6)
    for name, binary in found.items():
        assert exports.names(binary) >= _functions(), name
    macos = [binary for name, binary in found.items() if "darwin" in name]
    x86, arm = 0x01000007, 0x0100000C
    assert sorted(p for binary in macos for p in exports.processors(binary)) == [x86, arm]


@ZIG
@pytest.mark.slow
def test_table_of_all_platforms(tmp_path: Path) -> None:
    """Every FMU by every interface wherever this machine can run it; a report takes the record."""
    table = evidence.table(kr16cli.load_data())
    rows = table["result"]["rows"]
    assert [r["problems"] for r in rows] == [[]] * len(rows)
    assert {(r["fmi_version"], r["interface"]) for r in rows} == {
        (version, kind) for version in ("2.0", "3.0") for kind in evidence.KINDS
    }
    ran = {r["platform"] for r in rows}
    assert ("Windows x86_64 (wine)" in ran) == (shutil.which("wine") is not None)
    assert ("Linux aarch64 (qemu-aarch64)" in ran) == (shutil.which("qemu-aarch64") is not None)
    cases = report.numbered(report.cases(table))
    assert {c.status for c in cases} == {"passed"}
    assert len({c.id for c in cases}) == len(rows)
