"""What people read in a native FMU: the page about it, licences, the icon."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from textwrap import dedent

from kr16cli.assets import asset
from kr16cli.fmi import pages
from kr16cli.fmi.native.sources import NATIVE, text_of
from kr16cli.fmi.native.table import Item
from kr16cli.fmi.variables import Variable

ICON2, ICON3 = "model.png", "terminalsAndIcons/icon.png"
"""Where FMI 2.0 and 3.0 look for the icon."""


def files(
    folder: str,
    texts: Mapping[str, object],
    listed: Iterable[Item],
    headers: Iterable[str],
    version: int,
) -> dict[str, bytes]:
    """Contents by path in the FMU.

    Args:
        folder: the asset folder with the page's template, below `pages`.
        texts: what goes into the template.
        listed: the variables.
        headers: names of FMI's headers among the sources.
        version: of FMI, 2 or 3.
    """
    root = asset(f"{folder}/pages")
    own = asset(f"{NATIVE}/pages")
    style = text_of(own / "style.css")
    page = pages.filled(text_of(root / "index.html"), {"style": style, **texts}, map(row, listed))
    return {
        "documentation/index.html": page,
        "documentation/licenses/license.txt": text_of(
            asset("fmu/documentation/licenses/license.txt")
        ).encode(),
        "documentation/licenses/fmi-headers.txt": notices(tuple(headers)).encode(),
        (ICON2 if version == 2 else ICON3): (own / "icon.png").read_bytes(),
    }


def row(item: Item) -> pages.Row:
    """The row of a variable; of an array with its size and all start values."""
    first = pages.row(item.first)
    if len(item.members) == 1:
        return first
    starts = " ".join(map(pages.start, item.members)).strip()
    return first._replace(
        name=f"{item.name} ({len(item.members)})", start=starts, description=text(item)
    )


def text(item: Item) -> str:
    """The description; of an array, that of its first with all joints in place of one."""
    found = item.first.description
    if len(item.members) == 1:
        return found
    last = item.members[-1].description
    pairs = list(zip(found.split(" "), last.split(" "), strict=False))
    return " ".join(a if a == b else f"{a}..{b}" for a, b in pairs)


@lru_cache(maxsize=4)
def notices(headers: tuple[str, ...]) -> str:
    """Copyright and conditions of FMI's headers, as they stand in them."""
    return "\n".join(map(_notice, (asset(f"{NATIVE}/include") / name for name in headers)))


def _notice(header: Path) -> str:
    content = text_of(header)
    begin = content.rindex("\n", 0, content.index("Copyright"))
    return f"{header.name}\n\n{dedent(content[begin : content.index('*/', begin)]).strip()}\n"


def items(known: Iterable[Variable]) -> tuple[Item, ...]:
    """Variables as items of one."""
    return tuple(Item(v.name, (v,)) for v in known)
