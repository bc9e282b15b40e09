"""Suite `velocity`: Jacobians, their rates, determinant and singular families."""

from kr16cli.verify.suites.velocity import jacobians, singularities

__all__ = ["jacobians", "singularities"]
