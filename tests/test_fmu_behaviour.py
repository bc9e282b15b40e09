"""How the FMU behaves in FMPy: motion, instances, states, refusals, a closed loop of two."""

from __future__ import annotations

import ast
import math
import shutil
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

import fmus
import kr16cli
from fmus import BENT, QD, TAU, Q
from kr16cli.fmi import build, choices, compiling, quick, reading
from kr16cli.fmi.variables import Part, Start
from kr16cli.simulate.experiment import simulate
from kr16cli.simulate.scenario import Scenario, load_scenario

_HELD = Start(q=BENT, mode=4)


def test_motion_is_the_simulators() -> None:
    scenario = Scenario("swing", BENT, duration=1.0, output_step=0.05)
    run = simulate(kr16cli.load_data(), scenario)
    result = fmpy.simulate_fmu(
        str(fmus.file()), stop_time=1.0, output_interval=0.05, output=[*Q, *QD, "energy.kinetic"]
    )
    for k, name in enumerate(Q):
        assert np.abs(result[name] - run.q[:, k]).max() < 1e-7
    assert np.abs(result["energy.kinetic"] - run.energy_kinetic).max() < 1e-4


@pytest.mark.parametrize("name", ["drop_gravity_compensated", "payload_16kg"])
def test_scenario_sets_the_start_values(name: str, tmp_path: Path) -> None:
    data, scenario = kr16cli.load_data(), load_scenario(name)
    options, notes = choices.options(data, scenario, Part.ROBOT, None)
    path = tmp_path / "s.fmu"
    path.write_bytes(build.build(data, options))
    fmu = reading.read(path)
    assert notes == []
    assert fmu.number("stopTime") == scenario.duration
    run = simulate(data, scenario)
    result = fmpy.simulate_fmu(str(path), stop_time=scenario.duration, output_interval=0.01,
                               output=Q)  # fmt: skip
    last = [result[name][-1] for name in Q]
    assert last == pytest.approx(run.q[-1], abs=2e-3)


_MANY = """
import gc, sys
from pathlib import Path
import fmus
path = Path(sys.argv[1])
folder = None
for k in range(120):
    gc.collect()  # Python then has no references to spare for those the wrapper gives away
    host = fmus.Host(path, folder)
    folder = host.folder
    host.begin()
    host.steps(2, 0.001)
    try:
        host.set(["tau[1]"], [float("nan")])
        raise SystemExit("NaN was taken")
    except Exception as error:
        assert "failed with status" in str(error)
    host.slave.reset()
    host.begin()
    host.steps(1, 0.001)
    host.slave.terminate()
    host.free()
several = [fmus.Host(path, folder) for _ in range(10)]
for k, host in enumerate(several):
    host.begin(payload__mass=float(k))
    host.set(["tau[1]"], [100.0])
for host in several:
    host.steps(5, 0.01)
print(len({host.get(["q[1]"])[0] for host in several}))
for host in several:
    host.free()
"""


@pytest.mark.slow
@pytest.mark.parametrize("with_shim", fmus.SHIM)
def test_many_runs_failures_and_instances_in_one_process(with_shim: bool) -> None:
    assert fmus.isolated(_MANY, fmus.file(with_shim=with_shim)).strip() == "10"


_COUNTED = """
import gc, sys
from pathlib import Path
import fmus
path = Path(sys.argv[1])

def living():
    gc.collect()
    return sum(type(thing).__name__ == "KR16" for thing in gc.get_objects())

counts = []
first = fmus.Host(path)
for k in range(3):
    host = fmus.Host(path, first.folder)
    counts.append(living())
    host.begin()
    for _ in range(5):
        try:
            host.set(["tau[1]"], [float("nan")])
        except Exception:
            pass
        counts.append(living())
    host.slave.reset()
    counts.append(living())
    host.free()
    counts.append(living())
print(counts)
"""


