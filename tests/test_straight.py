"""The written-out functions are the model's, and serve where no kernels are compiled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import kr16cli
import strategies as own
from kr16cli import Payload
from kr16cli.errors import InputError
from kr16cli.kernels.straight import functions, straight_arm
from kr16cli.kernels.straight_arm import NAMES, StraightArm
from kr16cli.simulate.fast import FastArm, quickest_arm
from kr16cli.single import Arm

_PAYLOAD = Payload(16.0, (0.02, -0.03, 0.12), (0.2, 0.3, 0.25, 0.01, -0.02, 0.03))


@lru_cache
def _arms(name: str, *, drives: bool) -> tuple[Arm, StraightArm]:
    data = kr16cli.load_data(None if name == "kr16_2" else name)
    tilted = data.with_gravity((1.0, -2.0, -9.0))
    return (
        Arm(tilted, payload=_PAYLOAD, drives=drives),
        straight_arm(tilted, payload=_PAYLOAD, drives=drives),
    )


def _flat(value: Any) -> list[float]:
    if isinstance(value, dict):
        return _flat(list(value.values()))
    return [v for part in value for v in _flat(part)] if hasattr(value, "__iter__") else [value]


def _agree(one: Any, other: Any) -> None:
    """The same to rounding, NaN in the same places."""
    first, second = _flat(one), _flat(other)
    size = max([1.0, *(abs(v) for v in first if not math.isnan(v))])
    assert second == pytest.approx(first, rel=0.0, abs=1e-13 * size, nan_ok=True)


@pytest.mark.parametrize("name", ["kr16_2", "chapter3"])
@given(q=own.generic, qd=own.rates, load=own.loads, drives=st.booleans())
def test_written_functions_equal_the_models(
    name: str, q: list[float], qd: list[float], load: list[float], drives: bool
) -> None:
    plain, written = _arms(name, drives=drives)
    asked: list[Callable[[Arm], Any]] = [
        lambda arm: arm.fk(q),
        lambda arm: arm.frames(q),
        lambda arm: arm.frames(q, "chapter"),
        lambda arm: arm.jacobian(q),
        lambda arm: arm.jacobian(q, link=4, axes="flange"),
        lambda arm: arm.jacobian_dot(q, qd),
        lambda arm: arm.mass_matrix(q),
        lambda arm: arm.coriolis_matrix(q, qd),
        lambda arm: arm.gravity(q),
        lambda arm: arm.friction(qd),
        lambda arm: arm.inverse_dynamics(q, qd, load),
        lambda arm: arm.forward_dynamics(q, qd, load),
        lambda arm: arm.energy(q, qd),
    ]
    for ask in asked:
        _agree(ask(plain), ask(written))


@pytest.mark.parametrize("regime", own.REGIMES)
@given(pick=st.data(), near=own.generic, stretch=st.sampled_from([1.0, 1.2]))
def test_written_inverse_kinematics_is_the_models(
    regime: str, pick: st.DataObject, near: list[float], stretch: float
) -> None:
    """Branches, missing ones (beyond the arm's reach), and the singular cases told."""
    plain, written = _arms("kr16_2", drives=False)
    T = plain.fk(pick.draw(own.REGIMES[regime]))
    T[0][3] *= stretch
    one, other = plain.ik(T, near), written.ik(T, near)
    for mine, theirs in zip(one, other, strict=True):
        _agree(mine, theirs)


def test_exactly_singular_poses_are_told_alike() -> None:
    plain, written = _arms("kr16_2", drives=False)
    q = [0.0, -math.pi / 2, math.pi / 2, 0.3, 0.0, 0.0]
    one, other = (arm.ik(plain.fk(q), q) for arm in (plain, written))
    assert any(one.straight_wrist)
    assert list(map(bool, one.straight_wrist)) == list(map(bool, other.straight_wrist))


def test_one_set_of_functions_serves_every_robot_of_a_process() -> None:
    one, other = (straight_arm(kr16cli.load_data(name)) for name in ("kr16_2", "chapter3"))
    assert one._functions is other._functions
    for name in NAMES:
        assert functions()[name] is functions()[name]
    with pytest.raises(KeyError):
        functions()["nothing"]


def test_a_robot_without_inertia_is_refused_by_name() -> None:
    bare = straight_arm(replace(kr16cli.load_data(), links=()))
    assert bare.fk([0.0] * 6)
    with pytest.raises(InputError, match="no inertial data"):
        bare.gravity([0.0] * 6)


@pytest.mark.parametrize(("engine", "kind"), [("numpy", StraightArm), ("native", FastArm)])
def test_simulation_takes_the_quickest_arm(
    engine: str, kind: type[Arm], monkeypatch: pytest.MonkeyPatch
) -> None:
    if engine == "native" and not kr16cli.kernels.has_native():
        pytest.skip("no compiled kernels here")
    monkeypatch.setenv("KR16_ENGINE", engine)
    robot = kr16cli.load_robot(payload=_PAYLOAD, drives=True)
    arm = quickest_arm(robot)
    assert type(arm) is kind
    assert (arm.payload, arm.drives) == (_PAYLOAD, True)
    q, qd = [0.1, -1.0, 1.2, 0.3, 0.7, -0.2], [0.5, -0.4, 0.3, 0.8, -0.6, 0.9]
    _agree(robot.arm.forward_dynamics(q, qd, qd), arm.forward_dynamics(q, qd, qd))
