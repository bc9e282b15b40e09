"""The machine behind the FMU: steps, phases, saved states, refusals; and against other solvers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import kr16cli
from fmus import BENT, QD, TAU, Q
from kr16cli import InputError, Payload
from kr16cli.fmi import variables, written
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.variables import Part, Start, table
from kr16cli.fmi.written_arm import WrittenArm
from kr16cli.robot import RobotData
from kr16cli.single import Arm

_NAN, _INF = math.nan, math.inf


class Driven(Machine):
    """A machine spoken to by names."""

    def put(self, **values: float) -> None:
        self.set([self._places[k.replace("__", ".")] for k in values], list(values.values()))

    def row(self, name: str, values: Sequence[float]) -> None:
        self.set([self._places[n] for n in variables.six(name)], values)

    def see(self, names: Sequence[str]) -> list[float]:
        return self.get([self._places[n] for n in names])

    def begin(self) -> Driven:
        self.setup(0.0, None, None)
        self.enter()
        self.leave()
        return self


@pytest.fixture(scope="module")
def make(data: RobotData) -> Callable[..., Driven]:
    def made(part: Part = Part.ROBOT, **start: object) -> Driven:
        chosen = Start(q=BENT, **start)  # type: ignore[arg-type]
        return Driven(table(data, chosen, part), data, make_arm, part)

    # Written-out dynamics, which are the model's (test_fmu_written), several times faster.
    make_arm = partial(WrittenArm, functions=written.functions(written.python()))
    return made


def _go(machine: Machine, *sizes: float) -> None:
    t = machine.time
    for size in sizes:
        machine.step(t, size)
        t += size


def test_motion_agrees_with_scipy_and_the_array_api(make: Callable[..., Driven]) -> None:
    load, push = Payload(8.0, (0.0, 0.0, 0.1)), [30.0, -20.0, 10.0, 1.0, 2.0, -1.0]
    tau = [50.0, -300.0, -100.0, 2.0, -1.0, 0.5]
    robot = kr16cli.load_robot().with_payload(load.mass, load.com)
    machine = make(payload=load, tau=tau).begin()
    machine.row("wrench", push)
    for k in range(10):
        machine.step(0.02 * k, 0.02)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        torque = np.array(tau) + robot.jacobian(y[:6]).T @ push
        return np.concatenate([y[6:], robot.forward_dynamics(y[:6], y[6:], torque)])

    start = np.array([*BENT, *[0.0] * 6])
    exact = solve_ivp(rates, (0.0, 0.2), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    assert np.abs(machine.see([*Q, *QD]) - exact).max() < 1e-8


@pytest.mark.parametrize("sizes", [[0.01] * 20, [0.2], [0.05, 0.001, 0.149], [0.0007] * 285])
def test_any_communication_step_gives_the_same_motion(
    make: Callable[..., Driven], sizes: list[float]
) -> None:
    fine, coarse = (
        make(qd=(1.0, 0.5, -0.5, 2.0, 1.0, -2.0)),
        make(qd=(1.0, 0.5, -0.5, 2.0, 1.0, -2.0)),
    )
    fine.begin()
    coarse.begin()
    _go(fine, *[0.001] * 200)
    rest = 0.2 - math.fsum(sizes)
    _go(coarse, *sizes, *([rest] if rest > 1e-9 else []))
    gaps = [abs(a - b) for a, b in zip(fine.see(Q), coarse.see(Q), strict=True)]
    assert max(gaps) < 1e-9


@pytest.mark.parametrize(("method", "order"), [(2, 4), (3, 1), (4, 2)])
def test_internal_step_has_the_order_of_its_method(
    make: Callable[..., Driven], method: int, order: int
) -> None:
    ends = []
    for step in (0.02, 0.01, 0.005, 0.0005):
        machine = make(qd=(1.0,) * 6, method=method, step=step).begin()
        machine.step(0.0, 0.2)
        ends.append(np.array(machine.see(Q)))
    exact = ends[-1]
    errors = [float(np.abs(q - exact).max()) for q in ends[:3]]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)
    assert math.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize("mode", [3, 4, 5])
def test_controllers_hold_and_reach_a_setpoint(make: Callable[..., Driven], mode: int) -> None:
    machine = make(mode=mode, frequency=(20.0,) * 6).begin()
    machine.step(0.0, 0.1)
    assert machine.see(Q) == pytest.approx(BENT, abs=1e-9)
    wanted = [q + 0.02 for q in BENT]
    machine.row("q_ref", wanted)
    for k in range(10):
        machine.step(0.1 + 0.1 * k, 0.1)
    assert machine.see(Q) == pytest.approx(wanted, abs=1e-4)


def test_gravity_mode_floats_and_torque_mode_falls(make: Callable[..., Driven]) -> None:
    floating, falling = make(mode=2).begin(), make().begin()
    for machine in (floating, falling):
        machine.step(0.0, 0.2)
    assert floating.see(QD) == pytest.approx([0.0] * 6, abs=1e-12)
    assert max(map(abs, falling.see(QD))) > 0.5


def test_outputs_are_those_of_the_library(make: Callable[..., Driven]) -> None:
    machine = make(qd=(1.0, 0.5, -0.5, 2.0, 1.0, -2.0), tau=(9.0,) * 6).begin()
    machine.step(0.0, 0.05)
    robot, q, qd = kr16cli.load_robot(), machine.see(Q), machine.see(QD)
    T = robot.fk(q)
    assert machine.see(variables.POSE) == pytest.approx([*T[:3, 3], *robot.rpy(T)], abs=1e-12)
    energies = machine.see(["energy.kinetic", "energy.potential"])
    assert energies == pytest.approx([float(e) for e in robot.energy(q, qd)], rel=1e-12)
    qdd = robot.forward_dynamics(q, qd, [9.0] * 6)
    assert machine.see(variables.six("qdd")) == pytest.approx(qdd, rel=1e-9)


def test_inputs_act_on_outputs_at_once(make: Callable[..., Driven]) -> None:
    machine = make().begin()
    before = machine.see(variables.six("qdd"))
    machine.row("tau", [100.0] * 6)
    assert machine.see(variables.six("tau_applied")) == [100.0] * 6
    assert machine.see(variables.six("qdd")) != before


def test_limits_are_flagged_and_enforced_if_asked(make: Callable[..., Driven]) -> None:
    free, bound = make(tau=(0, 9e3, 0, 0, 0, 0)), make(tau=(0, 9e3, 0, 0, 0, 0), limit_torque=True)
    for machine in (free, bound):
        machine.begin()
        assert machine.see(variables.six("limit.torque")) == [False, True, *[False] * 4]
    assert free.see(["tau_applied[2]"]) == [9e3]
    assert bound.see(["tau_applied[2]"])[0] < 5e3
    _go(free, *[0.01] * 30)
    assert True in free.see(variables.six("limit.position"))
    assert True in free.see(variables.six("limit.speed"))


def test_beyond_a_limit_warns_once(data: RobotData) -> None:
    said: list[str] = []
    outside = (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)  # A2 ends at 35 deg
    machine = Driven(table(data, Start(q=outside, mode=2)), data, Arm, warn=said.append).begin()
    _go(machine, 0.01, 0.01, 0.01)
    assert len(said) == 1
    assert "A2" in said[0] and "range" in said[0]


def test_contact_keeps_a_joint_near_its_range(make: Callable[..., Driven]) -> None:
    pushed = {"tau": (0, 2e3, 0, 0, 0, 0), "drives": True}
    gone, held = make(**pushed), make(limits=2, **pushed)
    for machine in (gone, held):
        machine.begin()
        _go(machine, *[0.01] * 80)
    upper = math.radians(35.0)
    assert gone.see(["q[2]"])[0] > upper + 0.2
    assert held.see(["q[2]"])[0] < upper + 0.1


def test_saved_state_restores_everything_through_json(make: Callable[..., Driven]) -> None:
    one, other = make(mode=3, drives=True), make()
    one.begin()
    one.row("q_ref", [q + 0.1 for q in BENT])
    _go(one, 0.013, 0.02)
    saved = json.loads(json.dumps(one.save()))
    _go(one, 0.05)
    expected = one.see([*Q, *QD, *variables.POSE, *variables.six("tau_applied")])
    for machine in (one, other):
        machine.restore(saved)
        assert machine.time == 0.033
        _go(machine, 0.05)
        seen = machine.see([*Q, *QD, *variables.POSE, *variables.six("tau_applied")])
        assert seen == expected


@pytest.mark.parametrize(
    "saved", [None, {}, [], "x", {"schema": "kr16.fmu_state/1", "identity": "z"}]
)
def test_foreign_states_are_refused(make: Callable[..., Driven], saved: object) -> None:
    machine = make().begin()
    before = machine.save()
    with pytest.raises(InputError, match=r"state"):
        machine.restore(saved)
    assert machine.save() == before


@pytest.mark.parametrize("value", [_NAN, _INF, -_INF])
@pytest.mark.parametrize("name", ["tau__1", "q_ref__6", "control__damping"])
def test_numbers_that_are_not_finite_are_refused(
    make: Callable[..., Driven], name: str, value: float
) -> None:
    machine = make().begin()
    full = f"{name[:-3]}[{name[-1]}]" if name[-1].isdigit() else name.replace("__", ".")
    before = machine.save()
    with pytest.raises(InputError, match=r"finite"):
        machine.set([machine._places["tau[2]"], machine._places[full]], [5.0, value])
    assert machine.save() == before
    _go(machine, 0.01)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda m: m.step(0.0, 0.01), "doStep"),
        (lambda m: m.leave(), "exitInitializationMode"),
        (lambda m: (m.enter(), m.enter()), "enterInitializationMode"),
        (lambda m: (m.begin(), m.setup(0.0, None, None)), "setupExperiment"),
        (lambda m: (m.begin(), m.step(0.0, 0.0)), "positive"),
        (lambda m: (m.begin(), m.step(0.0, -0.1)), "positive"),
        (lambda m: (m.begin(), m.step(0.0, _NAN)), "positive"),
        (lambda m: (m.begin(), m.step(0.5, 0.1)), "stands at 0.0 s"),
        (lambda m: (m.begin(), m.step(_NAN, 0.1)), "stands at 0.0 s"),
        (lambda m: (m.begin(), m.terminate(), m.step(0.0, 0.1)), "doStep"),
        (lambda m: (m.begin(), m.terminate(), m.put(control__damping=1.0)), "terminated"),
        (lambda m: (m.begin(), m.put(payload__mass=1.0)), "fixed"),
        (lambda m: m.put(payload__mass=-1.0), "payload.mass = -1 kg"),
        (lambda m: m.put(solver__step=0.0), "solver.step"),
        (lambda m: m.put(control__mode=9), "1 to 5"),
        (lambda m: (m.put(**{"payload.inertia.xx": 5.0}), m.enter(), m.leave()), "inertia"),
        (lambda m: m.set([m._places["q[1]"]], [0.0]), "output"),
        (lambda m: m.get([999]), "999"),
        (lambda m: m.set([-1], [0.0]), "-1"),
        (lambda m: m.setup(_NAN, None, None), "start time"),
        (lambda m: m.setup(1.0, 0.5, None), "stop time"),
        (lambda m: m.setup(0.0, None, 0.0), "tolerance"),
        (
            lambda m: (m.setup(0.0, 0.01, None), m.enter(), m.leave(), m.step(0.0, 0.02)),
            "past the stop time, 0.01 s",
        ),
        (lambda m: m.get([0], ("String",)), "Real"),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_reason(
    make: Callable[..., Driven], act: Callable[[Driven], object], words: str
) -> None:
    with pytest.raises(InputError) as refused:
        act(make())
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_motion_beyond_numbers_fails_with_time_and_state(make: Callable[..., Driven]) -> None:
    machine = make(tau=(0.0,) * 5 + (1e6,)).begin()
    with pytest.raises(InputError, match=r"leaves the range of numbers.*rad/s"):
        _go(machine, *[0.1] * 100)
    with pytest.raises(InputError, match=r"failed"):
        machine.step(machine.time, 0.1)


def test_controller_alone_gives_the_torques_of_the_robots_own(make: Callable[..., Driven]) -> None:
    robot, alone = make(mode=4), make(part=Part.CONTROLLER, mode=4)
    wanted = [q + 0.05 for q in BENT]
    for machine in (robot, alone):
        machine.begin()
        machine.row("q_ref", wanted)
    _go(robot, 0.03)
    alone.row("q", robot.see(Q))
    alone.row("qd", robot.see(QD))
    _go(alone, 0.03)
    assert alone.see(TAU) == robot.see(variables.six("tau_applied"))


def test_friction_is_followed_with_order_two_and_sticks(make: Callable[..., Driven]) -> None:
    sliding = []
    for step in (2e-3, 1e-3, 5e-4, 1.25e-4):
        machine = make(drives=True, step=step).begin()
        machine.step(0.0, 0.2)
        sliding.append(np.array(machine.see(Q)))
    errors = [float(np.abs(q - sliding[-1]).max()) for q in sliding[:3]]
    assert errors[2] < 1e-5
    assert 3.0 < errors[0] / errors[1] < 6.0
    assert 3.0 < errors[1] / errors[2] < 6.0
    stuck = make(drives=True, mode=2, qd=(0.2, -0.2, 0.3, 0.5, -1.0, 1.0)).begin()
    _go(stuck, 0.5, 0.5)
    assert max(map(abs, stuck.see(QD))) < 1e-9


def test_explicit_steps_of_1_ms_chatter_where_rosenbrocks_do_not(
    make: Callable[..., Driven],
) -> None:
    speeds = []
    for method in (1, 2):
        machine = make(
            drives=True, mode=2, qd=(0.0, 0.0, 0.0, 0.5, -1.0, 1.0), method=method
        ).begin()
        machine.step(0.0, 0.5)
        speeds.append(max(map(abs, machine.see(QD))))
    assert speeds[0] < 1e-6
    assert speeds[1] > 1e-3
