"""Maps against a robot of its own: forward kinematics in words, inverse by Newton from anywhere.

Nothing here comes from the package but the map and the numbers of the parameter file.
"""

from __future__ import annotations

import numpy as np
import pytest

from kr16cli.robot_file import load_data
from kr16cli.study.engine import Local
from kr16cli.study.grid import from_abc, make_grid
from kr16cli.study.maps import MapWork
from kr16cli.study.session import finished

DATA = load_data()
G = DATA.geometry
LOWER, UPPER = (np.array([getattr(j, side) for j in DATA.joints]) for side in ("lower", "upper"))

# From the floor to the flange: a shift (m), then a turn about an axis by a sign times the angle.
CHAIN = (
    ((0.0, 0.0, 0.0), "z", -1.0),
    ((G.a1, 0.0, G.d1), "y", 1.0),
    ((G.a2, 0.0, 0.0), "y", 1.0),
    ((G.d4, 0.0, -G.a3), "x", -1.0),
    ((0.0, 0.0, 0.0), "y", 1.0),
    ((0.0, 0.0, 0.0), "x", -1.0),
)
FLANGE = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # Ry(90 deg)


def turned(axis: str, angle: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3)."""
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    made = np.tile(np.eye(3), (len(angle), 1, 1))
    made[:, i, i] = made[:, j, j] = np.cos(angle)
    made[:, j, i] = np.sin(angle)
    made[:, i, j] = -made[:, j, i]
    return made


def forward(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Flange positions (n, 3), rotations (n, 3, 3) and Jacobians (n, 6, 6)."""
    n = len(q)
    R, p = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
    axes, places = [], []
    for k, (shift, axis, sign) in enumerate(CHAIN):
        p = p + R @ np.array(shift)
        axes.append(sign * R[:, :, "xyz".index(axis)])
        places.append(p)
        R = R @ turned(axis, sign * q[:, k])
    p, R = p + R @ np.array([G.d6, 0.0, 0.0]), R @ FLANGE
    rows = [np.hstack([np.cross(a, p - o), a]) for a, o in zip(axes, places, strict=True)]
    return p, R, np.stack(rows, axis=-1)


def branches(position: np.ndarray, rotation: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """All joint vectors (n, 6) with a flange pose, angles in (-pi, pi], by damped Newton steps."""
    q = rng.uniform(-np.pi, np.pi, (250, 6))
    for _ in range(40):
        p, R, J = forward(q)
        turn = rotation @ R.swapaxes(1, 2)
        axis = 0.5 * np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0],
                               turn[:, 1, 0] - turn[:, 0, 1]], axis=-1)  # fmt: skip
        error = np.hstack([position - p, axis])
        gram = J @ J.swapaxes(1, 2) + 1e-3 * np.minimum(1.0, (error**2).sum(axis=1))[
            :, None, None
        ] * np.eye(6)
        move = np.einsum(
            "nij,nj->ni", J.swapaxes(1, 2), np.linalg.solve(gram, error[..., None])[..., 0]
        )
        q = q + move / np.maximum(1.0, np.abs(move).max(axis=1) / 0.5)[:, None]
    p, R, _ = forward(q)
    good = (np.abs(p - position).max(axis=1) < 1e-9) & (
        np.abs(R - rotation).max(axis=(1, 2)) < 1e-9
    )
    found: list[np.ndarray] = []
    for row in np.remainder(q[good] + np.pi, 2 * np.pi) - np.pi:
        if all(np.abs(np.exp(1j * row) - np.exp(1j * other)).max() > 1e-5 for other in found):
            found.append(row)
    return np.array(found).reshape(-1, 6)


def within(q: np.ndarray) -> np.ndarray:
    """Whether each of the joint vectors, or one whole turns away, is in its ranges."""
    turns = q[..., None] + 2 * np.pi * np.arange(-1, 2)
    return ((turns >= LOWER[:, None]) & (turns <= UPPER[:, None])).any(axis=2).all(axis=1)


@pytest.mark.parametrize("abc", [(20.0, 160.0, 10.0), (-70.0, 80.0, 40.0)])
def test_every_branch_that_newton_finds_is_counted_and_no_other(abc: tuple[float, ...]) -> None:
    grid = make_grid(
        DATA, 0.53, rotations=from_abc([abc]), ranges={"x": (-0.5, 1.7), "y": (0.1, 1.0)}
    )
    with finished(MapWork(DATA, "reach", grid)) as store:
        found = next(store.chunks())
    with finished(MapWork(DATA, "manipulability", grid), runner=Local(2)) as store:
        measured = next(store.chunks())
    rng = np.random.default_rng(7)
    rows = [(x, y, z) for x in grid.x for y in grid.y for z in grid.z]
    seen = set()
    for i, place in enumerate(rows):
        solutions = branches(np.array(place), grid.rotations[0], rng)
        inside = solutions[within(solutions)]
        assert (found["solutions"][i], found["branches"][i]) == (len(solutions), len(inside)), place
        seen.add(len(inside))
        if len(inside):
            w = np.abs(np.linalg.det(forward(inside)[2]))
            assert measured["best"][i] == pytest.approx(w.max(), rel=1e-5)
            assert measured["worst"][i] == pytest.approx(w.min(), rel=1e-5)
    assert {0, 2, 4} <= seen
