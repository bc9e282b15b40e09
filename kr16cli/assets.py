"""Find the shipped assets: `kr16cli/assets/` in an installed wheel, else the checkout."""

from __future__ import annotations

from pathlib import Path

from kr16cli.errors import FileError

_PACKAGE = Path(__file__).resolve().parent


def asset(relative: str) -> Path:
    """Path of an asset such as `data/kr16_2.toml`; FileError if this install lacks it."""
    for root in (_PACKAGE / "assets", _PACKAGE.parent):
        path = root / relative
        if path.exists():
            return path
    raise FileError(relative, "this installation lacks the file; reinstall kr16cli")
