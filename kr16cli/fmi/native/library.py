"""The compiled libraries of a native FMU, by their places in it."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from kr16cli.errors import CheckFailedError, FileError, InputError
from kr16cli.fmi.compiling import find_compiler
from kr16cli.fmi.native import numbers, sources, toolchain
from kr16cli.fmi.native.generate import generic

MODEL = "KR16"
ALL, HOST = "all", "host"
_HERE = Path(__file__).resolve().parent


def platforms(text: str, version: int) -> tuple[str, ...]:
    """The platforms that `--platforms` names: all, host, or names with commas between.

    Args:
        text: what was typed.
        version: of FMI; 2 has no place for Linux on ARM.

    Raises:
        InputError: a name that is not known, or a platform that has no place.
    """
    known = [n for n, t in toolchain.TARGETS.items() if version == 3 or t.folder2]
    if text == ALL:
        return tuple(known)
    chosen = []
    for word in text.split(","):
        name = toolchain.host() if word.strip() == HOST else word.strip()
        if name is None:
            raise InputError("this machine is none of the platforms; name them with --platforms")
        if name not in known:
            raise InputError(
                f"platform {name} is not known to FMI {version}; choose from all, host, "
                + ", ".join(known)
            )
        chosen.append(name)
    return tuple(dict.fromkeys(chosen))


class Made(NamedTuple):
    """What a library is made of.

    `complete` is its C; `generic` gives the same before a robot or a motion is in, which is `own`
    as bytes. `file` is the name of the library that the package may bring, `digest` of its C.
    """

    file: str
    digest: str
    own: bytes
    complete: Mapping[str, str]
    generic: Callable[[], Mapping[str, str]]


def of_robot(table: numbers.Table) -> Made:
    """The library of a robot or its controller."""
    return Made(
        MODEL, sources.digest(), numbers.as_bytes(table), sources.complete(table),
        lambda: sources.complete(generic()),
    )  # fmt: skip


def libraries(made: Made, names: Sequence[str], version: int) -> dict[str, bytes]:
    """The library of each platform by its path in an FMU.

    The one of this machine comes ready from the package where it was built with it.

    Raises:
        MissingPartError: a compiler is needed and none is there.
        CheckFailedError: it did not compile.
    """
    found: dict[str, bytes] = {}
    for name in names:
        target = toolchain.TARGETS[name]
        folder = target.folder2 if version == 2 else target.folder3
        path = f"binaries/{folder}/{MODEL}{target.suffix}"
        content = _library(made, name)
        found[path] = _universal((found[path], content)) if path in found else content
    return found


def _library(made: Made, name: str) -> bytes:
    """One library. The numbers are put into a compiled one, which so is the same for every robot.

    But macOS runs no library that was changed after it was signed.
    """
    if toolchain.TARGETS[name].suffix == ".dylib":
        return toolchain.compiled(made.complete, name, None)
    key = (made.file, name)
    if key not in _GENERIC:
        _GENERIC[key] = _generic(made, name)
    content = numbers.put_in(_GENERIC[key], made.own)
    if content is None:
        raise CheckFailedError(f"the library for {name} has no place for its numbers; update zig")
    return content


_GENERIC: dict[tuple[str, str], bytes] = {}
"""Libraries that were compiled, by what they are and the platform."""


def _generic(made: Made, name: str) -> bytes:
    """The library of a platform before a robot is put in."""
    own = name == toolchain.host()
    ready = prebuilt(made.file, made.digest) if own else None
    return ready or toolchain.compiled(made.generic(), name, find_compiler() if own else None)


def prebuilt(file: str = MODEL, digest: str | None = None) -> bytes | None:
    """This machine's library as the package brought it; None if there is none of this version.

    Args:
        file: its name, without suffix.
        digest: of the C it must be of; None for that of a robot.
    """
    host = toolchain.host()
    if host is None or toolchain.TARGETS[host].suffix == ".dylib":
        return None
    path = _HERE / f"{file}{toolchain.TARGETS[host].suffix}"
    try:
        content = path.read_bytes() if path.is_file() else b""
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror}; reinstall kr16cli") from None
    return content if (digest or sources.digest()).encode() in content else None


def _universal(parts: Sequence[bytes]) -> bytes:
    """One file of libraries for several processors of macOS ("fat"): a table, then the parts."""
    align = 14
    place = 1 << align
    head = struct.pack(">2I", 0xCAFEBABE, len(parts))
    body = b""
    for part in parts:
        kind, sub = struct.unpack_from("<2I", part, 4)
        head += struct.pack(">5I", kind, sub, place, len(part), align)
        body = body.ljust(place - (1 << align), b"\0") + part
        place += -(-len(part) // (1 << align)) * (1 << align)
    return head.ljust(1 << align, b"\0") + body
