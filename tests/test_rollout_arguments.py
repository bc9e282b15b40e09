"""Rollouts of bad arguments: each is named, in one line."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import kr16cli
from kr16cli.errors import InputError
from kr16cli.rollout import Variation, rollout
from rollout_cases import START


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": [np.nan] * 6}, "q[0] is nan"),
        ({"qd": [0.0, np.inf, 0.0, 0.0, 0.0, 0.0]}, "qd[1] is inf"),
        ({"q": np.zeros(5)}, "q has shape (5,)"),
        ({"tau": [0.0] * 5 + [np.nan]}, "tau[5] is nan"),
        ({"duration": 0.0}, "duration is 0 s; it must be above 0"),
        ({"duration": np.nan}, "duration is nan s"),
        ({"duration": "long"}, "duration is 'long'"),
        ({"method": "rk4", "step": -1e-3}, "step is -0.001 s; it must be above 0"),
        ({"method": "rk4"}, "method rk4 needs a step"),
        ({"method": "rk4", "step": 1e-9}, "1e+09 steps in 1 s"),
        ({"method": "euler"}, "method is 'euler'; choose rk4 or dopri5"),
        ({"rtol": 0.0}, "rtol is 0; it must be above 0"),
        ({"max_steps": 0}, "max_steps is 0"),
        ({"times": [0.0, 2.0]}, "times are 0 to 2 s; they must lie between 0 and duration = 1 s"),
        ({"times": [0.5, 0.2, 0.7]}, "times[1] is 0.2 s, before"),
        ({"times": [[0.5]]}, "times has shape (1, 1)"),
        ({"tau": np.zeros(6), "hold": 0.1}, "tau has shape (6,); with hold"),
        ({"tau": np.zeros((4, 0, 6)), "hold": 0.1}, "tau has shape (4, 0, 6); with hold"),
        ({"tau": np.zeros((4, 6)), "hold": -0.1}, "hold is -0.1 s"),
        ({"wrench": [1.0] * 5}, "wrench has shape (5,)"),
        ({"wrench": [1.0] * 6, "wrench_axes": "tool"}, "wrench_axes is 'tool'"),
        ({"q": np.zeros((3, 6)), "tau": np.zeros((2, 6))}, "leading shapes do not broadcast"),
        ({"threads": 0}, "threads is 0"),
        ({"variation": {"payload_mass": 1.0}}, "variation is a dict; expected a Variation"),
        ({"variation": Variation(payload_mass=-1.0)}, "payload_mass holds -1"),
        ({"variation": Variation(payload_com=(0, 0, 1))}, "payload_com needs"),
        ({"variation": Variation(gravity=(0, 0))}, "variation.gravity has shape (2,)"),
        ({"variation": Variation(coulomb=[np.nan] * 6)}, "variation.coulomb[0] is nan"),
        (
            {"variation": Variation(payload_mass=1.0, payload_inertia=(1, 1, 5, 0, 0, 0))},
            "payload_inertia has principal moments 1, 1, 5 kg m2; no rigid body",
        ),
    ],
)
def test_bad_argument_is_named(robot: kr16cli.Robot, change: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {"q": START, "duration": 1.0, **change}
    with pytest.raises(InputError) as caught:
        rollout(robot, **arguments)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_robot_without_inertia_cannot_move() -> None:
    data = kr16cli.load_data()
    with pytest.raises(InputError, match="no inertial data"):
        rollout(kr16cli.Robot(replace(data, links=())), START, duration=1.0)
