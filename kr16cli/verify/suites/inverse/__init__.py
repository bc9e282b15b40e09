"""Suite `inverse`: closure, labels, completeness against other root finders, singular poses."""

from kr16cli.verify.suites.inverse import (
    closure,
    completeness,
    edges,
    judged,
    singular,
    stages,
)

__all__ = ["closure", "completeness", "edges", "judged", "singular", "stages"]
