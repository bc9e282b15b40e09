"""Controllers that measure at instants, late and coarsely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import kr16cli
from kr16cli.simulate.core import Setpoint
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.loop import SampledLoop, Sampling
from kr16cli.simulate.motion_spec import ControllerSpec, ReferenceSpec
from kr16cli.simulate.scenario import Scenario, SolverSpec
from kr16cli.single import Arm

Q = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
STILL = Scenario("still", Q, duration=0.4, output_step=0.02)


@pytest.fixture(scope="module")
def arm(data: kr16cli.RobotData) -> Arm:
    return Arm(data)


def sampled(data: kr16cli.RobotData, sampling: Sampling | None, **changes: object) -> float:
    """Largest joint error (rad) of a PTP of 0.4 rad under computed torque."""
    end = tuple(v + 0.4 for v in Q)
    scenario = replace(
        STILL, duration=1.0,
        controller=ControllerSpec("computed_torque", frequency=10.0, sampling=sampling),
        reference=ReferenceSpec("ptp", end=end, acceleration=(6.0,) * 6),
    )  # fmt: skip
    run = simulate(data, replace(scenario, **changes))  # type: ignore[arg-type]
    assert run.failure is None and run.q_ref is not None
    return float(np.abs(run.q - run.q_ref).max())


def test_sampling_costs_accuracy_in_proportion(data: kr16cli.RobotData) -> None:
    exact = sampled(data, None)
    errors = [sampled(data, Sampling(p)) for p in (0.016, 0.008)]
    assert exact < 1e-7
    assert 1.7 < errors[0] / errors[1] < 2.3
    late = sampled(data, Sampling(0.008, delay=0.008))
    assert 2.0 < late / errors[1] < 4.0  # half a period becomes one and a half


def test_quantised_angles_and_torques_leave_a_trace(data: kr16cli.RobotData) -> None:
    fine = sampled(data, Sampling(0.008))
    coarse = sampled(data, Sampling(0.008, resolution=2e-3))
    assert coarse > fine + 5e-4


class _Counter:
    """Says how often it was asked; answers with the time."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    def torque(self, t: float, q: object, qd: object, reference: object) -> list[float]:
        self.asked.append(t)
        return [t + 0.04] * 6


def test_torque_is_held_and_late(arm: Arm) -> None:
    loop = SampledLoop(
        _Counter(), Setpoint(arm, Q), Sampling(0.1, delay=0.05, torque_step=0.1), 0.35
    )
    assert loop.breaks == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35])
    for t in loop.breaks:
        loop.sample(t, Q, Q)
    assert loop.controller.asked == pytest.approx([0.0, 0.1, 0.2, 0.3])  # type: ignore[attr-defined]
    found = [loop(t, Q, Q)[0] for t in (0.0, 0.149, 0.151, 0.2, 0.251)]
    assert found == pytest.approx([0.0, 0.0, 0.1, 0.1, 0.2])


def test_delay_of_whole_periods_meets_the_instants_exactly(arm: Arm) -> None:
    loop = SampledLoop(_Counter(), Setpoint(arm, Q), Sampling(0.1, delay=0.3), 1.0)
    assert len(loop.breaks) == 14  # 11 instants, and 3 beyond the end
    assert set(loop.instants) <= set(loop.breaks)


def test_speeds_are_differences_of_the_angles_read(arm: Arm) -> None:
    seen: list[Sequence[float]] = []

    class _Spy:
        def torque(
            self, t: float, q: Sequence[float], qd: Sequence[float], reference: object
        ) -> list[float]:
            seen.append([q[0], qd[0]])
            return [0.0] * 6

    loop = SampledLoop(_Spy(), Setpoint(arm, Q), Sampling(0.1, resolution=0.01), 1.0)
    for k in range(3):
        loop.sample(0.1 * k, [0.026 * k] * 6, [0.26] * 6)
    assert np.array(seen) == pytest.approx(np.array([[0.0, 0.26], [0.03, 0.3], [0.05, 0.2]]))


def test_adaptive_and_fixed_steps_agree_between_samples(data: kr16cli.RobotData) -> None:
    scenario = replace(
        STILL, duration=0.1,
        controller=ControllerSpec("computed_torque", sampling=Sampling(0.01, 0.004)),
        reference=ReferenceSpec("ptp", end=tuple(v + 0.2 for v in Q)),
    )  # fmt: skip
    adaptive = simulate(data, replace(scenario, solver=SolverSpec("DOP853", 1e-8, 1e-10)))
    fixed = simulate(data, replace(scenario, solver=SolverSpec("RK4", step=0.002)))
    assert np.abs(adaptive.q - fixed.q).max() < 1e-8
    assert np.array_equal(adaptive.tau.shape, fixed.tau.shape)
    assert np.abs(adaptive.tau - fixed.tau).max() < 1e-4
    assert fixed.statistics.step == 0.002 and fixed.statistics.rtol == 0.0
