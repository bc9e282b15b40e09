"""Batch kernels: the model over many configurations, on NumPy or compiled to C."""

from __future__ import annotations

from kr16cli.kernels.engine import engine_name, has_native

__all__ = ["engine_name", "has_native"]
