"""Batch kernels: the model over many configurations, and the choice of the engine that runs it."""

from __future__ import annotations

from kr16cli.kernels.engine import engine, engine_name

__all__ = ["engine", "engine_name"]
