"""The FMU as built: bytes, description, what it carries."""

from __future__ import annotations

import ast
import hashlib
import io
import math
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.validation import validate_fmu

import fmus
import kr16cli
from fmus import BENT
from kr16cli import Payload
from kr16cli.errors import CheckFailedError, InputError, MissingPartError
from kr16cli.fmi import build, choices, compiling, quick, shim, stage
from kr16cli.fmi.variables import Part, Start

_HELD = Start(q=BENT, mode=4)


def _members(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _description(content: bytes) -> ElementTree.Element:
    return ElementTree.fromstring(_members(content)["modelDescription.xml"])


# Bytes ------------------------------------------------------------------------------------------


def test_equal_input_gives_equal_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    data, options = kr16cli.load_data(), build.Options(Start(q=BENT))
    first, second = build.build(data, options), build.build(data, options)
    assert first == second
    assert _description(first).get("generationDateAndTime") == "2023-11-14T22:13:20Z"
    other = build.build(data, options._replace(start=Start(q=BENT, drives=True)))
    assert _description(other).get("guid") != _description(first).get("guid")


def test_builds_of_a_process_agree_whatever_happens_to_the_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    data, options = kr16cli.load_data(), build.Options(Start(q=BENT))
    first = build.build(data, options)
    monkeypatch.setattr(stage, "_ROOT", tmp_path)  # as if every file had gone
    monkeypatch.setattr(build, "asset", lambda relative: tmp_path / relative)
    assert build.build(data, options) == first


def test_nothing_but_sources_travels() -> None:
    names = [Path(name) for name in _members(fmus.content())]
    assert {name.suffix for name in names if name.parts[0] == "resources"} <= {
        ".py", ".json", ".txt"
    }  # fmt: skip
    assert not any("__pycache__" in name.parts for name in names)


def test_guid_stays_while_the_date_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    guids = set()
    for epoch in ("1700000000", "1800000000"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
        content = build.build(kr16cli.load_data(), build.Options(Start(q=BENT)))
        guids.add(_description(content).get("guid"))
    assert len(guids) == 1


def test_bad_source_date_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(InputError, match=r"SOURCE_DATE_EPOCH is 'yesterday'"):
        build.build(kr16cli.load_data(), build.Options(Start(q=BENT)))


def test_building_leaves_python_as_it_was() -> None:
    path, modules = list(sys.path), dict(sys.modules)
    build.build(kr16cli.load_data(), build.Options(Start(q=BENT, mode=2, drives=True)))
    assert sys.path == path
    ours = ("kr16_core_", "kr16_slave_")
    left = {k: v for k, v in sys.modules.items() if k.startswith(ours)}
    assert left == {k: v for k, v in modules.items() if k.startswith(ours)}


def test_what_runs_in_this_process_can_be_built_in_it_again() -> None:
    options = build.Options(Start(q=BENT, mode=2))
    first = build.build(kr16cli.load_data(), options)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "KR16.fmu"
        path.write_bytes(first)
        with fmus.hosted(path, fmpy.extract(str(path), folder)) as host:
            host.begin()
    again = build.build(kr16cli.load_data(), options)
    assert _description(again).get("guid") == _description(first).get("guid")


_AFTER_HOSTING = """
import hashlib, shutil, sys
from pathlib import Path
import fmpy
import fmus
folder = str(fmpy.extract(sys.argv[1]))
with fmus.hosted(Path(sys.argv[1]), folder) as host:
    host.begin()
    assert sys.modules["pythonfmu"].__file__.startswith(folder)  # the FMU's own copy
    again = fmus.content(with_shim=True)
    assert sys.modules["pythonfmu"].__file__.startswith(folder)
    host.steps(3, 0.01)
shutil.rmtree(folder)
print(hashlib.sha256(again).hexdigest())
"""


def test_a_process_that_hosts_an_fmu_builds_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The FMU brings a pythonfmu of its own, without libraries; the build takes the installed."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    code = f"import os; os.environ['SOURCE_DATE_EPOCH'] = '1700000000'\n{_AFTER_HOSTING}"
    hosted = fmus.isolated(code, fmus.file(with_shim=True)).strip()
    options, _ = choices.options(kr16cli.load_data(), None, Part.ROBOT, compiling.find_compiler())
    built = build.build(kr16cli.load_data(), options)
    assert hosted == hashlib.sha256(built).hexdigest()


def test_missing_pythonfmu_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pythonfmu.builder", None)
    with pytest.raises(MissingPartError, match=r"kr16cli\[fmu\]"):
        build.build(kr16cli.load_data(), build.Options(Start(q=BENT)))


def test_robot_without_masses_is_refused() -> None:
    with pytest.raises(InputError, match=r"inertial"):
        build.build(kr16cli.load_data("kr16_l6"), build.Options(Start(q=BENT)))


def test_broken_compiler_is_a_failed_check(tmp_path: Path) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho 'shim.c:1: error: no such luck' >&2\nexit 1\n")
    compiler.chmod(0o755)
    with pytest.raises(CheckFailedError, match=r"no such luck.*--no-shim"):
        shim.compiled(str(compiler))


@pytest.mark.skipif(
    compiling.find_compiler() is None or quick.headers() is None, reason="nothing is compiled"
)
def test_functions_that_cannot_be_loaded_are_not_built_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quick, "compiled", lambda compiler: b"no library")
    options = build.Options(Start(q=BENT), compiler=compiling.find_compiler())
    with pytest.raises(CheckFailedError, match=r"cannot load.*--no-shim"):
        build.build(kr16cli.load_data(), options)


# What it carries --------------------------------------------------------------------------------


def test_carried_code_imports_itself_and_the_standard_library_only() -> None:
    members = _members(fmus.content())
    scripts = {n: t for n, t in members.items() if n.endswith(".py") and "/pythonfmu/" not in n}
    core = {n.split("/")[1] for n in scripts if "kr16_core_" in n}
    assert len(core) == 1
    allowed = {*core, "pythonfmu", *sys.stdlib_module_names}
    for name, text in scripts.items():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Import):
                tops = {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                tops = {str(node.module).split(".")[0]}
            else:
                continue
            assert tops <= allowed, name


def test_it_runs_without_numpy(tmp_path: Path) -> None:
    shutil.unpack_archive(fmus.file(), tmp_path, "zip")
    code = """
import sys
sys.modules["numpy"] = sys.modules["kr16cli"] = None
sys.path.insert(0, sys.argv[1])
slave = __import__(open(sys.argv[1] + "/slavemodule.txt").read()).KR16(instance_name="x")
slave.setup_experiment(0.0, None, None)
slave.enter_initialization_mode()
slave.exit_initialization_mode()
slave.do_step(0.0, 0.01)
print(slave.get_real([0]))
"""
    assert fmus.isolated(code, tmp_path / "resources").strip() == "[0.0]"


def test_relative_imports_cannot_be_staged(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(kr16cli.FileError, match=r"relative import"):
        list(stage._imports("from . import x\n", "some.py"))


def test_documentation_and_licences_are_inside() -> None:
    members = _members(fmus.content())
    page = members["documentation/index.html"].decode()
    assert "{{" not in page
    assert "tau[1]" in page and "KUKA KR 16-2" in page and "not for safety functions" in page
    assert b"MIT" in members["documentation/licenses/license.txt"]
    assert b"MIT" in members["documentation/licenses/pythonfmu.txt"]


# Description ------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", list(Part))
def test_fmpy_finds_nothing_to_complain_of(part: Part) -> None:
    assert validate_fmu(str(fmus.file(_HELD, part))) == []


def test_description_says_what_an_engineer_looks_for() -> None:
    root = _description(fmus.content())
    variables = {v.get("name"): v for v in root.iterfind("ModelVariables/ScalarVariable")}
    for name in ("tau", "q_ref", "qd_ref", "wrench", "q", "qd", "qdd", "tau_applied", "q_start"):
        assert {f"{name}[{i}]" for i in range(1, 7)} <= set(variables)
    assert {f"pose.{k}" for k in "xyzabc"} | {"payload.mass", "energy.kinetic"} <= set(variables)
    assert all(v.get("description") and v.get("causality") for v in variables.values())
    assert variables["tau[1]"][0].get("unit") == "N.m"
    assert variables["q[1]"][0].attrib.items() >= {"unit": "rad", "displayUnit": "deg"}.items()
    degrees = root.find("UnitDefinitions/Unit[@name='rad']/DisplayUnit[@name='deg']")
    assert float(degrees.get("factor")) == pytest.approx(180.0 / math.pi, rel=1e-15)  # type: ignore
    experiment = root.find("DefaultExperiment")
    assert experiment is not None and experiment.get("stopTime") == "2.0"
    can = root.find("CoSimulation")
    assert can is not None and can.get("canSerializeFMUstate") == "true"


def test_dependencies_are_written_for_every_unknown() -> None:
    root = _description(fmus.content())
    names = [v.get("name", "") for v in root.iterfind("ModelVariables/ScalarVariable")]
    outputs = [v.get("name") for v in root.iterfind("ModelVariables/*[@causality='output']")]
    for tag in ("Outputs", "InitialUnknowns"):
        unknowns = list(root.iterfind(f"ModelStructure/{tag}/Unknown"))
        assert [names[int(u.get("index", "0")) - 1] for u in unknowns] == outputs
        assert all(u.get("dependencies") is not None for u in unknowns)
        known = {
            names[int(u.get("index", "0")) - 1]: {
                names[int(k) - 1] for k in u.get("dependencies", "").split()
            }
            for u in unknowns
        }
        if tag == "Outputs":
            assert known["q[1]"] == known["pose.x"] == set()
            assert {"tau[6]", "q_ref[1]", "wrench[3]"} <= known["qdd[1]"]
        else:
            assert known["q[2]"] == {"q_start[2]"}
            assert {"payload.mass", "gravity.z", "q_start[4]"} <= known["energy.potential"]
            assert "qd_start[1]" not in known["pose.a"]


def test_dependencies_hold_nothing_back() -> None:
    """An output that reacts to an input or parameter names it."""
    load = Payload(5.0, (0.01, 0.02, 0.1), (0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
    held = _HELD._replace(payload=load, drives=True)
    root = _description(fmus.content(held))
    listed = list(root.iterfind("ModelVariables/ScalarVariable"))
    names = [v.get("name", "") for v in listed]
    known = {
        int(u.get("index", "0")) - 1: {int(k) - 1 for k in u.get("dependencies", "").split()}
        for u in root.iterfind("ModelStructure/InitialUnknowns/Unknown")
    }
    reals = [k for k, v in enumerate(listed) if v[0].tag == "Real"]
    free = [k for k in reals if listed[k].get("causality") in ("input", "parameter")]
    with fmus.hosted(fmus.file(held)) as host:
        host.slave.setupExperiment(startTime=0.0)
        host.slave.enterInitializationMode()
        seen = [k for k in known if k in reals]
        before = host.slave.getReal(seen)
        for place in free:
            value = host.slave.getReal([place])[0]
            host.slave.setReal([place], [value + 1e-3])
            after = host.slave.getReal(seen)
            host.slave.setReal([place], [value])
            moved = {k for k, a, b in zip(seen, before, after, strict=True) if a != b}
            assert all(place in known[k] for k in moved), names[place]
