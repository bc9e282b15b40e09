"""The compiled kernels of one robot, made when first asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kr16cli.kernels import _native
from kr16cli.kernels.parameters import Parameters, pack
from kr16cli.kernels.quantities import QUANTITIES, variant
from kr16cli.model.scalars import ZERO

ARM_METHODS = {"fk": 1, "ik": 1, "jacobian": 1, "jacobian_dot": 2}
"""Methods that a kernel answers as they are, unless a tool is mounted: name -> inputs."""

DYNAMIC_METHODS = {
    **{"mass_centres": 1, "mass_centre_jacobians": 1, "mass_matrix": 1, "coriolis_matrix": 2},
    **{"christoffel": 1, "gravity": 1, "bias": 2, "inverse_dynamics": 3, "forward_dynamics": 3},
    "base_wrench": 3,
}
"""The same of those that need inertial data."""


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

    def method(self, name: str, required: int, fallback: Callable[..., Any]) -> Any:
        """A callable like the method `fallback`, whose plain cases skip Python."""
        return _native.Method(self[name], required, fallback)
