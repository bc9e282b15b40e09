"""`kr16 verify --self-test`: the suites are tested by seeding faults in the model.

Each mutant runs in a fresh process under the NumPy engine. The cases that call the changed
function are run, quick ones first, until one fails. Which cases those are is measured on the
model as it is, where all of them must pass. Cases that need other people's engines are left
out: the suites must see a fault without them.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any

import kr16cli
from kr16cli.errors import CheckFailedError, Kr16Error
from kr16cli.verify import mutants
from kr16cli.verify.mutants import Mutant
from kr16cli.verify.registry import SUITES

OWN_SUITES = tuple(name for name in SUITES if name != "engines")
QUICK = 240
"""Mutants of a quick run."""
_LIMIT = 60.0
"""Seconds after which a mutant counts as detected: the slowest case takes a few."""
_SURVIVORS = Path(__file__).with_name("survivors.toml")


@dataclass(frozen=True)
class Fault:
    """What became of a mutant.

    `by` is the case that detected it, or `error` or `timeout`; `reason` says why a survivor
    may survive, None where it may not.
    """

    mutant: Mutant
    by: str | None
    says: str
    reason: str | None

    @property
    def explained(self) -> bool:
        """Detected, or with a reason not to be."""
        return self.by is not None or self.reason is not None

    def entry(self) -> dict[str, Any]:
        """The fault as JSON."""
        m = self.mutant
        return {
            "id": m.id, "file": m.file, "change": m.change, "kind": m.kind,
            "detected": self.by is not None, "by": self.by, "reason": self.reason,
        }  # fmt: skip


@cache
def survivors() -> Mapping[tuple[str, str, str], str]:
    """Reasons by (file, function, change): line numbers shift, these do not."""
    listed = tomllib.loads(_SURVIVORS.read_text(encoding="utf-8"))["survivor"]
    return {
        (entry["file"], entry["where"], change): f"{entry['verdict']}: {entry['reason']}"
        for entry in listed
        for change in entry["changes"]
    }


def reason_for(mutant: Mutant) -> str | None:
    """Why a mutant may survive; None if no reason is listed."""
    return survivors().get((mutant.file, mutant.where, mutant.change))


def chosen(seed: int, *, quick: bool) -> list[Mutant]:
    """All mutants, or for a quick run all misprints and an even share of each file and kind."""
    everything = mutants.all_mutants()
    if not quick:
        return everything
    groups: dict[tuple[str, str], list[Mutant]] = {}
    for m in everything:
        groups.setdefault((m.file, m.kind), []).append(m)
    draw, share = random.Random(seed), QUICK / len(everything)
    picked = {
        m.id
        for (_, kind), group in groups.items()
        for m in draw.sample(
            group, len(group) if kind == "misprint" else max(1, round(share * len(group)))
        )
    }
    return [m for m in everything if m.id in picked]


def run(seeded: Sequence[Mutant], seed: int, workers: int | None = None) -> Iterator[Fault]:
    """Evaluate mutants, in the order they get done.

    Args:
        seeded: the mutants.
        seed: of the cases' samples.
        workers: processes at a time; by default one for each core.

    Raises:
        CheckFailedError: a case fails on the model as it is; a self-test would prove nothing.
    """
    count = max(1, min(workers or _cores(), len(seeded)))
    pool: SimpleQueue[_Worker] = SimpleQueue()
    started = [_Worker() for _ in range(count)]
    for worker in started:
        pool.put(worker)
    try:
        cases = _sound_cases(started[0], seed)

        def evaluate(mutant: Mutant) -> Fault:
            worker = pool.get()
            try:
                answer = worker.ask(_job(mutant, order(mutant, cases), seed))
            finally:
                pool.put(worker)
            by = answer["by"]
            return Fault(mutant, by, answer["says"], None if by else reason_for(mutant))

        with ThreadPoolExecutor(count) as threads:
            tasks = [threads.submit(evaluate, m) for m in seeded]
            try:
                for task in as_completed(tasks):
                    yield task.result()
            finally:
                for task in tasks:
                    task.cancel()
    finally:
        for worker in started:
            worker.close()


def _sound_cases(worker: _Worker, seed: int) -> list[dict[str, Any]]:
    """The cases with what they call and take, after two runs of the model as it is.

    The second run is a control: it is made like that of a mutant, and nothing may be detected.
    """
    job = {"kind": "baseline", "suites": OWN_SUITES, "seed": seed, "limit": 10 * _LIMIT}
    cases: list[dict[str, Any]] = worker.ask(job)["cases"]
    broken = [c["id"] for c in cases if c["status"] == "failed"]
    if not broken:
        control = Mutant("control", "", "", "control", "")
        answer = worker.ask(_job(control, order(control, cases), seed))
        broken = [answer["by"]] if answer["by"] else []
    if broken or not cases:
        raise CheckFailedError(
            f"{len(broken)} cases fail on the model as it is ({', '.join(broken[:1])}); "
            "run kr16 verify --quick and mend these first"
        )
    return cases


def _cores() -> int:
    usable: Callable[[int], set[int]] | None = getattr(os, "sched_getaffinity", None)
    return len(usable(0)) if usable else os.cpu_count() or 1


def _job(mutant: Mutant, cases: Sequence[tuple[str, str]], seed: int) -> dict[str, Any]:
    return {
        "kind": "mutant", "module": mutant.module, "source": mutant.source,
        "table": mutant.table, "cases": cases, "seed": seed, "limit": _LIMIT,
    }  # fmt: skip


def order(mutant: Mutant, cases: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """The cases that can see a mutant as (suite, id), quick ones first.

    They are those that call the function it stands in; all cases for a mutant outside of
    functions, and for a number of the parameter file.
    """
    name = f"{mutant.file.rpartition('/')[2]}:{mutant.where}"
    everywhere = not mutant.module or not mutant.where
    able = [c for c in cases if everywhere or name in c["calls"]] or cases
    quick_first = sorted(able, key=lambda c: c["seconds"])
    return [(c["suite"], c["id"]) for c in quick_first if c["status"] == "passed"]


class _Worker:
    """A process of `kr16cli.verify.fresh`, started again where it ended."""

    def __init__(self) -> None:
        self._process = self._start()

    def __enter__(self) -> _Worker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self.close()

    @staticmethod
    def _start() -> subprocess.Popen[str]:
        home = str(Path(kr16cli.__file__).resolve().parents[1])
        path = os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
        single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
        return subprocess.Popen(
            [sys.executable, "-m", "kr16cli.verify.fresh"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
            env=os.environ | single | {"KR16_ENGINE": "numpy", "PYTHONPATH": path},
        )

    def ask(self, job: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a job; a process that dies over it has detected the mutant."""
        if self._process.poll() is not None:
            self.close()
            self._process = self._start()
        source, sink = self._process.stdout, self._process.stdin
        if source is None or sink is None:
            raise Kr16Error("a process of the self-test has no pipes")
        try:
            sink.write(json.dumps(job) + "\n")
            sink.flush()
            line = source.readline()
        except BrokenPipeError:
            line = ""
        if line:
            answer: dict[str, Any] = json.loads(line)
            return answer
        self._process.wait()
        return {"by": "error", "says": "the process ended without an answer", "cases": []}

    def close(self) -> None:
        """End the process."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        self._process.wait()