@pytest.mark.parametrize("with_shim", fmus.SHIM)
def test_failures_and_resets_neither_free_nor_leak_an_instance(with_shim: bool) -> None:
    counts = ast.literal_eval(fmus.isolated(_COUNTED, fmus.file(with_shim=with_shim)))
    assert counts == [2, *[2] * 5, 2, 1] * 3


_BOTH = """
import sys
from pathlib import Path
import fmus
import kr16cli
before = kr16cli.load_data().geometry
hosts = [fmus.Host(Path(p)) for p in sys.argv[1:]]
for host in hosts:
    host.begin()
    host.steps(10, 0.01)
print([host.get(["q[2]"])[0] for host in hosts])
"""


@pytest.mark.parametrize("with_shim", fmus.SHIM)
def test_two_builds_live_beside_each_other_and_kr16cli(with_shim: bool) -> None:
    falling, floating = fmus.file(with_shim=with_shim), fmus.file(Start(q=BENT, mode=2))
    alone = []
    for path in (falling, floating):
        with fmus.hosted(path) as host:
            host.begin()
            host.steps(10, 0.01)
            alone += host.get(["q[2]"])
    together = ast.literal_eval(fmus.isolated(_BOTH, falling, floating))
    assert together == alone
    assert abs(alone[0] - alone[1]) > 1e-2


@pytest.mark.parametrize("with_shim", fmus.SHIM)
def test_state_set_back_serialized_and_reset_repeats_the_run(with_shim: bool) -> None:
    path = fmus.file(Start(q=BENT, mode=3, drives=True), with_shim=with_shim)
    with fmus.hosted(path) as one, fmus.hosted(path) as other:
        for host in (one, other):
            host.begin()
        one.set(["q_ref[3]"], [1.3])
        one.steps(7, 0.01)
        state = one.slave.getFMUstate()
        content = one.slave.serializeFMUstate(state)
        one.steps(5, 0.013, 0.07)
        expected = one.get([*Q, *QD])
        one.slave.setFMUstate(state)
        one.steps(5, 0.013, 0.07)
        assert one.get([*Q, *QD]) == expected
        other.slave.setFMUstate(other.slave.deSerializeFMUstate(content))
        other.steps(5, 0.013, 0.07)
        assert other.get([*Q, *QD]) == expected
        one.slave.reset()
        one.begin()
        one.set(["q_ref[3]"], [1.3])
        one.steps(7, 0.01)
        one.steps(5, 0.013, 0.07)
        assert one.get([*Q, *QD]) == expected


def _refused(host: fmus.Host, act: Any) -> int:
    """Status with which the FMU refuses; it must say why in the log, in one line."""
    said = len(host.messages)
    with pytest.raises(FMICallException) as refused:
        act()
    assert any(status == 3 and text for status, text in host.messages[said:])
    return int(refused.value.status)


@pytest.mark.parametrize("with_shim", fmus.SHIM)
def test_bad_calls_end_in_an_error_with_a_reason_in_the_log(with_shim: bool) -> None:
    expected = 3 if with_shim else 4  # pythonfmu alone knows no error but the fatal one
    with fmus.hosted(fmus.file(with_shim=with_shim)) as host:
        assert _refused(host, lambda: host.steps(1, 0.01)) == expected
        assert _refused(host, lambda: host.set(["q_start[1]"], [math.inf])) == expected
        host.begin()
        for act in (
            lambda: host.set(["tau[1]"], [math.nan]),
            lambda: host.steps(1, 0.0),
            lambda: host.steps(1, -0.01),
            lambda: host.steps(1, math.nan),
            lambda: host.steps(1, 0.01, 5.0),
            lambda: host.set(["payload.mass"], [1.0]),
            lambda: host.slave.getReal([12345]),
            host.slave.enterInitializationMode,
            lambda: host.slave.setFMUstate(host.slave.deSerializeFMUstate(b"{}")),
        ):
            assert _refused(host, act) == expected
        host.steps(3, 0.01)
        assert all(map(math.isfinite, host.get(Q)))


