"""The same chunks on a Dask cluster: one that is there, or one started here to try it.

A worker that dies is Dask's to notice: it gives the chunk to another. A chunk counts when its
result arrives and is written, once, by the process that asked.
"""

from __future__ import annotations

import logging
import signal
from collections.abc import Iterable
from contextlib import ExitStack
from itertools import islice
from typing import Any

from kr16cli.errors import InputError, MissingPartError
from kr16cli.study.engine import Finished, WorkersLostError
from kr16cli.study.work import Work, compute_chunk, stamp

# Chunks handed out for each thread of the cluster, so that none waits for this process.
_AHEAD = 3
# Times a chunk is given out again after an error of the network.
_RETRIES = 3
_PATIENCE = 20.0


def dask_setup(worker: Any) -> None:
    """What a worker started here does first: it leaves Ctrl-C to the process that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


class Cluster:
    """Workers of a Dask cluster; use it as a context.

    Args:
        address: "tcp://host:port" of a scheduler, or "local" for a LocalCluster of processes.
        workers: processes of a LocalCluster.

    Attributes:
        client: the `distributed.Client`.

    Raises:
        MissingPartError: Dask is not installed.
        InputError: no scheduler answers there, or it has no workers.
    """

    def __init__(self, address: str, workers: int = 1) -> None:
        if address != "local" and "://" not in address:
            raise InputError(
                f"scheduler is {address}; it must be tcp://host:port, or local for workers here"
            )
        try:
            import distributed
        except ImportError:
            raise MissingPartError("distributed", "cluster") from None
        self._distributed = distributed
        self.address, self.workers = address, workers
        self._open = ExitStack()
        self.client: Any = None

    def __enter__(self) -> Cluster:
        d = self._distributed
        with ExitStack() as stack:
            target: Any = self.address
            if self.address == "local":
                target = stack.enter_context(
                    d.LocalCluster(
                        n_workers=self.workers,
                        threads_per_worker=1,
                        dashboard_address=":0",
                        silence_logs=logging.ERROR,
                        preload=[__name__],
                    )
                )
            try:
                self.client = stack.enter_context(d.Client(target, timeout=_PATIENCE))
                self.client.wait_for_workers(1, timeout=_PATIENCE)
            except (OSError, TimeoutError) as error:
                reason = " ".join(str(error).split())[:120]
                raise InputError(
                    f"no Dask scheduler with workers answers at {self.address}: {reason}; start "
                    "one: dask scheduler, and on each machine dask worker tcp://host:8786"
                ) from None
            self._open = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def run(self, work: Work, todo: Iterable[int]) -> Finished:
        """See `engine.Runner`."""
        d, client = self._distributed, self.client
        rest = iter(todo)
        flow = d.as_completed(with_results=True, raise_errors=True)
        window = _AHEAD * max(1, sum(client.nthreads().values()))
        mine = stamp()

        def hand_out(count: int) -> None:
            for index in islice(rest, count):
                flow.add(
                    client.submit(compute_chunk, work, index, mine, pure=False, retries=_RETRIES)
                )

        hand_out(window)
        try:
            for future, result in flow:
                future.release()
                hand_out(1)
                yield result
        except (KeyboardInterrupt, SystemExit):
            yield from _arrived(flow)
            raise
        except (d.KilledWorker, d.client.FutureCancelledError, OSError) as error:
            reason = " ".join(str(error).split())[:160]
            raise WorkersLostError(
                f"the cluster at {self.address} lost its workers: {reason}; finished chunks are "
                "kept, repeat the command to go on"
            ) from None
        finally:
            flow.clear()


def _arrived(flow: Any) -> Finished:
    """Results that are here already when the user has had enough."""
    for future, result in flow.next_batch(block=False):
        if future.status == "finished":
            yield result
