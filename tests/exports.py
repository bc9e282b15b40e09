"""Names that a shared library gives away: of ELF, PE and Mach-O files, read from their tables."""

from __future__ import annotations

import struct
from collections.abc import Iterator


def names(library: bytes) -> set[str]:
    """The names; of a universal Mach-O file, those that all its parts give."""
    if library[:4] == b"\x7fELF":
        return set(_elf(library))
    if library[:2] == b"MZ":
        return set(_pe(library))
    if library[:4] == b"\xca\xfe\xba\xbe":
        count = struct.unpack_from(">I", library, 4)[0]
        places = [struct.unpack_from(">2I", library, 8 + 20 * k + 8) for k in range(count)]
        return set.intersection(*(set(_macho(library[at : at + size])) for at, size in places))
    return set(_macho(library))


def processors(library: bytes) -> list[int]:
    """The processor types of a universal Mach-O file, or of a single one."""
    if library[:4] != b"\xca\xfe\xba\xbe":
        return [struct.unpack_from("<I", library, 4)[0]]
    count = struct.unpack_from(">I", library, 4)[0]
    return [struct.unpack_from(">I", library, 8 + 20 * k)[0] for k in range(count)]


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(b"\0", at)].decode()


def _elf(data: bytes) -> Iterator[str]:
    table, size, count = (*struct.unpack_from("<Q", data, 40), *struct.unpack_from("<2H", data, 58))
    sections = [struct.unpack_from("<2I4Q2I2Q", data, table + size * k) for k in range(count)]
    symbols = next(s for s in sections if s[1] == 11)  # SHT_DYNSYM
    texts = sections[symbols[6]][4]
    for at in range(symbols[4], symbols[4] + symbols[5], 24):
        name, info, _, section = struct.unpack_from("<IBBH", data, at)
        if section and info >> 4:  # defined here, and not local
            yield _text(data, texts + name)


def _pe(data: bytes) -> Iterator[str]:
    head = struct.unpack_from("<I", data, 60)[0]
    count, optional = struct.unpack_from("<H12xH", data, head + 6)
    wide = struct.unpack_from("<H", data, head + 24)[0] == 0x20B
    directory = struct.unpack_from("<I", data, head + 24 + (112 if wide else 96))[0]
    first = head + 24 + optional
    sections = [struct.unpack_from("<8x4I", data, first + 40 * k) for k in range(count)]

    def place(address: int) -> int:
        _, start, _, at = next(s for s in sections if s[1] <= address < s[1] + max(s[0], s[2]))
        return int(at + address - start)

    number, _, texts = struct.unpack_from("<3I", data, place(directory) + 24)
    for k in range(number):
        yield _text(data, place(struct.unpack_from("<I", data, place(texts) + 4 * k)[0]))


def _macho(data: bytes) -> Iterator[str]:
    at = 32
    for _ in range(struct.unpack_from("<I", data, 16)[0]):
        command, size = struct.unpack_from("<2I", data, at)
        if command == 2:  # LC_SYMTAB
            symbols, count, texts = struct.unpack_from("<3I", data, at + 8)
            for k in range(count):
                name, kind = struct.unpack_from("<IB", data, symbols + 16 * k)
                if kind & 0x0F == 0x0F:  # external and defined in a section
                    yield _text(data, texts + name).removeprefix("_")
        at += size
