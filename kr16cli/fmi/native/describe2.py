"""modelDescription.xml of FMI 2.0 for a native FMU: that of the pythonfmu FMU, and more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from kr16cli.fmi.description import model_description, unknown
from kr16cli.fmi.native import depend, slots
from kr16cli.fmi.native.table import DERIVATIVES
from kr16cli.fmi.variables import Part, Variable

_COMMON = {
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}
_CO_SIMULATION = {
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "true",
    "maxOutputDerivativeOrder": "1",
    "canRunAsynchronuously": "false",
}


def describe(
    name: str, identity: str, about: Mapping[str, Any], known: Sequence[Variable],
    sources: Sequence[str],
) -> Element:  # fmt: skip
    """The whole document.

    Args:
        name: the model's name and identifier.
        identity: SHA-256 of the build.
        about: texts and times, as for the pythonfmu FMU; "part" among them.
        known: the table; value references count from 1.
        sources: names of the C files.
    """
    root = model_description(name, identity, "", about, known)
    date = about.get("date")
    root.attrib.pop("generationDateAndTime")
    if date:
        root.set("generationDateAndTime", str(date))
    robot = about["part"] == Part.ROBOT
    root.set("numberOfEventIndicators", str(len(slots.MARGINS)) if robot else "0")
    _replace_kinds(root, name, sources)
    _retouch_variables(root, known, robot=robot)
    _experiment(root).set("tolerance", "1e-08")
    _structure(root, known, robot=robot)
    return root


def _replace_kinds(root: Element, name: str, sources: Sequence[str]) -> None:
    """Model exchange and co-simulation in place of pythonfmu's co-simulation."""
    old = root.find("CoSimulation")
    assert old is not None
    root.remove(old)
    derivative = {"providesDirectionalDerivative": "true"}
    for place, (tag, more) in enumerate((("ModelExchange", {}), ("CoSimulation", _CO_SIMULATION))):
        kind = Element(tag, {"modelIdentifier": name, **_COMMON, **more, **derivative})
        files = SubElement(kind, "SourceFiles")
        for file in sources:
            SubElement(files, "File", {"name": file})
        root.insert(place, kind)


def _retouch_variables(root: Element, known: Sequence[Variable], *, robot: bool) -> None:
    """Value references from 1; derivatives name what they derive."""
    places = {v.name: place for place, v in enumerate(known, 1)}
    for place, element in enumerate(root.iterfind("ModelVariables/ScalarVariable"), 1):
        element.set("valueReference", str(place))
        stem, bracket, index = element.get("name", "").partition("[")
        if robot and stem in DERIVATIVES and bracket:
            element[0].set("derivative", str(places[f"{DERIVATIVES[stem]}[{index}"]))


def _experiment(root: Element) -> Element:
    found = root.find("DefaultExperiment")
    assert found is not None
    return found


def _structure(root: Element, known: Sequence[Variable], *, robot: bool) -> None:
    """Outputs, derivatives and initial unknowns, each with what it depends on."""
    structure = root.find("ModelStructure")
    assert structure is not None
    structure.clear()
    outputs = [v.name for v in known if v.causality == "output"]
    places = {v.name: place for place, v in enumerate(known, 1)}
    derivatives = [f"{stem}[{i}]" for stem in ("qd", "qdd") for i in range(1, 7)] if robot else []
    for tag, names in (("Outputs", outputs), ("Derivatives", derivatives)):
        if names:
            unknowns = SubElement(structure, tag)
            for name in names:
                on = depend.running(known, name, states=robot)
                unknowns.append(unknown(places[name], [places[n] for n in on]))
    initial = SubElement(structure, "InitialUnknowns")
    for name in outputs:
        on = depend.initial(known, name)
        initial.append(unknown(places[name], [places[n] for n in on]))
