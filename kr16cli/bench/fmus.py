"""What the FMUs cost: the native one in C and through FMPy, beside pythonfmu's and MuJoCo."""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kr16cli.api import Robot
from kr16cli.assets import asset
from kr16cli.bench.rollouts import STEP, Figure
from kr16cli.bench.timing import least
from kr16cli.errors import MissingPartError
from kr16cli.export.mjcf import mjcf
from kr16cli.fmi import timed
from kr16cli.fmi.timed import Slave
from kr16cli.fmi.variables import Part, Start

_MODES = {"torques": 1, "computed torque": 4, "task space": 5}
"""What the FMU's drives do: control.mode."""

_PEER = "FMU by pythonfmu"
_RUN = 1.0
_COUNT = 200
"""Steps in a row: short enough to find the machine undisturbed now and then."""

_TURNS = 5
"""Turns in a round."""


def measure(robot: Robot, rounds: int) -> list[Figure]:
    """Seconds of a step, a right-hand side, an instance and a run of the native FMU, and of peers.

    Least time of `rounds`, the contenders taking turns. Nothing without FMPy, or where no native
    FMU can be built; no figures in C without a C compiler.
    """
    if find_spec("fmpy") is None:
        return []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="kr16_bench_")))
        try:
            native = _native(robot, folder)
        except MissingPartError:
            return []
        peer = _by_pythonfmu(robot, folder)
        paths = {"": native} | ({} if peer is None else {_PEER: peer})
        found = [*_in_c(robot, native, folder, rounds)]
        for name, mode in _MODES.items():
            contenders = {
                k: stack.enter_context(Slave(path, mode, STEP)) for k, path in paths.items()
            }
            calls = {k: partial(slave.steps, _COUNT) for k, slave in contenders.items()}
            found.append(_figure(f"FMU, doStep of 1 ms through FMPy, {name}", calls, rounds))
        runs = {k: partial(timed.run, path, _RUN, STEP) for k, path in paths.items()}
        times = least(runs, min(rounds, 3))
        return [*found, Figure(f"simulate_fmu of {_RUN:g} s at 1 ms", times.pop(""), times)]


def _figure(what: str, calls: Mapping[str, Callable[[], object]], rounds: int) -> Figure:
    """Of calls that do `_COUNT` of it."""
    times = {name: spent / _COUNT for name, spent in least(calls, _TURNS * rounds).items()}
    return Figure(what, times.pop(""), times)


def _native(robot: Robot, folder: Path) -> Path:
    from kr16cli.fmi.native import build, library

    options = build.Options(_start(robot), platforms=library.platforms(library.HOST, 2))
    path = folder / "native.fmu"
    path.write_bytes(build.build(robot.data, options))
    return path


def _start(robot: Robot) -> Start:
    """Where FMUs start that are built without a scenario."""
    from kr16cli.fmi import choices

    return choices.options(robot.data, None, Part.ROBOT, None)[0].start


def _by_pythonfmu(robot: Robot, folder: Path) -> Path | None:
    from kr16cli.fmi import build, choices, compiling

    options, _ = choices.options(robot.data, None, Part.ROBOT, compiling.find_compiler())
    path = folder / "python.fmu"
    try:
        path.write_bytes(build.build(robot.data, options))
    except MissingPartError:
        return None
    return path


def _in_c(robot: Robot, path: Path, folder: Path, rounds: int) -> Iterator[Figure]:
    """The same calls from a host in C, which is compiled here."""
    from kr16cli.fmi import compiling

    compiler = compiling.find_compiler()
    if compiler is None:
        return
    text = asset("fmu/host/calls.c").read_text(encoding="utf-8")
    library = folder / "calls.so"
    library.write_bytes(compiling.library(compiler, "a host", {"calls.c": text}, ()))
    host = ctypes.CDLL(str(library))
    with Slave(path, 1, STEP) as slave, Slave(path, 1, STEP, exchange=True) as model:
        dll = slave.fmu.dll
        calls: dict[str, Callable[[], object]] = {"": _steps(host, dll, slave)}
        peer = _mujoco(robot)
        if peer is not None:
            calls["MuJoCo, mj_step by RK4"] = peer
        yield _figure("native FMU, doStep of 1 ms in C", calls, rounds)
        model.fmu.enterContinuousTimeMode()
        x = (ctypes.c_double * 12)()
        model.fmu.getContinuousStates(x, 12)
        exchange = model.fmu.dll
        rates = partial(
            _checked, host.rates, exchange.fmi2SetContinuousStates, exchange.fmi2GetDerivatives,
            ctypes.c_void_p(model.fmu.component), x, ctypes.c_long(_COUNT),
        )  # fmt: skip
        yield _figure("native FMU, right-hand side in C", {"": rates}, rounds)
        make = partial(
            _checked, host.instances, dll.fmi2Instantiate, dll.fmi2FreeInstance,
            ctypes.c_char_p(slave.token.encode()), ctypes.c_long(_COUNT),
        )  # fmt: skip
        yield _figure("native FMU, instantiate and free in C", {"": make}, rounds)


def _steps(host: ctypes.CDLL, dll: Any, slave: Slave) -> Callable[[], None]:
    def call() -> None:
        component, count = ctypes.c_void_p(slave.fmu.component), ctypes.c_long(_COUNT)
        now, size = ctypes.c_double(slave.time), ctypes.c_double(STEP)
        _checked(host.steps, dll.fmi2DoStep, component, now, size, count)
        slave.time += _COUNT * STEP

    return call


def _checked(call: Any, *arguments: Any) -> None:
    failed = call(*arguments)
    if failed:
        raise RuntimeError(f"{failed} of {_COUNT} calls of the FMU failed")


def _mujoco(robot: Robot) -> Callable[[], Any] | None:
    """As many steps of the same arm from the same start, limits and contacts off."""
    try:
        import mujoco
    except ImportError:
        return None
    model = mujoco.MjModel.from_xml_string(mjcf(robot.data))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = STEP
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    data.qpos[:] = _start(robot).q
    return lambda: mujoco.mj_step(model, data, _COUNT)
