"""The compiled kernels of one robot, made when first asked for."""

from __future__ import annotations

from typing import Any

from kr16cli.kernels import _native
from kr16cli.kernels.parameters import Parameters, pack
from kr16cli.kernels.quantities import QUANTITIES, variant
from kr16cli.model.scalars import ZERO


class NativeKernels(dict[str, Any]):
    """Quantity name -> kernel(*inputs, out, threads).

    A kernel answers what needs no care (float64, contiguous, equal leading axes, finite) and
    returns None for anything else, which the caller then checks and converts.
    """

    def __init__(self, parameters: Parameters) -> None:
        super().__init__()
        self._numbers = pack(parameters)
        self._vertical = parameters.gravity[0] is ZERO and parameters.gravity[1] is ZERO
        self._drives = bool(parameters.coulomb)

    def __missing__(self, name: str) -> Any:
        kernel = variant(name, vertical=self._vertical, drives=self._drives)
        self[name] = _native.Kernel(kernel, self._numbers, QUANTITIES[name].shape)
        return self[name]
