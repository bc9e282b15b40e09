"""The library's own figures: batches into the caller's array, single calls, threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.bench.timing import nanoseconds
from kr16cli.kernels import engine_name
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


def measure(robot: Robot, n: int, threads: int, rounds: int) -> list[dict[str, Any]]:
    """One row per quantity: ns per configuration in a batch, with threads, and of one call."""
    return [_row(robot, name, inputs(robot, n), threads, rounds) for name in MEASURED]


def _row(
    robot: Robot, name: str, made: Mapping[str, Any], threads: int, rounds: int
) -> dict[str, Any]:
    ask: Callable[..., Any] = getattr(robot, name)
    arguments = [made[i] for i in QUANTITIES[name].inputs if i in made]
    n = len(arguments[0])
    out = np.empty((n, *QUANTITIES[name].shape))
    one = [np.ascontiguousarray(a[0]) for a in arguments]
    row: dict[str, Any] = {
        "quantity": name,
        "batch_ns": nanoseconds(lambda: ask(*arguments, out=out), n, rounds),
        "threads_ns": nanoseconds(lambda: ask(*arguments, out=out, threads=threads), n, rounds),
        "call_ns": nanoseconds(lambda: ask(*one), 1, rounds),
    }
    if engine_name() == "native":
        from kr16cli.kernels import _native

        operations = _native.operations()[f"{name}_vertical" if QUANTITIES[name].gravity else name]
        row |= {"operations": operations, "gflop_s": operations / row["batch_ns"]}
    return row
