"""A Dask cluster computes the same bits, and survives the death of a worker."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from kr16cli.errors import InputError
from kr16cli.study import engine
from kr16cli.study.cluster import Cluster
from kr16cli.study.session import partial_folder
from studies import Toy
from test_study_engine import same, whole

distributed = pytest.importorskip("distributed")
pytestmark = [
    # Dask and its event loop leave these behind when a cluster is shut.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
]


@pytest.fixture(scope="module")
def scheduler():
    """The address of a cluster of two worker processes, and its client."""
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield cluster.scheduler_address, client


def test_a_cluster_computes_the_same_bits(scheduler, tmp_path):
    address, _ = scheduler
    with Cluster(address) as cluster:
        rows = whole(Toy(rows=103), tmp_path / "out.npz", runner=cluster)
    same(whole(Toy(rows=103)), rows)


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL is POSIX")
def test_a_killed_worker_loses_nothing_and_counts_nothing_twice(scheduler, tmp_path):
    address, client = scheduler
    toy = Toy(rows=150, seconds=0.1)
    pids = list(client.run(os.getpid).values())
    saved: list[int] = []

    def kill_one(progress: engine.Progress) -> None:
        saved.append(progress.done)
        if progress.done == 4:
            os.kill(pids[0], signal.SIGKILL)

    with Cluster(address) as cluster:
        rows = whole(toy, tmp_path / "out.npz", runner=cluster, listen=kill_one)
    assert saved == list(range(31))
    assert not partial_folder(tmp_path / "out.npz").exists()
    same(whole(Toy(rows=150)), rows)
    assert pids[0] not in client.run(os.getpid).values()


def test_an_interrupted_cluster_run_goes_on_elsewhere(scheduler, tmp_path):
    address, _ = scheduler
    toy, output = Toy(rows=100, seconds=0.02), tmp_path / "out.npz"

    def interrupt(progress: engine.Progress) -> None:
        if progress.done == 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), Cluster(address) as cluster:
        whole(toy, output, runner=cluster, listen=interrupt)
    assert len(list(partial_folder(output).glob("0*.npz"))) == 6
    same(whole(Toy(rows=100)), whole(Toy(rows=100), output))


def test_no_scheduler_is_told_in_a_line(monkeypatch):
    monkeypatch.setattr("kr16cli.study.cluster._PATIENCE", 0.5)
    with pytest.raises(InputError, match="no Dask scheduler with workers answers at tcp://127"):
        Cluster("tcp://127.0.0.1:9").__enter__()
    with pytest.raises(InputError, match="must be tcp://host:port"):
        Cluster("machine")


def test_workers_here_are_started_and_ended():
    with Cluster("local", 1) as cluster:
        pid = next(iter(cluster.client.run(os.getpid).values()))
        rows = whole(Toy(), runner=cluster)
    same(whole(Toy()), rows)
    deadline = time.monotonic() + 20.0
    while Path(f"/proc/{pid}").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not Path(f"/proc/{pid}").exists()
    assert rows["index"].dtype == np.int64
    assert threading.active_count() < 50


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX")
def test_ctrl_c_reaches_the_command_and_not_its_workers(tmp_path):
    """A terminal interrupts the whole group of processes."""
    words = ["map", "condition", "--grid", "60", "--scheduler", "local", "--workers", "1"]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}
    process = subprocess.Popen(
        [sys.executable, "-m", "kr16cli", *words, "-o", "m.npz"], cwd=tmp_path, env=environment,
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    folder, deadline = tmp_path / "m.npz.partial", time.monotonic() + 120
    while not list(folder.glob("0*.npz")) and time.monotonic() < deadline:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert (process.returncode, out) == (130, ""), err
    kept = len(list(folder.glob("0*.npz")))
    assert err.splitlines() == [
        f"kr16: {kept} of 3 chunks are kept in m.npz.partial; the same command goes on from there",
        "kr16: interrupted; nothing more was written",
    ]
