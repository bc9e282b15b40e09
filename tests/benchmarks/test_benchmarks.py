"""Speed, reported and not asserted: `pytest tests/benchmarks --benchmark-enable -s`.

Each group measures one quantity on 100,000 configurations with the engine in force and, in the
same run, Pinocchio called in a Python loop; the ratio of the two is printed. Without
`--benchmark-enable` everything runs once, on few configurations, to see that it works.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kr16cli
import oracles
from kr16cli.kernels import engine_name
from pinocchio_peer import Pinocchio

MANY, LOOP, FEW = 100_000, 2_000, 50

QUANTITIES = {
    "FK": ("fk", 1),
    "J": ("jacobian", 1),
    "Jdot": ("jacobian_dot", 2),
    "M": ("mass_matrix", 1),
    "C": ("coriolis_matrix", 2),
    "G": ("gravity", 1),
    "ID": ("inverse_dynamics", 3),
    "FD": ("forward_dynamics", 3),
}

PROGRAM = """
import typer
app = typer.Typer()
@app.command()
def main(q: list[float]) -> None:
    typer.echo("1088.000 0.000 1320.000")
app()
"""


def rows(n: int, arguments: int) -> list[np.ndarray]:
    rng = np.random.default_rng(60)
    return [rng.uniform(-3, 3, (n, 6)) for _ in range(arguments)]


def measured(benchmark: Any, call: Callable[[], Any], n: int) -> float | None:
    """Seconds per configuration, median; None where benchmarks are disabled."""
    benchmark(call)
    benchmark.extra_info["configurations"] = n
    return None if benchmark.disabled else benchmark.stats.stats.median / n


def pinocchio(quantity: str, robot: kr16cli.Robot) -> Callable[..., Any]:
    """Pinocchio's own call for a quantity, with nothing of ours around it."""
    data = robot.data
    built = Pinocchio(data.geometry, oracles.bodies(data.geometry, data.links), data.gravity)
    pin, common = built.pin, (built.model, built.data)
    frame = built.flange, built.pin.LOCAL_WORLD_ALIGNED

    def jacobian_dot(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        pin.computeJointJacobiansTimeVariation(*common, q, qd)
        return pin.getFrameJacobianTimeVariation(*common, *frame)

    calls: dict[str, Callable[..., Any]] = {
        "FK": partial(pin.framesForwardKinematics, *common),
        "J": lambda q: pin.computeFrameJacobian(*common, q, *frame),
        "Jdot": jacobian_dot,
        "M": partial(pin.crba, *common),
        "C": partial(pin.computeCoriolisMatrix, *common),
        "G": partial(pin.computeGeneralizedGravity, *common),
        "ID": partial(pin.rnea, *common),
        "FD": partial(pin.aba, *common),
    }
    return calls[quantity]


def in_a_loop(theirs: Callable[..., Any], arguments: list[np.ndarray]) -> float:
    """Seconds per call of another engine, best of five loops over the rows."""
    best = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        for row in zip(*arguments, strict=True):
            theirs(*row)
        best = min(best, time.perf_counter() - start)
    return best / len(arguments[0])


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_batch(quantity: str, benchmark: Any, robot: kr16cli.Robot) -> None:
    name, arguments = QUANTITIES[quantity]
    n = FEW if benchmark.disabled else MANY
    benchmark.group = quantity
    values = rows(n, arguments)
    method = getattr(robot, name)
    out = np.empty_like(method(*values))
    ours = measured(benchmark, lambda: method(*values, out=out), n)
    assert np.isfinite(out).all()
    if ours is None:
        return
    print(f"\n{quantity}: {ours * 1e9:.0f} ns per configuration ({engine_name()})", end="")
    pytest.importorskip("pinocchio")
    loop = in_a_loop(pinocchio(quantity, robot), rows(LOOP, arguments))
    benchmark.extra_info["pinocchio_ratio"] = loop / ours
    print(f"; Pinocchio in a loop {loop * 1e9:.0f} ns, {loop / ours:.1f} times as long")


def test_inverse_kinematics(benchmark: Any, robot: kr16cli.Robot) -> None:
    """All branches. Pinocchio has no closed form to compare with."""
    n = FEW if benchmark.disabled else MANY
    benchmark.group = "IK"
    T = robot.fk(rows(n, 1)[0])
    out = np.empty((n, 8, 6))
    ours = measured(benchmark, lambda: robot.ik(T, out=out), n)
    assert np.isfinite(out).all(axis=-1).any(axis=-1).all()
    if ours is not None:
        print(f"\nIK, all branches: {ours * 1e9:.0f} ns per pose ({engine_name()})")


@pytest.mark.parametrize("quantity", ["FK", "M", "FD"])
def test_one_configuration(quantity: str, benchmark: Any, arm: kr16cli.Arm) -> None:
    """The float path of single queries."""
    name, arguments = QUANTITIES[quantity]
    benchmark.group = f"{quantity}, one"
    values = [v[0].tolist() for v in rows(1, arguments)]
    assert benchmark(getattr(arm, name), *values)


def _run(command: list[str]) -> float:
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "1088" in done.stdout
    return time.perf_counter() - start


def test_start_up(tmp_path: Path, benchmark: Any) -> None:
    """`kr16 fk` against a typer program that prints a constant, runs taken in turn."""
    program = tmp_path / "constant.py"
    program.write_text(PROGRAM, encoding="utf-8")
    query = ["--", "0", "-90", "90", "0", "0", "0"]
    constant = [sys.executable, str(program), *query]
    kr16 = [sys.executable, "-m", "kr16cli", "fk", *query]
    benchmark.group = "start-up"
    repeats = 1 if benchmark.disabled else 15
    pairs = [(_run(kr16), _run(constant)) for _ in range(repeats)]
    benchmark(lambda: _run(kr16)) if benchmark.disabled else benchmark.pedantic(_run, (kr16,))
    ours, theirs = (statistics.median(column) for column in zip(*pairs, strict=True))
    benchmark.extra_info["typer_ratio"] = ours / theirs
    print(
        f"\nkr16 fk {ours * 1e3:.0f} ms, a typer program that prints a constant "
        f"{theirs * 1e3:.0f} ms: ratio {ours / theirs:.2f} (aim 1.6)"
    )


def test_single_query_leaves_heavy_libraries_out() -> None:
    """The whole command in one interpreter, then what it has loaded."""
    script = (
        "import sys\n"
        "from kr16cli.cli import main\n"
        "sys.argv = ['kr16', 'fk', '0', '-90', '90', '0', '0', '0']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print('heavy:', sorted({'numpy', 'scipy', 'matplotlib'} & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert "1088" in done.stdout
    assert done.stdout.splitlines()[-1] == "heavy: []"
