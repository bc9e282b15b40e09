"""What the unknowns of a native FMU depend on, while it runs and at the start."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.fmi.native.table import STATES
from kr16cli.fmi.variables import Variable, dependencies, group, six

# States an output follows from besides its inputs, by the first parts of names; others of one
# joint follow from that joint's state alone.
_ALL = tuple(name for stem in STATES for name in six(stem))
_OF_STATE = {
    "qdd": _ALL,
    "tau_applied": _ALL,
    "pose": six("q"),
    "energy.kinetic": _ALL,
    "energy.potential": six("q"),
    "limit.torque": _ALL,
    "margin.torque": _ALL,
}
_OWN = {
    "q": "q", "qd": "qd", "limit.position": "q", "limit.speed": "qd", "margin.lower": "q",
    "margin.upper": "q", "margin.speed": "qd",
}  # fmt: skip
_LIKE = {"margin.torque": "limit.torque"}


def running(known: Sequence[Variable], name: str, *, states: bool) -> list[str]:
    """Names of inputs and, for a robot, states that an output, derivative or margin follows from.

    The derivative of q is qd, a state itself.
    """
    stem, _, index = name.rstrip("]").partition("[")
    found = set(_inputs(known, stem, index))
    if states:
        key = stem if stem in _OF_STATE or stem in _OWN else group(stem)
        found |= {f"{_OWN[key]}[{index}]"} if key in _OWN else set(_OF_STATE[key])
    return [v.name for v in known if v.name in found]


def _inputs(known: Sequence[Variable], stem: str, index: str) -> list[str]:
    if stem.startswith("margin") and stem not in _LIKE:
        return []
    alike = _LIKE.get(stem, stem) + (f"[{index}]" if index else "")
    return [known[place - 1].name for place in dependencies(known, alike, start=False)]


def initial(known: Sequence[Variable], name: str) -> list[str]:
    """Names of inputs and parameters that an unknown follows from at the start."""
    return [known[place - 1].name for place in dependencies(known, name, start=True)]
