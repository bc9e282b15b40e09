"""Native FMUs beside the simulator on every platform that this machine can run, and their names."""

from __future__ import annotations

import io
import json
import re
import shutil
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

import exports
import kr16cli
import native_fmus as native
from command_line import kr16
from fmus import BENT
from kr16cli.assets import asset
from kr16cli.fmi import choices, compiling, evidence, reading
from kr16cli.fmi.compare import Comparison
from kr16cli.fmi.native import build, library, toolchain
from kr16cli.fmi.platforms import Job, Runner, UnusableError
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

        def other(name: str, job: Job) -> list[tuple[float, ...]]:
            rows = right(name, job)
            return rows if job.save >= 0 else [(row[0] + 1e-15, *row[1:]) for row in rows]

        monkeypatch.setattr(runner, "run", other)
        found = evidence.run(runner, platform, fmu, compared, "co-simulation")
    assert found.problems == ["a state serialized and set in another process does not go on alike"]


def _valid(table: dict[str, object]) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(asset("data/schemas/fmu_table.json").read_text(encoding="utf-8"))
    jsonschema.validate(table, schema)


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
    arm = shutil.which("qemu-aarch64") and Path("/usr/aarch64-linux-gnu").is_dir()
    assert ("Linux aarch64 (qemu-aarch64)" in ran) == bool(arm)
    _valid(table)
    cases = report.numbered(report.cases(table))
    assert {c.status for c in cases} == {"passed"}
    assert len({c.id for c in cases}) == len(rows)


def _record(*, passed: bool) -> dict[str, object]:
    data = kr16cli.load_data()
    found = {"group": "q", "largest": 1e-3, "unit": "rad", "time": 0.5, "relative": 1e-3}
    row = {
        "file": "KR16_fmi2.fmu", "fmi_version": "2.0", "interface": "co-simulation",
        "host": "C host", "platform": "Windows x86_64 (wine)", "passed": passed,
        "problems": [] if passed else ["q deviates by 0.001 rad"], "deviations": [found],
        "tolerance": 1e-9, "steps": 100,
    }  # fmt: skip
    return {
        "schema": evidence.SCHEMA, "robot": data.name, "model_sha256": data.sha256,
        "units": {"q": "rad"}, "input": {"stop": 1.0, "step": 0.01}, "result": {"rows": [row]},
        "warnings": ["not run on macOS arm64: nothing here runs its programs"],
    }  # fmt: skip


@pytest.mark.parametrize("passed", [True, False])
def test_command_writes_the_record_and_fails_with_a_row(
    passed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evidence, "table", lambda data, tell: _record(passed=passed))
    path = tmp_path / "fmus.json"
    done = kr16("fmu", "table", "-o", path)
    assert done.code == (0 if passed else 1)
    assert "warning: not run on macOS arm64" in done.err
    assert ("1 of 1 FMUs fail, the first KR16_fmi2.fmu" in done.err) == (not passed)
    record = json.loads(path.read_text(encoding="utf-8"))
    _valid(record)
    assert record == _record(passed=passed)
    words = kr16("fmu", "table").out
    assert "C host, Windows x86_64 (wine)" in words
    assert ("FAILED: q deviates" in words) == (not passed)
