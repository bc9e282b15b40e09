"""Programs of others that run FMUs, in an environment of their own: KR16_HOSTS is its Python.

Each script prints the angles that it reaches, after the word "angles".
"""

from __future__ import annotations

import csv
import os
import subprocess
from pathlib import Path

from fmus import Q

PYTHON = os.environ.get("KR16_HOSTS", "")
STOP, STEP = 0.5, 0.001


def run(*words: object, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_PRELOAD")}
    return subprocess.run(
        [str(word) for word in words], cwd=folder, env=environment | more, capture_output=True,
        text=True, check=False, timeout=300,
    )  # fmt: skip


def has(module: str, folder: Path) -> bool:
    """Whether the environment has a package."""
    return run(PYTHON, "-c", f"import {module}", folder=folder).returncode == 0


def angles(done: subprocess.CompletedProcess[str]) -> list[float]:
    """What a script printed."""
    assert done.returncode == 0, done.stderr[-500:]
    line = next(line for line in done.stdout.splitlines() if line.startswith("angles"))
    return [float(v) for v in line.split()[1:]]


def ecos(path: Path, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    where = "import ecospy, pathlib; print(pathlib.Path(ecospy.__file__).parent / 'binaries/ecos')"
    program = run(PYTHON, "-c", where, folder=folder).stdout.strip()
    Path(program).chmod(0o755)
    return run(program, "simulate", "--path", path, "--stopTime", STOP, "--stepSize", STEP,
                folder=folder, **more)  # fmt: skip


def ecos_angles(folder: Path) -> tuple[float, list[float]]:
    """Time and angles of the last row of Ecos' CSV, which has six decimals."""
    with (folder / "KR16.csv").open() as file:
        header, *rows = list(csv.reader(file))
    names = [cell.strip().removeprefix("instance::").removesuffix("[REAL]") for cell in header]
    last = dict(zip(names, rows[-1], strict=True))
    return float(last["time"]), [float(last[name]) for name in Q]


LIBCOSIM = """
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


PATHSIM = """
import sys
from pathsim import Connection, Simulation
from pathsim.blocks import Scope
from pathsim_fmi import CoSimulationFMU
robot, scope = CoSimulationFMU(sys.argv[1], instance_name="robot", dt=1e-3), Scope()
Simulation([robot, scope], [Connection(robot[0], scope[0])], dt=1e-3, log=False).run(0.5)
print("angles", *(float(robot.outputs[k]) for k in range(6)))
"""


COFMUPY = """
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


CASADI = """
import json, sys, zipfile
import numpy as np
import casadi
path, point = sys.argv[1], json.loads(sys.argv[2])
zipfile.ZipFile(path).extractall("robot")
try:
    dae = casadi.DaeBuilder("robot", "robot")
except Exception as error:
    print("refused:", str(error).splitlines()[-1])
    sys.exit()
assert dae.provides_directional_derivatives()
assert dae.x() == [f"{n}[{i}]" for n in ("q", "qd") for i in range(1, 7)]
f, J = dae.create("f", ["x", "u"], ["ode"]), dae.create("J", ["x", "u"], ["jac_ode_x"])
u = np.zeros(f.size_in(1)[0])
found = {"rates": np.array(f(point, u)).ravel(), "jacobian": np.array(J(point, u))}
print(json.dumps({name: value.tolist() for name, value in found.items()}))
"""
