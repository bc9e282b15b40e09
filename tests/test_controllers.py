"""Controllers, and the limits, wrench and stops of the plant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import kr16cli
from kr16cli.simulate import evidence
from kr16cli.simulate.build import make_controller
from kr16cli.simulate.controllers import ComputedTorque, GravityPD, gains
from kr16cli.simulate.core import Setpoint, euler_step, rk4_step
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.loop import ClosedLoop
from kr16cli.simulate.motion_spec import ControllerSpec, ReferenceSpec
from kr16cli.simulate.plant import FADE, Limits, Plant, Wrench
from kr16cli.simulate.run import load_run
from kr16cli.simulate.scenario import Scenario, SolverSpec, TorqueSpec
from kr16cli.simulate.summary import summarise, warnings
from kr16cli.simulate.task_control import TaskComputedTorque
from kr16cli.simulate.torque import Constant
from kr16cli.single import Arm

Q = (0.2, -1.1, 1.2, 0.3, 0.6, -0.4)
STILL = Scenario("still", Q, duration=0.4, output_step=0.02)


@pytest.fixture(scope="module")
def arm(data: kr16cli.RobotData) -> Arm:
    return Arm(data)


# What must come out -------------------------------------------------------------------------


@pytest.mark.parametrize("method", evidence.ORDERS)
def test_method_has_its_order(data: kr16cli.RobotData, method: str) -> None:
    found = evidence.convergence(data, method)
    assert abs(found.slope - found.expected) < 0.15 * found.expected
    assert found.errors[-1] < found.errors[0]


@pytest.mark.parametrize(("joint", "amplitude"), [(1, 1.5), (4, 2.8)])
def test_locked_arm_is_a_pendulum(data: kr16cli.RobotData, joint: int, amplitude: float) -> None:
    found = evidence.pendulum(data, joint=joint, amplitude=amplitude, duration=1.0)
    assert np.ptp(found.expected[:, joint]) > amplitude
    assert np.abs(found.found - found.expected).max() < 1e-7


@pytest.mark.parametrize("damping", [0.3, 1.0, 1.5])
def test_joint_errors_die_out_as_designed(data: kr16cli.RobotData, damping: float) -> None:
    found = evidence.joint_error_dynamics(data, 15.0, damping)
    assert np.abs(found.found - found.expected).max() < 1e-8
    assert np.abs(found.found[0]).max() > 5 * np.abs(found.found[-1]).max()


def test_friction_and_rotors_are_compensated(data: kr16cli.RobotData) -> None:
    found = evidence.joint_error_dynamics(data, drives=True)
    assert np.abs(found.found - found.expected).max() < 1e-7


def test_every_joule_is_accounted_for(data: kr16cli.RobotData) -> None:
    run = evidence.busy_run(data, 0.12)
    works = [run.work_torque, run.work_friction, run.work_wrench, run.work_contact]
    assert min(float(np.abs(w).max()) for w in works) > 1.0
    assert np.abs(run.drift).max() < 1e-5
    assert (np.diff(run.work_friction) >= 0.0).all()


def test_decay_solves_its_equation() -> None:
    t, h = np.array([0.4]), 1e-4
    for damping in (0.2, 1.0, 3.0):
        e0, v0 = np.array([0.3]), np.array([-0.5])
        low, now, high = (
            evidence.designed_decay(t + k * h, e0, v0, 5.0, damping) for k in (-1, 0, 1)
        )
        second, first = (high - 2 * now + low) / h**2, (high - low) / (2 * h)
        assert second + 2 * damping * 5.0 * first + 25.0 * now == pytest.approx(0.0, abs=1e-6)
        start = evidence.designed_decay(np.array([0.0, h]), e0, v0, 5.0, damping)
        assert (start[1] - start[0]) / h == pytest.approx(v0, rel=1e-2)


# Steps --------------------------------------------------------------------------------------


def test_steps_on_an_oscillator() -> None:
    """x'' = -x from (1, 0): the state begins with six angles and six speeds."""

    def rates(t: float, y: Sequence[float]) -> list[float]:
        return [*y[6:12], *(-v for v in y[:6]), t]

    start = [1.0] * 6 + [0.0] * 6 + [0.0]
    y = rk4_step(rates, 2.0, start, 0.1)
    assert y[0] == pytest.approx(math.cos(0.1), abs=1e-7)
    assert y[12] == pytest.approx(0.205, abs=1e-12)  # the integral of t from 2 to 2.1
    z = euler_step(rates, 2.0, start, 0.1)
    assert (z[0], z[6], z[12]) == pytest.approx((1.0 - 0.01, -0.1, 0.2))


# Controllers --------------------------------------------------------------------------------


def test_pd_settles_where_its_spring_balances_the_push(data: kr16cli.RobotData, arm: Arm) -> None:
    """At rest Kp e = -J^T w, whatever the damping."""
    kp = [8000.0, 8000.0, 4000.0, 800.0, 800.0, 20.0]
    wrench = Wrench((0.0, 40.0, -60.0), (1.0, -2.0, 0.1))
    spec = ControllerSpec("pd", kp=tuple(kp), kd=(1500, 1500, 500, 10, 10, 0.1))
    run = simulate(
        data,
        replace(
            STILL, duration=2.0, output_step=0.5, wrench=wrench, controller=spec,
            reference=ReferenceSpec("hold"), solver=SolverSpec(rtol=1e-7, atol=1e-9),
        ),
    )  # fmt: skip
    assert np.abs(run.qd[-1]).max() < 1e-4
    pushed = np.array(arm.jacobian(run.q[-1].tolist())).T @ [0.0, 40.0, -60.0, 1.0, -2.0, 0.1]
    assert kp * (run.q[-1] - Q) == pytest.approx(pushed, abs=0.2)
    assert run.error is not None and run.error[-1, 0] > 0.002


def test_tuned_gains_are_those_of_a_single_joint(arm: Arm) -> None:
    pd = GravityPD.tuned(arm, Q, 10.0, 0.5)
    M = arm.mass_matrix(Q)
    assert pd.kp == pytest.approx([100.0 * M[i][i] for i in range(6)])
    assert pd.kd == pytest.approx([10.0 * M[i][i] for i in range(6)])
    assert gains([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 0.5)[0] == [1.0, 4.0, 9.0, 16.0, 25.0, 36.0]


def test_unknown_payload_makes_the_arm_sag(data: kr16cli.RobotData) -> None:
    load = kr16cli.Payload(16.0, (0.0, 0.0, 0.12))
    known = ControllerSpec("computed_torque", frequency=15.0)
    sag = {}
    for knows in (True, False):
        scenario = replace(
            STILL, payload=load, controller=replace(known, knows_payload=knows),
            reference=ReferenceSpec("hold"),
        )  # fmt: skip
        sag[knows] = float(np.abs(simulate(data, scenario).q - Q).max())
    assert sag[True] < 1e-9
    assert sag[False] > 0.01


def test_zero_and_gravity_are_controllers_too(data: kr16cli.RobotData, arm: Arm) -> None:
    goal = Setpoint(arm, Q)
    assert make_controller(ControllerSpec("zero"), arm, Q).torque(0.0, Q, Q, goal) == [0.0] * 6
    tau = make_controller(ControllerSpec("gravity"), arm, Q).torque(0.0, Q, Q, goal)
    assert tau == arm.gravity(Q)


# The plant ----------------------------------------------------------------------------------


def test_drives_give_no_more_than_they_have(arm: Arm) -> None:
    plant = Plant(arm, Constant(), limits=Limits(torque=True, speed=True))
    most = [j.torque for j in arm.data.joints]
    speed = [j.speed or 0.0 for j in arm.data.joints]
    assert plant.applied([1e5] * 6, [0.0] * 6) == most
    assert plant.applied([-1e5] * 6, speed) == [-m for m in most if m]
    fast = [v * (1.0 + FADE / 2.0) for v in speed]
    assert plant.applied([10.0] * 6, fast) == pytest.approx([5.0] * 6)
    assert plant.applied([-10.0] * 6, fast) == [-10.0] * 6  # braking is not limited
    assert plant.applied([10.0] * 6, [2.0 * v for v in speed]) == [0.0] * 6
    assert Plant(arm, Constant()).applied([1e9] * 6, fast) == [1e9] * 6


def test_speed_limit_is_kept_in_a_run(data: kr16cli.RobotData) -> None:
    torque = TorqueSpec("constant", (1500.0, -400.0, -130.0, 0.0, 0.0, 0.0))
    limits = Limits(speed=True)
    scenario = replace(STILL, torque=torque, limits=limits, duration=0.5, drives=True)
    top = data.joints[0].speed or 0.0
    fast = simulate(data, replace(scenario, limits=Limits()))
    run = simulate(data, scenario)
    assert np.abs(fast.qd[:, 0]).max() > 1.2 * top
    assert top < np.abs(run.qd[:, 0]).max() < (1.0 + FADE) * top * 1.01
    assert np.abs(run.drift).max() < 1e-4


def test_wrench_is_that_of_inverse_dynamics(data: kr16cli.RobotData, arm: Arm) -> None:
    """A force at the flange is a payload's weight in another coat."""
    held = Arm(data, payload=kr16cli.Payload(10.0))
    weight = Wrench((0.0, 0.0, -98.1))
    plant = Plant(arm, Constant(), wrench=weight)
    more = np.subtract(held.gravity(Q), arm.gravity(Q))
    assert plant.external(0.0, Q) == pytest.approx(-more, abs=1e-9)
    R = np.array(arm.fk(Q))[:3, :3]
    same = Wrench(tuple(R.T @ [0.0, 0.0, -98.1]), axes="flange")
    assert Plant(arm, Constant(), wrench=same).external(0.0, Q) == pytest.approx(-more, abs=1e-9)


