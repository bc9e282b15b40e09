"""modelDescription.xml of FMI 2.0, written from the table of variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from kr16cli.fmi.variables import TYPES, UNITS, Type, Unit, Variable, dependencies

LOG = {
    "logStatusWarning": "Joints beyond their limits",
    "logStatusError": "Why a call failed",
    "logAll": "All messages",
}
"""Log categories."""
_CAN = {
    "needsExecutionTool": True,  # Python is not in the FMU
    "canHandleVariableCommunicationStepSize": True,
    "canInterpolateInputs": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
}


def guid(identity: str) -> str:
    """A GUID made of the first half of a SHA-256 in hexadecimal."""
    h = identity
    return f"{{{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}}}"


def model_description(
    name: str, identity: str, date: str, about: Mapping[str, Any], variables: Sequence[Variable]
) -> Element:
    """The whole document.

    Args:
        name: the model's name and identifier.
        identity: SHA-256 of the build.
        date: as FMI has it, ending in Z.
        about: description, author, version, copyright, license, tool, stop and step (s).
        variables: the table.
    """
    root = Element("fmiModelDescription", {
        "fmiVersion": "2.0", "modelName": name, "guid": guid(identity),
        "description": about["description"], "author": about["author"],
        "version": about["version"], "copyright": about["copyright"],
        "license": about["license"], "generationTool": about["tool"],
        "generationDateAndTime": date, "variableNamingConvention": "structured",
        "numberOfEventIndicators": "0",
    })  # fmt: skip
    SubElement(root, "CoSimulation", {
        "modelIdentifier": name, **{key: word(value) for key, value in _CAN.items()}
    })  # fmt: skip
    units = SubElement(root, "UnitDefinitions")
    for unit, parts in UNITS.items():
        units.append(unit_element(unit, parts))
    types = SubElement(root, "TypeDefinitions")
    for key, kind in TYPES.items():
        types.append(_type(key, kind))
    categories = SubElement(root, "LogCategories")
    for category, text in LOG.items():
        SubElement(categories, "Category", {"name": category, "description": text})
    SubElement(root, "DefaultExperiment", {
        "startTime": "0.0", "stopTime": repr(float(about["stop"])),
        "stepSize": repr(float(about["step"])),
    })  # fmt: skip
    listed = SubElement(root, "ModelVariables")
    for place, variable in enumerate(variables):
        listed.append(variable_element(place, variable))
    structure = SubElement(root, "ModelStructure")
    for tag, start in (("Outputs", False), ("InitialUnknowns", True)):
        unknowns = SubElement(structure, tag)
        for place, variable in enumerate(variables, 1):
            if variable.causality == "output":
                known = dependencies(variables, variable.name, start=start)
                unknowns.append(unknown(place, known))
    return root


def word(value: Any) -> str:
    """A value as XML has it: true, a number in its shortest exact form."""
    return str(value).lower() if isinstance(value, bool) else repr(value)


def unit_element(name: str, unit: Unit) -> Element:
    """A unit's definition."""
    element = Element("Unit", {"name": name})
    exponents = {key: getattr(unit, key) for key in ("kg", "m", "s", "rad")}
    SubElement(element, "BaseUnit", {k: str(n) for k, n in exponents.items() if n})
    if unit.display:
        SubElement(element, "DisplayUnit", {"name": unit.display, "factor": repr(unit.factor)})
    return element


def _type(name: str, kind: Type) -> Element:
    element = Element("SimpleType", {"name": name, "description": kind.description})
    own = SubElement(element, kind.base)
    if kind.quantity:
        own.set("quantity", kind.quantity)
    for key, value in units_of(kind).items():
        own.set(key, value)
    if kind.nominal is not None:
        own.set("nominal", repr(kind.nominal))
    return element


def units_of(kind: Type) -> dict[str, str]:
    """Attributes that name the unit and display unit of a type."""
    display = UNITS[kind.unit].display if kind.unit else ""
    found = {"unit": kind.unit, "displayUnit": display}
    return {key: value for key, value in found.items() if value}


def variable_element(place: int, variable: Variable) -> Element:
    """The ScalarVariable of a variable with the value reference `place`."""
    attributes = {
        "name": variable.name, "valueReference": str(place), "description": variable.description,
        "causality": variable.causality, "variability": variable.variability,
    }  # fmt: skip
    if variable.causality == "parameter":
        attributes["initial"] = "exact"
    elif variable.causality == "output":
        attributes["initial"] = "calculated"
    element = Element("ScalarVariable", attributes)
    kind = TYPES[variable.type]
    own = SubElement(element, kind.base, {"declaredType": variable.type})
    if kind.base == "Real":
        for key, value in units_of(kind).items():
            own.set(key, value)
    for key, bound in (("min", variable.low), ("max", variable.high)):
        if bound is not None:
            own.set(key, repr(bound if kind.base == "Real" else int(bound)))
    if variable.start is not None:
        own.set("start", word(variable.start))
    return element


def unknown(place: int, known: Sequence[int]) -> Element:
    """An unknown of the model structure with the places of what it depends on."""
    attributes = {"index": str(place), "dependencies": " ".join(map(str, known))}
    if known:
        attributes["dependenciesKind"] = " ".join(["dependent"] * len(known))
    return Element("Unknown", attributes)
