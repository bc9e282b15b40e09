"""Text to numbers: every complaint says what, the value, and what it should be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from kr16cli.errors import InputError

if TYPE_CHECKING:
    from kr16cli.robot import Payload

JOINT_NAMES = ("A1", "A2", "A3", "A4", "A5", "A6")
POSE_NAMES = ("X", "Y", "Z", "A", "B", "C")


def number(text: str, name: str) -> float:
    """One finite number."""
    try:
        value = float(text if "_" not in text else "")  # 1_000 is Python's, not a user's
    except ValueError:
        shown = f"'{text}'" if text.strip() else "empty"
        raise InputError(f"{name} is {shown}; it must be a number") from None
    if not math.isfinite(value):
        raise InputError(f"{name} is {text.strip()}; every number must be finite")
    return value + 0.0  # a typed -0 is 0


def numbers(
    words: Sequence[str], names: Sequence[str], what: str, *, of_option: bool = False
) -> list[float]:
    """As many finite numbers as there are names; words may hold several, `1,2,3`.

    A complaint about one of an option's numbers names the option too.
    """
    parts = [part for word in words for part in word.replace(",", " ").replace(";", " ").split()]
    if len(parts) != len(names):
        raise InputError(f"{what} takes {len(names)} numbers ({' '.join(names)}), got {len(parts)}")
    before = f"{what} " if of_option else ""
    return [number(part, before + name) for part, name in zip(parts, names, strict=True)]


def option(text: str | None, names: Sequence[str], what: str) -> list[float] | None:
    """The numbers of an option, or None where it was not given."""
    return None if text is None else numbers([text], names, what, of_option=True)


def six(text: str | None, what: str) -> list[float] | None:
    """Six numbers of an option, one for each joint, or None."""
    return option(text, JOINT_NAMES, what)


def joints(text: str | None, what: str, *, si: bool) -> list[float] | None:
    """Six joint angles of an option: numbers (degrees, or rad with `si`) or KRL `{A1 ..}`."""
    if text is not None and "{" in text:
        return _krl(text, JOINT_NAMES, (0, 1, 2, 3, 4, 5), si=si)
    return option(text, JOINT_NAMES, what)


def pose(text: str | None, what: str, *, si: bool) -> list[float] | None:
    """Six pose numbers of an option (mm and degrees, or m and rad with `si`) or KRL text."""
    if text is not None and "{" in text:
        return _krl(text, POSE_NAMES, (3, 4, 5), si=si)
    return option(text, POSE_NAMES, what)


def _krl(text: str, names: Sequence[str], angles: Sequence[int], *, si: bool) -> list[float]:
    from kr16cli import units
    from kr16cli.krl import parse_krl

    values = parse_krl(text).numbers(names)
    if not si:
        return values
    return [units.rad(v) if i in angles else units.metres(v) for i, v in enumerate(values)]


def payload(text: str | None, load_data: str | None, *, si: bool) -> Payload | None:
    """The payload of `--payload` (numbers or LOAD_DATA) or `--load-data`."""
    if text is not None and load_data is not None:
        raise InputError("--payload and --load-data exclude each other; give one")
    text = load_data if text is None else text
    if text is None:
        return None
    from kr16cli import kuka

    if load_data is not None or "{" in text:
        return kuka.parse_load_data(text)
    names = ("M", "X", "Y", "Z", "IX", "IY", "IZ")
    words = text.replace(",", " ").split()
    if len(words) not in (4, 7):
        raise InputError(f"--payload takes 4 or 7 numbers ({' '.join(names)}), got {len(words)}")
    values = numbers(words, names[: len(words)], "--payload", of_option=True)
    return kuka.payload_from_numbers(values, si=si)


def whole(text: str | None, what: str, lowest: int, highest: int) -> int | None:
    """A whole number of an option within bounds; decimal, or KUKA's 'B010' and 'H2'."""
    if text is None:
        return None
    bare = text.strip().strip("'").upper()
    base = {"B": 2, "H": 16}.get(bare[:1], 10)
    try:
        value = int(bare if base == 10 else bare[1:], base)
    except ValueError:
        value = lowest - 1
    if not lowest <= value <= highest:
        raise InputError(f"{what} is {text}; it must be a whole number from {lowest} to {highest}")
    return value


def point(text: str | None) -> str | list[float] | None:
    """A point: a name, or three numbers."""
    if text is None or (text.strip().isalpha() and text.lower() not in ("nan", "inf")):
        return text
    return option(text, POSE_NAMES[:3], "--point")
