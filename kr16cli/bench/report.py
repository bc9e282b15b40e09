"""The whole benchmark as one result: own figures, peers, ratios, and what machine it was."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from typing import Any

from kr16cli.api import Robot
from kr16cli.bench import motion, own, peers, rollouts
from kr16cli.bench.timing import Work, nanoseconds
from kr16cli.kernels import engine_name

SCHEMA = "kr16.bench/1"
UNITS = {
    **dict.fromkeys(("batch_ns", "threads_ns", "call_ns", "peers"), "ns"),
    **{"gflop_s": "1e9/s", "gb_s": "1e9 B/s", "motions": "s"},
}


def bench(robot: Robot, *, n: int, threads: int, rounds: int, with_peers: bool) -> dict[str, Any]:
    """Measure. `ratio`: the fastest peer's time over the batch time of this engine.

    `call_ratio`: a call of Pinocchio over a call of this library.
    """
    made = own.inputs(robot, n)
    others = peers.works(robot, made) if with_peers else {}
    rows = [
        _row(name, own.works(robot, name, made, threads), others.get(name, {}), rounds)
        for name in own.MEASURED
    ]
    figures = []
    if with_peers:
        figures = [*motion.measure(robot, rounds), *rollouts.measure(robot, rounds)]
    limits = own.near_the_limit(rows, rounds) if engine_name() == "native" else {}
    return {
        "schema": SCHEMA,
        "robot": robot.data.name,
        "model_sha256": robot.data.sha256,
        "units": UNITS,
        "input": {"configurations": n, "threads": threads, "rounds": rounds},
        "result": {
            "engine": engine_name(),
            "machine": machine(),
            "limits": limits,
            "rows": rows,
            "motions": [figure._asdict() for figure in figures],
        },
        "warnings": ["wall times of a shared machine drift; compare the ratios of one run"],
    }


def _row(
    name: str, works: Mapping[str, Work], others: Mapping[str, Work], rounds: int
) -> dict[str, Any]:
    """One quantity, here and by the peers, all taking turns."""
    times = nanoseconds({**works, **others}, rounds)
    row: dict[str, Any] = {"quantity": name, **{key: times[key] for key in works}}
    row["peers"] = found = {peer: times[peer] for peer in others}
    row["ratio"] = min(found.values()) / row["batch_ns"] if found else None
    loop = found.get(peers.LOOP)
    row["call_ratio"] = loop / row["call_ns"] if loop else None
    return row


def machine() -> dict[str, Any]:
    """Processor, cores and Python, as far as the system says."""
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
    }


def table(answer: Mapping[str, Any]) -> str:
    """The figures as text, one quantity a line."""
    given, result = answer["input"], answer["result"]
    head = (
        f"engine {result['engine']}, {given['configurations']} configurations, ns each\n"
        f"  {'quantity':<18}{'batch':>9}{given['threads']:>3} thr{'one call':>10}{'Gop/s':>8}"
        f"{'GB/s':>6}{'of most':>8}{'ratio':>8}{'call':>6}  fastest peer"
    )
    most = result["limits"]
    foot = (
        [
            f"most of one core: {most['gflop_s']:.0f} Gop/s, memory {most['read_gb_s']:.0f} GB/s "
            f"read, {most['write_gb_s']:.0f} GB/s written; 'of most' is of the one that binds"
        ]
        if most
        else []
    )
    moving = motion.lines(result["motions"])
    foot += ["motions, least time and ratio", *moving] if moving else []
    return "\n".join([head, *map(_line, result["rows"]), *foot]) + "\n"


def _line(row: Mapping[str, Any]) -> str:
    peer = min(row["peers"], key=row["peers"].get) if row["peers"] else None
    rate = " " * 22
    if "share" in row:
        rate = f"{row['gflop_s']:8.1f}{row['gb_s']:6.1f}{100 * row['share']:6.0f} %"
    ratio = f"{row['ratio']:8.1f}" if row["ratio"] is not None else " " * 8
    ratio += f"{row['call_ratio']:6.1f}" if row["call_ratio"] is not None else " " * 6
    told = f"  {peer} {row['peers'][peer]:.0f} ns" if peer else ""
    return (
        f"  {row['quantity']:<18}{row['batch_ns']:9.1f}{row['threads_ns']:7.1f}"
        f"{row['call_ns']:10.0f}{rate}{ratio}{told}"
    ).rstrip()
