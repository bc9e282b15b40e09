"""Run a study: who computes the chunks, what is told meanwhile, and what an interruption leaves.

Chunks are handed out a few at a time, so that memory does not grow with their number, and each
is on disk before the next result is waited for.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from typing import NamedTuple, Protocol

from kr16cli.errors import InputError, Kr16Error
from kr16cli.study.store import Store
from kr16cli.study.work import Chunk, Work, compute_chunk, stamp

Finished = Generator[tuple[int, Chunk], None, None]

# A pool that breaks this often without one chunk in between is beyond help.
_BREAKS = 3


class WorkersLostError(Kr16Error):
    """Workers that keep dying, or a cluster that is gone; the finished chunks are kept."""

    exit_code = 1


class Progress(NamedTuple):
    """Where a study is: chunks done, chunks in all, seconds so far and (or None) still to go."""

    done: int
    total: int
    elapsed: float
    left: float | None


Listener = Callable[[Progress], None]


class Runner(Protocol):
    """Computes chunks, in any order."""

    def run(self, work: Work, todo: Iterable[int]) -> Finished:
        """The chunks as they get finished. Interrupted, those under way still come."""


def run(work: Work, store: Store, runner: Runner, listen: Listener | None = None) -> None:
    """Compute the chunks that a store does not have.

    Args:
        work: the study.
        store: keeps the chunks; open.
        runner: computes them.
        listen: told after each chunk.

    Raises:
        FileError: a chunk cannot be written. WorkersLostError: see there.
        KeyboardInterrupt, SystemExit: after what was under way is kept.
    """
    start, at_first = time.monotonic(), len(store.done)
    if listen:
        listen(Progress(at_first, store.total, 0.0, None))
    with closing(runner.run(work, store.missing())) as finished:
        for index, chunk in finished:
            store.save(index, chunk)
            if listen:
                elapsed, now = time.monotonic() - start, len(store.done)
                left = elapsed * (store.total - now) / (now - at_first)
                listen(Progress(now, store.total, elapsed, left))


class Local:
    """Workers of this machine.

    Args:
        workers: how many; 1 computes in this thread.
        kind: "threads" or "processes"; None is what the work prefers.
    """

    def __init__(self, workers: int = 1, kind: str | None = None) -> None:
        if workers < 1:
            raise InputError(f"workers is {workers}; it must be a whole number of 1 or more")
        self.workers, self.kind = workers, kind

    def run(self, work: Work, todo: Iterable[int]) -> Finished:
        """See `Runner`."""
        if self.workers == 1:
            return self._here(work, todo)
        if (self.kind or work.prefers) == "threads":
            return self._threads(work, todo)
        return self._processes(work, todo)

    @staticmethod
    def _here(work: Work, todo: Iterable[int]) -> Finished:
        mine = stamp()
        for index in todo:
            yield compute_chunk(work, index, mine)

    def _threads(self, work: Work, todo: Iterable[int]) -> Finished:
        with ThreadPoolExecutor(self.workers) as pool:
            queue = _Queue(pool, work, todo, 2 * self.workers)
            try:
                yield from queue.finished()
            except (KeyboardInterrupt, SystemExit):
                yield from queue.rest()
                raise
            finally:
                pool.shutdown(cancel_futures=True)

    def _processes(self, work: Work, todo: Iterable[int]) -> Finished:
        """As with threads; where a process dies, a new pool computes what was lost.

        A single chunk is computed here: to start a process takes longer than most of them.
        """
        left, breaks = list(todo), 0
        if len(left) == 1:
            yield from self._here(work, left)
            return
        while left:
            done: set[int] = set()
            pool = _process_pool(min(self.workers, len(left)))
            queue = _Queue(pool, work, left, 2 * self.workers)
            try:
                for index, chunk in queue.finished():
                    done.add(index)
                    yield index, chunk
            except (KeyboardInterrupt, SystemExit):
                yield from queue.rest()
                raise
            except BrokenProcessPool:
                breaks = 0 if done else breaks + 1
                if breaks >= _BREAKS:
                    raise WorkersLostError(
                        f"the worker processes ended {breaks} times before a chunk was done; "
                        "is there enough memory? Finished chunks are kept"
                    ) from None
            finally:
                pool.shutdown(cancel_futures=True)
            left = [i for i in left if i not in done]


def _process_pool(workers: int) -> Executor:
    from multiprocessing import get_context

    # A fresh interpreter: threads of this one may hold locks that a fork would copy.
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_deaf)


def _deaf() -> None:
    """A worker leaves Ctrl-C to the process that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


class _Queue:
    """Hands out chunks to a pool, a window of them at a time."""

    def __init__(self, pool: Executor, work: Work, todo: Iterable[int], window: int) -> None:
        self._pool, self._work, self._window = pool, work, window
        self._todo = iter(todo)
        self._mine = stamp()
        self._waiting: set[Future[tuple[int, Chunk]]] = set()

    def finished(self) -> Finished:
        """Results as they come."""
        self._fill()
        while self._waiting:
            done, self._waiting = wait(self._waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
            self._fill()

    def _fill(self) -> None:
        while len(self._waiting) < self._window:
            index = next(self._todo, None)
            if index is None:
                return
            task = self._pool.submit(compute_chunk, self._work, index, self._mine)
            self._waiting.add(task)

    def rest(self) -> Finished:
        """What is under way, to its end; what has not begun is dropped."""
        self._pool.shutdown(wait=True, cancel_futures=True)
        for future in self._waiting:
            if future.done() and not future.cancelled() and future.exception() is None:
                yield future.result()
