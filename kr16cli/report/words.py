"""All words of a page as one artist, written straight into the page of a PDF.

matplotlib shapes every string anew, letter by letter, which is most of a report's time. Here the
letters of a page are looked up once for each face and strings are written with the font's own
advances, the ones lines are wrapped by. Other renderers, and versions of matplotlib whose PDF
files keep their fonts otherwise, get the strings by `draw_text`: slower, the same to the eye.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from functools import lru_cache
from itertools import groupby
from typing import Any, NamedTuple, cast

from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_pdf import PdfFile
from matplotlib.colors import to_rgb
from matplotlib.font_manager import findfont, get_font

from kr16cli.report.typeset import Face, properties, width


class Piece(NamedTuple):
    """A line where it stands: left end and baseline in points from the top left; its look."""

    x: float
    base: float
    text: str
    face: Face
    size: float
    color: str

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right, bottom of the letters, points."""
        right = self.x + width(self.text, self.size, self.face)
        return self.x, self.base - 0.76 * self.size, right, self.base + 0.24 * self.size


class Words(Artist):
    """The words of a page of a given height, points."""

    def __init__(self, height: float) -> None:
        super().__init__()
        self.pieces: list[Piece] = []
        self._height = height
        self.set_zorder(3)

    def draw(self, renderer: RendererBase) -> None:
        """Hand the words to the renderer, in their order."""
        gc = renderer.new_gc()
        scale = float(cast("float", renderer.points_to_pixels(1.0)))
        letters = _Letters.of(renderer)
        for plain, run in groupby(self.pieces, key=lambda p: letters is not None and p in letters):
            if plain and letters is not None:
                cast("Any", renderer).check_gc(gc, (0.0, 0.0, 0.0))
                letters.write(run, self._height)
                continue
            for piece in run:
                gc.set_foreground(piece.color)
                y = piece.base if renderer.flipy() else self._height - piece.base
                look = properties(piece.face, piece.size)
                renderer.draw_text(gc, piece.x * scale, y * scale, piece.text, look, 0.0)
        gc.restore()


class _Letters:
    """Codes of letters in the fonts of a PDF file, and text by them."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self._codes: dict[tuple[Face, str], tuple[bytes, str] | None] = {}

    @classmethod
    def of(cls, renderer: RendererBase) -> _Letters | None:
        """Those of a renderer's file; None where its fonts are kept in another way."""
        file: Any = getattr(renderer, "file", None)
        known = isinstance(file, PdfFile) and hasattr(file, "_character_tracker")
        known = known and hasattr(file._character_tracker, "track_glyph")
        return cls(file) if known and rcParams["pdf.fonttype"] == 42 else None

    def __contains__(self, piece: Piece) -> bool:
        """Whether the letters can stand one after the other, all from one font of the file."""
        for letter in piece.text:
            if (piece.face, letter) not in self._codes:
                self._codes[piece.face, letter] = self._code(piece.face, letter)
        found = [self._codes[piece.face, letter] for letter in piece.text]
        return None not in found and len({code[0] for code in found if code}) == 1

    def _code(self, face: Face, letter: str) -> tuple[bytes, str] | None:
        """The font's name and the letter's code; None if it is missing or stands on another."""
        path, font = _font(face)
        glyph = font.get_char_index(ord(letter))
        if glyph == 0 or unicodedata.combining(letter):
            return None
        subset, code = self._file._character_tracker.track_glyph(font, letter, glyph)
        return self._file.fontName(path, subset).pdfRepr(), f"{code:04x}"

    def write(self, run: Iterable[Piece], height: float) -> None:
        """Text operators for pieces that are all in here."""
        lines = [b"q", b"BT"]
        font, color = (b"", 0.0), ""
        for piece in run:
            codes = [code for x in piece.text if (code := self._codes[piece.face, x])]
            if color != piece.color:
                color = piece.color
                lines.append(b"%.3f %.3f %.3f rg" % to_rgb(color))
            if font != (codes[0][0], piece.size):
                font = codes[0][0], piece.size
                lines.append(b"%s %.2f Tf" % font)
            lines.append(b"1 0 0 1 %.2f %.2f Tm" % (piece.x, height - piece.base))
            lines.append(b"<%s> Tj" % "".join(code for _, code in codes).encode())
        self._file.write(b"\n".join([*lines, b"ET", b"Q", b""]))


@lru_cache(maxsize=16)
def _font(face: Face) -> tuple[Any, Any]:
    """The path of a face's file, and its font."""
    path: Any = findfont(properties(face, 10.0))
    return path, get_font(path)
