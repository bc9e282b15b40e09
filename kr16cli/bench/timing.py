"""Wall time of a call, as the best of several runs: the machine's noise only ever adds."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial

_LEAST = 0.02
"""Seconds a run should last, so that the clock's own cost does not count."""


Work = tuple[Callable[[], object], int]
"""A call, and how many units it does."""


def nanoseconds(works: Mapping[str, Work], rounds: int) -> dict[str, float]:
    """Nanoseconds per unit of each, the least of `rounds`; they take turns, as in `least`."""
    repeats = {name: _repeats(call) for name, (call, _) in works.items()}
    spent = least({name: partial(_run, works[name][0], repeats[name]) for name in works}, rounds)
    return {name: spent[name] / repeats[name] / per * 1e9 for name, (_, per) in works.items()}


def _repeats(call: Callable[[], object]) -> int:
    """How often to call, to last long enough."""
    repeat = 1
    while (spent := _run(call, repeat)) < _LEAST:
        repeat *= 2 if spent <= 0.0 else max(2, int(_LEAST / spent) + 1)
    return repeat


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