def test_wrench_has_its_time(arm: Arm) -> None:
    plant = Plant(arm, Constant(), wrench=Wrench((1.0, 0.0, 0.0), start=0.2, end=0.4))
    on = [any(plant.external(t, Q)) for t in (0.0, 0.1999, 0.2, 0.3, 0.4, 0.5)]
    assert on == [False, False, True, True, False, False]
    assert plant.wrench is not None and plant.wrench.breaks == [0.2, 0.4]


def test_stop_is_as_stiff_as_promised_and_never_pulls(arm: Arm) -> None:
    limits = Limits("contact", depth=0.01, bounce=0.5)
    plant = Plant(arm, Constant(), limits=limits)
    upper = [j.upper for j in arm.data.joints]
    most = [j.torque or 0.0 for j in arm.data.joints]
    rest = [0.0] * 6
    assert plant.contact(upper, rest) == rest
    deep = [v + 0.01 for v in upper]
    assert plant.contact(deep, rest) == pytest.approx([-m for m in most])
    assert plant.contact(deep, [1.0] * 6) == pytest.approx([-1.5 * m for m in most])
    assert plant.contact(deep, [-3.0] * 6) == rest
    low = [j.lower - 0.005 for j in arm.data.joints]
    assert plant.contact(low, rest) == pytest.approx([0.5 * m for m in most])


