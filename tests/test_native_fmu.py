"""Native FMUs: valid, equal to the direct simulator, in every interface; exact derivatives."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Sequence
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

import kr16cli
import native_fmus as native
from command_line import complains, kr16
from kr16cli.fmi import compiling
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.native import library, numbers, sources, table
from kr16cli.fmi.variables import Part, Start, six
from kr16cli.fmi.variables import table as common
from kr16cli.single import Arm

pytestmark = pytest.mark.skipif(
    compiling.find_compiler() is None and library.prebuilt() is None, reason="no C compiler"
)

BENT = tuple(map(math.radians, (0.0, -60.0, 60.0, 0.0, 30.0, 0.0)))
Q, QD, QDD = six("q"), six("qd"), six("qdd")
_LOAD = {"payload.mass": 12.0, "payload.com.z": 0.1, "payload.inertia.xx": 0.2,
         "payload.inertia.yy": 0.2, "payload.inertia.zz": 0.1}  # fmt: skip
_PUSH = {"wrench[1]": 80.0, "wrench[3]": -50.0, "wrench[5]": 6.0}
_WAY = {f"q_ref[{i}]": q + 0.05 for i, q in enumerate(BENT, 1)} | {"qd_ref[2]": 0.1}
CASES = {
    "torque": {"tau[1]": 50.0, "tau[2]": -400.0, "qd_start[4]": 1.0},
    "gravity, load": {"control.mode": 2, **_LOAD},
    "pd": {"control.mode": 3, **_WAY, **_PUSH},
    "computed torque": {"control.mode": 4, **_WAY, "qdd_ref[1]": 0.4, "gravity.x": 2.0},
    "task space": {"control.mode": 5, **_WAY, "qdd_ref[1]": 0.4, **_LOAD},
    "task space near a singularity": {"control.mode": 5, **_WAY, "q_start[5]": 0.03},
    "drives": {"control.mode": 4, "drives": True, **_WAY},
    "stops": {"limits.joint": 2, "q_start[2]": 0.55, "qd_start[2]": 1.0},
    "drives' limits": {"limits.torque": True, "limits.speed": True, "tau[1]": 5000.0,
                       "qd_start[1]": 3.0},
    "euler": {"solver.method": 3},
    "rosenbrock": {"solver.method": 4, "drives": True},
}  # fmt: skip


def _machine(values: dict[str, float], part: Part = Part.ROBOT) -> Machine:
    """The direct simulator with the values set, initialized."""
    data = kr16cli.load_data()
    machine = Machine(common(data, Start(q=BENT), part), data, Arm, part)
    places = {v.name: k for k, v in enumerate(machine.variables)}
    machine.set([places[name] for name in values], list(values.values()))
    machine.enter()
    machine.leave()
    return machine


def _compared(part: Part = Part.ROBOT) -> list[str]:
    known = common(kr16cli.load_data(), Start(q=BENT), part)
    return [v.name for v in known if v.causality == "output"]


def _gap(names: Sequence[str], a: Sequence[float], b: Sequence[float]) -> float:
    """Largest deviation over the larger of 1 and the value; angles of the pose modulo 2 pi."""
    gaps = np.array(a, dtype=float) - np.array(b, dtype=float)
    for k, name in enumerate(names):
        if name in ("pose.a", "pose.c"):
            gaps[k] = math.remainder(gaps[k], 2.0 * math.pi)
    return float((np.abs(gaps) / np.maximum(1.0, np.abs(np.array(b, dtype=float)))).max())


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("values", CASES.values(), ids=CASES.keys())
def test_same_steps_give_the_direct_simulators_numbers(
    version: int, values: dict[str, float]
) -> None:
    start = Start(q=BENT)
    machine, names = _machine(values), _compared()
    instance = native.Instance(native.file(version, start=start))
    instance.begin(**{k.replace(".", "__"): v for k, v in values.items()})
    places = {v.name: k for k, v in enumerate(machine.variables)}
    # Rosenbrock's method takes slopes of friction and stops by differences, which round more.
    stiff = values.get("drives") or values.get("limits.joint") == 2
    for k in range(20):
        expected = machine.get([places[name] for name in names])
        gap = _gap(names, instance.get(names), expected)
        assert gap < (1e-9 if stiff else 1e-12), (k, instance.messages)
        machine.step(0.01 * k, 0.01)
        instance.step(0.01 * k, 0.01)
    instance.close()


@pytest.mark.parametrize("version", [2, 3])
def test_controller_wants_the_direct_controllers_torque(version: int) -> None:
    path = native.file(version, Part.CONTROLLER, Start(q=BENT))
    names = _compared(Part.CONTROLLER)
    for mode in (2, 3, 4, 5):
        values = {"control.mode": mode, **_WAY, "q[2]": -1.0, "q[3]": 1.1, "q[5]": 0.5,
                  "qd[1]": 0.3}  # fmt: skip
        machine = _machine(values, Part.CONTROLLER)
        places = {v.name: k for k, v in enumerate(machine.variables)}
        instance = native.Instance(path)
        instance.begin(**{k.replace(".", "__"): v for k, v in values.items()})
        expected = machine.get([places[name] for name in names])
        assert _gap(names, instance.get(names), expected) < 1e-12
        instance.close()


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("part", list(Part))
def test_description_is_valid(version: int, part: Part) -> None:
    assert validate_fmu(str(native.file(version, part))) == []


def test_description_with_arrays_is_valid_and_moves_alike() -> None:
    path = native.file(3, arrays=True)
    assert validate_fmu(str(path)) == []
    array = fmpy.simulate_fmu(str(path), stop_time=0.1, output_interval=0.01, output=["q", "qd"])
    scalar = fmpy.simulate_fmu(
        str(native.file(3)), stop_time=0.1, output_interval=0.01, output=[*Q, *QD]
    )
    assert np.array_equal(array["q"][-1], [scalar[name][-1] for name in Q])
    assert np.array_equal(array["qd"][-1], [scalar[name][-1] for name in QD])


def test_arrays_are_checked_and_run_element_by_element(tmp_path: Path) -> None:
    single, arrays = native.file(3), native.file(3, arrays=True)
    done = kr16("fmu", "check", arrays)
    assert (done.code, done.err) == (0, ""), done.out
    told = {v["name"]: v for v in kr16("fmu", "info", arrays, "--json").result()["variables"]}
    assert (told["q"]["size"], told["solver.step"]["size"]) == (6, None)
    (tmp_path / "in.csv").write_text("time,tau[2],wrench3\n0,-300,0\n0.1,10,20\n")
    given = ("--input", tmp_path / "in.csv", "--set", "q_start[2]=-1.2", "--set", "drives=true")
    runs = [kr16("fmu", "run", file, *given) for file in (single, arrays)]
    assert runs[0].out == runs[1].out and runs[0].out.count("\n") == 12
    complains(kr16("fmu", "run", arrays, "--set", "q_start[7]=1"), "no parameter q_start[7]")


def test_check_against_another_robot_names_both() -> None:
    done = kr16("fmu", "check", native.file(), "--robot", "chapter3")
    assert done.code == 1
    for word in ("Dynamics of the KUKA KR 16-2", "Chapter 3 test arm", "--robot"):
        assert word in done.err


@pytest.mark.parametrize("version", [2, 3])
def test_documents_follow_their_schemas(version: int) -> None:
    etree = pytest.importorskip("lxml.etree")
    folder = Path(fmpy.__file__).parent / "schema" / f"fmi{version}"
    documents = {"modelDescription.xml": f"fmi{version}ModelDescription.xsd"}
    if version == 3:
        documents["sources/buildDescription.xml"] = "fmi3BuildDescription.xsd"
    with zipfile.ZipFile(io.BytesIO(native.content(version))) as archive:
        for name, schema in documents.items():
            checker = etree.XMLSchema(etree.parse(str(folder / schema)))
            checker.assertValid(etree.fromstring(archive.read(name)))


@pytest.mark.parametrize("version", [2, 3])
def test_variables_are_those_of_the_pythonfmu_fmu(version: int) -> None:
    start = Start(q=BENT)
    listed = {
        v.name: v for v in native.unpacked(native.file(version, start=start))[1].modelVariables
    }
    for wanted in common(kr16cli.load_data(), start):
        found = listed[wanted.name]
        assert (found.causality, found.variability) == (wanted.causality, wanted.variability)
        if wanted.start is not None:
            assert float(found.start.replace("true", "1").replace("false", "0")) == wanted.start


@pytest.mark.parametrize("version", [2, 3])
def test_model_exchange_moves_as_co_simulation(version: int) -> None:
    values = CASES["pd"]
    names = [*Q, *QD]
    ends = []
    for kind in ("CoSimulation", "ModelExchange"):
        result = fmpy.simulate_fmu(
            str(native.file(version, start=Start(q=BENT))), fmi_type=kind, stop_time=0.3,
            output_interval=0.01, start_values=values, output=names, relative_tolerance=1e-9,
        )  # fmt: skip
        ends.append([float(result[name][-1]) for name in names])
    assert ends[0] == pytest.approx(ends[1], abs=1e-6)


def _limit_crossing(version: int, kind: str, **more: bool) -> tuple[float, float]:
    """Time and angle at the first sample with A2 beyond its limit."""
    values = {"q_start[2]": 0.55, "qd_start[2]": 1.0}
    result = fmpy.simulate_fmu(
        str(native.file(version, start=Start(q=BENT))), fmi_type=kind, stop_time=0.1,
        output_interval=0.01, start_values=values, output=["q[2]", "limit.position[2]"],
        relative_tolerance=1e-10, **more,
    )  # fmt: skip
    k = int(np.argmax(result["limit.position[2]"]))
    return float(result["time"][k]), float(result["q[2]"][k])


def test_passing_a_limit_is_an_event() -> None:
    upper = kr16cli.load_data().joints[1].upper
    exchange = [_limit_crossing(version, "ModelExchange") for version in (2, 3)]
    stepping = _limit_crossing(3, "CoSimulation", use_event_mode=True, early_return_allowed=True)
    for time, angle in (*exchange, stepping):
        assert angle == pytest.approx(upper, abs=1e-7)
        assert time == pytest.approx(stepping[0], abs=1e-7)
    assert _limit_crossing(3, "CoSimulation")[0] == pytest.approx(0.05)  # without event mode


def test_dormand_prince_keeps_its_tolerance() -> None:
    names = [*Q, *QD]
    ends = {}
    for method, step, tolerance in ((2, 1e-4, None), (5, 1e-3, 1e-6), (5, 1e-3, 1e-11)):
        instance = native.Instance(native.file(2, start=Start(q=BENT)))
        instance.fmu.setupExperiment(startTime=0.0, tolerance=tolerance)
        instance.set(["solver.method", "solver.step"], [method, step])
        instance.fmu.enterInitializationMode()
        instance.fmu.exitInitializationMode()
        for k in range(10):
            instance.step(0.03 * k, 0.03)
        ends[tolerance] = np.array(instance.get(names))
        instance.close()
    errors = {t: float(np.abs(ends[t] - ends[None]).max()) for t in (1e-6, 1e-11)}
    assert errors[1e-11] < 1e-9 < errors[1e-6] < 1e-4


@pytest.mark.parametrize("version", [2, 3])
def test_state_goes_on_bit_by_bit_in_another_instance(version: int) -> None:
    path = native.file(version, start=Start(q=BENT))
    first, second = (native.Instance(path) for _ in range(2))
    first.begin(control__mode=4)
    first.step(0.0, 0.0123)
    save = "getFMUstate" if version == 2 else "getFMUState"
    state = getattr(first.fmu, save)()
    serialize = "serializeFMUstate" if version == 2 else "serializeFMUState"
    content = getattr(first.fmu, serialize)(state)
    assert bytes(content)[:8] == bytes(8)
    deserialize = "deSerializeFMUstate" if version == 2 else "deserializeFMUState"
    other = getattr(second.fmu, deserialize)(content)
    getattr(second.fmu, save.replace("get", "set"))(other)
    for instance in (first, second):
        instance.step(0.0123, 0.02)
    assert first.get(_compared()) == second.get(_compared())
    with pytest.raises(FMICallException):
        getattr(second.fmu, deserialize)(bytes(content)[:-1] + b"\x01")
    assert "no state of this build" in second.messages[-1]


def test_rising_inputs_act_within_a_step() -> None:
    path, rise = native.file(2, start=Start(q=BENT)), 3000.0
    ramp, fine = (native.Instance(path).begin() for _ in range(2))
    ramp.fmu.setRealInputDerivatives(ramp.references(["tau[1]"]), [1], [rise])
    ramp.step(0.0, 0.05)
    for k in range(1000):
        fine.set(["tau[1]"], [rise * (k + 0.5) * 5e-5])
        fine.step(k * 5e-5, 5e-5)
    assert ramp.get([*Q, *QD]) == pytest.approx(fine.get([*Q, *QD]), abs=1e-6)
    assert ramp.get(["tau[1]"]) == [pytest.approx(rise * 0.05)]


def test_wrong_calls_leave_the_instance_as_it_was() -> None:
    instance = native.Instance(native.file(2, start=Start(q=BENT))).begin()
    before = instance.get(_compared())
    wrong = [
        lambda: instance.set(["tau[1]"], [math.nan]),
        lambda: instance.set(["payload.mass"], [1.0]),
        lambda: instance.set(["q[1]"], [1.0]),
        lambda: instance.fmu.getReal([0]),
        lambda: instance.fmu.getReal([100000]),
        lambda: instance.fmu.getBoolean(instance.references(["q[1]"])),
        lambda: instance.step(0.0, 0.0),
        lambda: instance.step(0.0, -1.0),
        lambda: instance.step(0.0, math.inf),
        lambda: instance.step(0.5, 0.01),
        instance.fmu.enterInitializationMode,
    ]
    for call in wrong:
        heard = len(instance.messages)
        with pytest.raises(FMICallException):
            call()
        assert len(instance.messages) == heard + 1
    assert instance.get(_compared()) == before
    instance.step(0.0, 0.01)
    instance.close()


def test_equal_input_gives_equal_bytes() -> None:
    once = native.content(3)
    native.content.cache_clear()
    assert native.content(3) == once


def test_robot_put_into_a_library_is_as_one_compiled_in() -> None:
    data = kr16cli.load_data()
    known = table.variables(data, Start(q=BENT), Part.ROBOT, version=2)
    entries = numbers.entries(table.items(known, arrays=False), Part.ROBOT)
    other = numbers.table(data, entries, Part.ROBOT, "{other}", sources.digest())
    with zipfile.ZipFile(io.BytesIO(native.content(2))) as archive:
        path = next(name for name in archive.namelist() if name.startswith("binaries/"))
        compiled = archive.read(path)
    patched = numbers.put_in(compiled, other)
    assert patched is not None
    assert len(patched) == len(compiled)
    assert patched != compiled
    assert numbers.as_bytes(other) in patched
    stale = other._replace(sources="0" * 64)
    assert numbers.put_in(compiled, stale) is None


def test_libraries_and_fmus_are_small() -> None:
    for version in (2, 3):
        with zipfile.ZipFile(io.BytesIO(native.content(version))) as archive:
            sizes = [i.file_size for i in archive.infolist() if i.filename.startswith("binaries/")]
        assert max(sizes) <= 122_880
        assert len(native.content(version)) <= 512_000
