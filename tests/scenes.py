"""A motion, a load and torques that tests of the simulator share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import kr16cli
from kr16cli.simulate.scenario import Scenario

BENT = Scenario(
    name="bent",
    q=(0.1, -1.0, 1.1, 0.3, 0.6, -0.2),
    qd=(0.3, -0.2, 0.4, 0.5, -0.6, 0.7),
    duration=0.5,
    output_step=0.05,
)
LOAD = kr16cli.Payload(16.0, (0.02, -0.03, 0.12), (0.4, 0.36, 0.3, 0.01, -0.02, 0.015))
TAU = (120.0, -300.0, -90.0, 6.0, -4.0, 0.02)


def torque_csv(path: Path, rows: Sequence[Sequence[float]], header: str = "") -> Path:
    """A file of torques over time; rows are time (s) and six torques (N m)."""
    names = header or "time,tau1,tau2,tau3,tau4,tau5,tau6"
    lines = [names, *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
