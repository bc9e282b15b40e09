"""Write the C of the native FMUs' libraries: `python -m kr16cli.fmi.native.generate FOLDER`.

For the build of the package. The robot inside is replaced when an FMU is built, and so is the
motion of the trajectory source, whose C goes into FOLDER/track.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from kr16cli.fmi.native import numbers, sources, table
from kr16cli.fmi.variables import Part, Start
from kr16cli.robot_file import load_data


def generic() -> numbers.Table:
    """The table that a library is compiled with: that of the KR 16-2, without a token."""
    data = load_data()
    known = table.variables(data, Start(q=(0.0,) * 6), Part.ROBOT, version=2)
    entries = numbers.entries(table.items(known, arrays=False), Part.ROBOT)
    return numbers.table(data, entries, Part.ROBOT, "", sources.digest())


def write(folder: Path, files: Mapping[str, str]) -> None:
    """All files into a folder; those that have not changed are left alone."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        file = folder / name
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    from kr16cli.fmi.native import track_fmu

    target = Path(sys.argv[1])
    write(target, sources.complete(generic()))
    write(target / "track", track_fmu.generic())
