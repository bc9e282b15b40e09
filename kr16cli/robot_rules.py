"""What each number of a robot parameter file may be: unit, range, usual mistake.

Also the rule every inertia tensor keeps, for links and payloads alike.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from kr16cli.errors import InputError
from kr16cli.robot import Inertia6, Payload

# Rounding of a tensor typed with 16 digits; a body needs no finer test.
_RELATIVE = 1e-12


class Quantity(NamedTuple):
    """What a number means, and which values make sense: the unit and its usual mistake."""

    what: str
    unit: str
    high: float = math.inf
    mistaken: str = ""
    low: float = -math.inf
    open_low: bool = False

    def problem(self, value: float) -> str | None:
        """The rule that `value` breaks, or None."""
        if not math.isfinite(value):
            return "every number must be finite"
        below = value < self.low or (self.open_low and value == self.low)
        if abs(value) > self.high and not (below and self.low == 0.0):
            unit = f"in {self.unit}, " if self.unit else ""
            rule = f"{self.what} are {unit}at most {self.high:g}"
            return f"{rule}; {value:g} looks like {self.mistaken}" if self.mistaken else rule
        if below:
            relation = ">" if self.open_low else ">="
            return f"must be {relation} {self.low:g} {self.unit}".rstrip()
        return None


def _positive(what: str, unit: str, high: float = math.inf, mistaken: str = "") -> Quantity:
    return Quantity(what, unit, high, mistaken, 0.0, True)


LENGTH = Quantity("lengths", "m", 20.0, "mm")
_POSITIVE_LENGTH = _positive("lengths", "m", 20.0, "mm")
GEOMETRY = {
    "d1": LENGTH,
    "a1": LENGTH,
    "a2": _POSITIVE_LENGTH,
    "a3": LENGTH,
    "d4": _POSITIVE_LENGTH,
    "d6": Quantity("lengths", "m", 20.0, "mm", low=0.0),
}
JOINT = {
    "speed_deg_s": _positive("speeds", "deg/s"),
    "torque_nm": _positive("torques", "N m"),
    "gear_ratio": _positive("gear ratios", ""),
    "rotor_inertia": Quantity("rotor inertias", "kg m2", 1.0, "kg cm2", low=0.0),
    "coulomb_nm": Quantity("torques", "N m", low=0.0),
    "viscous_nms": Quantity("viscous frictions", "N m s/rad", low=0.0),
}
LIMITS = Quantity("limits", "deg", 720.0)
MASS = _positive("masses", "kg", 10_000.0, "g")
INERTIA = Quantity("inertias", "kg m2", 100_000.0, "kg mm2")
GRAVITY = Quantity("accelerations", "m/s2", 100.0, "mm/s2")
LINK = {"mass": MASS, "tolerance": Quantity("relative tolerances", "", 1.0, "percent", low=0.0)}
NOTE = {
    "tolerance": Quantity("relative tolerances", "", 1.0, "percent", low=0.0),
    "plus_minus": Quantity("tolerances", "", low=0.0),
}
"""Numbers of a note: how far the key may be off, relative or in its own unit."""
_RATING_UNITS = {
    "kg": ("payload", "mass", "supplementary_load_arm", "supplementary_load_column", "total_load"),
    "mm": (
        *("reach", "rated_load_com_xy", "rated_load_com_z", "repeatability", "wrist_height"),
        *("total_height", "inner_reach", "reach_difference", "rear_reach"),
    ),
    "kgm2": ("rated_load_inertia",),
    "m3": ("working_volume",),
    "n": tuple(f"foundation_{way}" for way in ("vertical", "horizontal"))
    + tuple(f"foundation_{way}_max" for way in ("vertical", "horizontal")),
    "nm": tuple(f"foundation_{way}" for way in ("tilt", "torque"))
    + tuple(f"foundation_{way}_max" for way in ("tilt", "torque")),
}
RATINGS = {
    f"{name}_{unit}": _positive("ratings", {"kgm2": "kg m2", "n": "N", "nm": "N m"}.get(unit, unit))
    for unit, names in _RATING_UNITS.items()
    for name in names
}
_GROUPS: Mapping[str, Mapping[str, Quantity]] = {
    "geometry": GEOMETRY,
    "joint": {"limits_deg": LIMITS, **JOINT},
    "link": {"com": LENGTH, "inertia": INERTIA, **LINK},
    "ratings": RATINGS,
}
_DOTTED = re.compile(r"(\w+)(?:\[(\d)\])?\.(\w+)(?:\[(\d)\])?")


def look_up(table: Mapping[str, Any], key: object) -> tuple[object, str]:
    """The value a dotted key names, such as geometry.d6 or joint[1].torque_nm, and its unit.

    (None, "") where the key names nothing. Counting is from 1, as in messages.
    """
    match = _DOTTED.fullmatch(key) if isinstance(key, str) else None
    quantity = _GROUPS.get(match[1], {}).get(match[3]) if match else None
    if match is None or quantity is None:
        return None, ""
    value: Any = table
    try:
        for name, index in ((match[1], match[2]), (match[3], match[4])):
            value = value[name] if index is None else [None, *value[name]][int(index)]
    except (KeyError, IndexError, TypeError):
        return None, ""
    return value, quantity.unit


def principal_moments(inertia: Inertia6) -> tuple[float, float, float]:
    """Eigenvalues of an inertia tensor, ascending, by Jacobi's rotations.

    Args:
        inertia: (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), finite, any unit.

    Returns:
        The three principal moments, each within a few roundings of the largest entry.
    """
    xx, yy, zz, xy, xz, yz = inertia
    scale = max(map(abs, inertia))
    if scale == 0.0:
        return 0.0, 0.0, 0.0
    A = [[e / scale for e in row] for row in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))]
    # Convergence is quadratic: 3x3 takes 4 to 6 sweeps, and a further one changes nothing.
    for _ in range(10):
        for p, q, r in ((0, 1, 2), (0, 2, 1), (1, 2, 0)):
            if A[p][q] == 0.0:
                continue
            theta = (A[q][q] - A[p][p]) / (2.0 * A[p][q])
            t = math.copysign(1.0, theta) / (abs(theta) + math.hypot(theta, 1.0))
            c = 1.0 / math.hypot(t, 1.0)
            s = t * c
            A[p][p], A[q][q] = A[p][p] - t * A[p][q], A[q][q] + t * A[p][q]
            A[p][q] = A[q][p] = 0.0
            A[r][p], A[r][q] = c * A[r][p] - s * A[r][q], s * A[r][p] + c * A[r][q]
            A[p][r], A[q][r] = A[r][p], A[r][q]
    low, middle, high = sorted(A[i][i] * scale for i in range(3))
    return low, middle, high


def inertia_problem(inertia: Inertia6) -> str | None:
    """Why no rigid body has this tensor about its mass centre, or None if one can."""
    low, middle, high = principal_moments(inertia)
    moments = f"principal moments {low:.6g}, {middle:.6g}, {high:.6g} kg m2"
    if low <= _RELATIVE * high:
        return f"an inertia must be positive definite; {moments}"
    if low + middle < high * (1.0 - _RELATIVE):
        return f"two principal moments must add up to the third (triangle inequality); {moments}"
    return None


def checked_payload(mass: float, com: Sequence[float], inertia: Sequence[float]) -> Payload:
    """A payload whose numbers a rigid load can have; a point mass and a rod are allowed.

    Args:
        mass: kg, 0 or more.
        com: mass centre in flange axes, m, 3 numbers.
        inertia: (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about the mass centre, kg m2, 6 numbers.

    Raises:
        InputError: naming what is wrong, its value and the rule.
    """
    for name, values, count in (("com", com, 3), ("inertia", inertia, 6)):
        if len(values) != count:
            raise InputError(f"payload {name} has {len(values)} numbers; expected {count}")
    for name, numbers in (("mass", (mass,)), ("com", com), ("inertia", inertia)):
        for value in numbers:
            if not math.isfinite(value):
                raise InputError(f"payload {name} has {value}; every number must be finite")
    if mass < 0.0:
        raise InputError(f"payload mass is {mass:g} kg; it must be 0 or more")
    xx, yy, zz, xy, xz, yz = map(float, inertia)
    tensor = (xx, yy, zz, xy, xz, yz)
    low, middle, high = principal_moments(tensor)
    if low < -_RELATIVE * high or low + middle < high * (1.0 - _RELATIVE):
        raise InputError(
            f"payload inertia has principal moments {low:.6g}, {middle:.6g}, {high:.6g} kg m2; "
            "no rigid body has that (none negative, any two at least the third)"
        )
    x, y, z = map(float, com)
    return Payload(float(mass), (x, y, z), tensor)
