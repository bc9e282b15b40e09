"""modelDescription.xml of FMI 3.0 for a native FMU; of scalars, or with rows of six as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from kr16cli.fmi.description import LOG, guid, unit_element, units_of, word
from kr16cli.fmi.native import depend, documents, slots
from kr16cli.fmi.native.table import DERIVATIVES, Item
from kr16cli.fmi.variables import TYPES, UNITS, Part, Type

_COMMON = {
    "needsExecutionTool": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canGetAndSetFMUState": True,
    "canSerializeFMUState": True,
    "providesDirectionalDerivatives": True,
    "providesAdjointDerivatives": True,
}
_CO_SIMULATION = {
    "canHandleVariableCommunicationStepSize": True,
    "maxOutputDerivativeOrder": 1,
    "hasEventMode": True,
}
_STEPPING = {
    "providesIntermediateUpdate": True,
    "mightReturnEarlyFromDoStep": True,
    "canReturnEarlyAfterIntermediateUpdate": True,
}
"""Of a robot: it has internal steps, a controller has none."""
_BASES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}


def describe(name: str, identity: str, about: Mapping[str, Any], listed: Sequence[Item]) -> Element:
    """The whole document.

    Args:
        name: the model's name and identifier.
        identity: SHA-256 of the build.
        about: texts and times, as for the pythonfmu FMU; "part" among them.
        listed: the variables; value references count from 1.
    """
    keys = {"description": "description", "author": "author", "version": "version",
            "copyright": "copyright", "license": "license", "generationTool": "tool",
            "generationDateAndTime": "date"}  # fmt: skip
    root = Element("fmiModelDescription", {
        "fmiVersion": "3.0", "modelName": name, "instantiationToken": guid(identity),
        "variableNamingConvention": "structured",
        **{key: str(about[own]) for key, own in keys.items() if about.get(own)},
    })  # fmt: skip
    robot = about["part"] == Part.ROBOT
    stepping = _CO_SIMULATION | (_STEPPING if robot else {})
    for tag, more in (("ModelExchange", {}), ("CoSimulation", stepping)):
        can = {key: word(value) for key, value in (_COMMON | more).items()}
        SubElement(root, tag, {"modelIdentifier": name, **can})
    units = SubElement(root, "UnitDefinitions")
    units.extend(unit_element(unit, parts) for unit, parts in UNITS.items())
    types = SubElement(root, "TypeDefinitions")
    types.extend(_type(key, kind) for key, kind in TYPES.items())
    categories = SubElement(root, "LogCategories")
    for category, text in LOG.items():
        SubElement(categories, "Category", {"name": category, "description": text})
    SubElement(root, "DefaultExperiment", {
        "startTime": "0.0", "stopTime": repr(float(about["stop"])), "tolerance": "1e-08",
        "stepSize": repr(float(about["step"])),
    })  # fmt: skip
    variables = SubElement(root, "ModelVariables")
    places = {item.name: place for place, item in enumerate(listed, 1)}
    variables.extend(_variable(item, places, robot=robot) for item in listed)
    root.append(_structure(listed, places, robot=robot))
    return root


def _type(name: str, kind: Type) -> Element:
    # Without a description: older FMPy, which other hosts build on, fails at one.
    element = Element(_BASES[kind.base] + "Type", {"name": name})
    if kind.quantity:
        element.set("quantity", kind.quantity)
    element.attrib |= units_of(kind)
    if kind.nominal is not None:
        element.set("nominal", repr(kind.nominal))
    return element


def _variable(item: Item, places: Mapping[str, int], *, robot: bool) -> Element:
    v, kind = item.first, TYPES[item.first.type]
    element = Element(_BASES[kind.base], {
        "name": item.name, "valueReference": str(places[item.name]),
        "description": documents.text(item), "causality": v.causality, "variability": v.variability,
    })  # fmt: skip
    if v.causality == "parameter":
        element.set("initial", "exact")
    elif v.causality in ("output", "local"):
        element.set("initial", "calculated")
    if v.causality != "independent":
        element.set("declaredType", v.type)
    if robot and v.causality == "output" and v.variability == "continuous":
        element.set("intermediateUpdate", "true")
    if kind.base == "Real":
        element.attrib |= units_of(kind)
    for key, values, chosen in (
        ("min", [m.low for m in item.members], min), ("max", [m.high for m in item.members], max)
    ):  # fmt: skip
        if None not in values:
            bound = chosen(values)  # type: ignore[type-var]  # no None among them
            element.set(key, repr(bound if kind.base == "Real" else int(bound)))  # type: ignore[arg-type]
    if v.start is not None:
        element.set("start", " ".join(word(m.start) for m in item.members))
    stem, bracket, index = item.name.partition("[")
    if robot and stem in DERIVATIVES:
        element.set("derivative", str(places[DERIVATIVES[stem] + bracket + index]))
    if len(item.members) > 1:
        SubElement(element, "Dimension", {"start": str(len(item.members))})
    return element


def _structure(listed: Sequence[Item], places: Mapping[str, int], *, robot: bool) -> Element:
    known = [v for item in listed for v in item.members]
    owner = {v.name: places[item.name] for item in listed for v in item.members}
    structure = Element("ModelStructure")

    def add(tag: str, item: Item, *, start: bool) -> None:
        names = (
            depend.initial(known, v.name) if start else depend.running(known, v.name, states=robot)
            for v in item.members
        )
        on = sorted({owner[name] for some in names for name in some})
        element = SubElement(structure, tag, {"valueReference": str(places[item.name])})
        element.set("dependencies", " ".join(map(str, on)))
        if on:
            element.set("dependenciesKind", " ".join(["dependent"] * len(on)))

    outputs = [item for item in listed if item.first.causality == "output"]
    for item in outputs:
        add("Output", item, start=False)
    for item in outputs:
        if robot and item.name.partition("[")[0] in DERIVATIVES:
            add("ContinuousStateDerivative", item, start=False)
    for item in outputs:
        add("InitialUnknown", item, start=True)
    for item in listed:
        if item.first.name in slots.MARGINS:
            add("EventIndicator", item, start=False)
    return structure


def build_description(name: str, sources: Sequence[str]) -> Element:
    """buildDescription.xml: how to make the library from the sources.

    Args:
        name: the model's identifier.
        sources: names of the C files.
    """
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": name})
    files = SubElement(configuration, "SourceFileSet", {"language": "C11"})
    for file in sources:
        SubElement(files, "SourceFile", {"name": file})
    SubElement(configuration, "Library", {"name": "m", "external": "true"})
    return root
