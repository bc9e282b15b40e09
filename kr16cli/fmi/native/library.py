"""The compiled libraries of a native FMU, by their places in it."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

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


def libraries(table: numbers.Table, names: Sequence[str], version: int) -> dict[str, bytes]:
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
        made = _library(table, name)
        found[path] = _universal((found[path], made)) if path in found else made
    return found


def _library(table: numbers.Table, name: str) -> bytes:
    """One library. The numbers are put into a compiled one, which so is the same for every robot.

    But macOS runs no library that was changed after it was signed.
    """
    if toolchain.TARGETS[name].suffix == ".dylib":
        return toolchain.compiled(sources.complete(table), name, None)
    made = numbers.put_in(_generic(name), table)
    if made is None:
        raise CheckFailedError(f"the library for {name} has no place for a robot; update zig")
    return made


@lru_cache(maxsize=len(toolchain.TARGETS))
def _generic(name: str) -> bytes:
    """The library of a platform before a robot is put in."""
    own = name == toolchain.host()
    ready = prebuilt() if own else None
    files = sources.complete(generic())
    return ready or toolchain.compiled(files, name, find_compiler() if own else None)


def prebuilt() -> bytes | None:
    """This machine's library as the package brought it; None if there is none of this version."""
    host = toolchain.host()
    if host is None or toolchain.TARGETS[host].suffix == ".dylib":
        return None
    file = _HERE / f"{MODEL}{toolchain.TARGETS[host].suffix}"
    try:
        content = file.read_bytes() if file.is_file() else b""
    except OSError as error:
        raise FileError(file, f"cannot be read: {error.strerror}; reinstall kr16cli") from None
    return content if sources.digest().encode() in content else None


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