@pytest.mark.skipif(compiling.find_compiler() is None, reason="no C compiler for the shim")
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda r: (r / "slavemodule.txt").unlink(), "slavemodule.txt"),
        (lambda r: next(r.glob("kr16_slave_*.py")).unlink(), "kr16_slave_"),
        (lambda r: next(r.glob("kr16_core_*/cargo.json")).write_text("{"), "unpack the FMU anew"),
        (lambda r: shutil.rmtree(next(r.glob("kr16_core_*"))), "No module named"),
        (shutil.rmtree, "unpack it anew"),
    ],
)
def test_spoilt_resources_are_an_error_with_a_reason(
    spoil: Any, words: str, tmp_path: Path
) -> None:
    shutil.unpack_archive(fmus.file(with_shim=True), tmp_path, "zip")
    spoil(tmp_path / "resources")
    code = """
import sys
from pathlib import Path
import fmpy, fmus
messages = []
fmus.Host._log = lambda self, e, n, status, category, text: messages.append(text.decode())
try:
    fmus.Host(Path(sys.argv[1]), sys.argv[2])
    print("instantiated")
except Exception:
    print("refused:", *messages)
"""
    said = fmus.isolated(code, fmus.file(with_shim=True), tmp_path)
    assert said.startswith("refused:")
    assert words in said


def test_closed_loop_of_two_fmus_tends_to_the_monolithic_run_with_order_one() -> None:
    robot, controller = fmus.file(), fmus.file(_HELD, Part.CONTROLLER)
    wanted = [q + 0.1 for q in BENT]
    references = [f"q_ref[{i}]" for i in range(1, 7)]
    whole = fmus.file(_HELD)
    with fmus.hosted(whole) as host:
        host.begin()
        host.set(references, wanted)
        host.steps(100, 0.002)
        exact = np.array(host.get(Q))
    errors = []
    for size in (0.008, 0.004, 0.002):
        with fmus.hosted(robot) as plant, fmus.hosted(controller) as law:
            for host in (plant, law):
                host.begin()
            law.set(references, wanted)
            for k in range(round(0.2 / size)):
                law.set([*Q, *QD], plant.get([*Q, *QD]))
                plant.set(TAU, law.get(TAU))
                for host in (plant, law):
                    host.slave.doStep(k * size, size)
            errors.append(float(np.abs(np.array(plant.get(Q)) - exact).max()))
    assert errors[2] < 5e-3
    assert math.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.25)
    assert math.log2(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.25)


_RUN = """
import sys
from pathlib import Path
import fmus
host = fmus.Host(Path(sys.argv[1]), sys.argv[2])
host.begin(control__mode=5, drives=True)
host.set([f"q_ref[{i}]" for i in range(1, 7)], [q + 0.1 for q in fmus.BENT])
host.steps(5, 0.003)
quick = [n for n in sys.modules if n.startswith("kr16_core_") and n.endswith(".quick")]
print(len(quick) == 1, host.get([*fmus.Q, *fmus.QD]))
"""


@pytest.mark.skipif(
    compiling.find_compiler() is None or quick.headers() is None, reason="nothing is compiled"
)
def test_what_is_compiled_changes_no_bit_of_the_motion(tmp_path: Path) -> None:
    path = fmus.file(with_shim=True)
    shutil.unpack_archive(path, tmp_path, "zip")
    (module,) = (tmp_path / "resources").glob(f"kr16_core_*/{quick.MODULE}")
    quickly = fmus.isolated(_RUN, path, tmp_path).split(maxsplit=1)
    module.write_bytes(b"of another machine")  # it cannot be loaded
    plainly = fmus.isolated(_RUN, path, tmp_path).split(maxsplit=1)
    assert (quickly[0], plainly[0]) == ("True", "False")
    assert quickly[1] == plainly[1]
