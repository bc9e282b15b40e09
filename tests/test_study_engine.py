"""Chunks, their store, and those who compute them: whole, resumable, the same for any workers."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kr16cli
from kr16cli.errors import FileError, InputError
from kr16cli.study import engine, store, work
from kr16cli.study.session import finished, partial_folder, write_npz
from kr16cli.study.store import Store
from kr16cli.study.streams import uniforms
from studies import Toy, computed


def whole(toy: Toy, output: Path | None = None, **options) -> dict[str, np.ndarray]:
    with finished(toy, output, **options) as kept:
        parts = list(kept.chunks())
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def same(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> None:
    assert list(a) == list(b)
    for name, values in a.items():
        assert values.dtype == b[name].dtype
        assert values.tobytes() == b[name].tobytes()


def test_rows_are_complete_in_order_and_typed():
    rows = whole(Toy())
    assert rows["index"].tolist() == list(range(23))
    assert rows["square"].dtype == np.float32
    assert rows["square"].tolist() == [i * i for i in range(23)]
    assert rows["random"].shape == (23, 3)


@pytest.mark.parametrize(
    "runner",
    [engine.Local(3, "threads"), engine.Local(2, "processes")],
    ids=["threads", "processes"],
)
def test_results_are_the_same_bits_whatever_the_workers(runner):
    same(whole(Toy()), whole(Toy(), runner=runner))


@pytest.mark.parametrize("chunk_rows", [1, 4, 7, 100])
def test_results_do_not_depend_on_the_cutting(chunk_rows):
    same(whole(Toy()), whole(Toy(chunk_rows=chunk_rows)))


def test_random_rows_are_uniform_and_depend_on_seed_kind_and_row_alone():
    table = uniforms(7, 1, 0, 40_000, 5)
    assert (table > 0.0).all()
    assert (table < 1.0).all()
    assert abs(table.mean() - 0.5) < 4 / np.sqrt(12 * table.size)
    assert abs(np.corrcoef(table.T) - np.eye(5)).max() < 0.02
    for start, stop in ((0, 1), (1, 4), (777, 1777), (39_999, 40_000)):
        assert (uniforms(7, 1, start, stop, 5) == table[start:stop]).all()
    assert not np.isin(uniforms(8, 1, 0, 100, 5), table).any()
    assert not np.isin(uniforms(7, 2, 0, 100, 5), table).any()


def test_what_is_finished_is_neither_lost_nor_computed_again(tmp_path):
    marks = tmp_path / "marks"
    marks.mkdir()
    toy, output = Toy(marks=str(marks)), tmp_path / "out.npz"
    expected = whole(replace(toy, marks=None))

    def interrupt(progress: engine.Progress) -> None:
        if progress.done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whole(toy, output, listen=interrupt)
    folder = partial_folder(output)
    assert len(list(folder.glob("*.npz"))) == 3
    same(expected, whole(toy, output))
    assert computed(marks) == [0, 5, 10, 15, 20]
    assert not folder.exists()


def test_an_interrupted_pool_keeps_what_was_under_way(tmp_path):
    toy, output = Toy(rows=40, seconds=0.05), tmp_path / "out.npz"

    class Interrupting(engine.Local):
        def run(self, work_, todo):
            chunks = super().run(work_, todo)
            yield next(chunks)
            signal.raise_signal(signal.SIGINT)
            yield from chunks

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            whole(toy, output, runner=Interrupting(2))
    finally:
        signal.signal(signal.SIGINT, before)
    kept = list(partial_folder(output).glob("*.npz"))
    assert 1 <= len(kept) < 8
    for path in kept:
        with np.load(path) as chunk:
            assert len(chunk["index"]) == 5
    same(whole(replace(toy, seconds=0.0)), whole(toy, output))


_KILLED = """
import sys
from pathlib import Path
sys.path[:0] = {paths!r}
from studies import Toy
from kr16cli.study.engine import Local
from kr16cli.study.session import finished
toy = Toy(rows=200, seconds=0.05, marks={marks!r})
with finished(toy, Path({output!r}), runner=Local(2)):
    pass
