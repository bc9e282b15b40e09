"""What the tests of the engines share: robots, inputs by quantity, and the NumPy engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import kr16cli
from kr16cli.kernels import has_native
from kr16cli.kernels.quantities import QUANTITIES

native = pytest.mark.skipif(not has_native(), reason="no compiler at install: NumPy serves")

ROBOTS: dict[str, dict[str, Any]] = {
    "bare": {},
    "loaded": {"payload": kr16cli.Payload(16.0, (0.1, -0.05, 0.12), (0.3, 0.2, 0.25, 0.01, 0, 0))},
    "drives": {"drives": True},
}


def inputs(name: str, n: int, robot: kr16cli.Robot, seed: int = 5) -> list[np.ndarray]:
    """Random inputs (n, k) of a quantity."""
    rng = np.random.default_rng(seed)
    made = {k: rng.uniform(-3.1, 3.1, (n, 6)) for k in ("q", "qd", "qdd", "near")}
    made["tau"] = rng.uniform(-500.0, 500.0, (n, 6))
    made["T"] = robot.fk(rng.uniform(-3.1, 3.1, (n, 6)))
    middle, half = rng.uniform(-0.5, 0.5, (n, 6)), rng.uniform(1.0, 6.0, (n, 6))
    made["limits"] = np.concatenate([middle, half], axis=1)
    return [made[k] for k in QUANTITIES[name].inputs]


def numpy_engine(robot: kr16cli.Robot) -> kr16cli.Robot:
    """The same robot on the NumPy engine."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KR16_ENGINE", "numpy")
        return kr16cli.Robot(robot.data, payload=robot.payload, drives=robot.drives)
