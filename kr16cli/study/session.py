"""One study from its first chunk to its file: what commands and scripts call."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from kr16cli.errors import FileError
from kr16cli.study.engine import Listener, Local, Runner, run
from kr16cli.study.store import SUFFIX, Store
from kr16cli.study.work import Work


@contextmanager
def finished(
    work: Work,
    output: Path | None = None,
    *,
    runner: Runner | None = None,
    fresh: bool = False,
    listen: Listener | None = None,
) -> Iterator[Store]:
    """The store of a study with every chunk in it.

    Args:
        work: the study.
        output: the file that will be written; the chunks are kept beside it in `output.partial`
            until the block ends without an error. None keeps them in a temporary folder, from
            which no other run can go on.
        runner: who computes; one thread by default.
        fresh: forget what an earlier run left.
        listen: told after each chunk.

    Raises:
        FileError, WorkersLostError, KeyboardInterrupt: see `engine.run`; what is finished stays.
    """
    runner = runner or Local()
    if output is None:
        with (
            tempfile.TemporaryDirectory(prefix="kr16-") as folder,
            Store(Path(folder) / "study", work) as store,
        ):
            run(work, store, runner, listen)
            yield store
        return
    with Store(partial_folder(output), work, fresh=fresh) as store:
        run(work, store, runner, listen)
        yield store
        store.discard()


def partial_folder(output: Path) -> Path:
    """Where the chunks of a file to come are kept.

    Raises:
        FileError: the file itself could not be written.
    """
    path = output.expanduser().resolve()
    if path.is_dir():
        raise FileError(path, "is a directory; name a file in it")
    if not path.parent.is_dir():
        raise FileError(path, "cannot be written: No such file or directory")
    return path.with_name(path.name + SUFFIX)


def write_npz(
    file: IO[bytes],
    store: Store,
    shape: tuple[int, ...],
    extra: Mapping[str, npt.ArrayLike],
    metadata: Mapping[str, Any],
) -> None:
    """Stream a finished study into an npz file, a chunk in memory at a time.

    Args:
        file: to write.
        store: complete.
        shape: of the rows; each column gets it in front of the shape of an entry.
        extra: further arrays.
        metadata: JSON-ready; kept as text in `metadata`.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, column in store.work.columns().items():
            with _member(archive, name) as member:
                header = {
                    "descr": np.lib.format.dtype_to_descr(np.dtype(column.dtype)),
                    "fortran_order": False,
                    "shape": (*shape, *column.shape),
                }
                np.lib.format.write_array_header_1_0(member, header)
                for part in store.column(name):
                    member.write(part.tobytes())
        text = json.dumps(metadata, allow_nan=False, ensure_ascii=False)
        for name, values in {**extra, "metadata": text}.items():
            with _member(archive, name) as member:
                np.lib.format.write_array(member, np.asarray(values), allow_pickle=False)


def _member(archive: zipfile.ZipFile, name: str) -> IO[bytes]:
    # Without a date, so that equal studies make equal files.
    return archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True)