"""


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is POSIX")
def test_a_killed_process_leaves_chunks_from_which_the_next_goes_on(tmp_path):
    marks, output = tmp_path / "marks", tmp_path / "out.npz"
    marks.mkdir()
    here = Path(__file__).resolve().parent
    paths = [str(here), str(Path(kr16cli.__file__).resolve().parent.parent)]
    script = _KILLED.format(paths=paths, marks=str(marks), output=str(output))
    process = subprocess.Popen([sys.executable, "-c", script])
    folder, deadline = partial_folder(output), time.monotonic() + 60
    while len(list(folder.glob("0*.npz"))) < 5 and time.monotonic() < deadline:
        time.sleep(0.01)
    process.kill()
    process.wait()
    kept = {int(path.stem) for path in folder.glob("0*.npz")}
    assert 5 <= len(kept) < 40
    before = len(computed(marks))
    toy = Toy(rows=200, marks=str(marks))
    rows = whole(toy, output)
    same(whole(replace(toy, marks=None)), rows)
    again = computed(marks)
    assert len(again) - before == 40 - len(kept)


def test_a_worker_process_that_dies_is_replaced_and_nothing_is_counted_twice(tmp_path):
    fatal = tmp_path / "fatal"
    fatal.touch()
    toy = Toy(rows=60, fatal=str(fatal))
    rows = whole(toy, tmp_path / "out.npz", runner=engine.Local(2, "processes"))
    assert not fatal.exists()
    same(whole(Toy(rows=60)), rows)


def test_workers_that_always_die_end_the_run_and_keep_what_is_finished(tmp_path):
    toy, output = Toy(deadly=10), tmp_path / "out.npz"
    with pytest.raises(engine.WorkersLostError, match="ended 3 times before a chunk was done"):
        whole(toy, output, runner=engine.Local(2, "processes"))
    kept = {path.name for path in partial_folder(output).glob("0*.npz")}
    assert kept <= {"000000000.npz", "000000001.npz"}
    same(whole(Toy()), whole(Toy(), output))


def test_a_damaged_chunk_is_computed_again(tmp_path):
    toy, output = Toy(), tmp_path / "out.npz"
    folder = _partial(toy, output, 4)
    broken = sorted(folder.glob("*.npz"))
    broken[0].write_bytes(broken[0].read_bytes()[:-30])
    data = bytearray(broken[1].read_bytes())
    data[len(data) // 2] ^= 1
    broken[1].write_bytes(bytes(data))
    broken[2].write_bytes(b"")
    same(whole(Toy()), whole(toy, output))


def _partial(toy: Toy, output: Path, count: int) -> Path:
    """A folder with the first chunks of a study."""

    def interrupt(progress: engine.Progress) -> None:
        if progress.done == count:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whole(toy, output, listen=interrupt)
    return partial_folder(output)


def test_another_study_is_not_mixed_in(tmp_path):
    output = tmp_path / "out.npz"
    folder = _partial(Toy(), output, 2)
    with pytest.raises(FileError, match=r"part of another study \(seed differ\).*--fresh"):
        whole(Toy(seed=4), output)
    assert len(list(folder.glob("*.npz"))) == 2
    same(whole(Toy(seed=4)), whole(Toy(seed=4), output, fresh=True))


def test_another_engine_is_another_study(tmp_path, monkeypatch):
    output = tmp_path / "out.npz"
    _partial(Toy(), output, 2)
    monkeypatch.setattr(work, "stamp", lambda: "kr16cli 9, engine other")
    monkeypatch.setattr(store, "stamp", lambda: "kr16cli 9, engine other")
    with pytest.raises(FileError, match="the version, the engine or the cutting differ"):
        whole(Toy(), output)


def test_a_folder_that_is_no_store_is_left_alone(tmp_path):
    folder = partial_folder(tmp_path / "out.npz")
    folder.mkdir()
    (folder / "manifest.json").write_text("{}")
    (folder / "letter.txt").write_text("dear")
    with pytest.raises(FileError, match="holds no partial study"):
        whole(Toy(), tmp_path / "out.npz")
    assert (folder / "letter.txt").read_text() == "dear"


def test_two_runs_do_not_share_a_folder(tmp_path):
    with Store(tmp_path / "s", Toy()), pytest.raises(FileError, match="another kr16 is at work"):
        Store(tmp_path / "s", Toy()).__enter__()


def test_a_full_disk_ends_the_run_and_keeps_what_is_finished(tmp_path, monkeypatch):
    output, written = tmp_path / "out.npz", []

    def full(file, chunk):
        written.append(1)
        if len(written) > 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        np.savez(file, **chunk)

    monkeypatch.setattr(store, "_savez", full)
    with pytest.raises(FileError, match=r"No space left.*3 of 5 chunks are kept.*make room"):
        whole(Toy(), output)
    folder = partial_folder(output)
    assert len(list(folder.glob("*.npz"))) == 3
    assert not list(folder.glob(".*.tmp"))
    monkeypatch.undo()
    same(whole(Toy()), whole(Toy(), output))


_FULL = """
import resource, signal, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.path[:0] = {paths!r}
from kr16cli.__main__ import main
sys.argv = ["kr16", "map", "reach", "--grid", "200", "-o", {output!r}]
sys.exit(main())
"""


@pytest.mark.skipif(os.name == "nt", reason="limits of files are POSIX")
def test_files_that_may_not_grow_are_told_and_nothing_is_left(tmp_path):
    paths = [str(Path(kr16cli.__file__).resolve().parent.parent)]
    script = _FULL.format(paths=paths, output=str(tmp_path / "m.npz"))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("kr16: error:")
    assert "m.npz.partial: cannot be written: File too large" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_study_that_cannot_fit_is_refused_at_once(tmp_path):
    with pytest.raises(FileError, match=r"needs .* GB on this disk, .* are free"):
        whole(Toy(rows=10**14, chunk_rows=10**9), tmp_path / "out.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("place", "words"), [("", "is a directory"), ("no/out.npz", "No such file")]
)
def test_an_output_that_cannot_be_is_told_before_work(tmp_path, place, words):
    with pytest.raises(FileError, match=words):
        whole(Toy(), tmp_path / place)


def test_progress_counts_and_estimates(tmp_path):
    told: list[engine.Progress] = []
    whole(Toy(seconds=0.01), listen=told.append)
    assert [p.done for p in told] == [0, 1, 2, 3, 4, 5]
    assert told[0].left is None
    assert told[-1].left == 0.0
    assert told[1].left == pytest.approx(4 * told[1].elapsed)


def test_a_stored_study_becomes_one_npz_file(tmp_path):
    toy = Toy()
    with finished(toy) as kept, (tmp_path / "a.npz").open("wb") as file:
        write_npz(file, kept, (23, 1), {"axis": [1.0, 2.0]}, {"about": "ü"})
    with np.load(tmp_path / "a.npz") as archive:
        assert archive["random"].shape == (23, 1, 3)
        assert (archive["index"][:, 0] == np.arange(23)).all()
        assert archive["axis"].tolist() == [1.0, 2.0]
        assert json.loads(str(archive["metadata"])) == {"about": "ü"}


def test_workers_must_be_some():
    with pytest.raises(InputError, match="workers is 0"):
        engine.Local(0)


def test_a_worker_of_another_version_is_refused():
    with pytest.raises(work.ForeignWorkerError, match="install the same kr16cli"):
        work.compute_chunk(Toy(), 0, "kr16cli 0.0, engine native")
