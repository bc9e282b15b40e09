"""The compiled kernels under fuzzed layouts, many threads and many calls.

`.ci/sanitize` runs this file with the extension built for the address and undefined-behaviour
sanitizers.
"""

from __future__ import annotations

import gc
import threading
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import kr16cli
from kernel_cases import inputs, native, numpy_engine
from kr16cli.kernels.quantities import QUANTITIES

ROBOT = kr16cli.load_robot(drives=True)
ARRAYS = numpy_engine(ROBOT)


class _Named(np.ndarray):
    """A subclass, which kernels leave to the careful path."""


def _unaligned(a: np.ndarray) -> np.ndarray:
    raw = np.zeros(a.nbytes + 1, dtype=np.uint8)
    view = raw[1:].view(np.float64).reshape(a.shape)
    view[...] = a
    return view


def _locked(a: np.ndarray) -> np.ndarray:
    copy = a.copy()
    copy.setflags(write=False)
    return copy


LAYOUTS = {
    "C": lambda a: a,
    "Fortran": np.asfortranarray,
    "every second": lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
    "backward": lambda a: np.ascontiguousarray(a[..., ::-1])[..., ::-1],
    "rows apart": lambda a: np.concatenate([a, a], axis=-1)[..., : a.shape[-1]],
    "unaligned": _unaligned,
    "big-endian": lambda a: a.astype(">f8"),
    "broadcast": lambda a: np.broadcast_to(a, (2, *a.shape))[1],
    "subclass": lambda a: a.view(_Named),
    "read-only": _locked,
    "float32": lambda a: a.astype(np.float32),
    "int": lambda a: np.rint(a).astype(np.int16),
    "list": lambda a: a.tolist() if a.size else a,
}


shapes = st.lists(st.integers(0, 5), max_size=3).map(tuple) | st.sampled_from(
    [(39,), (40,), (41,), (63,), (64,), (65,), (2, 40), (7, 0, 3), (1, 1, 1, 1)]
)
layouts = st.sampled_from(list(LAYOUTS))


@native
@given(
    name=st.sampled_from([n for n in QUANTITIES if n not in ("ik", "branches")]),
    shape=shapes,
    ways=st.tuples(layouts, layouts, layouts),
    target=st.sampled_from([None, "C", "Fortran", "every second", "backward", "unaligned"]),
    threads=st.integers(1, 3),
)
def test_any_layout_gives_the_same(
    name: str, shape: tuple[int, ...], ways: tuple[str, ...], target: str | None, threads: int
) -> None:
    quantity = QUANTITIES[name]
    count = int(np.prod(shape, dtype=int))
    flat = [np.round(v, 1) for v in inputs(name, count, ROBOT)]
    flat = [np.rint(v) if way == "int" else v for v, way in zip(flat, ways, strict=False)]
    given_ = [LAYOUTS[way](v.reshape(*shape, 6)) for v, way in zip(flat, ways, strict=False)]
    exact = [np.asarray(v, dtype=np.float64) for v in given_]
    out = None
    if target is not None:
        out = LAYOUTS[target](np.full((*shape, *quantity.shape), np.nan))
    result = ROBOT._ask(name, tuple(given_), out, threads)
    assert result.shape == (*shape, *quantity.shape)
    assert out is None or result is out
    expected = ARRAYS._ask(name, tuple(exact), None, 1)
    assert np.isfinite(result).all()
    if result.size:
        assert np.abs(result - expected).max() <= 1e-12 * np.abs(expected).max() + 1e-300


@native
@given(
    shape=shapes.filter(lambda s: 0 not in s),
    way=st.sampled_from(["C", "Fortran", "rows apart", "unaligned", "read-only", "list"]),
    nearby=st.booleans(),
    threads=st.integers(1, 3),
)
def test_poses_in_any_layout(shape: tuple[int, ...], way: str, nearby: bool, threads: int) -> None:
    T, near = inputs("ik", int(np.prod(shape, dtype=int)), ROBOT)
    T, near = T.reshape(*shape, 4, 4), near.reshape(*shape, 6)
    expected = ROBOT.ik(T, near if nearby else None)
    given_ = LAYOUTS[way](T)
    assert np.array_equal(
        ROBOT.ik(given_, LAYOUTS[way](near) if nearby else None, threads=threads),
        expected,
        equal_nan=True,
    )


