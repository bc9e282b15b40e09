"""The FMU in programs of others: Ecos (native), libcosim, pathsim-fmi, CoFMUPy, CasADi's importer.

They live in an environment of their own, named by KR16_HOSTS (its Python); without it nothing
runs here. `.ci/full` makes one: `pip install ecospy libcosimpy pathsim-fmi casadi fmpy`, and
`cofmupy` where it can be installed; Ecos needs Debian's libtbb12.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
from pathlib import Path

import fmpy
import pytest

import fmus
from fmus import BENT, QD, TAU, Q
from kr16cli.fmi import compiling
from kr16cli.fmi.variables import Part, Start

_PYTHON = os.environ.get("KR16_HOSTS", "")
_SYSTEM = Path("/usr/lib/x86_64-linux-gnu/libpython3.11.so.1.0")
_START = Start(q=BENT, drives=True)
_LAW = Start(q=BENT, mode=4)
_STOP, _STEP = 0.5, 0.001

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not _PYTHON, reason="KR16_HOSTS names no Python with the hosts"),
    pytest.mark.skipif(compiling.find_compiler() is None, reason="no C compiler for the shim"),
]


def _run(*words: object, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_PRELOAD")}
    return subprocess.run(
        [str(word) for word in words], cwd=folder, env=environment | more, capture_output=True,
        text=True, check=False, timeout=300,
    )  # fmt: skip


@pytest.fixture(scope="module")
def expected() -> list[float]:
    """The angles at the end, in FMPy."""
    result = fmpy.simulate_fmu(
        str(fmus.file(_START)), stop_time=_STOP, output_interval=_STEP, output=Q
    )
    return [float(result[name][-1]) for name in Q]


def _ecos(path: Path, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    where = "import ecospy, pathlib; print(pathlib.Path(ecospy.__file__).parent / 'binaries/ecos')"
    program = _run(_PYTHON, "-c", where, folder=folder).stdout.strip()
    Path(program).chmod(0o755)
    return _run(program, "simulate", "--path", path, "--stopTime", _STOP, "--stepSize", _STEP,
                folder=folder, **more)  # fmt: skip


def _ecos_angles(folder: Path) -> tuple[float, list[float]]:
    """Time and angles of the last row of Ecos' CSV, which has six decimals."""
    with (folder / "KR16.csv").open() as file:
        header, *rows = list(csv.reader(file))
    names = [cell.strip().removeprefix("instance::").removesuffix("[REAL]") for cell in header]
    last = dict(zip(names, rows[-1], strict=True))
    return float(last["time"]), [float(last[name]) for name in Q]


def _reached_in_fmpy(stop: float) -> list[float]:
    result = fmpy.simulate_fmu(
        str(fmus.file(_START)), stop_time=stop, output_interval=_STEP, output=Q
    )
    return [float(result[name][-1]) for name in Q]


def test_ecos_a_native_program_loads_the_shim(tmp_path: Path) -> None:
    done = _ecos(fmus.file(_START, with_shim=True), tmp_path)
    assert done.returncode == 0, done.stdout[-500:]
    time, angles = _ecos_angles(tmp_path)
    assert time >= _STOP - 1.5 * _STEP
    assert angles == pytest.approx(_reached_in_fmpy(time), abs=1e-6)


@pytest.mark.skipif(not _SYSTEM.exists(), reason="Debian's libpython3.11 is not installed")
def test_ecos_loads_the_fmu_without_shim_by_ld_preload(tmp_path: Path) -> None:
    path = fmus.file(_START)
    assert _ecos(path, tmp_path).returncode != 0
    done = _ecos(path, tmp_path, LD_PRELOAD=_SYSTEM.name)
    assert done.returncode == 0, done.stdout[-500:]
    time, angles = _ecos_angles(tmp_path)
    assert angles == pytest.approx(_reached_in_fmpy(time), abs=1e-6)


@pytest.mark.skipif(not _SYSTEM.exists(), reason="Debian's libpython3.11 is not installed")
def test_shim_takes_the_libpython_it_is_told(tmp_path: Path) -> None:
    path = fmus.file(_START, with_shim=True)
    assert _ecos(path, tmp_path, KR16_LIBPYTHON=str(_SYSTEM)).returncode == 0
    # Ecos goes on without the instance, whatever the FMU says; nothing may crash.
    assert _ecos(path, tmp_path, KR16_LIBPYTHON="/nowhere/libpython.so").returncode == 0


