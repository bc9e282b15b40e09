"""The methods of Robot that share one signature, and motions to ask them of."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import kr16cli

CHUNK = 2048  # configurations per piece of a batch; the borders are tried one by one


class Method(NamedTuple):
    """A method of Robot: its name, how many (..., 6) arguments it takes, its trailing shape."""

    name: str
    arguments: int
    shape: tuple[int, ...]

    def __call__(self, robot: kr16cli.Robot, rows: Any, **options: Any) -> Any:
        return getattr(robot, self.name)(*rows[: self.arguments], **options)


METHODS = [
    Method("fk", 1, (4, 4)),
    Method("mass_centres", 1, (6, 3)),
    Method("jacobian", 1, (6, 6)),
    Method("mass_centre_jacobians", 1, (6, 6, 6)),
    Method("jacobian_dot", 2, (6, 6)),
    Method("mass_matrix", 1, (6, 6)),
    Method("coriolis_matrix", 2, (6, 6)),
    Method("christoffel", 1, (6, 6, 6)),
    Method("gravity", 1, (6,)),
    Method("inverse_dynamics", 3, (6,)),
    Method("forward_dynamics", 3, (6,)),
    Method("base_wrench", 3, (6,)),
]
each_method = pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)

TOOL = np.array([[0, 0, 1, 0.1], [0, 1, 0, -0.05], [-1, 0, 0, 0.2], [0, 0, 0, 1.0]])
ARGUMENT_NAMES = {"forward_dynamics": ("q", "qd", "tau")}


def argument_names(method: Method) -> tuple[str, ...]:
    return ARGUMENT_NAMES.get(method.name, ("q", "qd", "qdd"))[: method.arguments]


def motions(*shape: int, seed: int = 50) -> list[np.ndarray]:
    """q, qd and qdd (or tau) of a leading shape."""
    rng = np.random.default_rng(seed)
    return [rng.uniform(-3, 3, (*shape, 6)) for _ in range(3)]


def same(a: Any, b: Any, rel: float = 1e-13) -> None:
    """Equal up to rounding of the largest number: sine and cosine may differ in the last place."""
    a, b = np.asarray(a), np.asarray(b)
    assert a.shape == b.shape
    assert (np.isnan(a) == np.isnan(b)).all()
    if a.size:
        assert np.nanmax(np.abs(a - b), initial=0) <= rel * (1 + np.nanmax(np.abs(b), initial=0))
