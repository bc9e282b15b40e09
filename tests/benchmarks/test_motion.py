"""Motions from Python and steps of the FMU, printed: `--benchmark-enable -s` measures in full.

Due on an idle machine of 2 cores: no slower than Pinocchio, 100 us for a step of the FMU under
torques, 0.3 s to open and instantiate it.
"""

from __future__ import annotations

from typing import Any

import pytest

import kr16cli
from kr16cli.bench import motion


@pytest.mark.filterwarnings("ignore")
def test_motions_beside_pinocchio_and_steps_of_the_fmu(
    benchmark: Any, robot: kr16cli.Robot
) -> None:
    pytest.importorskip("pinocchio")
    rounds, duration = (1, 0.1) if benchmark.disabled else (5, 10.0)
    figures = motion.measure(robot, rounds, duration)
    print("\n" + "\n".join(motion.lines([f._asdict() for f in figures])))
    benchmark(lambda: motion.lines([f._asdict() for f in figures]))
    ratios = {f.what: s / f.seconds for f in figures for s in f.peers.values()}
    benchmark.extra_info["ratios"] = ratios
    benchmark.extra_info["seconds"] = {f.what: f.seconds for f in figures}
    swings = [f for f in figures if "SciPy" in f.what]
    assert len(swings) == len(motion.METHODS) and all(f.peers for f in swings)
    assert len(ratios) > len(swings)  # FMUs beside each other, too
    assert all(f.seconds > 0.0 for f in figures)
