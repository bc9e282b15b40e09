"""Build native FMUs: describe, compile, pack. Equal input gives equal bytes."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from kr16cli.fmi import packing
from kr16cli.fmi.description import guid
from kr16cli.fmi.native import (
    describe2,
    describe3,
    documents,
    numbers,
    references,
    sources,
    table,
    terminals,
)
from kr16cli.fmi.native.library import MODEL, libraries, of_robot
from kr16cli.fmi.native.xmltext import xml
from kr16cli.fmi.variables import Part, Start, Variable
from kr16cli.fmi.variables import table as common
from kr16cli.robot import RobotData

_STATES = {
    Part.ROBOT: "The states are q and qd.",
    Part.CONTROLLER: "This FMU is the controller alone: q and qd are inputs, tau is the output, "
    "and there are no states.",
}


class Options(NamedTuple):
    """What a native FMU is made of.

    `stop` and `step` (s) are the default experiment's; `version` is FMI's; `platforms` are
    names of `toolchain.TARGETS`. `arrays`, with version 3, makes rows of six arrays. `inputs` are
    start values of inputs by name, in place of those that follow from `start`.
    """

    start: Start
    part: Part = Part.ROBOT
    stop: float = 2.0
    step: float = 0.01
    scenario: str = ""
    version: int = 2
    platforms: Sequence[str] = ()
    arrays: bool = False
    inputs: Mapping[str, float] = MappingProxyType({})


def build(data: RobotData, options: Options) -> bytes:
    """The bytes of the .fmu file.

    Args:
        data: the robot, with inertial data.
        options: start values, default experiment, version, platforms.

    Raises:
        InputError: no inertial data, or a SOURCE_DATE_EPOCH that is no time.
        MissingPartError: a compiler is needed and none is there.
        CheckFailedError: the compiler failed.
    """
    packing.require_inertia(data)
    known = started(
        table.variables(data, options.start, options.part, version=options.version), options.inputs
    )
    listed = table.items(known, arrays=options.arrays)
    entries = numbers.entries(listed, options.part)
    about = packing.about(
        data, options.part, options.scenario, stop=options.stop, step=options.step, tool=""
    )
    about["date"] = date()
    units = sources.units()

    def described(identity: str) -> tuple[numbers.Table, bytes]:
        if options.version == 2:
            root = describe2.describe(MODEL, identity, about, known, units)
        else:
            root = describe3.describe(MODEL, identity, about, listed)
        content = numbers.table(data, entries, options.part, guid(identity), sources.digest())
        return content, xml(root)

    identity = _identity(*described("0" * 64))
    content, description = described(identity)
    files = sources.complete(content)
    packed = {"modelDescription.xml": description}
    packed |= {f"sources/{name}": text.encode() for name, text in files.items()}
    if options.version == 3:
        packed["sources/buildDescription.xml"] = xml(describe3.build_description(MODEL, units))
        packed["terminalsAndIcons/terminalsAndIcons.xml"] = xml(
            terminals.document(listed, options.part)
        )
    packed |= _shown(data, options, about, listed)
    packed |= libraries(of_robot(content), options.platforms, options.version)
    return packing.packed(packed, level=9)


def started(known: Sequence[Variable], inputs: Mapping[str, float]) -> tuple[Variable, ...]:
    """The table with other start values of inputs."""
    return tuple(v._replace(start=inputs.get(v.name, v.start)) for v in known)


def _shown(
    data: RobotData, options: Options, about: Mapping[str, object], listed: Sequence[table.Item]
) -> dict[str, bytes]:
    """The page, licences and icon, reference results and parameters."""
    variables = started(common(data, options.start, options.part), options.inputs)
    found = references.results(data, variables, options.part, options.stop, options.step)
    texts = {**about, "reference": found.told(), "states": _STATES[options.part]}
    headers = [name for name in sources.common() if name.startswith("fmi") and name[-1] == "h"]
    return references.files(found, listed) | documents.files(
        sources.NATIVE, texts, listed, headers, options.version
    )


def _identity(content: numbers.Table, description: bytes) -> str:
    """SHA-256 of all that makes the FMU but its own name."""
    return hashlib.sha256(numbers.as_bytes(content) + description).hexdigest()


def date() -> str | None:
    """SOURCE_DATE_EPOCH as FMI has dates; without it there is no date, lest bytes differ."""
    when = packing.source_time()
    return None if when is None else time.strftime("%Y-%m-%dT%H:%M:%SZ", when)