@native
@given(
    names=st.lists(st.sampled_from(["q", "qd", "out", "threads", "no"]), unique=True),
    wrong=st.sampled_from(
        [None, "text", object(), np.zeros(5), np.zeros((2, 7)), np.zeros((3, 6), complex), [[]], 1j]
    ),
)
def test_wrong_arguments_raise_and_do_not_crash(names: list[str], wrong: Any) -> None:
    right: dict[str, Any] = {"q": np.zeros((3, 6)), "qd": np.zeros((3, 6))}
    for name in names:
        arguments = {**right, name: wrong}
        if wrong is None and name == "out":
            assert ROBOT.bias(**arguments).shape == (3, 6)
            continue
        with pytest.raises((TypeError, ValueError)):
            ROBOT.bias(**arguments)


@native
@pytest.mark.parametrize("robot", [ROBOT, ARRAYS], ids=["native", "numpy"])
@pytest.mark.parametrize("shift", [0, 1, 6, 47, -1, -6])
def test_results_over_inputs_are_kept_apart(robot: kr16cli.Robot, shift: int) -> None:
    """`out` may share memory with an input: the result is as if it did not."""
    room = np.random.default_rng(1).uniform(-3, 3, 1300)
    q, out = (room[50 + s :][:1200].reshape(200, 6) for s in (0, shift))
    expected = robot.gravity(q.copy())
    assert np.array_equal(robot.gravity(q, out=out), expected)


@native
def test_threads_of_the_caller_do_not_disturb_each_other() -> None:
    q, qd, tau = inputs("forward_dynamics", 5000, ROBOT)
    expected = ROBOT.forward_dynamics(q, qd, tau)
    one = ROBOT.forward_dynamics(q[0], qd[0], tau[0])
    wrong: list[int] = []

    def work(number: int) -> None:
        mine = kr16cli.load_robot(drives=True)
        out = np.empty_like(expected)
        for i in range(5):
            robot = mine if i % 2 else ROBOT
            robot.forward_dynamics(q, qd, tau, threads=1 + i % 3, out=out)
            if not (out == expected).all():
                wrong.append(number)
            for _ in range(200):
                if not (robot.forward_dynamics(q[0], qd[0], tau[0]) == one).all():
                    wrong.append(number)

    workers = [threading.Thread(target=work, args=(i,)) for i in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert not wrong


def _calls(count: int) -> None:
    """Calls of every way in: results made and given, refused, and complained about."""
    q, out = np.zeros(6), np.empty((4, 4))
    bad, many, short = np.full(6, np.nan), np.zeros((100, 6)), np.zeros(5)
    M = np.empty((100, 6, 6))
    for i in range(count):
        ROBOT.fk(q)
        ROBOT.fk(q, out=out)
        ROBOT._native["fk"](bad, None, 1)
        if i % 100 == 0:
            ROBOT.mass_matrix(many, out=M, threads=2)
            ROBOT.inverse_dynamics_derivatives(q, q, q)
            for wrong in (bad, short):
                try:
                    ROBOT.fk(wrong)
                except ValueError:
                    continue
                raise AssertionError("nothing was said about a bad input")
    gc.collect()


@native
def test_python_memory_does_not_grow() -> None:
    _calls(1000)
    tracemalloc.start()
    _calls(10_000)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 20_000


def _resident() -> int:
    """Memory this process holds, bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096


@native
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no /proc to ask for memory")
def test_process_does_not_grow_over_a_million_calls() -> None:
    _calls(20_000)
    before = _resident()
    _calls(350_000)
    assert _resident() - before < 4_000_000


@native
@pytest.mark.parametrize("name", ["fk", "jacobian", "gravity", "christoffel"])
@pytest.mark.parametrize("beyond", [0, 1, 7, 8, 39])
def test_large_results_go_past_the_caches_wherever_they_begin(
    robot: kr16cli.Robot, name: str, beyond: int
) -> None:
    ask = getattr(robot, name)
    shape = ask(np.zeros(6)).shape
    width = int(np.prod(shape))
    n = (1 << 18) // width + 1 + beyond
    q = np.random.default_rng(beyond).uniform(-3.0, 3.0, (n, 6))
    want = np.concatenate([ask(part) for part in np.array_split(q, 300)])
    for offset in range(8):
        room = np.full(n * width + 16, 7.0)
        out = room[offset : offset + n * width].reshape(n, *shape)
        ask(q, out=out, threads=1 + offset % 2)
        assert (out == want).all()
        assert (room[:offset] == 7.0).all() and (room[offset + n * width :] == 7.0).all()
