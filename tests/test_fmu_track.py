"""The trajectory source: fitted to references, valid, and playing them in a host."""

from __future__ import annotations

import io
import math
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

import kr16cli
from kr16cli.errors import InputError
from kr16cli.fmi import compiling
from kr16cli.fmi.native import library, sources, track, track_fmu
from kr16cli.simulate.build import make_reference
from kr16cli.simulate.core import JointTarget, Reference, TaskTarget
from kr16cli.simulate.references import Chain, Hold, JointMove, Spline
from kr16cli.simulate.scenario import load_scenario
from kr16cli.single import Arm

pytestmark = pytest.mark.skipif(
    compiling.find_compiler() is None
    and library.prebuilt(track_fmu.FILE, sources.track_digest()) is None,
    reason="no C compiler",
)

DATA = kr16cli.load_data()
ARM = Arm(DATA)
HOME = [0.0, -1.2, 1.5, 0.0, 0.6, 0.0]
AWAY = [0.6, -0.9, 1.1, 0.4, -0.3, 1.0]
_FAST, _RAMP = [2.0] * 6, [8.0] * 6
_REFS = [f"{stem}[{i}]" for stem in ("q_ref", "qd_ref", "qdd_ref") for i in range(1, 7)]
_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []


def _scenario(name: str) -> Reference:
    scenario = load_scenario(name)
    assert scenario.reference is not None
    return make_reference(scenario.reference, ARM, scenario.q, scenario.folder)


@lru_cache
def _reference(name: str) -> Reference:
    if name == "trapezoid":
        return JointMove(ARM, HOME, AWAY, "trapezoid", _FAST, _RAMP)
    if name == "chain":
        there = JointMove(ARM, HOME, AWAY, "trapezoid", _FAST, _RAMP)
        back = JointMove(ARM, AWAY, HOME, "quintic", _FAST, _RAMP)
        return Chain([Hold(ARM, HOME, 0.2), there, Hold(ARM, AWAY, 0.1), back])
    if name == "spline":
        middle = [0.5 * (a + b) for a, b in zip(HOME, AWAY, strict=True)]
        return Spline(ARM, [0.1, 0.9, 2.0, 3.1], [HOME, middle, AWAY, HOME])
    if name == "hold":
        return Hold(ARM, HOME)
    return _scenario(name)


NAMES = ("hold", "trapezoid", "chain", "spline", "ptp_16kg", "circle_task_space",
         "lin_near_wrist_singularity")  # fmt: skip


@lru_cache
def _file(name: str) -> Path:
    """The source of a reference as a file that lives as long as the tests."""
    reference = _reference(name)
    options = track_fmu.Options(
        max(1.0, reference.duration), 0.01, name, library.platforms("host", 2)
    )
    folder = tempfile.TemporaryDirectory(prefix="kr16_tests_")
    _FOLDERS.append(folder)
    path = Path(folder.name) / "KR16.fmu"
    path.write_bytes(track_fmu.build(DATA, reference, options))
    return path


def _rows(reference: Reference, times: Sequence[float]) -> np.ndarray:
    targets = (reference.joint(t) for t in times)
    return np.array([[*t.q, *t.qd, *t.qdd] for t in targets])


@pytest.mark.parametrize("name", NAMES)
def test_plays_its_reference(name: str) -> None:
    reference = _reference(name)
    stop = reference.duration + 0.1
    result = fmpy.simulate_fmu(str(_file(name)), stop_time=stop, output_interval=0.0037)
    found = np.array([result[n] for n in _REFS]).T
    gaps = np.abs(found - _rows(reference, result["time"]))
    assert gaps[:, :6].max() < 2e-9
    assert gaps[:, 6:12].max() < 2e-8
    assert gaps[:, 12:].max() < 2e-5


@pytest.mark.parametrize("name", ["trapezoid", "chain"])
def test_acceleration_at_a_jump_is_the_references_own(name: str) -> None:
    reference = _reference(name)
    points = track.fit(reference).points
    times = [t for t, _ in points]
    jumps = [b for b in reference.breaks if b < reference.duration]
    assert len(jumps) >= 3
    for t in jumps:
        k = max(i for i, own in enumerate(times) if own <= t)
        after = track.between(points[k], points[k + 1], (t - times[k]) / (times[k + 1] - times[k]))
        wanted = _rows(reference, [t])[0]
        assert np.abs(np.array(after) - wanted).max() < 1e-5


