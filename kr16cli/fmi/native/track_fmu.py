"""The trajectory source: a native FMU (FMI 2.0, co-simulation) that plays a reference."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from kr16cli.fmi import packing
from kr16cli.fmi.description import guid, model_description, unknown, variable_element
from kr16cli.fmi.native import documents, references, sources, track
from kr16cli.fmi.native.library import MODEL, Made, libraries
from kr16cli.fmi.native.xmltext import xml
from kr16cli.fmi.variables import TYPES, UNITS, Part, Variable
from kr16cli.robot import RobotData
from kr16cli.simulate.core import Reference

FILE = "KR16_track"
"""Name of the library that the package may bring."""

_STEMS = (
    ("q_ref", "Angle", "angle"),
    ("qd_ref", "AngularVelocity", "speed"),
    ("qdd_ref", "AngularAcceleration", "acceleration"),
)
_NOTHING = track.Track(((0.0, (0.0,) * 18),), 0.0)


class Options(NamedTuple):
    """What a trajectory source is made of: default experiment (s), scenario's name, platforms."""

    stop: float
    step: float
    scenario: str
    platforms: Sequence[str]


def variables(data: RobotData) -> tuple[Variable, ...]:
    """The table in the order of value references, which begin with 1."""
    outputs = [
        Variable(f"{stem}[{i}]", kind, "output", "continuous", f"Wanted {what} of {joint.name}")
        for stem, kind, what in _STEMS
        for i, joint in enumerate(data.joints, 1)
    ]
    begin = "When the motion begins"
    pace = "How many times faster than it was made the motion runs"
    return (
        *outputs,
        Variable("motion.start", "Time", "parameter", "fixed", begin, 0.0),
        Variable("motion.rate", "Ratio", "parameter", "fixed", pace, 1.0, 1e-3, 1e3),
    )


def build(data: RobotData, reference: Reference, options: Options) -> bytes:
    """The bytes of the .fmu file.

    Args:
        data: the robot, for names.
        reference: what is played.
        options: default experiment, platforms.

    Raises:
        InputError: the reference needs more points than there is room for.
        MissingPartError: a compiler is needed and none is there.
        CheckFailedError: the compiler failed.
    """
    known = variables(data)
    played = track.fit(reference)
    about = packing.about(
        data, Part.CONTROLLER, options.scenario, stop=options.stop, step=options.step, tool=""
    )
    about["description"] = (
        f"Motion of the scenario {options.scenario} for the {data.name}, as references for its "
        "controller. Not affiliated with KUKA; not for safety functions."
    )
    digest = sources.track_digest()
    identity = hashlib.sha256(
        xml(_describe(data, "0" * 64, about)) + track.as_bytes(played, "", digest)
    ).hexdigest()
    token = guid(identity)
    text = {sources.MOTION: track.as_c(played, token, digest)}
    made = Made(
        FILE, digest, track.as_bytes(played, token, digest), sources.track_common() | text, generic
    )
    packed = {"modelDescription.xml": xml(_describe(data, identity, about))}
    packed |= {f"sources/{name}": text.encode() for name, text in made.complete.items()}
    found = results(reference, known, options.stop, options.step)
    listed = documents.items(known)
    texts = {**about, "robot": data.name, "reference": found.told(),
             "points": len(played.points), "fit": f"{played.tolerance:g} rad"}  # fmt: skip
    headers = [name for name in made.complete if name.startswith("fmi")]
    packed |= references.files(found, listed)
    packed |= documents.files(sources.TRACK, texts, listed, headers, 2)
    packed |= libraries(made, options.platforms, 2)
    return packing.packed(packed, level=9)


def generic() -> Mapping[str, str]:
    """The C that a library is compiled from before a motion is put in."""
    empty = track.as_c(_NOTHING, "", sources.track_digest())
    return sources.track_common() | {sources.MOTION: empty}


def results(
    reference: Reference, known: Sequence[Variable], stop: float, step: float
) -> references.Results:
    """The reference itself at times of the default experiment."""
    names = tuple(v.name for v in known if v.causality == "output")
    rows = []
    for k in references.sample_places(stop, step):
        target = reference.joint(k * step)
        rows.append((k * step, *target.q, *target.qd, *target.qdd))
    return references.Results(names, tuple(rows))


def _describe(data: RobotData, identity: str, about: Mapping[str, object]) -> Element:
    """modelDescription.xml of FMI 2.0."""
    known = variables(data)
    root = model_description(MODEL, identity, "", about, ())
    root.attrib.pop("generationDateAndTime")
    kind = root.find("CoSimulation")
    assert kind is not None
    kind.attrib |= {"needsExecutionTool": "false", "maxOutputDerivativeOrder": "1"}
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    experiment.set("tolerance", "1e-08")  # not used, but checkers miss it
    files = SubElement(kind, "SourceFiles")
    for name in sources.units(generic()):
        SubElement(files, "File", {"name": name})
    _keep_used(root, {v.type for v in known})
    listed, structure = root.find("ModelVariables"), root.find("ModelStructure")
    assert listed is not None
    assert structure is not None
    listed.extend(variable_element(place, v) for place, v in enumerate(known, 1))
    parameters = [place for place, v in enumerate(known, 1) if v.causality == "parameter"]
    outputs = [place for place, v in enumerate(known, 1) if v.causality == "output"]
    for tag, on in (("Outputs", []), ("InitialUnknowns", parameters)):
        found = structure.find(tag)
        assert found is not None
        found.extend(unknown(place, on) for place in outputs)
    return root


def _keep_used(root: Element, types: set[str]) -> None:
    """Drop definitions of types and units that no variable has."""
    units = {TYPES[name].unit for name in types}
    for tag, used in (("UnitDefinitions", units & set(UNITS)), ("TypeDefinitions", types)):
        group = root.find(tag)
        assert group is not None
        for element in list(group):
            if element.get("name") not in used:
                group.remove(element)