def flying(**changes: object) -> Scenario:
    """A6 alone turns towards its limit at 2 rad/s, half a radian away; no gravity."""
    q = (0.0, -1.0, 1.0, 0.0, 0.5, math.radians(350.0) - 0.5)
    base = Scenario("spin", q, (0.0,) * 5 + (2.0,), gravity=(0.0,) * 3, duration=0.4)
    return replace(base, **changes)  # type: ignore[arg-type]


def test_run_ends_at_a_limit_if_asked_to(data: kr16cli.RobotData, tmp_path: object) -> None:
    run = simulate(data, flying(limits=Limits("stop")))
    assert run.failure is None and run.complete is False
    assert run.stopped == "A6 reaches its upper limit of 350 deg"
    assert run.time[-1] == pytest.approx(0.25, abs=1e-8)
    assert run.q[-1, 5] == pytest.approx(math.radians(350.0), abs=1e-8)
    assert len(run.time) == len(run.tau) == len(run.pose)
    assert run.to_csv().count("partial") == len(run.time)
    assert any(text.startswith("the run ends at 0.25 s: A6") for text in warnings(run, data))
    assert summarise(run, data)["stopped"] == run.stopped
    at_once = simulate(data, flying(q=(0.0, -1.0, 1.0, 0.0, 0.5, 6.2), limits=Limits("stop")))
    assert (len(at_once.time), at_once.stopped) == (1, run.stopped)


