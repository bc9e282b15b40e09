"""The kernels built by clang for 64-bit ARM, run by an emulator, against this machine's own."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import kr16cli
from kr16cli.kernels import has_native
from kr16cli.kernels.parameters import pack, parameters
from kr16cli.kernels.quantities import QUANTITIES, variant

_EMULATOR = shutil.which("qemu-aarch64") or shutil.which("qemu-aarch64-static")
_LIBRARIES = Path("/usr/aarch64-linux-gnu")  # Debian's libc6-arm64-cross

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (_EMULATOR and _LIBRARIES.is_dir() and find_spec("ziglang") and has_native()),
        reason="needs qemu-aarch64, libc6-arm64-cross, ziglang and the compiled kernels",
    ),
]
_FLAGS = (
    *("-O3", "-std=gnu11", "-fopenmp-simd", "-ffp-contract=fast", "-fno-math-errno"),
    *("-fno-trapping-math", "-fno-signed-zeros", "-Wall", "-Wextra", "-Werror"),
)


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program of the generated kernels."""
    room = tmp_path_factory.mktemp("aarch64")
    made = [room / name for name in ("kr16_kernels.inc", "kr16_own_kernels.inc")]
    subprocess.run([sys.executable, "-m", "kr16cli.kernels.generate", *made], check=True)
    native, program = Path(__file__).parents[1] / "kr16cli" / "kernels" / "native", room / "host"
    sources = [native / f"{name}.c" for name in ("batch", "kernels_batch", "kernels_single")]
    compiler = [sys.executable, "-m", "ziglang", "cc", "-target", "aarch64-linux-gnu.2.28"]
    here = Path(__file__).with_name("kernel_host.c")
    folders = (f"-I{native}", f"-I{room}")
    subprocess.run([*compiler, *_FLAGS, *folders, here, *sources, "-o", program, "-lm"], check=True)
    return program


@pytest.mark.parametrize("name", [n for n, q in QUANTITIES.items() if "limits" not in q.inputs])
def test_kernel_answers_as_here(name: str, host: Path, robot: kr16cli.Robot) -> None:
    rng, n = np.random.default_rng(3), 101
    given = {key: rng.uniform(-3.0, 3.0, (n, 6)) for key in ("q", "qd", "qdd")}
    given |= {"tau": 100.0 * given["qdd"], "T": robot.fk(given["q"])}
    inputs = [given.get(key) for key in QUANTITIES[name].inputs]  # `near` is left out
    marks = "".join("0" if v is None else "1" for v in inputs)
    numbers = np.array(pack(parameters(robot.arm)))
    done = subprocess.run(
        [str(_EMULATOR), "-L", _LIBRARIES, host, variant(name, vertical=True, drives=False), str(n),
         marks],
        input=b"".join(v.tobytes() for v in (numbers, *inputs) if v is not None),
        capture_output=True, check=True,
    )  # fmt: skip
    kernels = robot.compiled(name)
    assert kernels is not None
    here = kernels[0](*inputs, None, 1).reshape(n, -1)
    there = np.frombuffer(done.stdout).reshape(n + 1, -1)
    batch, one = there[:n], there[n]
    if name == "ik":  # rounding decides how a free angle falls; the poses tell
        reached = np.isfinite(here).all(axis=1)
        assert (np.isfinite(batch) == np.isfinite(here)).all() and reached.any()
        poses = robot.fk(batch.reshape(n, 8, 6)[np.isfinite(batch.reshape(n, 8, 6)).all(axis=2)])
        wanted = np.repeat(given["T"], np.isfinite(batch.reshape(n, 8, 6)).all(axis=2).sum(1), 0)
        np.testing.assert_allclose(poses, wanted, atol=1e-12)
        return
    scale = np.abs(here).max()
    np.testing.assert_allclose(batch, here, atol=4e-15 * scale, rtol=0)
    np.testing.assert_allclose(one, here[0], atol=4e-15 * scale, rtol=0)
