"""Look into an FMU of anyone: what its model description says, and our cargo if it holds one."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from kr16cli.errors import FileError
from kr16cli.fmi import cargo as freight

SCHEMA = "kr16.fmu/1"
_BASES = ("Real", "Integer", "Boolean", "String", "Enumeration")
_LARGEST = 64 * 2**20


@dataclass(frozen=True)
class Described:
    """One variable of a model description; `start` as written, None where there is none.

    `size` is how many numbers an array holds; None for one number, and where another variable
    says how many.
    """

    name: str
    base: str
    causality: str
    variability: str
    unit: str | None
    start: str | None
    description: str
    size: int | None = None

    def elements(self) -> tuple[Described, ...]:
        """An array's numbers as variables of their own, `q[1]` first; else itself."""
        if self.size is None:
            return (self,)
        given = (self.start or "").split()
        starts: Sequence[str | None] = given if len(given) == self.size else [None] * self.size
        if len(given) == 1:
            starts = given * self.size
        return tuple(
            replace(self, name=f"{self.name}[{k}]", start=start, size=None)
            for k, start in enumerate(starts, 1)
        )


@dataclass(frozen=True)
class Fmu:
    """What is in an FMU: attributes and default experiment of the model description as written.

    `kinds` are "co-simulation", "model-exchange" and "scheduled-execution"; `platforms` the
    folders with binaries; `cargo` is ours, None for other people's FMUs.
    """

    path: str
    attributes: Mapping[str, str]
    kinds: tuple[str, ...]
    experiment: Mapping[str, str]
    variables: tuple[Described, ...]
    platforms: tuple[str, ...]
    shim: bool
    cargo: freight.Cargo | None

    @cached_property
    def scalars(self) -> tuple[Described, ...]:
        """The variables, each element of an array by itself."""
        return tuple(element for v in self.variables for element in v.elements())

    def starts(self) -> dict[str, float]:
        """Start values that are numbers, by the names of `scalars`; Booleans as 0 and 1."""
        words = {"true": 1.0, "false": 0.0}
        found = {}
        for v in self.scalars:
            if v.start is not None and v.base not in ("String", "Enumeration"):
                try:
                    found[v.name] = words.get(v.start, 0.0) if v.start in words else float(v.start)
                except ValueError:
                    continue
        return found

    def number(self, key: str) -> float | None:
        """A number of the default experiment."""
        try:
            return float(self.experiment[key])
        except (KeyError, ValueError):
            return None


