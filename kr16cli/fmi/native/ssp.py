"""A system of three native FMUs as an SSP 1.0: trajectory source, controller, robot, connected.

No connectors of the system itself, and every input of a component that is named is connected:
one host takes others for connected to whatever came last.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

import kr16cli
from kr16cli.api import Robot
from kr16cli.errors import InputError
from kr16cli.fmi import choices, packing
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.native import build, documents, references, track_fmu
from kr16cli.fmi.native.references import SSC, SSV
from kr16cli.fmi.native.xmltext import xml
from kr16cli.fmi.variables import POSE, TYPES, Part, Start, Variable, group, six, table
from kr16cli.fmi.written_arm import WrittenArm
from kr16cli.robot import Payload, RobotData
from kr16cli.simulate.build import make_reference
from kr16cli.simulate.core import Reference
from kr16cli.simulate.fast import quickest_arm
from kr16cli.simulate.motion_spec import FOLLOWERS
from kr16cli.simulate.scenario import Scenario

STEP = 1e-3
"""Communication step (s) where the scenario's controller is not sampled."""

WITH_FRICTION = 2.5e-4
"""Longest internal step (s) of a robot with drives: friction at rest under a torque that is held
is followed to 1e-5 rad, with 1 ms to 2e-3 rad."""

SSD = "http://ssp-standard.org/SSP1/SystemStructureDescription"
_OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"
_TARGETS = [name for stem in ("q_ref", "qd_ref", "qdd_ref") for name in six(stem)]
_STATE = [*six("q"), *six("qd")]


class Component(NamedTuple):
    """An FMU of the system: its variables, and names of those that are connectors."""

    name: str
    variables: Sequence[Variable]
    inputs: Sequence[str]
    outputs: Sequence[str]


class Cell(NamedTuple):
    """What an SSP is made of.

    `step` (s) is the communication step to run it with; `robot` and `controller` are start
    values; `inputs` those of the controller's inputs by name; `notes` what of the scenario is
    not in it.
    """

    data: RobotData
    scenario: Scenario
    reference: Reference
    step: float
    robot: Start
    controller: Start
    inputs: Mapping[str, float]
    notes: list[str]


def cell(data: RobotData, scenario: Scenario) -> Cell:
    """The system that a scenario amounts to.

    Raises:
        InputError: the scenario has no reference or no controller that follows it, or the robot
            no inertial data.
        FileError, NoAnswerError: the reference cannot be made.
    """
    packing.require_inertia(data)
    spec = scenario.controller
    if scenario.reference is None or spec is None or spec.kind not in FOLLOWERS:
        raise InputError(
            f"the scenario {scenario.name} has no controller that follows a reference; an SSP "
            f"needs [reference] and a [controller] of kind {', '.join(FOLLOWERS)}; try "
            "--scenario ptp_16kg"
        )
    placed = data if scenario.gravity is None else data.with_gravity(scenario.gravity)
    arm = quickest_arm(Robot(placed, payload=scenario.payload, drives=scenario.drives))
    reference = make_reference(scenario.reference, arm, scenario.q, scenario.folder)
    # The host's step takes the place of the sampling; the source plays the reference.
    plain = replace(
        scenario, reference=None, controller=replace(spec, sampling=None, knows_payload=True)
    )
    options, notes = choices.options(data, plain, Part.ROBOT, None)
    start, sampling = options.start, spec.sampling
    if sampling and (sampling.resolution or sampling.torque_step):
        notes.append("the SSP leaves out the steps of measured angles and of torques")
    known = start if spec.knows_payload else start._replace(payload=Payload())
    target = reference.joint(0.0)
    inputs = dict(
        zip(
            [*_STATE, *_TARGETS],
            [*scenario.q, *scenario.qd, *target.q, *target.qd, *target.qdd],
            strict=True,
        )
    )
    tau = _first_torque(data, known, inputs)
    step = min(start.step, WITH_FRICTION) if start.drives else start.step
    return Cell(
        data, scenario, reference, sampling.period if sampling else STEP,
        start._replace(mode=1, tau=tau, step=step), known, inputs, notes,
    )  # fmt: skip


def _first_torque(data: RobotData, start: Start, inputs: Mapping[str, float]) -> Sequence[float]:
    """What the controller wants at the start, N m: the robot's input until the first step."""
    known = build.started(table(data, start, Part.CONTROLLER), inputs)
    make_arm = partial(WrittenArm, functions=references.functions())
    machine = Machine(known, data, make_arm, Part.CONTROLLER)
    machine.enter()
    machine.leave()
    tau: list[float] = machine.get([k for k, v in enumerate(known) if group(v.name) == "tau"])
    return tau