def test_contact_turns_a_joint_back(data: kr16cli.RobotData) -> None:
    run = simulate(data, flying(limits=Limits("contact")))
    assert [e.kind for e in run.events] == ["leave_upper", "return_upper"]
    assert run.qd[0, 5] == 2.0
    assert -2.0 < run.qd[-1, 5] < -0.2
    assert run.work_contact[-1] < 0.0
    assert np.abs(run.drift).max() < 1e-8
    springy = simulate(data, flying(limits=Limits("contact", bounce=0.0)))
    assert np.linalg.norm(springy.work_contact[-1]) < 1e-7


def test_works_may_be_left_out_of_a_state(arm: Arm) -> None:
    plant = Plant(arm, Constant((1.0,) * 6))
    full = plant.rates(0.0, [*Q, *Q, 0.0, 0.0, 0.0, 0.0])
    assert plant.rates(0.0, [*Q, *Q]) == full[:12]
    assert plant.rates(0.0, np.array([*Q, *Q, 0.0, 0.0])) == full[:14]
    assert full[12] == pytest.approx(sum(Q))


# Runs ---------------------------------------------------------------------------------------


def test_target_reached_is_an_event(data: kr16cli.RobotData) -> None:
    spec = ReferenceSpec("ptp", start=0.05, end=tuple(v + 0.1 for v in Q))
    scenario = replace(
        STILL, duration=0.8, controller=ControllerSpec("pd", frequency=25.0), reference=spec
    )
    run = simulate(data, scenario)
    (event,) = run.events
    assert (event.joint, event.kind) == ("all", "target_reached")
    i = int(np.searchsorted(run.time, event.time))
    gap = np.abs(run.q - spec.end).max(axis=1)
    assert gap[i] <= event.value
    short = simulate(data, replace(scenario, duration=0.1))
    assert not short.events
    assert any("end of the reference is not reached" in text for text in warnings(short, data))


def test_run_with_a_reference_is_saved_with_it(data: kr16cli.RobotData, tmp_path: object) -> None:
    scenario = replace(
        STILL, duration=0.1, controller=ControllerSpec("computed_torque"),
        reference=ReferenceSpec("ptp", end=tuple(v + 0.1 for v in Q)),
    )  # fmt: skip
    run = simulate(data, scenario)
    path = tmp_path / "run.npz"  # type: ignore[operator]
    path.write_bytes(run.to_npz())
    read = load_run(path)
    assert read.q_ref is not None and read.error is not None
    assert np.array_equal(read.q_ref, run.q_ref)
    assert read.scenario["controller"]["kind"] == "computed_torque"
    header = run.to_csv().split("\n", 1)[0].split(",")
    assert header[-8:-2] == [f"q_ref{i} [rad]" for i in range(1, 7)]
    assert header[-2:] == ["error_position [m]", "error_angle [rad]"]


def test_controller_that_gives_up_leaves_a_marked_part(data: kr16cli.RobotData, arm: Arm) -> None:
    """Turned by 80 deg and getting further away: the error angles meet their singularity."""
    goal = Setpoint(arm, (0.2, -1.1, 1.2, 0.3, 0.6 - 1.4, 0.0))
    control = TaskComputedTorque(arm, [0.0] * 6, [0.0] * 6)
    scenario = replace(STILL, q=(*Q[:5], 0.0), qd=(0.0, 0.0, 0.0, 0.0, 1.5, 0.0))
    run = simulate(data, scenario, torque=ClosedLoop(control, goal))
    assert run.failure is not None and "90 deg is singular" in run.failure
    assert 0.0 < run.time[-1] < 0.4
    assert np.isfinite(run.tau).all() and len(run.tau) == len(run.time)


def test_computed_torque_needs_no_numpy() -> None:
    import subprocess
    import sys

    code = (
        "import sys, kr16cli.simulate.plant, kr16cli.simulate.loop, "
        "kr16cli.simulate.task_control; print('numpy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_gain_for_each_joint_or_for_all(arm: Arm) -> None:
    one, six = ComputedTorque(arm, 4.0, 2.0), ComputedTorque(arm, [4.0] * 6, [2.0] * 6)
    goal = Setpoint(arm, [v + 0.1 for v in Q])
    assert one.torque(0.0, Q, Q, goal) == six.torque(0.0, Q, Q, goal)
