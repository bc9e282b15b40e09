"""The library's own figures: batches into the caller's array, single calls, threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.bench.timing import Work
from kr16cli.kernels.quantities import QUANTITIES

MEASURED = (
    *("fk", "jacobian", "jacobian_dot", "mass_matrix", "coriolis_matrix", "gravity"),
    *("inverse_dynamics", "forward_dynamics", "ik"),
)


def inputs(robot: Robot, n: int, seed: int = 1) -> dict[str, Any]:
    """Random states by argument name; every pose is in reach."""
    rng = np.random.default_rng(seed)
    made = {name: rng.uniform(-3.0, 3.0, (n, 6)) for name in ("q", "qd", "qdd")}
    made["tau"] = rng.uniform(-500.0, 500.0, (n, 6))
    made["T"] = robot.fk(rng.uniform(-3.0, 3.0, (n, 6)))
    return made


def works(robot: Robot, name: str, made: Mapping[str, Any], threads: int) -> dict[str, Work]:
    """A quantity in a batch, in a batch with threads, and in one call."""
    ask: Callable[..., Any] = getattr(robot, name)
    arguments = [made[i] for i in QUANTITIES[name].inputs if i in made]
    n = len(arguments[0])
    out = np.empty((n, *QUANTITIES[name].shape))
    one = [np.ascontiguousarray(a[0]) for a in arguments]
    return {
        "batch_ns": (lambda: ask(*arguments, out=out), n),
        "threads_ns": (lambda: ask(*arguments, out=out, threads=threads), n),
        "call_ns": (lambda: ask(*one), 1),
    }


def near_the_limit(rows: Sequence[dict[str, Any]], rounds: int) -> dict[str, float]:
    """Add to each row what its kernel does a second, and which part of the machine's most.

    `share` is the time that the binding limit, arithmetic or memory, leaves no program below,
    over the time taken. Returns the limits, one core's, in 1e9/s. Compiled kernels only.
    """
    from kr16cli.bench.machine import cost, limits

    most = limits(rounds)
    for row in rows:
        name = row["quantity"]
        given = tuple(i for i in QUANTITIES[name].inputs if i != "near")
        takes = cost(name, given)
        row |= {
            "gflop_s": takes.flops / row["batch_ns"],
            "gb_s": (takes.read + takes.write) / row["batch_ns"],
            "share": takes.bound(most) * 1e9 / row["batch_ns"],
        }
    return {
        "gflop_s": most.flops / 1e9,
        "read_gb_s": most.read / 1e9,
        "write_gb_s": most.write / 1e9,
    }
