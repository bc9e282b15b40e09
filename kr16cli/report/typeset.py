"""Text on a page: its width, its lines, and the plain formulas of the audit set as formulas.

Widths are sums of the letters' advances, which is quick and, without kerning, right to about
one per cent.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, NamedTuple

from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ft2font import LoadFlags

SANS, MONO = "DejaVu Sans", "DejaVu Sans Mono"
_UNIT = 100.0  # letters are measured at this size and scaled


class Face(NamedTuple):
    """A cut of a font."""

    family: str = SANS
    weight: str = "normal"
    slant: Literal["normal", "italic"] = "normal"


PLAIN, BOLD, ITALIC = Face(), Face(weight="bold"), Face(slant="italic")


@lru_cache(maxsize=256)
def properties(face: Face, size: float) -> FontProperties:
    """The face at a size, as matplotlib wants it."""
    return FontProperties(family=face.family, weight=face.weight, style=face.slant, size=size)


@lru_cache(maxsize=4000)
def _advance(letter: str, face: Face) -> float:
    font = get_font(findfont(properties(face, _UNIT)))
    font.set_size(_UNIT, 72)
    glyph = font.load_char(ord(letter), flags=LoadFlags.NO_HINTING)
    return float(glyph.linearHoriAdvance) / 65536.0


@lru_cache(maxsize=20000)
def _unit_width(text: str, face: Face) -> float:
    return sum(_advance(letter, face) for letter in text)


def width(text: str, size: float, face: Face = PLAIN) -> float:
    """Width of a line in points."""
    return _unit_width(text, face) * size / _UNIT


@lru_cache(maxsize=1)
def _letters() -> frozenset[int]:
    return frozenset(get_font(findfont(properties(PLAIN, _UNIT))).get_charmap())


def printable(text: str) -> str:
    """The text with a question mark for every letter the font lacks."""
    known = _letters()
    return "".join(c if ord(c) in known or c == "\n" else "?" for c in text)


def wrap(text: str, limit: float, size: float, face: Face = PLAIN) -> list[str]:
    """Lines of at most `limit` points. A word that is too long is broken, last of all."""
    space = width(" ", size, face)
    lines: list[str] = []
    for paragraph in printable(text).split("\n"):
        line, used = "", 0.0
        for word in paragraph.split():
            for piece in _pieces(word, limit, size, face):
                wide = width(piece, size, face)
                if line and used + space + wide > limit:
                    lines.append(line)
                    line, used = piece, wide
                else:
                    line, used = (f"{line} {piece}", used + space + wide) if line else (piece, wide)
        lines.append(line)
    return lines


def _pieces(word: str, limit: float, size: float, face: Face) -> list[str]:
    """The word, or parts of it that fit, broken after marks where there are any."""
    if width(word, size, face) <= limit:
        return [word]
    pieces, piece = [], ""
    for part in re.split(r"(?<=[._/,;*+-])", word):
        if piece and width(piece + part, size, face) > limit:
            pieces.append(piece)
            piece = ""
        for letter in part:
            if piece and width(piece + letter, size, face) > limit:
                pieces.append(piece)
                piece = ""
            piece += letter
    return [*pieces, piece]


# Formulas ------------------------------------------------------------------------------------


class Run(NamedTuple):
    """Letters in one look: how far right and up they begin (in sizes), and their scale."""

    text: str
    face: Face
    right: float
    up: float
    scale: float


class Formula(NamedTuple):
    """A set word or line: its runs, and its width in sizes."""

    runs: tuple[Run, ...]
    width: float


_GREEK = {
    "alpha": "\u03b1", "beta": "\u03b2", "delta": "\u03b4", "epsilon": "\u03b5",
    "theta": "\u03b8", "pi": "\u03c0", "rho": "\u03c1", "tau": "\u03c4", "phi": "\u03c6",
    "psi": "\u03c8", "omega": "\u03c9", "Delta": "\u0394", "Omega": "\u03a9",
}  # fmt: skip
_NAMED = frozenset(
    ("sin", "cos", "tan", "asin", "acos", "atan", "Atan", "Atan2", "sqrt", "det", "rank", "skew",
     "Rot", "Trans", "Col", "mod")
)  # fmt: skip
_THIN_SPACE, _MINUS, _PRIME, _TIMES, _DOT_ABOVE = "\u2009", "\u2212", "\u2032", "\u00d7", "\u0307"
_SIGNS = {"*": _THIN_SPACE, "-": _MINUS, "||": "‖", "<=": "≤", ">=": "≥", "!=": "≠", "'": _PRIME}
_TOKEN = re.compile(
    r"(?P<dot>dq)(?P<joint>[0-9])"
    r"|(?P<name>[A-Za-z]+)(?P<digits>[0-9][A-Za-z0-9]*)?"
    r"|(?P<script>[_^])(?P<body>\([^()]*\)|\{[^{}]*\}|-?[A-Za-z0-9]+(,[A-Za-z0-9]+(_[a-z]+)?)*)"
    r"|(?P<sign>\|\||<=|>=|!=|[*'-])|(?P<rest>.)"
)
_PROSE = re.compile(r"[(\"']?[A-Za-z][a-z]+(-[a-z]{3,})*('s)?[)\"',.;:]*|a|[A-Z]{2,}")
_LOW, _HIGH, _SMALL = -0.18, 0.36, 0.7


def formula(text: str, limit: float, size: float) -> list[Formula]:
    """Lines of a plain formula (`c23*c6`, `T_2[3]`, `o_c`) with indices set; prose as it is."""
    words = text.split()
    done = [_word(w, sign=_crosses(words, i)) for i, w in enumerate(words)]
    lines: list[list[Formula]] = [[]]
    used, space = 0.0, _unit_width(" ", PLAIN) / _UNIT
    for word in done:
        if lines[-1] and (used + space + word.width) * size > limit:
            lines.append([])
            used = 0.0
        used += word.width + (space if lines[-1] else 0.0)
        lines[-1].append(word)
    return [_line(words, space) for words in lines]


def _crosses(words: Sequence[str], i: int) -> bool:
    """Whether a word is the sign of a product: an x between factors, not the name of a number."""
    if words[i] != "x" or not 0 < i < len(words) - 1:
        return False
    return not _is_prose(words[i - 1]) and words[i + 1][0] not in "<>=!"


def _is_prose(word: str) -> bool:
    bare = word.strip("(),.;:'\"")
    return bool(_PROSE.fullmatch(word)) and bare not in _GREEK and bare not in _NAMED


def _line(words: Sequence[Formula], space: float) -> Formula:
    runs: list[Run] = []
    at = 0.0
    for word in words:
        if runs:
            at += space
        runs += [run._replace(right=run.right + at) for run in word.runs]
        at += word.width
    return Formula(tuple(runs), at)


@lru_cache(maxsize=4000)
def _word(word: str, *, sign: bool) -> Formula:
    if sign:
        return _set([(_TIMES, PLAIN, "")])
    if _is_prose(word):
        return _set([(printable(word), PLAIN, "")])
    return _set([part for m in _TOKEN.finditer(word) for part in _parts(m)])


def _parts(m: re.Match[str], place: str = "") -> list[tuple[str, Face, str]]:
    """Letters of a token with their face, and "_" or "^" where they are an index."""
    if m["dot"]:
        return [("q" + _DOT_ABOVE, ITALIC, place), (m["joint"], PLAIN, place or "_")]
    if m["name"] and m["name"] + (m["digits"] or "") in _NAMED:
        return [(m[0], PLAIN, place)]
    if m["name"]:
        digits = [(m["digits"], PLAIN, place or "_")] if m["digits"] else []
        return [*_name(m["name"], place), *digits]
    if m["script"]:
        inner = _TOKEN.finditer(m["body"].strip("(){}"))
        return [part for t in inner for part in _parts(t, m["script"])]
    text = m["sign"] or m["rest"]
    return [(_SIGNS.get(text, printable(text)), PLAIN, place)]


def _name(name: str, place: str) -> list[tuple[str, Face, str]]:
    """A named function, Greek letter, or letters: single ones slanted."""
    if name in _NAMED or (len(name) > 3 and name not in _GREEK and name[:-1] not in _GREEK):
        return [(name, PLAIN, place)]
    for word, letter in _GREEK.items():
        if name.startswith(word) and len(name) <= len(word) + 1:
            return [(letter + name[len(word) :], ITALIC, place)]
    return [(name, ITALIC, place)]


def _set(parts: Sequence[tuple[str, Face, str]]) -> Formula:
    """Place parts one after the other; an index above starts where the one below did."""
    runs: list[Run] = []
    at, low_from, place_before = 0.0, 0.0, ""
    end = 0.0
    for text, face, place in parts:
        if place and not place_before:
            low_from = at
        if place == "^" and place_before == "_":
            at = low_from
        if not place:
            at = end
        scale = _SMALL if place else 1.0
        up = {"": 0.0, "_": _LOW, "^": _HIGH}[place]
        runs.append(Run(text, face, at, up, scale))
        at += _unit_width(text, face) / _UNIT * scale
        end = max(end, at)
        place_before = place
    return Formula(tuple(runs), end)
