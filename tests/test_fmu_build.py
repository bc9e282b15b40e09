"""The FMU as built: bytes, description, what it carries, and how it behaves in FMPy."""

from __future__ import annotations

import ast
import io
import math
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

import fmus
import kr16cli
from fmus import BENT, QD, TAU, Q
from kr16cli import Payload
from kr16cli.errors import CheckFailedError, InputError, MissingPartError
from kr16cli.fmi import build, choices, reading, shim, stage
from kr16cli.fmi.variables import Part, Start
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.scenario import Scenario, load_scenario

_TESTS = Path(__file__).resolve().parent
_SHIM = [False, pytest.param(True, marks=pytest.mark.skipif(
    shim.find_compiler() is None, reason="no C compiler for the shim"))]  # fmt: skip
_HELD = Start(q=BENT, mode=4)
_CONTROL = Start(q=BENT, mode=4)


def _members(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _description(content: bytes) -> ElementTree.Element:
    return ElementTree.fromstring(_members(content)["modelDescription.xml"])


def _isolated(code: str, *arguments: object) -> str:
    """What code prints in a process of its own; a crash of the FMU would end only that."""
    done = subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", code, *map(str, arguments)],
        capture_output=True, text=True, timeout=300, check=False,
        env={"PYTHONPATH": f"{_TESTS}:{_TESTS.parent}", "PATH": "/usr/bin:/bin"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


# Bytes ------------------------------------------------------------------------------------------


def test_equal_input_gives_equal_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    data, options = kr16cli.load_data(), build.Options(Start(q=BENT))
    first, second = build.build(data, options), build.build(data, options)
    assert first == second
    assert _description(first).get("generationDateAndTime") == "2023-11-14T22:13:20Z"
    other = build.build(data, options._replace(start=Start(q=BENT, drives=True)))
    assert _description(other).get("guid") != _description(first).get("guid")


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
    assert _isolated(code, tmp_path / "resources").strip() == "[0.0]"


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
    assert validate_fmu(str(fmus.file(_CONTROL, part))) == []


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


# Behaviour in FMPy ------------------------------------------------------------------------------


def test_motion_is_the_simulators() -> None:
    scenario = Scenario("swing", BENT, duration=1.0, output_step=0.05)
    run = simulate(kr16cli.load_data(), scenario)
    result = fmpy.simulate_fmu(
        str(fmus.file()), stop_time=1.0, output_interval=0.05, output=[*Q, *QD, "energy.kinetic"]
    )
    for k, name in enumerate(Q):
        assert np.abs(result[name] - run.q[:, k]).max() < 1e-7
    assert np.abs(result["energy.kinetic"] - run.energy_kinetic).max() < 1e-4


@pytest.mark.parametrize("name", ["drop_gravity_compensated", "payload_16kg"])
def test_scenario_sets_the_start_values(name: str, tmp_path: Path) -> None:
    data, scenario = kr16cli.load_data(), load_scenario(name)
    options, notes = choices.options(data, scenario, Part.ROBOT, None)
    path = tmp_path / "s.fmu"
    path.write_bytes(build.build(data, options))
    fmu = reading.read(path)
    assert notes == []
    assert fmu.number("stopTime") == scenario.duration
    run = simulate(data, scenario)
    result = fmpy.simulate_fmu(str(path), stop_time=scenario.duration, output_interval=0.01,
                               output=Q)  # fmt: skip
    last = [result[name][-1] for name in Q]
    assert last == pytest.approx(run.q[-1], abs=2e-3)


_MANY = """
import gc, sys
from pathlib import Path
import fmus
path = Path(sys.argv[1])
folder = None
for k in range(120):
    gc.collect()  # Python then has no references to spare for those the wrapper gives away
    host = fmus.Host(path, folder)
    folder = host.folder
    host.begin()
    host.steps(2, 0.001)
    try:
        host.set(["tau[1]"], [float("nan")])
        raise SystemExit("NaN was taken")
    except Exception as error:
        assert "failed with status" in str(error)
    host.slave.reset()
    host.begin()
    host.steps(1, 0.001)
    host.slave.terminate()
    host.free()
several = [fmus.Host(path, folder) for _ in range(10)]
for k, host in enumerate(several):
    host.begin(payload__mass=float(k))
    host.set(["tau[1]"], [100.0])
for host in several:
    host.steps(5, 0.01)
print(len({host.get(["q[1]"])[0] for host in several}))
for host in several:
    host.free()
"""


@pytest.mark.slow
@pytest.mark.parametrize("with_shim", _SHIM)
def test_many_runs_failures_and_instances_in_one_process(with_shim: bool) -> None:
    assert _isolated(_MANY, fmus.file(with_shim=with_shim)).strip() == "10"


_COUNTED = """
import gc, sys
from pathlib import Path
import fmus
path = Path(sys.argv[1])

def living():
    gc.collect()
    return sum(type(thing).__name__ == "KR16" for thing in gc.get_objects())

counts = []
first = fmus.Host(path)
for k in range(3):
    host = fmus.Host(path, first.folder)
    counts.append(living())
    host.begin()
    for _ in range(5):
        try:
            host.set(["tau[1]"], [float("nan")])
        except Exception:
            pass
        counts.append(living())
    host.slave.reset()
    counts.append(living())
    host.free()
    counts.append(living())
print(counts)
"""


@pytest.mark.parametrize("with_shim", _SHIM)
def test_failures_and_resets_neither_free_nor_leak_an_instance(with_shim: bool) -> None:
    counts = ast.literal_eval(_isolated(_COUNTED, fmus.file(with_shim=with_shim)))
    assert counts == [2, *[2] * 5, 2, 1] * 3


_BOTH = """
import sys
from pathlib import Path
import fmus
import kr16cli
before = kr16cli.load_data().geometry
hosts = [fmus.Host(Path(p)) for p in sys.argv[1:]]
for host in hosts:
    host.begin()
    host.steps(10, 0.01)
print([host.get(["q[2]"])[0] for host in hosts])
"""


@pytest.mark.parametrize("with_shim", _SHIM)
def test_two_builds_live_beside_each_other_and_kr16cli(with_shim: bool) -> None:
    falling, floating = fmus.file(with_shim=with_shim), fmus.file(Start(q=BENT, mode=2))
    alone = []
    for path in (falling, floating):
        with fmus.hosted(path) as host:
            host.begin()
            host.steps(10, 0.01)
            alone += host.get(["q[2]"])
    together = ast.literal_eval(_isolated(_BOTH, falling, floating))
    assert together == alone
    assert abs(alone[0] - alone[1]) > 1e-2


@pytest.mark.parametrize("with_shim", _SHIM)
def test_state_set_back_serialized_and_reset_repeats_the_run(with_shim: bool) -> None:
    path = fmus.file(Start(q=BENT, mode=3, drives=True), with_shim=with_shim)
    with fmus.hosted(path) as one, fmus.hosted(path) as other:
        for host in (one, other):
            host.begin()
        one.set(["q_ref[3]"], [1.3])
        one.steps(7, 0.01)
        state = one.slave.getFMUstate()
        content = one.slave.serializeFMUstate(state)
        one.steps(5, 0.013, 0.07)
        expected = one.get([*Q, *QD])
        one.slave.setFMUstate(state)
        one.steps(5, 0.013, 0.07)
        assert one.get([*Q, *QD]) == expected
        other.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
        other.steps(5, 0.013, 0.07)
        assert other.get([*Q, *QD]) == expected
        one.slave.reset()
        one.begin()
        one.set(["q_ref[3]"], [1.3])
        one.steps(7, 0.01)
        one.steps(5, 0.013, 0.07)
        assert one.get([*Q, *QD]) == expected


def _refused(host: fmus.Host, act: Any) -> int:
    """Status with which the FMU refuses; it must say why in the log, in one line."""
    said = len(host.messages)
    with pytest.raises(FMICallException) as refused:
        act()
    assert any(status == 3 and text for status, text in host.messages[said:])
    return int(refused.value.status)


@pytest.mark.parametrize("with_shim", _SHIM)
def test_bad_calls_end_in_an_error_with_a_reason_in_the_log(with_shim: bool) -> None:
    expected = 3 if with_shim else 4  # pythonfmu alone knows no error but the fatal one
    with fmus.hosted(fmus.file(with_shim=with_shim)) as host:
        assert _refused(host, lambda: host.steps(1, 0.01)) == expected
        assert _refused(host, lambda: host.set(["q_start[1]"], [math.inf])) == expected
        host.begin()
        for act in (
            lambda: host.set(["tau[1]"], [math.nan]),
            lambda: host.steps(1, 0.0),
            lambda: host.steps(1, -0.01),
            lambda: host.steps(1, math.nan),
            lambda: host.steps(1, 0.01, 5.0),
            lambda: host.set(["payload.mass"], [1.0]),
            lambda: host.slave.getReal([12345]),
            host.slave.enterInitializationMode,
            lambda: host.slave.setFMUstate(host.slave.deSerializeFMUstate(b"{}")),
        ):
            assert _refused(host, act) == expected
        host.steps(3, 0.01)
        assert all(map(math.isfinite, host.get(Q)))


@pytest.mark.skipif(shim.find_compiler() is None, reason="no C compiler for the shim")
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda r: (r / "slavemodule.txt").unlink(), "slavemodule.txt"),
        (lambda r: next(r.glob("kr16_slave_*.py")).unlink(), "kr16_slave_"),
        (lambda r: next(r.glob("kr16_core_*/cargo.json")).write_text("{"), "unpack the FMU anew"),
        (lambda r: shutil.rmtree(next(r.glob("kr16_core_*"))), "No module named"),
        (shutil.rmtree, "unpack it anew"),
    ],
)
def test_spoilt_resources_are_an_error_with_a_reason(
    spoil: Any, words: str, tmp_path: Path
) -> None:
    shutil.unpack_archive(fmus.file(with_shim=True), tmp_path, "zip")
    spoil(tmp_path / "resources")
    code = """
import sys
from pathlib import Path
import fmpy, fmus
messages = []
fmus.Host._log = lambda self, e, n, status, category, text: messages.append(text.decode())
try:
    fmus.Host(Path(sys.argv[1]), sys.argv[2])
    print("instantiated")
except Exception:
    print("refused:", *messages)
"""
    said = _isolated(code, fmus.file(with_shim=True), tmp_path)
    assert said.startswith("refused:")
    assert words in said


def test_closed_loop_of_two_fmus_tends_to_the_monolithic_run_with_order_one() -> None:
    robot, controller = fmus.file(), fmus.file(_CONTROL, Part.CONTROLLER)
    wanted = [q + 0.1 for q in BENT]
    references = [f"q_ref[{i}]" for i in range(1, 7)]
    whole = fmus.file(_HELD)
    with fmus.hosted(whole) as host:
        host.begin()
        host.set(references, wanted)
        host.steps(100, 0.002)
        exact = np.array(host.get(Q))
    errors = []
    for size in (0.008, 0.004, 0.002):
        with fmus.hosted(robot) as plant, fmus.hosted(controller) as law:
            for host in (plant, law):
                host.begin()
            law.set(references, wanted)
            for k in range(round(0.2 / size)):
                law.set([*Q, *QD], plant.get([*Q, *QD]))
                plant.set(TAU, law.get(TAU))
                for host in (plant, law):
                    host.slave.doStep(k * size, size)
            errors.append(float(np.abs(np.array(plant.get(Q)) - exact).max()))
    assert errors[2] < 5e-3
    assert math.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.25)
    assert math.log2(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.25)