def test_fit_is_exact_where_the_motion_is_a_polynomial() -> None:
    assert len(track.fit(_reference("hold")).points) == 1
    assert len(track.fit(_reference("trapezoid")).points) <= 8
    assert len(track.fit(_reference("ptp_16kg")).points) <= 4
    assert track.fit(_reference("circle_task_space")).tolerance == track.TOLERANCES[0]


class _Shaking:
    """All joints swing fast for a long time."""

    duration, breaks = 1000.0, (0.0, 1000.0)

    def __init__(self, w: float) -> None:
        self.w = w

    def joint(self, t: float) -> JointTarget:
        s, c, w = math.sin(self.w * t), math.cos(self.w * t), self.w
        return JointTarget([s] * 6, [w * c] * 6, [-w * w * s] * 6)

    def task(self, t: float) -> TaskTarget:
        raise NotImplementedError


def test_tolerance_gives_way_before_the_room_does() -> None:
    assert track.TOLERANCES[0] < track.fit(_Shaking(0.2)).tolerance <= track.TOLERANCES[-1]
    with pytest.raises(InputError, match=r"more than 512 points.*shorter or simpler"):
        track.fit(_Shaking(300.0))


@pytest.mark.parametrize("name", ["hold", "chain"])
def test_is_valid(name: str) -> None:
    assert validate_fmu(str(_file(name))) == []
    etree = pytest.importorskip("lxml.etree")
    schemas = Path(fmpy.__file__).parent
    with zipfile.ZipFile(_file(name)) as archive:
        names = archive.namelist()
        for member, schema in (
            ("modelDescription.xml", "schema/fmi2/fmi2ModelDescription.xsd"),
            ("extra/org.fmi-standard.fmi-ls-ref/parameters.ssv",
             "ssp/schema/SystemStructureParameterValues.xsd"),
        ):  # fmt: skip
            checker = etree.XMLSchema(etree.parse(str(schemas / schema)))
            checker.assertValid(etree.fromstring(archive.read(member)))
        page = archive.read("documentation/index.html").decode()
    assert "model.png" in names
    assert "{{" not in page
    assert "motion.rate" in page
    assert max(i.file_size for i in zipfile.ZipFile(_file(name)).infolist()) <= 122_880


def test_equal_input_gives_equal_bytes_and_another_motion_another_identity() -> None:
    options = track_fmu.Options(1.0, 0.01, "x", library.platforms("host", 2))
    once = [track_fmu.build(DATA, _reference(name), options) for name in ("chain", "chain", "hold")]
    assert once[0] == once[1]
    guids = []
    for content in once[1:]:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            guids.append(ElementTree.fromstring(archive.read("modelDescription.xml")).get("guid"))
    assert guids[0] != guids[1]


def test_reference_results_are_those_of_the_reference() -> None:
    with zipfile.ZipFile(_file("chain")) as archive:
        text = archive.read("extra/org.fmi-standard.fmi-ls-ref/reference.csv").decode()
    rows = np.array([line.split(",") for line in text.splitlines()[1:]], dtype=float)
    assert np.abs(rows[:, 1:] - _rows(_reference("chain"), rows[:, 0])).max() < 1e-8


class _Source:
    """An instance in FMPy."""

    def __init__(self, path: Path, folder: str) -> None:
        description = fmpy.read_model_description(str(path))
        self.places = {v.name: v.valueReference for v in description.modelVariables}
        self.messages: list[str] = []
        self.fmu = fmi2.FMU2Slave(
            guid=description.guid, unzipDirectory=folder, modelIdentifier="KR16",
            instanceName="source",
        )  # fmt: skip
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._heard)
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self._callbacks = callbacks
        self.fmu.instantiate(callbacks=callbacks)

    def _heard(self, _: Any, name: Any, status: int, category: Any, message: bytes) -> None:
        self.messages.append(message.decode())

    def begin(self, **values: float) -> _Source:
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        for name, value in values.items():
            self.fmu.setReal([self.places[name.replace("__", ".")]], [value])
        self.fmu.exitInitializationMode()
        return self

    def row(self) -> list[float]:
        return list(self.fmu.getReal([self.places[name] for name in _REFS]))

    def step(self, time: float, size: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=size)


