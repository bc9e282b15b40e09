"""The system of three FMUs: what the SSP says, and how it moves in hosts."""

from __future__ import annotations

import csv
import io
import os
import subprocess
import tempfile
import zipfile
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy import fmi2
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import SystemStructureDescription, read_ssd
from fmpy.validation import validate_fmu

import kr16cli
from command_line import complains, kr16
from kr16cli.fmi import compiling
from kr16cli.fmi.native import library, ssp
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.loop import Sampling
from kr16cli.simulate.motion_spec import ControllerSpec
from kr16cli.simulate.scenario import Scenario, SolverSpec, load_scenario

_PYTHON = os.environ.get("KR16_HOSTS", "")
_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []
Q = [f"q[{i}]" for i in range(1, 7)]

pytestmark = pytest.mark.skipif(
    compiling.find_compiler() is None and library.prebuilt() is None, reason="no C compiler"
)
hosts = [pytest.mark.slow, pytest.mark.skipif(not _PYTHON, reason="KR16_HOSTS names no hosts")]


@lru_cache
def _scenario(name: str) -> Scenario:
    """A shipped scenario; near singularities with the damping that FMUs have."""
    scenario = load_scenario(name)
    assert scenario.controller is not None
    usual = ControllerSpec("task_space")
    controller = replace(scenario.controller, near=usual.near, strength=usual.strength)
    return replace(scenario, controller=controller)


@lru_cache
def _cell(name: str) -> ssp.Cell:
    return ssp.cell(kr16cli.load_data(), _scenario(name))


@lru_cache
def _content(name: str) -> bytes:
    return ssp.package(_cell(name), library.platforms("host", 2))


@lru_cache
def _file(name: str) -> Path:
    """The SSP as a file that lives as long as the tests."""
    folder = tempfile.TemporaryDirectory(prefix="kr16_tests_")
    _FOLDERS.append(folder)
    path = Path(folder.name) / "cell.ssp"
    path.write_bytes(_content(name))
    return path


@lru_cache
def _expected(name: str, most: float = 100.0) -> np.ndarray:
    """Angles at every communication point by the project's simulator, sampled as a host does.

    The controller measures at each point; its torque acts one step later. At most `most` s.
    """
    cell = _cell(name)
    controller = cell.scenario.controller
    assert controller is not None
    scenario = replace(
        cell.scenario,
        controller=replace(controller, sampling=Sampling(cell.step, cell.step)),
        output_step=cell.step,
        duration=min(cell.scenario.duration, most),
    )
    if not scenario.drives:
        scenario = replace(scenario, solver=SolverSpec(method="RK4", step=1e-3))
    run = simulate(kr16cli.load_data(), scenario)
    assert run.complete
    return np.asarray(run.q)


