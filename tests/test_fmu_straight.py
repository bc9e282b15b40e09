"""The written-out dynamics are the model's, operation by operation."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from hypothesis import given
from hypothesis import strategies as st

import kr16cli
import strategies as own
from kr16cli import Payload
from kr16cli.fmi import straight
from kr16cli.fmi.straight_arm import StraightArm
from kr16cli.single import Arm

_PAYLOAD = Payload(16.0, (0.02, -0.03, 0.12), (0.2, 0.3, 0.25, 0.01, -0.02, 0.03))


@lru_cache
def _arms(name: str, *, drives: bool) -> tuple[Arm, StraightArm]:
    data = kr16cli.load_data(None if name == "kr16_2" else name)
    written = straight.functions(straight.source(data))
    tilted = data.with_gravity((1.0, -2.0, -9.0))
    return (
        Arm(tilted, payload=_PAYLOAD, drives=drives),
        StraightArm(tilted, written, payload=_PAYLOAD, drives=drives),
    )


@given(q=own.generic, qd=own.rates, load=own.loads, drives=st.booleans())
def test_written_dynamics_equal_the_models(
    q: list[float], qd: list[float], load: list[float], drives: bool
) -> None:
    plain, written = _arms("kr16_2", drives=drives)
    for one, other in (
        (plain.forward_dynamics(q, qd, load), written.forward_dynamics(q, qd, load)),
        (plain.inverse_dynamics(q, qd, load), written.inverse_dynamics(q, qd, load)),
        (plain.gravity(q), written.gravity(q)),
        *zip(plain.mass_matrix(q), written.mass_matrix(q), strict=True),
    ):
        size = max(1.0, *map(abs, one))
        assert max(abs(a - b) for a, b in zip(one, other, strict=True)) <= 1e-13 * size


def test_what_is_written_has_no_number_of_the_robot_but_its_lengths() -> None:
    data = kr16cli.load_data()
    heavy = replace(data, links=tuple(replace(v, mass=2.0 * v.mass) for v in data.links))
    assert straight.source(heavy) == straight.source(data)
    long = replace(data, geometry=data.geometry._replace(d4=1.0))
    assert straight.source(long) != straight.source(data)
