"""Suite `dynamics`: mass, Coriolis and gravity terms, energies, loads, drives, task space."""

from kr16cli.verify.suites.dynamics import (
    derivatives,
    exactly,
    identities,
    lagrange,
    loads,
    moments,
    task,
)

__all__ = ["derivatives", "exactly", "identities", "lagrange", "loads", "moments", "task"]
