"""The compiled solvers of `simulate` against the plain ones, which know nothing of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import kr16cli
from kr16cli.api import Robot
from kr16cli.kernels.engine import has_native
from kr16cli.simulate import compiled
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.fast import quickest_arm
from kr16cli.simulate.loop import ClosedLoop, Sampling
from kr16cli.simulate.motion_spec import ControllerSpec, ReferenceSpec
from kr16cli.simulate.plant import Limits, Plant, Wrench
from kr16cli.simulate.run import WORK_NAMES, Run
from kr16cli.simulate.scenario import Scenario, SolverSpec
from kr16cli.simulate.torque import Constant, GravityCompensation

pytestmark = pytest.mark.skipif(not has_native(), reason="compiled kernels are not built here")

Q = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
SWING = Scenario("swing", Q, duration=1.0, output_step=0.05)
DRIVEN = replace(
    SWING,
    controller=ControllerSpec("computed_torque", frequency=10.0, sampling=Sampling(0.01, 0.004)),
    reference=ReferenceSpec("ptp", end=tuple(v + 0.4 for v in Q), acceleration=(6.0,) * 6),
)
WORLD = Wrench((30.0, -20.0, 10.0), (3.0, 1.0, -2.0), start=0.23, end=0.71)
FLANGE = replace(WORLD, axes="flange")
FIXED, ADAPTIVE = SolverSpec("RK4", step=0.002), SolverSpec("RK45", rtol=1e-10, atol=1e-11)


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether the compiled solver took each stretch since."""
    found: list[bool] = []
    ask = compiled.CompiledSolver.stepper

    def noted(self: compiled.CompiledSolver, *place: object) -> object:
        answer = ask(self, *place)  # type: ignore[arg-type]
        found.append(answer is not None)
        return answer

    monkeypatch.setattr(compiled.CompiledSolver, "stepper", noted)
    return found


def both(
    data: kr16cli.RobotData, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> tuple[Run, Run]:
    """The run by the compiled solver, and by the plain one on floats."""
    quick = simulate(data, scenario)
    with monkeypatch.context() as patch:
        patch.setenv("KR16_ENGINE", "numpy")
        return quick, simulate(data, scenario)


@pytest.mark.parametrize("solver", [FIXED, ADAPTIVE], ids=["RK4", "RK45"])
@pytest.mark.parametrize(
    ("scenario", "wrench"),
    [(SWING, None), (SWING, WORLD), (SWING, FLANGE), (DRIVEN, None), (DRIVEN, FLANGE)],
    ids=["free", "pushed", "pushed_in_flange_axes", "sampled", "sampled_and_pushed"],
)
def test_runs_are_those_of_the_plain_solvers(
    data: kr16cli.RobotData,
    scenario: Scenario,
    wrench: Wrench | None,
    solver: SolverSpec,
    served: list[bool],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quick, plain = both(data, replace(scenario, solver=solver, wrench=wrench), monkeypatch)
    half = len(served) // 2
    assert all(served[:half]) and not any(served[half:])
    assert quick.failure is plain.failure is None
    # The classical method makes the same steps; the adaptive ones keep to the tolerance.
    close = 1e-11 if solver is FIXED else 1e-8
    for name in ("q", "qd", "pose"):
        np.testing.assert_allclose(getattr(quick, name), getattr(plain, name), atol=close, rtol=0)
    for name in WORK_NAMES:
        mine, theirs = getattr(quick, name), getattr(plain, name)
        np.testing.assert_allclose(mine, theirs, atol=1e3 * close, rtol=0)
    assert np.abs(quick.work_wrench).max() > 0.1 or wrench is None
    if solver is FIXED:
        assert quick.statistics.steps == plain.statistics.steps


@pytest.mark.parametrize("joint", ["A1", "A2"])
def test_limits_are_passed_at_the_same_times(
    data: kr16cli.RobotData, joint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    i = int(joint[1]) - 1
    qd = tuple(4.0 if k == i else 0.0 for k in range(6))
    near = tuple(data.joints[k].upper - 0.05 if k == i else v for k, v in enumerate(Q))
    quick, plain = both(data, replace(SWING, q=near, qd=qd, solver=ADAPTIVE), monkeypatch)
    assert quick.events and [e[1:] for e in quick.events] == [e[1:] for e in plain.events]
    times = [[event.time for event in run.events] for run in (quick, plain)]
    np.testing.assert_allclose(*times, atol=1e-8)


def test_what_changes_between_breaks_is_left_to_the_plain_solvers(
    data: kr16cli.RobotData, served: list[bool]
) -> None:
    followed = replace(DRIVEN, controller=ControllerSpec("computed_torque", frequency=10.0))
    for scenario in (
        followed,
        replace(SWING, limits=Limits(speed=True)),
        replace(SWING, limits=Limits(joint="contact")),
        replace(SWING, drives=True),
    ):
        simulate(data, replace(scenario, duration=0.05, solver=ADAPTIVE))
    simulate(data, replace(SWING, duration=0.05, solver=SolverSpec("DOP853")))
    assert served and not any(served)


def test_torque_limits_hold_for_held_torques(
    data: kr16cli.RobotData, served: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    fast = replace(DRIVEN, controller=replace(DRIVEN.controller, frequency=60.0))  # type: ignore[type-var]
    scenario = replace(fast, limits=Limits(torque=True), solver=FIXED, payload=None)
    quick, plain = both(data, scenario, monkeypatch)
    assert served[0]
    np.testing.assert_allclose(quick.q, plain.q, atol=1e-9)
    np.testing.assert_allclose(quick.tau, plain.tau, atol=1e-6)


def test_a_torque_says_itself_whether_it_is_held(data: kr16cli.RobotData) -> None:
    robot = Robot(data)
    arm = quickest_arm(robot)
    assert Plant(arm, Constant()).holds
    assert not Plant(arm, GravityCompensation(arm)).holds
    assert not Plant(arm, lambda t, q, qd: (t,) * 6).holds  # type: ignore[arg-type]
    assert ClosedLoop.__dict__.get("steady") is None


@pytest.mark.parametrize("solver", [FIXED, ADAPTIVE], ids=["RK4", "RK45"])
def test_a_motion_beyond_the_numbers_ends_as_failed(
    data: kr16cli.RobotData, solver: SolverSpec
) -> None:
    run = simulate(data, replace(SWING, solver=solver), torque=Constant((1e300,) * 6))
    assert run.failure is not None and "\n" not in run.failure
    assert np.isfinite(run.q).all() and run.time[-1] < SWING.duration