@pytest.fixture
def source(tmp_path: Path) -> Iterator[_Source]:
    path = _file("chain")
    made = _Source(path, fmpy.extract(str(path), str(tmp_path)))
    yield made
    made.fmu.freeInstance()


def test_motion_can_begin_later_and_run_faster(source: _Source) -> None:
    source.begin(motion__start=0.25, motion__rate=2.0)
    assert source.row() == pytest.approx(_rows(_reference("chain"), [-1.0])[0])
    source.step(0.0, 0.4)
    q, qd, qdd = _rows(_reference("chain"), [0.3])[0].reshape(3, 6)
    assert np.abs(qdd).max() > 0.1
    assert source.row() == pytest.approx([*q, *(2.0 * qd), *(4.0 * qdd)], abs=1e-8)


def test_state_is_kept_restored_and_carried_over(source: _Source) -> None:
    source.begin(motion__rate=1.5).step(0.0, 0.3)
    here = source.row()
    state = source.fmu.getFMUstate()
    content = source.fmu.serializeFMUstate(state)
    source.step(0.3, 0.2)
    there = source.row()
    assert there != here
    source.fmu.setFMUstate(source.fmu.deSerializeFMUstate(content))
    assert source.row() == here
    source.step(0.3, 0.2)
    assert source.row() == there
    wrong = bytes(content)[:8] + b"\x01" + bytes(content)[9:]
    with pytest.raises(FMICallException):
        source.fmu.deSerializeFMUstate(wrong)
    assert "no state of this build" in source.messages[-1]


def test_output_derivatives_are_speeds_and_accelerations(source: _Source) -> None:
    source.begin(motion__rate=2.0).step(0.0, 0.15)
    places = [source.places[name] for name in _REFS[:12]]
    rates = source.fmu.getRealOutputDerivatives(places, [1] * 12)
    assert list(rates) == source.row()[6:]


def test_wrong_calls_are_refused_with_a_reason(source: _Source) -> None:
    source.begin()
    before = source.row()
    for call in (
        lambda: source.fmu.setReal([source.places["motion.rate"]], [2.0]),
        lambda: source.fmu.getReal([0]),
        lambda: source.fmu.getReal([21]),
        lambda: source.fmu.getInteger([1]),
        lambda: source.step(0.0, 0.0),
        lambda: source.step(0.0, math.nan),
        lambda: source.step(1.0, 0.1),
        source.fmu.enterInitializationMode,
    ):
        heard = len(source.messages)
        with pytest.raises(FMICallException):
            call()
        assert len(source.messages) == heard + 1
    assert source.row() == before
    source.fmu.reset()
    source.fmu.setupExperiment(startTime=0.0)
    for name, value in (("motion.rate", 0.0), ("motion.rate", math.inf), ("q_ref[1]", 1.0)):
        with pytest.raises(FMICallException):
            source.fmu.setReal([source.places[name]], [value])
    source.begin(motion__rate=3.0)


def test_no_step_goes_past_the_stop_time(source: _Source) -> None:
    source.fmu.setupExperiment(startTime=0.0, stopTime=0.03)
    source.fmu.enterInitializationMode()
    source.fmu.exitInitializationMode()
    for k in range(3):
        source.step(k * 0.01, 0.01)
    with pytest.raises(FMICallException):
        source.step(0.03, 1e-4)
    assert "past the stop time" in source.messages[-1]


def test_instance_of_another_build_is_refused(tmp_path: Path) -> None:
    path = _file("hold")
    folder = fmpy.extract(str(path), str(tmp_path))
    fmu = fmi2.FMU2Slave(
        guid="{other}", unzipDirectory=folder, modelIdentifier="KR16", instanceName="source"
    )
    with pytest.raises(Exception, match="instantiate"):
        fmu.instantiate()
