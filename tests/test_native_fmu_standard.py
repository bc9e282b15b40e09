"""Native FMUs: rules of the FMI standards that hosts seldom test, each tried in an instance."""

from __future__ import annotations

import ctypes
import zipfile
from collections.abc import Callable
from xml.etree import ElementTree

import pytest
from fmpy.fmi1 import FMICallException

import kr16cli
import native_fmus as native
from kr16cli.fmi import compiling
from kr16cli.fmi.native import library
from kr16cli.fmi.variables import Part, six
from kr16cli.tolerances import TOLERANCES

pytestmark = pytest.mark.skipif(
    compiling.find_compiler() is None and library.prebuilt() is None, reason="no C compiler"
)


def _begun(version: int, stop: float, part: Part = Part.ROBOT) -> native.Instance:
    """An instance told of a stop time, initialized."""
    instance = native.Instance(native.file(version, part))
    if version == 2:
        instance.fmu.setupExperiment(startTime=0.0, stopTime=stop)
        instance.fmu.enterInitializationMode()
    else:
        instance.fmu.enterInitializationMode(startTime=0.0, stopTime=stop)
    instance.fmu.exitInitializationMode()
    return instance


def _through_event(instance: native.Instance) -> None:
    instance.fmu.enterEventMode()
    instance.fmu.updateDiscreteStates()
    instance.fmu.enterStepMode()


@pytest.mark.parametrize("part", Part)
@pytest.mark.parametrize("version", [2, 3])
def test_no_step_goes_past_the_stop_time(version: int, part: Part) -> None:
    instance = _begun(version, 0.03, part)
    for k in range(3):  # 3 * 0.01 is more than 0.03 by rounding
        instance.step(k * 0.01, 0.01)
    with pytest.raises(FMICallException):
        instance.step(0.03, 1e-4)
    assert "past the stop time, 0.03 s" in instance.messages[-1]
    instance.fmu.reset()
    instance.begin().step(0.0, 0.05)  # told of none
    instance.close()


@pytest.mark.parametrize("version", [2, 3])
def test_state_keeps_its_stop_time_but_not_in_bytes(version: int) -> None:
    save, letter = ("FMUstate", "S") if version == 2 else ("FMUState", "s")
    first, second = _begun(version, 0.01), native.Instance(native.file(version))
    first.step(0.0, 0.01)
    state = getattr(first.fmu, f"get{save}")()
    content = getattr(first.fmu, f"serialize{save}")(state)
    copy = getattr(second.fmu, f"de{letter}erialize{save}")(content)
    getattr(second.fmu, f"set{save}")(copy)
    second.step(0.01, 0.01)
    first.fmu.reset()
    getattr(first.fmu, f"set{save}")(state)
    with pytest.raises(FMICallException):
        first.step(0.01, 0.01)
    getattr(first.fmu, f"free{save}")(state)
    getattr(second.fmu, f"free{save}")(copy)
    first.close()
    second.close()


@pytest.mark.parametrize(("version", "name"), [(2, "fmi2FreeFMUstate"), (3, "fmi3FreeFMUState")])
def test_freeing_no_state_is_ignored(version: int, name: str) -> None:
    instance = native.Instance(native.file(version)).begin()
    free: Callable[..., int] = getattr(instance.fmu.dll, name)
    free.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
    assert free(instance.fmu.component, None) == 0
    empty = ctypes.c_void_p(None)
    assert free(instance.fmu.component, ctypes.byref(empty)) == 0
    assert instance.messages == []
    instance.close()


def test_inputs_may_be_told_to_rise_before_the_initialization() -> None:
    instance = native.Instance(native.file(2))
    instance.fmu.setRealInputDerivatives(instance.references(["tau[1]"]), [1], [100.0])
    instance.begin().step(0.0, 0.01)
    assert instance.get(["tau[1]"]) == [pytest.approx(1.0)]
    instance.close()


@pytest.mark.parametrize("version", [2, 3])
def test_event_mode_may_be_entered_in_event_mode(version: int) -> None:
    instance = native.Instance(native.file(version), exchange=True).begin()
    instance.fmu.enterEventMode()
    instance.fmu.enterContinuousTimeMode()
    instance.close()


@pytest.mark.parametrize("start", [0.5, 1.1])
def test_torque_that_jumps_between_steps_is_an_event(start: float) -> None:
    limit = kr16cli.load_data().joints[0].torque
    assert limit is not None
    instance = native.Instance(native.file(3), events=True).begin()
    instance.set(["tau[1]"], [start * limit])
    instance.fmu.updateDiscreteStates()
    instance.fmu.enterStepMode()
    flag, time = start > 1.0, 0.0
    for torque in (1.2, 0.9, 0.8, 1.3):
        instance.set(["tau[1]"], [torque * limit])
        due = flag != (torque > 1.0)
        assert bool(instance.fmu.doStep(time, 1e-4)[0]) == due
        time += 1e-4
        flags = instance.references(["limit.torque[1]"])
        assert instance.fmu.getBoolean(flags) == [flag]  # held until the event
        _through_event(instance)
        flag = torque > 1.0
        assert instance.fmu.getBoolean(flags) == [flag]
    instance.close()


def test_event_indicators_follow_the_flags_at_once() -> None:
    upper = kr16cli.load_data().joints[1].upper
    instance = native.Instance(native.file(3), exchange=True).begin()
    x = instance.get([*six("q"), *six("qd")])
    x[1] = upper + TOLERANCES.limit - 2e-10  # counts as beyond at an event
    instance.states(x)

    def indicator() -> float:
        margins = (ctypes.c_double * 24)()
        instance.fmu.getEventIndicators(margins, 24)
        return float(margins[7])

    assert indicator() == pytest.approx(2e-10, rel=1e-3)
    instance.fmu.updateDiscreteStates()
    assert instance.fmu.getBoolean(instance.references(["limit.position[2]"])) == [True]
    assert indicator() == pytest.approx(-8e-10, rel=1e-3)
    instance.close()


def test_nothing_changes_along_time_alone() -> None:
    instance = native.Instance(native.file(3), exchange=True).begin()
    names = [*six("qdd"), "pose.x"]
    found = instance.fmu.getDirectionalDerivative(
        instance.references(names), instance.references(["time"]), [1.0]
    )
    assert list(found) == [0.0] * len(names)
    instance.close()


@pytest.mark.parametrize("part", Part)
def test_outputs_that_may_be_read_between_steps_are_marked(part: Part) -> None:
    with zipfile.ZipFile(native.file(3, part)) as fmu:
        root = ElementTree.fromstring(fmu.read("modelDescription.xml"))
    can = root.find("CoSimulation")
    assert can is not None
    robot = part is Part.ROBOT
    assert (can.get("providesIntermediateUpdate") == "true") == robot
    for variable in root.iterfind("ModelVariables/*"):
        smooth = (variable.get("causality"), variable.get("variability")) == (
            "output", "continuous"
        )  # fmt: skip
        assert variable.get("intermediateUpdate") == ("true" if smooth and robot else None)
