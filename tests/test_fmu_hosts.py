"""FMUs in programs of others: Ecos (native), libcosim, pathsim-fmi, CoFMUPy, CasADi's importer.

They live in an environment of their own, named by KR16_HOSTS (its Python); without it nothing
runs here. `.ci/full` makes one: `pip install ecospy libcosimpy pathsim-fmi casadi fmpy`, and
`cofmupy` where it can be installed; Ecos needs Debian's libtbb12.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

import fmpy
import numpy as np
import pytest

import fmus
import hosts
import kr16cli
import native_fmus as native
from fmus import BENT, QD, TAU, Q
from kr16cli.fmi import compiling
from kr16cli.fmi.variables import Part, Start

_SYSTEM = Path("/usr/lib/x86_64-linux-gnu/libpython3.11.so.1.0")
_START = Start(q=BENT, drives=True)
_LAW = Start(q=BENT, mode=4)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not hosts.PYTHON, reason="KR16_HOSTS names no Python with the hosts"),
    pytest.mark.skipif(compiling.find_compiler() is None, reason="no C compiler"),
]
EVERY = pytest.mark.parametrize("kind", ["pythonfmu", "native 2", "native 3"])


def _made(kind: str, start: Start, part: Part = Part.ROBOT) -> Path:
    """An FMU by pythonfmu with the shim, or a native one of a version of FMI."""
    if kind == "pythonfmu":
        return fmus.file(start, part, with_shim=True)
    return native.file(int(kind.removeprefix("native ")), part, start)


@lru_cache
def _reached_in_fmpy(stop: float = hosts.STOP) -> list[float]:
    """The angles of the pythonfmu FMU, in FMPy."""
    result = fmpy.simulate_fmu(
        str(fmus.file(_START)), stop_time=stop, output_interval=hosts.STEP, output=Q
    )
    return [float(result[name][-1]) for name in Q]


@EVERY
def test_ecos_a_native_program(kind: str, tmp_path: Path) -> None:
    done = hosts.ecos(_made(kind, _START), tmp_path)
    assert done.returncode == 0, done.stdout[-500:]
    time, angles = hosts.ecos_angles(tmp_path)
    assert time >= hosts.STOP - 1.5 * hosts.STEP
    assert angles == pytest.approx(_reached_in_fmpy(time), abs=1e-6)


@pytest.mark.skipif(not _SYSTEM.exists(), reason="Debian's libpython3.11 is not installed")
def test_ecos_loads_the_fmu_without_shim_by_ld_preload(tmp_path: Path) -> None:
    path = fmus.file(_START)
    assert hosts.ecos(path, tmp_path).returncode != 0
    done = hosts.ecos(path, tmp_path, LD_PRELOAD=_SYSTEM.name)
    assert done.returncode == 0, done.stdout[-500:]
    time, angles = hosts.ecos_angles(tmp_path)
    assert angles == pytest.approx(_reached_in_fmpy(time), abs=1e-6)


@pytest.mark.skipif(not _SYSTEM.exists(), reason="Debian's libpython3.11 is not installed")
def test_shim_takes_the_libpython_it_is_told(tmp_path: Path) -> None:
    path = fmus.file(_START, with_shim=True)
    assert hosts.ecos(path, tmp_path, KR16_LIBPYTHON=str(_SYSTEM)).returncode == 0
    # Ecos goes on without the instance, whatever the FMU says; nothing may crash.
    assert hosts.ecos(path, tmp_path, KR16_LIBPYTHON="/nowhere/libpython.so").returncode == 0


@pytest.mark.parametrize("kind", ["pythonfmu", "without shim", "native 2"])
def test_libcosim_which_has_no_fmi_3(kind: str, tmp_path: Path) -> None:
    path = fmus.file(_START) if kind == "without shim" else _made(kind, _START)
    done = hosts.run(hosts.PYTHON, "-c", hosts.LIBCOSIM, path, folder=tmp_path)
    near = 1e-9 if kind == "native 2" else 1e-12
    assert hosts.angles(done) == pytest.approx(_reached_in_fmpy(), abs=near)


@EVERY
def test_pathsim(kind: str, tmp_path: Path) -> None:
    path = _made(kind, _START)
    done = hosts.run(hosts.PYTHON, "-c", hosts.PATHSIM, path, folder=tmp_path)
    angles = hosts.angles(done)
    # Its clock runs a step behind: the last step is scheduled at, not before, the end.
    near = [_reached_in_fmpy(hosts.STOP + k * hosts.STEP) for k in (-1, 0, 1)]
    assert min(max(abs(a - b) for a, b in zip(angles, q, strict=True)) for q in near) < 1e-9


@EVERY
def test_cofmupy_closes_the_loop_of_two_fmus(kind: str, tmp_path: Path) -> None:
    if not hosts.has("cofmupy", tmp_path):
        pytest.skip("KR16_HOSTS has no CoFMUPy")
    # It takes the names of files for those of the FMUs.
    paths = [tmp_path / "robot.fmu", tmp_path / "law.fmu"]
    made = _made(kind, _START), _made(kind, _LAW, Part.CONTROLLER)
    for path, source in zip(paths, made, strict=True):
        path.write_bytes(source.read_bytes())
    done = hosts.run(hosts.PYTHON, "-c", hosts.COFMUPY, *paths, json.dumps(BENT), folder=tmp_path)
    assert hosts.angles(done) == pytest.approx(_loop(), abs=1e-9)


@lru_cache
def _loop() -> list[float]:
    """The angles that pythonfmu FMUs of robot and controller reach together."""
    robot_file, law_file = fmus.file(_START), fmus.file(_LAW, Part.CONTROLLER)
    with fmus.hosted(robot_file) as robot, fmus.hosted(law_file) as law:
        for host in (robot, law):
            host.begin()
        law.set([f"q_ref[{i}]" for i in range(1, 7)], [q + 0.1 for q in BENT])
        for k in range(100):  # Jacobi: both see what the other said at the last point
            state, tau = robot.get([*Q, *QD]), law.get(TAU)
            law.set([*Q, *QD], state)
            robot.set(TAU, tau if k else [0.0] * 6)
            for host in (robot, law):
                host.slave.doStep(0.002 * k, 0.002)
        return robot.get(Q)


def test_casadi_imports_model_exchange_only_and_says_so(tmp_path: Path) -> None:
    """Its importer does not apply to co-simulation; it must refuse, not crash."""
    path = _made("pythonfmu", _START)
    done = hosts.run(hosts.PYTHON, "-c", hosts.CASADI, path, "[]", folder=tmp_path)
    assert done.returncode == 0, done.stderr[-500:]
    assert done.stdout.startswith("refused: FMU must be of ModelExchange type")


@pytest.mark.parametrize("version", [2, 3])
def test_casadi_takes_our_rates_and_our_jacobian(version: int, tmp_path: Path) -> None:
    path = native.file(version, start=Start(q=BENT))
    point = [*BENT, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    done = hosts.run(hosts.PYTHON, "-c", hosts.CASADI, path, json.dumps(point), folder=tmp_path)
    assert done.returncode == 0, done.stderr[-500:]
    found = json.loads(done.stdout.splitlines()[-1])
    robot = kr16cli.Robot(kr16cli.load_data())
    q, qd, rest = point[:6], point[6:], [0.0] * 6
    slopes = robot.forward_dynamics_derivatives(q, qd, rest)
    expected = np.block([[np.zeros((6, 6)), np.eye(6)], [slopes.dqdd_dq, slopes.dqdd_dqd]])
    assert found["rates"][:6] == qd
    assert found["rates"][6:] == pytest.approx(robot.forward_dynamics(q, qd, rest), rel=1e-12)
    gaps = np.abs(np.array(found["jacobian"]) - expected)
    assert gaps.max() <= 1e-12 * np.abs(expected).max()