_LIBCOSIM = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
execution = CosimExecution.from_step_size(step_size=1_000_000)
slave = execution.add_local_slave(CosimLocalSlave(fmu_path=sys.argv[1], instance_name="robot"))
observer = CosimObserver.create_last_value()
execution.add_observer(observer)
references = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
assert {"control.mode", "limit.position[1]"} <= set(references)
assert execution.simulate_until(target_time=500_000_000)
print("angles", *observer.last_real_values(slave, [references[f"q[{i}]"] for i in range(1, 7)]))
"""


@pytest.mark.parametrize("with_shim", [False, True])
def test_libcosim(with_shim: bool, expected: list[float], tmp_path: Path) -> None:
    done = _run(_PYTHON, "-c", _LIBCOSIM, fmus.file(_START, with_shim=with_shim), folder=tmp_path)
    assert done.returncode == 0, done.stderr[-500:]
    line = next(line for line in done.stdout.splitlines() if line.startswith("angles"))
    assert [float(v) for v in line.split()[1:]] == pytest.approx(expected, abs=1e-12)


_PATHSIM = """
import sys
from pathsim import Connection, Simulation
from pathsim.blocks import Scope
from pathsim_fmi import CoSimulationFMU
robot, scope = CoSimulationFMU(sys.argv[1], instance_name="robot", dt=1e-3), Scope()
Simulation([robot, scope], [Connection(robot[0], scope[0])], dt=1e-3, log=False).run(0.5)
print("angles", *(float(robot.outputs[k]) for k in range(6)))
"""


def test_pathsim(tmp_path: Path) -> None:
    path = fmus.file(_START, with_shim=True)
    done = _run(_PYTHON, "-c", _PATHSIM, path, folder=tmp_path)
    assert done.returncode == 0, done.stderr[-500:]
    line = next(line for line in done.stdout.splitlines() if line.startswith("angles"))
    angles = [float(v) for v in line.split()[1:]]
    # Its clock runs a step behind: the last step is scheduled at, not before, the end.
    near = [_reached_in_fmpy(_STOP + k * _STEP) for k in (-1, 0, 1)]
    assert min(max(abs(a - b) for a, b in zip(angles, q, strict=True)) for q in near) < 1e-9


_COFMUPY = """
import json, sys
from cofmupy import Coordinator
def link(a, x, b, y):
    return {"source": {"id": a, "variable": x}, "target": {"id": b, "variable": y}}
links = [link("law", f"tau[{i}]", "robot", f"tau[{i}]") for i in range(1, 7)]
links += [link("robot", f"{n}[{i}]", "law", f"{n}[{i}]") for n in ("q", "qd") for i in range(1, 7)]
robot, law, bent = sys.argv[1:]
bent = json.loads(bent)
start = {f"q[{i}]": q for i, q in enumerate(bent, 1)}  # what is not said here starts at 0
start |= {f"q_ref[{i}]": q + 0.1 for i, q in enumerate(bent, 1)}
fmus = [{"id": "robot", "path": robot}, {"id": "law", "path": law, "initialization": start}]
with open("loop.json", "w") as file:
    json.dump({"fmus": fmus, "connections": links, "cosim_method": "jacobi"}, file)
coordinator = Coordinator()
coordinator.start("loop.json")
for _ in range(100):
    coordinator.do_step(0.002)
angles = (coordinator.get_variable(("robot", f"q[{i}]"))[0] for i in range(1, 7))
print("angles", *angles)
"""


def test_cofmupy_closes_the_loop_of_two_fmus(tmp_path: Path) -> None:
    if _run(_PYTHON, "-c", "import cofmupy", folder=tmp_path).returncode:
        pytest.skip("KR16_HOSTS has no CoFMUPy")
    # It takes the names of files for those of the FMUs.
    paths = [tmp_path / "robot.fmu", tmp_path / "law.fmu"]
    made = fmus.file(_START, with_shim=True), fmus.file(_LAW, Part.CONTROLLER, with_shim=True)
    for path, source in zip(paths, made, strict=True):
        path.write_bytes(source.read_bytes())
    done = _run(_PYTHON, "-c", _COFMUPY, *paths, json.dumps(BENT), folder=tmp_path)
    assert done.returncode == 0, done.stderr[-500:]
    line = next(line for line in done.stdout.splitlines() if line.startswith("angles"))
    with fmus.hosted(made[0]) as robot, fmus.hosted(made[1]) as law:
        for host in (robot, law):
            host.begin()
        law.set([f"q_ref[{i}]" for i in range(1, 7)], [q + 0.1 for q in BENT])
        for k in range(100):  # Jacobi: both see what the other said at the last point
            state, tau = robot.get([*Q, *QD]), law.get(TAU)
            law.set([*Q, *QD], state)
            robot.set(TAU, tau if k else [0.0] * 6)
            for host in (robot, law):
                host.slave.doStep(0.002 * k, 0.002)
        assert [float(v) for v in line.split()[1:]] == pytest.approx(robot.get(Q), abs=1e-9)


_CASADI = """
import sys
import casadi
try:
    casadi.Fmu("robot", sys.argv[1], {"in": ["tau[1]"]}, {"out": ["q[1]"]}, [])
except Exception as error:
    print("refused:", str(error).splitlines()[-1])
"""


def test_casadi_imports_model_exchange_only_and_says_so(tmp_path: Path) -> None:
    """Its importer does not apply to co-simulation; it must refuse, not crash."""
    folder = fmpy.extract(str(fmus.file(_START, with_shim=True)))
    done = _run(_PYTHON, "-c", _CASADI, folder, folder=tmp_path)
    assert done.returncode == 0, done.stderr[-500:]
    assert done.stdout.startswith("refused:")
