"""What every FMU of ours is told about itself, and its archive: equal input gives equal bytes."""

from __future__ import annotations

import io
import os
import time
import zipfile
from collections.abc import Mapping

import kr16cli
from kr16cli.errors import InputError
from kr16cli.fmi.variables import Part
from kr16cli.robot import RobotData

ZipTime = tuple[int, int, int, int, int, int]

OLDEST: ZipTime = (1980, 1, 1, 0, 0, 0)
"""The first time that a zip entry can have."""

_SUBJECT = {Part.ROBOT: "Dynamics of", Part.CONTROLLER: "Controller for"}


def about(
    data: RobotData, part: Part, scenario: str, *, stop: float, step: float, tool: str
) -> dict[str, object]:
    """Texts and times of the model description; `tool` goes on after our name and version."""
    ending = f", set up as the scenario {scenario}" if scenario else ""
    return {
        "description": f"{_SUBJECT[part]} the {data.name}{ending}. "
        "Not affiliated with KUKA; not for safety functions.",
        "part": str(part),
        "robot": data.name,
        "model_sha256": data.sha256,
        "author": "kr16cli developers",
        "version": kr16cli.__version__,
        "copyright": "kr16cli developers",
        "license": "MIT",
        "tool": f"kr16cli {kr16cli.__version__}{tool}",
        "stop": stop,
        "step": step,
    }


def require_inertia(data: RobotData) -> None:
    """InputError for a robot that cannot be an FMU."""
    if not data.links:
        raise InputError(f"{data.name} ({data.path}) has no inertial data; an FMU needs six links")


def source_time() -> time.struct_time | None:
    """The time of SOURCE_DATE_EPOCH, UTC, or None where it is not set.

    Raises:
        InputError: it is no time.
    """
    text = os.environ.get("SOURCE_DATE_EPOCH")
    if not text:
        return None
    try:
        return time.gmtime(int(text))
    except (ValueError, OverflowError, OSError):
        rule = "it must be seconds since 1970, a whole number"
        raise InputError(f"SOURCE_DATE_EPOCH is {text!r}; {rule}") from None


def packed(entries: Mapping[str, bytes], when: ZipTime = OLDEST, level: int | None = None) -> bytes:
    """The archive of named contents, in order, deflated, all of one time."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in sorted(entries.items()):
            info = zipfile.ZipInfo(name, when)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3
            info.external_attr = (0o100755 if name.startswith("binaries/") else 0o100644) << 16
            archive.writestr(info, content, compresslevel=level)
    return out.getvalue()
