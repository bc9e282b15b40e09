"""Build native FMUs: describe, compile, pack. Equal input gives equal bytes."""

from __future__ import annotations

import hashlib
import io
import os
import time
import zipfile
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree import ElementTree

import kr16cli
from kr16cli.errors import InputError
from kr16cli.fmi.description import guid
from kr16cli.fmi.native import describe2, describe3, numbers, sources, table
from kr16cli.fmi.native.library import MODEL, libraries
from kr16cli.fmi.variables import Part, Start
from kr16cli.robot import RobotData

_SUBJECT = {Part.ROBOT: "Dynamics of", Part.CONTROLLER: "Controller for"}
_OLDEST = (1980, 1, 1, 0, 0, 0)


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
    if not data.links:
        raise InputError(f"{data.name} ({data.path}) has no inertial data; an FMU needs six links")
    known = table.variables(data, options.start, options.part, version=options.version)
    listed = table.items(known, arrays=options.arrays)
    entries = numbers.entries(listed, options.part)
    about = _about(data, options)
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
    return _zipped(packed)


def _about(data: RobotData, options: Options) -> dict[str, object]:
    """Texts and times of the model description."""
    scenario = f", set up as the scenario {options.scenario}" if options.scenario else ""
    return {
        "description": f"{_SUBJECT[options.part]} the {data.name}{scenario}. "
        "Not affiliated with KUKA; not for safety functions.",
        "part": str(options.part),
        "robot": data.name,
        "model_sha256": data.sha256,
        "author": "kr16cli developers",
        "version": kr16cli.__version__,
        "copyright": "kr16cli developers",
        "license": "MIT",
        "tool": f"kr16cli {kr16cli.__version__}",
        "stop": options.stop,
        "step": options.step,
        "date": _date(),
    }


def _identity(content: numbers.Table, description: bytes) -> str:
    """SHA-256 of all that makes the FMU but its own name."""
    return hashlib.sha256(numbers.as_bytes(content) + description).hexdigest()


def _xml(root: ElementTree.Element) -> bytes:
    ElementTree.indent(root)
    head = b'<?xml version="1.0" encoding="UTF-8"?>\n'
    return head + ElementTree.tostring(root, encoding="unicode").encode() + b"\n"


def _zipped(entries: Mapping[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in sorted(entries.items()):
            info = zipfile.ZipInfo(name, _OLDEST)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3
            info.external_attr = (0o100755 if name.startswith("binaries/") else 0o100644) << 16
            archive.writestr(info, content, compresslevel=9)
    return out.getvalue()


def _date() -> str | None:
    """SOURCE_DATE_EPOCH as FMI has dates; without it there is no date, lest bytes differ."""
    text = os.environ.get("SOURCE_DATE_EPOCH")
    if not text:
        return None
    try:
        return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(int(text)))
    except (ValueError, OverflowError, OSError):
        rule = "it must be seconds since 1970, a whole number"
        raise InputError(f"SOURCE_DATE_EPOCH is {text!r}; {rule}") from None
