"""Suite `simulation`: motions whose course is known, by other means or by a law."""

from kr16cli.verify.suites.simulation import engines, known, laws, motions, orders

__all__ = ["engines", "known", "laws", "motions", "orders"]
