"""Suite `kinematics`: forward kinematics, frames, orientation, posture."""

from kr16cli.verify.suites.kinematics import frames, orientation, posture, scalars

__all__ = ["frames", "orientation", "posture", "scalars"]
