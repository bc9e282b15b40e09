"""Build native FMUs: describe, compile, pack. Equal input gives equal bytes."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from typing import NamedTuple
from xml.etree import ElementTree

from kr16cli.fmi import packing
from kr16cli.fmi.description import guid
from kr16cli.fmi.native import describe2, describe3, numbers, sources, table
from kr16cli.fmi.native.library import MODEL, libraries
from kr16cli.fmi.variables import Part, Start
from kr16cli.robot import RobotData


class Options(NamedTuple):
    """What a native FMU is made of.

    `stop` and `step` (s) are the default experiment's; `version` is FMI's; `platforms` are
    names of `toolchain.TARGETS`. `arrays`, with version 3, makes rows of six arrays.
    """

    start: Start
    part: Part = Part.ROBOT
    stop: float = 2.0
    step: float = 0.01
    scenario: str = ""
    version: int = 2
    platforms: Sequence[str] = ()
    arrays: bool = False


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
    known = table.variables(data, options.start, options.part, version=options.version)
    listed = table.items(known, arrays=options.arrays)
    entries = numbers.entries(listed, options.part)
    about = packing.about(
        data, options.part, options.scenario, stop=options.stop, step=options.step, tool=""
    )
    about["date"] = _date()
    units = sources.units()

    def documents(identity: str) -> tuple[numbers.Table, bytes]:
        if options.version == 2:
            root = describe2.describe(MODEL, identity, about, known, units)
        else:
            root = describe3.describe(MODEL, identity, about, listed)
        content = numbers.table(data, entries, options.part, guid(identity), sources.digest())
        return content, _xml(root)

    identity = _identity(*documents("0" * 64))
    content, description = documents(identity)
    files = sources.complete(content)
    packed = {"modelDescription.xml": description}
    packed |= {f"sources/{name}": text.encode() for name, text in files.items()}
    if options.version == 3:
        packed["sources/buildDescription.xml"] = _xml(describe3.build_description(MODEL, units))
    packed |= libraries(content, options.platforms, options.version)
    return packing.packed(packed, level=9)


def _identity(content: numbers.Table, description: bytes) -> str:
    """SHA-256 of all that makes the FMU but its own name."""
    return hashlib.sha256(numbers.as_bytes(content) + description).hexdigest()


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    head = b'<?xml version="1.0" encoding="UTF-8"?>\n'
    return head + ElementTree.tostring(root, encoding="unicode").encode() + b"\n"


def _date() -> str | None:
    """SOURCE_DATE_EPOCH as FMI has dates; without it there is no date, lest bytes differ."""
    when = packing.source_time()
    return None if when is None else time.strftime("%Y-%m-%dT%H:%M:%SZ", when)
