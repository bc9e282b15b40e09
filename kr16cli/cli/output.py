"""Where a result goes, and in which format: stdout, or a file that appears whole or not at all."""

from __future__ import annotations

import codecs
import os
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING

from kr16cli.errors import FileError, InputError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

FORMATS = ("table", "json", "csv", "npz")
_OF_SUFFIX = {".json": "json", ".csv": "csv", ".npz": "npz", ".txt": "table"}


def choose_format(
    chosen: str | None, json: bool, output: str | None, formats: tuple[str, ...] = FORMATS
) -> str:
    """The format asked for: --format, else --json, else the suffix of -o, else a table."""
    if chosen is not None and chosen.lower() not in formats:
        raise InputError(f"--format is {chosen}; it must be one of {', '.join(formats)}")
    if json and chosen not in (None, "json"):
        raise InputError(f"--json and --format {chosen} exclude each other; give one")
    kind = "json" if json else chosen.lower() if chosen else None
    if kind is None and output not in (None, "-"):
        suffix = Path(str(output)).suffix.lower()
        kind = _OF_SUFFIX.get(suffix)
        if kind not in formats and not _is_special(Path(str(output))):
            known = ", ".join(s for s, k in _OF_SUFFIX.items() if k in formats)
            raise InputError(f"-o {output}: the suffix must be one of {known}, or give --format")
    kind = kind or "table"
    if kind == "npz" and output in (None, "-"):
        raise InputError("npz is binary and needs a file; give -o FILE.npz")
    return kind


class Target:
    """A file or stdout, opened before the work starts and written once at its end.

    A file is written under a temporary name in the same folder and renamed, so that an
    interrupted or failed command leaves what was there before. An existing file keeps its
    permissions; a link keeps pointing at the file; a device or pipe is written to directly.
    """

    def __init__(self, output: str | None) -> None:
        self._path = None if output in (None, "-") else Path(str(output)).expanduser()
        self._temporary: Path | None = None

    def __enter__(self) -> Target:
        if self._path is not None:
            with _as_file_error(self._path):
                self._path = self._path.resolve()
                if self._path.is_dir():
                    raise FileError(self._path, "is a directory; name a file in it")
                if not _is_special(self._path):
                    self._open_beside(self._path)
        return self

    def _open_beside(self, path: Path) -> None:
        """A new empty file in the same folder; fails now if the output could not be written."""
        if path.exists() and not os.access(path, os.W_OK):
            raise FileError(path, "cannot be written: no permission; choose another name")
        temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
        try:
            temporary.touch(exist_ok=False)
            self._temporary = temporary
        except (KeyboardInterrupt, SystemExit):  # a signal between the two
            temporary.unlink(missing_ok=True)
            raise

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._temporary is not None:
            with suppress(OSError):
                self._temporary.unlink()

    def write(self, content: str | bytes) -> None:
        """Write the whole content."""
        data = content.encode() if isinstance(content, str) else content
        self.write_with(lambda out: out.write(data))

    def write_with(self, write: Callable[[IO[bytes]], object]) -> None:
        """Write what `write` gives to a file, which appears when it is done."""
        if self._path is None:
            _to_stdout(write)
            return
        with _as_file_error(self._path):
            with (self._temporary or self._path).open("wb") as out:
                write(out)
            if self._temporary is not None:
                self._temporary.chmod(_permissions(self._path))
                self._temporary.replace(self._path)
                self._temporary = None


def write_file(output: str | Path, make: Callable[[], str | bytes]) -> None:
    """Open `output` first, then make its content and write it: see `Target`."""
    with Target(str(output)) as target:
        target.write(make())


class _as_file_error:  # noqa: N801  (reads as a statement)
    """Turns an OSError about a path into a FileError."""

    def __init__(self, path: Path | str) -> None:
        self._path = path

    def __enter__(self) -> None:
        pass

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if isinstance(error, OSError) and not isinstance(error, BrokenPipeError):
            reason = error.strerror or str(error)
            raise FileError(self._path, f"cannot be written: {reason}") from None


def _is_special(path: Path) -> bool:
    """A device, pipe or socket: anything that exists and is no regular file or folder."""
    return path.exists() and not path.is_file() and not path.is_dir()


def _permissions(path: Path) -> int:
    """Permissions of the file to replace, or those a new file gets."""
    if path.exists():
        return stat.S_IMODE(path.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _to_stdout(write: Callable[[IO[bytes]], object]) -> None:
    if sys.stdout is None:
        raise FileError("standard output", "is closed; use -o FILE")
    with _as_file_error("standard output"):
        write(_StdoutBytes())
        sys.stdout.flush()


class _StdoutBytes(BytesIO):
    """Standard output that takes UTF-8, in pieces of any length."""

    def __init__(self) -> None:
        super().__init__()
        self._decoder = codecs.getincrementaldecoder("utf-8")()

    def write(self, content: ReadableBuffer) -> int:
        data = bytes(content)
        sys.stdout.write(self._decoder.decode(data))
        return len(data)