def read(path: str | Path) -> Fmu:
    """Read an FMU of FMI 2.0 or 3.0.

    Raises:
        FileError: the file cannot be read or is no FMU.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            if "modelDescription.xml" not in names:
                raise FileError(path, "is no FMU: it holds no modelDescription.xml")
            root = _xml(path, _member(path, archive, "modelDescription.xml"))
            own = [n for n in names if n.endswith(f"/{freight.NAME}") and n.count("/") == 2]
            cargo = _cargo(path, _member(path, archive, own[0])) if own else None
    except IsADirectoryError:
        raise FileError(path, "is a directory; name an FMU in it") from None
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise FileError(path, f"is no FMU: {' '.join(str(error).split())}") from None
    return _fmu(str(path), root, names, cargo)


def _member(path: str | Path, archive: zipfile.ZipFile, name: str) -> bytes:
    size = archive.getinfo(name).file_size
    if size > _LARGEST:
        raise FileError(path, f"{name} has {size} bytes, more than {_LARGEST}")
    return archive.read(name)


def _xml(path: str | Path, content: bytes) -> ElementTree.Element:
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise FileError(path, "modelDescription.xml declares entities, which FMI does not have")
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise FileError(path, f"modelDescription.xml is no XML: {error}") from None
    if root.tag != "fmiModelDescription" or "fmiVersion" not in root.attrib:
        raise FileError(path, "modelDescription.xml is no model description of FMI")
    if root.get("fmiVersion", "")[:2] not in ("2.", "3."):
        version = root.get("fmiVersion")
        raise FileError(path, f"is of FMI {version}; FMI 2.0 and 3.0 can be read")
    return root


def _cargo(path: str | Path, content: bytes) -> freight.Cargo:
    try:
        return freight.load(content.decode("utf-8"))
    except (ValueError, LookupError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise FileError(path, f"{freight.NAME} in it cannot be used: {reason}") from None


def _fmu(
    path: str, root: ElementTree.Element, names: list[str], cargo: freight.Cargo | None
) -> Fmu:
    experiment = root.find("DefaultExperiment")
    kinds = {
        "CoSimulation": "co-simulation",
        "ModelExchange": "model-exchange",
        "ScheduledExecution": "scheduled-execution",
    }
    binaries = {n.split("/")[1] for n in names if n.startswith("binaries/") and n.count("/") > 1}
    return Fmu(
        path=path,
        attributes=dict(root.attrib),
        kinds=tuple(kind for tag, kind in kinds.items() if root.find(tag) is not None),
        experiment={} if experiment is None else dict(experiment.attrib),
        variables=tuple(_variables(root)),
        platforms=tuple(sorted(binaries)),
        shim="binaries/linux64/libpythonfmu-export.so" in names,
        cargo=cargo,
    )


def _variables(root: ElementTree.Element) -> list[Described]:
    units = _units_of_types(root)
    found = []
    for element in root.iterfind("ModelVariables/*"):
        own = element
        if element.tag == "ScalarVariable":  # FMI 2.0 has the type inside
            own = next((child for child in element if child.tag in _BASES), element)
        unit = own.get("unit") or units.get(own.get("declaredType", ""))
        found.append(
            Described(
                name=element.get("name", ""),
                base=own.tag,
                causality=element.get("causality", "local"),
                variability=element.get("variability", "continuous"),
                unit=unit,
                start=own.get("start"),
                description=element.get("description", ""),
                size=_size(element),
            )
        )
    return found


def _size(element: ElementTree.Element) -> int | None:
    """How many numbers an array of FMI 3.0 holds, where its dimensions are numbers."""
    sizes = [dimension.get("start", "") for dimension in element.iterfind("Dimension")]
    return math.prod(map(int, sizes)) if sizes and all(s.isdigit() for s in sizes) else None


def _units_of_types(root: ElementTree.Element) -> dict[str, str]:
    """Units by declared type, in either version of FMI."""
    found = {}
    for kind in root.iterfind("TypeDefinitions/*"):
        holder = next(iter(kind), kind) if kind.tag == "SimpleType" else kind
        if holder.get("unit"):
            found[kind.get("name", "")] = str(holder.get("unit"))
    return found


def envelope(fmu: Fmu) -> dict[str, Any]:
    """The JSON answer of `kr16 fmu info`."""
    attributes, about = fmu.attributes, fmu.cargo.about if fmu.cargo else {}
    experiment = {
        key: fmu.number(name)
        for key, name in (("start", "startTime"), ("stop", "stopTime"), ("step", "stepSize"))
    }
    warnings = []
    if fmu.cargo and "linux64" in fmu.platforms and not fmu.shim:
        warnings.append(
            "no shim: on Linux a program that is not Python needs LD_PRELOAD=libpython3.11.so.1.0"
        )
    return {
        "schema": SCHEMA,
        "robot": about.get("robot"),
        "model_sha256": about.get("model_sha256"),
        "units": {"start": "s", "stop": "s", "step": "s"},
        "input": {"file": fmu.path},
        "result": {
            "fmi_version": attributes.get("fmiVersion"),
            "kinds": list(fmu.kinds),
            "name": attributes.get("modelName"),
            "description": attributes.get("description"),
            "guid": attributes.get("guid") or attributes.get("instantiationToken"),
            "tool": attributes.get("generationTool"),
            "date": attributes.get("generationDateAndTime"),
            "part": about.get("part"),
            "platforms": list(fmu.platforms),
            "shim": fmu.shim,
            "experiment": experiment,
            "variables": [vars(v) for v in fmu.variables],
        },
        "warnings": warnings,
    }
