"""Compiled kernels of the model (native/module.c)."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

_Array = npt.NDArray[np.float64]

class Kernel:
    def __init__(
        self, name: str, parameters: Sequence[float], shape: tuple[int, ...], /
    ) -> None: ...
    def __call__(self, *inputs_out_threads: object) -> _Array | None: ...

class Method:
    def __init__(self, kernel: Kernel, required: int, fallback: Callable[..., Any], /) -> None: ...
    def __call__(self, *inputs: object, **options: object) -> Any: ...

class Stretch:
    t: float
    t_old: float
    evaluations: int
    def __init__(
        self,
        dynamics: Kernel,
        jacobian: Kernel,
        pose: Kernel,
        fixed: bool,
        rtol: float,
        atol: _Array,
        /,
    ) -> None: ...
    def start(
        self, t: float, state: _Array, torque: _Array, wrench: _Array | None, in_flange: bool, /
    ) -> None: ...
    def step(self, end: float, /) -> bool: ...
    def state(self, out: _Array, /) -> None: ...
    def at(self, times: _Array, out: _Array, /) -> None: ...

def sincos(x: _Array, sine: _Array, cosine: _Array, /) -> None: ...
def atan2(y: _Array, x: _Array, angle: _Array, /) -> None: ...
def operations() -> dict[str, int]: ...
def multiply_adds(rounds: int, /) -> tuple[float, float]: ...
def touch(array: _Array, write: bool, /) -> float | None: ...
def rollout(
    method: int,
    kernel: str,
    own_kernel: str,
    inputs: tuple[_Array, _Array, _Array, _Array | None, _Array],
    results: tuple[_Array, _Array, npt.NDArray[np.int64]],
    in_flange: bool,
    samples: int,
    settings: tuple[float, float, float, float, float],
    max_steps: int,
    threads: int,
    /,
) -> None: ...
