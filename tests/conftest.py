"""Hypothesis profiles, and the robots and engines that most tests share."""

from __future__ import annotations

import hypothesis
import pytest

import kr16cli
from kernel_cases import native

# No deadline: times belong to the benchmarks, and a shared machine stalls at random.
# The gate draws the same examples every time; `--hypothesis-profile=full` explores.
hypothesis.settings.register_profile("gate", deadline=None, derandomize=True, max_examples=100)
hypothesis.settings.register_profile("full", deadline=None, max_examples=2000)
hypothesis.settings.load_profile("gate")


@pytest.fixture(scope="session")
def data() -> kr16cli.RobotData:
    """The KR 16-2's numbers."""
    return kr16cli.load_data()


@pytest.fixture(scope="session")
def arm(data: kr16cli.RobotData) -> kr16cli.Arm:
    """The KR 16-2 on floats: rigid, without payload."""
    return kr16cli.Arm(data)


@pytest.fixture(scope="session")
def robot() -> kr16cli.Robot:
    """The KR 16-2 on arrays: rigid, without payload."""
    return kr16cli.load_robot()


@pytest.fixture(params=["numpy", pytest.param("native", marks=native)])
def engine(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Each engine in turn, forced by the environment."""
    monkeypatch.setenv("KR16_ENGINE", request.param)
    return str(request.param)
