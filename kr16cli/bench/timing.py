"""Wall time of a call, as the best of several runs: the machine's noise only ever adds."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

_LEAST = 0.02
"""Seconds a run should last, so that the clock's own cost does not count."""


def nanoseconds(call: Callable[[], object], per: int, rounds: int) -> float:
    """Nanoseconds per unit of a call that does `per` units; the best of `rounds`."""
    repeat = 1
    while True:
        spent = _run(call, repeat)
        if spent >= _LEAST:
            break
        repeat *= 2 if spent <= 0.0 else max(2, int(_LEAST / spent) + 1)
    best = min(spent, *(_run(call, repeat) for _ in range(rounds)))
    return best / repeat / per * 1e9


def _run(call: Callable[[], object], repeat: int) -> float:
    start = time.perf_counter()
    for _ in range(repeat):
        call()
    return time.perf_counter() - start


def least(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Least time of each call, s; they take turns, so that drift touches all alike."""
    found = dict.fromkeys(calls, float("inf"))
    for _ in range(rounds):
        for name, call in calls.items():
            found[name] = min(found[name], _run(call, 1))
    return found
