"""Chunks on disk while a study runs: each is there whole or not at all, and survives a kill.

`NAME.partial/` beside the file to come holds `manifest.json`, which says what is computed, and one
npz file for each finished chunk. The same study started again goes on from there. When all
chunks are there they are streamed, one at a time, into the file asked for.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np

from kr16cli.errors import FileError
from kr16cli.study.work import Chunk, Work, chunks, fingerprint, row_bytes, stamp

SCHEMA = "kr16.partial/1"
SUFFIX = ".partial"
_MANIFEST, _LOCK = "manifest.json", "lock"


class Store:
    """The chunks of one study in its folder; use it as a context, which holds the lock.

    Args:
        folder: where the chunks are; made if it is not there.
        work: the study.
        fresh: throw away what an earlier run left, whatever it was.

    Attributes:
        done: indices of the chunks that are there.
        found: how many were there at the start.

    Raises:
        FileError: the folder cannot be written, is in use, holds another study, or the disk has
            too little room.
    """

    def __init__(self, folder: Path, work: Work, *, fresh: bool = False) -> None:
        self.folder, self.work = folder, work
        self.total = chunks(work)
        self.done: set[int] = set()
        self.found = 0
        self._fresh, self._ours = fresh, False
        self._lock: IO[bytes] | None = None

    def __enter__(self) -> Store:
        with _as_file_error(self.folder):
            self.folder.mkdir(exist_ok=True)
            self._lock = _locked(self.folder / _LOCK)
        try:
            with _as_file_error(self.folder):
                self._open()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of the folder; without a finished chunk it goes."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        with suppress(OSError):
            if self._ours and not self.done:
                _remove(self.folder)

    def _open(self) -> None:
        """Read the manifest and find the finished chunks, or start anew."""
        manifest = self.folder / _MANIFEST
        if self._fresh or not manifest.exists():
            self._ours = True
            for old in self.folder.glob("*.npz"):
                old.unlink()
            self._write_manifest(manifest)
        else:
            self._compare(manifest)
        self._ours = True
        for torn in self.folder.glob(".*.tmp"):
            torn.unlink()
        for index in range(self.total):
            if self._is_sound(self._path(index)):
                self.done.add(index)
        self.found = len(self.done)
        self._room()

    def _write_manifest(self, manifest: Path) -> None:
        about = {
            "schema": SCHEMA,
            "study": self.work.describe(),
            "made_by": stamp(),
            "rows": self.work.rows,
            "chunk_rows": self.work.chunk_rows,
            "sha256": fingerprint(self.work),
        }
        text = json.dumps(about, indent=1, allow_nan=False)
        _write_whole(manifest, lambda file: file.write(text.encode()))

    def _compare(self, manifest: Path) -> None:
        """FileError where the folder holds the chunks of another study."""
        try:
            about = json.loads(manifest.read_text(encoding="utf-8"))
            theirs, study = about["sha256"], about["study"]
        except (ValueError, KeyError, TypeError) as error:
            reason = f"holds no partial study: {error}; remove the folder or use --fresh"
            raise FileError(self.folder, reason) from None
        if theirs == fingerprint(self.work):
            return
        mine = self.work.describe()
        keys = [k for k in sorted({*mine, *study}) if mine.get(k) != study.get(k)]
        what = ", ".join(keys) if keys else "the version, the engine or the cutting"
        raise FileError(
            self.folder,
            f"holds part of another study ({what} differ); repeat that command to finish it, "
            "use --fresh to throw it away, or give another -o",
        )

    def _room(self) -> None:
        """FileError at once where the disk cannot hold the chunks and the file made of them."""
        rows = self.work.rows
        missing = rows - min(rows, len(self.done) * self.work.chunk_rows)
        needed = (missing + rows) * row_bytes(self.work)
        free = shutil.disk_usage(self.folder).free
        if needed > free:
            raise FileError(
                self.folder,
                f"needs {needed / 1e9:.3g} GB on this disk, {free / 1e9:.3g} GB are free; make "
                "room, take a coarser grid or fewer samples, or write elsewhere",
            )

    def _path(self, index: int) -> Path:
        return self.folder / f"{index:09d}.npz"

    @staticmethod
    def _is_sound(path: Path) -> bool:
        """Whether a chunk is there and whole; a damaged one is removed and counts as missing."""
        try:
            with zipfile.ZipFile(path) as archive:
                sound = archive.testzip() is None
        except FileNotFoundError:
            return False
        except (zipfile.BadZipFile, zlib.error, EOFError):
            sound = False
        if not sound:
            path.unlink()
        return sound

    def missing(self) -> list[int]:
        """The chunks still to be computed, in order."""
        return [i for i in range(self.total) if i not in self.done]

    def save(self, index: int, chunk: Chunk) -> None:
        """Keep a chunk; a chunk that is there already is not written again.

        Raises:
            FileError: it cannot be written; the chunks before it are safe.
        """
        if index in self.done:
            return
        kept = f"{len(self.done)} of {self.total} chunks are kept in it" if self.done else ""
        with _as_file_error(self.folder, kept):
            _write_whole(self._path(index), lambda file: _savez(file, chunk))
        self.done.add(index)

    def load(self, index: int) -> Chunk:
        """A finished chunk."""
        with _as_file_error(self._path(index)), np.load(self._path(index)) as archive:
            return {name: archive[name] for name in self.work.columns()}

    def chunks(self) -> Iterator[Chunk]:
        """The finished chunks in order, one in memory at a time."""
        for index in sorted(self.done):
            yield self.load(index)

    def column(self, name: str) -> Iterator[np.ndarray[Any, Any]]:
        """One column of the finished chunks in order."""
        for index in sorted(self.done):
            with _as_file_error(self._path(index)), np.load(self._path(index)) as archive:
                yield archive[name]

    def discard(self) -> None:
        """Remove the chunks, which are no longer needed."""
        self.done.clear()
        self.close()


@contextmanager
def whole_file(path: Path, kept: str = "") -> Iterator[IO[bytes]]:
    """A file to write that appears under its name when the block ends without an error.

    Args:
        path: the file.
        kept: what to tell where it cannot be written.
    """
    with _as_file_error(path, kept):
        target = path.expanduser().resolve()
        temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
        try:
            with temporary.open("xb") as file:
                yield file
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)


def _savez(file: IO[bytes], chunk: Chunk) -> None:
    arrays: dict[str, Any] = dict(chunk)
    np.savez(file, **arrays)


def _write_whole(path: Path, write: Any) -> None:
    """Write under another name, have it on the disk, rename."""
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with temporary.open("wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _locked(path: Path) -> IO[bytes]:
    """The open lock file; the system takes the lock back when its process ends, however."""
    file = path.open("wb")
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        file.close()
        raise FileError(path.parent, "another kr16 is at work in it; wait for its end") from None
    return file


def _remove(folder: Path) -> None:
    """Remove a store's folder with what a store puts into it, and nothing else."""
    for path in (*folder.glob("*.npz"), *folder.glob(".*.tmp"), folder / _MANIFEST, folder / _LOCK):
        path.unlink(missing_ok=True)
    folder.rmdir()


@contextmanager
def _as_file_error(path: Path, kept: str = "") -> Iterator[None]:
    """Turns an OSError into a FileError that tells what is kept, and how to go on."""
    try:
        yield
    except OSError as error:
        reason = f"cannot be written: {error.strerror or error}"
        if error.errno == errno.ENOSPC and kept:
            reason += f"; {kept}; make room and repeat the command"
        elif kept:
            reason += f"; {kept}; repeat the command to go on"
        raise FileError(path, reason) from None