class _Host:
    """Steps all components from point to point, then hands values on: Jacobi's way."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.ssd: SystemStructureDescription = read_ssd(str(path))
        unpacked = Path(fmpy.extract(str(path), str(folder)))
        self.fmus: dict[str, fmi2.FMU2Slave] = {}
        self.places: dict[str, dict[str, int]] = {}
        for component in self.ssd.system.elements:
            fmu = unpacked / component.source
            description = fmpy.read_model_description(str(fmu))
            self.places[component.name] = {
                v.name: v.valueReference for v in description.modelVariables
            }
            self.fmus[component.name] = fmi2.FMU2Slave(
                guid=description.guid, unzipDirectory=fmpy.extract(str(fmu)),
                modelIdentifier=description.coSimulation.modelIdentifier,
                instanceName=component.name,
            )  # fmt: skip
        for fmu in self.fmus.values():
            fmu.instantiate()
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()

    def hand_on(self) -> None:
        """Outputs to the inputs they are connected to, all read before one is set."""
        wires = self.ssd.system.connections
        values = [self.get(w.startElement, [w.startConnector])[0] for w in wires]
        for w, value in zip(wires, values, strict=True):
            self.fmus[w.endElement].setReal([self.places[w.endElement][w.endConnector]], [value])

    def get(self, component: str, names: list[str]) -> list[float]:
        places = self.places[component]
        return list(self.fmus[component].getReal([places[name] for name in names]))

    def run(self, step: float, count: int, *, zeros: bool = False) -> np.ndarray:
        """Angles at each point; with `zeros` all inputs hold 0 in the first step, as in FMPy."""
        if not zeros:
            self.hand_on()
            self.hand_on()  # the controller's torque follows from what it was handed
        for fmu in self.fmus.values():
            fmu.exitInitializationMode()
        for w in self.ssd.system.connections if zeros else ():
            self.fmus[w.endElement].setReal([self.places[w.endElement][w.endConnector]], [0.0])
        rows = [self.get("robot", Q)]
        for k in range(count):
            for fmu in self.fmus.values():
                fmu.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
            self.hand_on()
            rows.append(self.get("robot", Q))
        for fmu in self.fmus.values():
            fmu.freeInstance()
        return np.array(rows)


SCENARIOS = {
    "ptp_16kg": 2e-5,  # two solvers for friction
    "circle_task_space": 1e-8,
    "lin_near_wrist_singularity": 1e-6,  # near the singularity rounding grows
}


@pytest.mark.parametrize("most", [0.4, pytest.param(100.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("name", "tolerance"), SCENARIOS.items())
def test_moves_as_the_projects_simulator_sampled_alike(
    name: str, tolerance: float, most: float, tmp_path: Path
) -> None:
    wanted = _expected(name, most)
    found = _Host(_file(name), tmp_path).run(_cell(name).step, len(wanted) - 1)
    assert np.abs(wanted - wanted[0]).max() > 0.01
    assert np.abs(found - wanted).max() < tolerance


def test_follows_the_reference(tmp_path: Path) -> None:
    name = "ptp_16kg"
    reference, step = _cell(name).reference, _cell(name).step
    count = round(reference.duration / step)
    found = _Host(_file(name), tmp_path).run(step, count)
    wanted = np.array([reference.joint(k * step).q for k in range(count + 1)])
    assert np.abs(wanted[-1] - wanted[0]).max() > 1.0
    assert np.abs(found - wanted).max() < 2e-3


def test_fmpy_runs_it(tmp_path: Path) -> None:
    name = "ptp_16kg"
    result = simulate_ssp(str(_file(name)), stop_time=0.1995, step_size=0.001)
    found = np.array([result[f"robot.{n}"] for n in Q]).T
    wanted = _Host(_file(name), tmp_path).run(0.001, len(found), zeros=True)[1:]
    assert len(found) == 200
    assert np.abs(found - wanted).max() < 1e-12


@pytest.mark.slow
def test_fmpy_starts_with_zeros_and_then_moves_alike() -> None:
    name = "circle_task_space"
    step, stop = _cell(name).step, _cell(name).scenario.duration
    result = simulate_ssp(str(_file(name)), stop_time=stop, step_size=step)
    found = np.array([result[f"robot.{n}"] for n in Q]).T
    gap = np.abs(found - _expected(name)[1 : len(found) + 1]).max(axis=1)
    # Its connections hold 0 at first, and so the first two torques are wrong; that dies out.
    assert gap.max() < 0.02
    assert gap[round(1.5 / step) :].max() < 1e-6


@pytest.mark.parametrize("name", SCENARIOS)
def test_structure_follows_the_rules(name: str) -> None:
    etree = pytest.importorskip("lxml.etree")
    schemas = Path(fmpy.__file__).parent / "ssp" / "schema"
    with zipfile.ZipFile(_file(name)) as archive:
        names = archive.namelist()
        for member in names:
            kind = {"ssd": "Description", "ssv": "ParameterValues"}.get(member[-3:])
            if kind:
                schema = etree.XMLSchema(etree.parse(str(schemas / f"SystemStructure{kind}.xsd")))
                schema.assertValid(etree.fromstring(archive.read(member)))
        root = etree.fromstring(archive.read("SystemStructure.ssd"))
    kinds = [c.get("implementation") for c in root.iter(f"{{{ssp.SSD}}}Component")]
    assert kinds == ["CoSimulation"] * 3  # the trajectory has no other
    description = read_ssd(str(_file(name)))
    system = description.system
    assert description.version == "1.0"
    assert system.connectors == []
    components = {c.name: c for c in system.elements}
    assert list(components) == ["trajectory", "controller", "robot"]
    ends = [(w.endElement, w.endConnector) for w in system.connections]
    inputs = [(c.name, k.name) for c in components.values() for k in c.connectors
              if k.kind == "input"]  # fmt: skip
    assert sorted(ends) == sorted(inputs)
    assert len(set(ends)) == len(ends) == 36
    outputs = {(c.name, k.name) for c in components.values() for k in c.connectors
               if k.kind == "output"}  # fmt: skip
    assert {(w.startElement, w.startConnector) for w in system.connections} <= outputs
    for component in components.values():
        assert component.source in names
        (binding,) = component.parameterBindings
        assert binding.source in names


def _component(name: str, component: str) -> Any:
    """The description of an FMU in an SSP."""
    with zipfile.ZipFile(_file(name)) as archive:
        content = archive.read(f"resources/{component}.fmu")
    path = _file(name).with_name(f"{name}_{component}.fmu")
    path.write_bytes(content)
    return path, fmpy.read_model_description(str(path))


@pytest.mark.parametrize("component", ["trajectory", "controller", "robot"])
def test_components_are_valid_and_begin_where_the_scenario_does(component: str) -> None:
    path, description = _component("circle_task_space", component)
    assert validate_fmu(str(path)) == []
    assert float(description.defaultExperiment.stepSize) == 0.004
    assert float(description.defaultExperiment.tolerance) == 1e-8
    starts = {v.name: v.start for v in description.modelVariables}
    scenario = _cell("circle_task_space").scenario
    for i, angle in enumerate(scenario.q, 1):
        if component == "controller":
            assert float(starts[f"q[{i}]"]) == angle
            assert float(starts[f"q_ref[{i}]"]) == pytest.approx(angle)
        elif component == "robot":
            assert float(starts[f"q_start[{i}]"]) == angle
    if component == "robot":
        assert starts["control.mode"] == "1"
        assert abs(float(starts["tau[2]"])) > 100.0


def test_what_the_system_leaves_out_is_said() -> None:
    assert _cell("ptp_16kg").notes == []
    for name, words in (
        ("lin_near_wrist_singularity", "near_singular"),
        ("step_disturbance", "gains kp, kd"),
        ("step_disturbance", "the wrench"),
    ):
        notes = ssp.cell(kr16cli.load_data(), load_scenario(name)).notes
        assert any(words in note for note in notes)
        assert not any("reference" in note for note in notes)


def test_controller_that_ignores_the_payload_has_none() -> None:
    scenario = load_scenario("ptp_16kg")
    assert scenario.controller is not None
    ignoring = replace(scenario, controller=replace(scenario.controller, knows_payload=False))
    cell = ssp.cell(kr16cli.load_data(), ignoring)
    assert cell.robot.payload.mass == 16.0
    assert cell.controller.payload.mass == 0.0
    assert max(map(abs, np.subtract(cell.robot.tau, _cell("ptp_16kg").robot.tau))) > 10.0


def test_equal_input_gives_equal_bytes() -> None:
    once = _content("circle_task_space")
    assert ssp.package(_cell("circle_task_space"), library.platforms("host", 2)) == once
    assert len(once) < 1_000_000


def test_command_writes_it_and_says_how_to_run_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = kr16("fmu ssp --scenario circle_task_space -o c.ssp")
    assert done.code == 0
    assert done.out.startswith("c.ssp: Circle in task space by trajectory, controller and robot")
    assert "run it for 2 s in steps of 0.004 s" in done.out
    assert "steps of measured angles" in done.err
    with zipfile.ZipFile("c.ssp") as archive:
        assert archive.testzip() is None
        assert "SystemStructure.ssd" in archive.namelist()


def test_command_refuses_what_cannot_be_a_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    complains(kr16("fmu ssp --scenario free_swing"), "no controller that follows", "ptp_16kg")
    complains(kr16("fmu ssp --platforms beos"), "beos", "not known")
    complains(kr16("fmu ssp -o -"), "binary", "-o cell.ssp")
    complains(kr16("fmu build --native -o -"), "binary", "-o KR16.fmu")
    complains(kr16("fmu ssp --scenario nowhere"), "no shipped scenario")
    assert list(tmp_path.iterdir()) == []


def _run(*words: object, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    return subprocess.run(
        [str(word) for word in words], cwd=folder, env=environment, capture_output=True,
        text=True, check=False, timeout=300,
    )  # fmt: skip


@pytest.mark.parametrize(("name", "tolerance"), SCENARIOS.items())
class TestHosts:
    pytestmark = hosts

    def test_ecos(self, name: str, tolerance: float, tmp_path: Path) -> None:
        code = "import ecospy, pathlib; print(pathlib.Path(ecospy.__file__).parent)"
        program = Path(_run(_PYTHON, "-c", code, folder=tmp_path).stdout.strip()) / "binaries/ecos"
        program.chmod(0o755)
        cell = _cell(name)
        done = _run(program, "simulate", "--path", _file(name), "--stopTime",
                    cell.scenario.duration, "--stepSize", cell.step, folder=tmp_path)  # fmt: skip
        assert done.returncode == 0, done.stdout[-500:]
        (table,) = tmp_path.glob("*.csv")
        header, *rows = list(csv.reader(io.StringIO(table.read_text())))
        names = [cell.strip() for cell in header]
        places = [names.index(f"robot::{n}[REAL]") for n in Q]
        found = np.array([[float(row[k]) for k in places] for row in rows])
        wanted = _expected(name)
        assert len(wanted) - 1 <= len(found) <= len(wanted)
        # Its table has six decimals.
        assert np.abs(found - wanted[: len(found)]).max() < tolerance + 1e-6

    def test_libcosim(self, name: str, tolerance: float, tmp_path: Path) -> None:
        cell = _cell(name)
        done = _run(_PYTHON, "-c", _LIBCOSIM, _file(name), cell.step, len(_expected(name)) - 1,
                    folder=tmp_path)  # fmt: skip
        assert done.returncode == 0, done.stderr[-500:]
        rows = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("row ")]
        found = np.array(rows, dtype=float)
        assert np.abs(found - _expected(name)[1:]).max() < tolerance


_LIBCOSIM = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
path, step, count = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
execution = CosimExecution.from_ssp_file(path, round(step * 1e9))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
robot = execution.slave_index_from_instance_name("robot")
references = {v.name.decode(): v.reference for v in execution.slave_variables(robot)}
wanted = [references[f"q[{i}]"] for i in range(1, 7)]
for _ in range(count):
    assert execution.step(1)
    print("row", *map(repr, observer.last_real_values(robot, wanted)))
"""
