"""Compiled kernels of the model (native/module.c)."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

_Array = npt.NDArray[np.float64]

class Kernel:
    def __init__(
        self, name: str, parameters: Sequence[float], shape: tuple[int, ...], /
    ) -> None: ...
    def __call__(self, *inputs_out_threads: object) -> _Array | None: ...

def sincos(x: _Array, sine: _Array, cosine: _Array, /) -> None: ...
def atan2(y: _Array, x: _Array, angle: _Array, /) -> None: ...
def operations() -> dict[str, int]: ...
