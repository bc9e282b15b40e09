"""Reach maps beside the raw IK kernel, printed: `--benchmark-enable -s` measures in full.

Due on an idle machine: 10 million poses, judged, counted and written, at 90 % of the speed at
which the kernel alone answers the same poses from memory. One thread's processor time is
compared, which neighbours on the machine disturb less than the clock on the wall.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import kr16cli
from kr16cli.study.engine import Local
from kr16cli.study.grid import from_abc, make_grid
from kr16cli.study.maps import MapWork
from kr16cli.study.session import finished

_AT_ONCE = 4096
"""Poses the kernel gets together, as in a map: they stay in the core's cache."""


def _raw(robot: kr16cli.Robot, work: MapWork) -> tuple[float, int]:
    """Seconds that the IK kernel takes for the poses of a map, and how many it can reach."""
    pose, angles = np.zeros((_AT_ONCE, 4, 4)), np.empty((_AT_ONCE, 8, 6))
    pose[:, :3, :3], pose[:, 3, 3] = work.grid.rotations[0], 1.0
    at = np.empty((_AT_ONCE, 3))
    spent, reached = 0.0, 0
    for low in range(0, work.rows, _AT_ONCE):
        n = min(_AT_ONCE, work.rows - low)
        pose[:n, :3, 3] = work.grid.positions(low, low + n, at[:n])
        start = time.process_time()
        q = robot.ik(pose[:n], out=angles[:n])
        spent += time.process_time() - start
        reached += int(np.isfinite(q[:, :, 0]).any(axis=1).sum())
    return spent, reached


def _mapped(work: MapWork) -> tuple[float, int]:
    """Seconds of the whole map, chunks on disk included, and how many points it reaches."""
    start = time.process_time()
    with finished(work, runner=Local(1)) as store:
        spent = time.process_time() - start
        return spent, sum(int((chunk["solutions"] > 0).sum()) for chunk in store.chunks())


def test_a_reach_map_beside_the_raw_kernel(benchmark: Any, robot: kr16cli.Robot) -> None:
    rounds, step = (1, 0.1) if benchmark.disabled else (3, 0.0143)
    grid = make_grid(robot.data, step, rotations=from_abc([(0.0, 180.0, 0.0)]), kind="fixed")
    work = MapWork(robot.data, "reach", grid)
    taken = [(_raw(robot, work), _mapped(work)) for _ in range(rounds)]
    raw, mapped = (min(seconds for seconds, _ in column) for column in zip(*taken, strict=True))
    print(
        f"\n{work.rows} poses: kernel {1e9 * raw / work.rows:.1f} ns, map "
        f"{1e9 * mapped / work.rows:.1f} ns a pose, {100 * raw / mapped:.0f} % of its speed"
    )
    benchmark.extra_info["poses"] = work.rows
    benchmark.extra_info["share_of_the_kernel"] = raw / mapped
    benchmark(lambda: work.compute(0, min(work.rows, _AT_ONCE)))
    assert len({reached for pair in taken for _, reached in pair}) == 1
    assert 0 < taken[0][0][1] < work.rows
