"""Suite `inverse`: inverse kinematics: closure, completeness, branches, singular cases."""

from kr16cli.verify.suites.inverse import closure, completeness, edges, singular

__all__ = ["closure", "completeness", "edges", "singular"]