def package(made: Cell, platforms: Sequence[str]) -> bytes:
    """The bytes of the .ssp file.

    Args:
        made: the system.
        platforms: names of `toolchain.TARGETS`.

    Raises:
        InputError: the reference needs more points than a trajectory source has room for.
        MissingPartError: a compiler is needed and none is there.
        CheckFailedError: the compiler failed.
    """
    data, name = made.data, made.scenario.name
    stop = made.scenario.duration
    robot = build.Options(
        made.robot, Part.ROBOT, stop, made.step, name, platforms=platforms
    )  # fmt: skip
    controller = robot._replace(
        start=made.controller, part=Part.CONTROLLER, inputs=made.inputs
    )  # fmt: skip
    source = track_fmu.Options(stop, made.step, name, platforms)
    packed = {
        "resources/trajectory.fmu": track_fmu.build(data, made.reference, source),
        "resources/controller.fmu": build.build(data, controller),
        "resources/robot.fmu": build.build(data, robot),
    }
    components = _components(made)
    for component in components:
        parameters = references.parameter_set(
            documents.items(component.variables), component.name,
            f"Parameters of the {component.name}",
        )  # fmt: skip
        packed[f"resources/{component.name}.ssv"] = xml(parameters)
    packed["SystemStructure.ssd"] = xml(_structure(made, components))
    return packing.packed(packed, level=9)


def _components(made: Cell) -> list[Component]:
    law = build.started(table(made.data, made.controller, Part.CONTROLLER), made.inputs)
    arm = table(made.data, made.robot)
    return [
        Component("trajectory", track_fmu.variables(made.data), [], _TARGETS),
        Component("controller", law, [*_STATE, *_TARGETS], six("tau")),
        Component("robot", arm, six("tau"), [*_STATE, *six("tau_applied"), *POSE]),
    ]


def _structure(made: Cell, components: Sequence[Component]) -> Element:
    """SystemStructure.ssd."""
    root = Element("ssd:SystemStructureDescription", {
        "xmlns:ssd": SSD, "xmlns:ssc": SSC, "xmlns:ssv": SSV, "xmlns:osp": _OSP, "version": "1.0",
        "name": f"{made.data.name}, {made.scenario.name}",
        "generationTool": f"kr16cli {kr16cli.__version__}",
    })  # fmt: skip
    when = build.date()
    if when:
        root.set("generationDateAndTime", when)
    system = SubElement(root, "ssd:System", {
        "name": "cell", "description": made.scenario.description or made.scenario.name,
    })  # fmt: skip
    elements = SubElement(system, "ssd:Elements")
    elements.extend(map(_component, components))
    connections = SubElement(system, "ssd:Connections")
    for start, end, name in _connections(components):
        SubElement(connections, "ssd:Connection", {
            "startElement": start, "startConnector": name,
            "endElement": end, "endConnector": name,
        })  # fmt: skip
    used = {TYPES[v.type].unit for c in components for v in _connectors(c)}
    references.units(root, used, "ssd:Units")
    experiment = SubElement(root, "ssd:DefaultExperiment", {
        "startTime": "0.0", "stopTime": repr(float(made.scenario.duration)),
    })  # fmt: skip
    notes = SubElement(experiment, "ssd:Annotations")
    note = SubElement(notes, "ssc:Annotation", {"type": "com.opensimulationplatform"})
    algorithm = SubElement(note, "osp:Algorithm")  # one host takes its attributes for algorithms
    SubElement(algorithm, "osp:FixedStepAlgorithm", {"baseStepSize": repr(float(made.step))})
    return root


def _connectors(component: Component) -> list[Variable]:
    known = {v.name: v for v in component.variables}
    return [known[name] for name in (*component.inputs, *component.outputs)]


def _component(component: Component) -> Element:
    element = Element("ssd:Component", {
        "name": component.name, "type": "application/x-fmu-sharedlibrary",
        "source": f"resources/{component.name}.fmu", "implementation": "CoSimulation",
    })  # fmt: skip
    connectors = SubElement(element, "ssd:Connectors")
    for v in _connectors(component):
        connector = SubElement(connectors, "ssd:Connector", {"name": v.name, "kind": v.causality})
        SubElement(connector, "ssc:Real", {"unit": TYPES[v.type].unit})
    bindings = SubElement(element, "ssd:ParameterBindings")
    SubElement(bindings, "ssd:ParameterBinding", {"source": f"resources/{component.name}.ssv"})
    return element


def _connections(components: Sequence[Component]) -> Iterator[tuple[str, str, str]]:
    """(from, to, connector) of each connection; both ends have the same name."""
    for target in components:
        for name in target.inputs:
            found = [c.name for c in components if name in c.outputs and c is not target]
            yield found[0], target.name, name
