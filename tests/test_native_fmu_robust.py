"""The library of native FMUs under any calls in any order: sanitizers, allocations, valgrind.

tests/fuzz.c says what it holds the library to.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

import native_fmus as native
from fmus import BENT, TESTS
from kr16cli.fmi import compiling
from kr16cli.fmi.variables import Part, Start

_CC = compiling.find_compiler() or ""
_START = Start(q=BENT)
_GENERATED = ("kr16_model.c", "kr16_stepped.c", "kr16_tapes.c")
_ADDRESSES = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")
_SHORT = ("1", "4000", "2")
_LONG = [(str(seed), "60000", "4") for seed in (1000, 2000, 3000)]

pytestmark = pytest.mark.skipif(not _CC, reason="no C compiler")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMU unpacked: its library, and its sources."""
    found = tmp_path_factory.mktemp("robust")
    with zipfile.ZipFile(native.file(3, start=_START)) as archive:
        archive.extractall(found)
    return found


def _token(part: Part = Part.ROBOT) -> str:
    return str(native.unpacked(native.file(3, part, _START))[1].guid)


def _compile(folder: Path, name: str, words: Sequence[str], *, code: str = "") -> Path:
    """The fuzzer with what it is linked with; with `code`, with the sources under its options."""
    sources = folder / "sources"
    target = folder / name
    if code:
        plain = [n for n in _GENERATED if code == "hand-written"]
        flagged = [p.name for p in sorted(sources.glob("*.c")) if p.name not in plain]
        # Thousands of operations in a function: sanitizers of arithmetic take gigabytes there.
        for names, options in ((plain, ["-O0"]), (flagged, ["-O1", "-g", *words])):
            if names:
                _run([_CC, "-std=gnu11", "-w", "-ffp-contract=off", *options, "-c", *names],
                     sources)  # fmt: skip
        parts = [str(p) for p in sorted(sources.glob("*.o"))]
    else:
        library = next((folder / "binaries").glob("*-linux/KR16.so"))
        parts = [str(library), f"-Wl,-rpath,{library.parent}"]
    _run([_CC, "-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Wno-unused-but-set-variable",
          "-Werror", *words, "-I", str(sources), str(TESTS / "fuzz.c"), *parts, "-o",
          str(target), "-lm", "-lpthread"], folder)  # fmt: skip
    for left in sources.glob("*.o"):
        left.unlink()
    return target


def _run(command: Sequence[str], folder: Path) -> str:
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=1800,
        env={**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1"},
    )  # fmt: skip
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    return done.stdout


def _fuzz(program: Path, words: Sequence[str], *before: str, part: Part = Part.ROBOT) -> None:
    said = _run([*before, str(program), _token(part), *words], program.parent)
    calls, errors = (int(part.split()[0]) for part in said.split(","))
    # Wrong calls and right ones: else little would be seen.
    assert 0.3 * calls < errors < 0.9 * calls


def test_any_calls_under_sanitizers(folder: Path) -> None:
    _fuzz(_compile(folder, "checked", _ADDRESSES, code="hand-written"), _SHORT)


@pytest.mark.parametrize("part", list(Part))
def test_no_call_allocates_but_what_makes_instances_and_states(part: Part, tmp_path: Path) -> None:
    """And all is given back; and without memory there is an error. The library as it is shipped."""
    with zipfile.ZipFile(native.file(3, part, _START)) as archive:
        archive.extractall(tmp_path)
    _fuzz(_compile(tmp_path, "counted", ["-DCOUNT"]), ("7", "30000", "2"), part=part)


@pytest.mark.slow
@pytest.mark.parametrize("seed", _LONG, ids=lambda words: words[0])
def test_long_under_sanitizers(folder: Path, seed: Sequence[str]) -> None:
    program = folder / "long"
    if not program.exists():
        _compile(folder, "long", _ADDRESSES, code="hand-written")
    _fuzz(program, seed)


@pytest.mark.slow
def test_the_printed_model_too_stays_in_its_arrays(folder: Path) -> None:
    words = ("-fsanitize=address", "--param=asan-instrumentation-with-call-threshold=0")
    _fuzz(_compile(folder, "addresses", words, code="all"), ("20", "20000", "1"))


@pytest.mark.slow
def test_threads_share_nothing(folder: Path) -> None:
    _fuzz(_compile(folder, "threads", ["-fsanitize=thread"], code="hand-written"),
          ("30", "8000", "6"))  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_valgrind_sees_nothing(folder: Path) -> None:
    program = _compile(folder, "plain", [], code="all")
    _fuzz(program, ("40", "6000", "2"), "valgrind", "-q", "--leak-check=full", "--error-exitcode=9")


def _blob(instance: native.Instance) -> bytes:
    old = instance.version == 2
    state = getattr(instance.fmu, "getFMUstate" if old else "getFMUState")()
    write = "serializeFMUstate" if old else "serializeFMUState"
    return bytes(getattr(instance.fmu, write)(state))


def _set(instance: native.Instance, blob: bytes) -> None:
    old = instance.version == 2
    read = "deSerializeFMUstate" if old else "deserializeFMUState"
    state = getattr(instance.fmu, read)(blob)
    getattr(instance.fmu, "setFMUstate" if old else "setFMUState")(state)


def test_states_of_other_builds_and_other_kinds_are_refused() -> None:
    path = native.file(2, start=_START)
    other = native.file(2, Part.CONTROLLER, _START)
    robot, law = native.Instance(path).begin(), native.Instance(other).begin()
    newer = native.Instance(native.file(3, start=_START)).begin()
    stepped = native.Instance(path, exchange=True).begin()
    before = robot.get(["q[1]", "qdd[2]"])
    for source, words in ((law, "no state of this build"), (newer, "no state of this build"),
                          (stepped, "another kind")):  # fmt: skip
        with pytest.raises(FMICallException):
            _set(robot, _blob(source))
        assert words in robot.messages[-1]
    assert robot.get(["q[1]", "qdd[2]"]) == before
    _set(robot, _blob(native.Instance(path).begin()))


@pytest.mark.parametrize("version", [2, 3])
def test_a_failed_step_stays_where_it_got_to(version: int) -> None:
    instance = native.Instance(native.file(version, start=_START))
    instance.begin(solver__step=0.01, **{"tau[1]": 1e200})
    with pytest.raises(FMICallException):
        instance.step(0.0, 0.1)
    assert "leaves the range of numbers" in instance.messages[-1]
    assert instance.get(["q[1]", "q[2]"]) == [BENT[0], BENT[1]]
    with pytest.raises(FMICallException):
        instance.step(0.0, 0.01)
    assert "failed" in instance.messages[-1]


@pytest.mark.parametrize("version", [2, 3])
def test_what_is_no_number_is_an_error(version: int) -> None:
    instance = native.Instance(native.file(version, start=_START), exchange=True).begin()
    torques = [f"tau[{i}]" for i in range(1, 7)]
    instance.set(torques, [1.7e308] * 6)
    with pytest.raises(FMICallException):
        instance.get(["qdd[6]"])
    assert "qdd leaves the range of numbers" in instance.messages[-1]
    known, unknown = instance.references(["tau[1]"]), instance.references(["qdd[1]"])
    instance.set(torques, [0.0] * 6)
    with pytest.raises(FMICallException):
        instance.fmu.getDirectionalDerivative(unknown, known, [float("nan")])
    assert "seed number 1 is nan" in instance.messages[-1]
