"""What a scenario says of its controller and reference, and the rules it keeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, cast

from kr16cli.robot_check import Checker
from kr16cli.robot_rules import Quantity
from kr16cli.simulate.loop import Sampling
from kr16cli.simulate.paths import PathSpeed
from kr16cli.simulate.plant import Limits, Wrench
from kr16cli.simulate.profiles import Shape
from kr16cli.units import metres, rad

Six = tuple[float, float, float, float, float, float]
ControllerKind = Literal["zero", "gravity", "pd", "computed_torque", "task_space"]
ReferenceKind = Literal["hold", "ptp", "line", "circle", "csv", "krl"]

CONTROLLERS = ("zero", "gravity", "pd", "computed_torque", "task_space")
FOLLOWERS = CONTROLLERS[2:]
REFERENCES = ("hold", "ptp", "line", "circle", "csv", "krl")
SHAPES = ("quintic", "trapezoid")
LIMITS = ("report", "stop", "contact")


def _positive(what: str, unit: str, high: float, mistaken: str = "") -> Quantity:
    return Quantity(what, unit, high, mistaken, 0.0, True)


_ANGLE_DEG = Quantity("angles", "deg", 720.0)
_ANGLE = Quantity("angles", "rad", 12.6, "degrees")
_DIRECTION = Quantity("directions", "", 1e6)
_PLACE = Quantity("lengths", "mm", 20_000.0)
_FORCE = Quantity("forces", "N", 1e6)
_MOMENT = Quantity("moments", "N m", 1e6)
_GAIN = Quantity("gains", "", 1e8, low=0.0)
_TIME = Quantity("times", "s", 86_400.0, "ms", 0.0)

_SAMPLING = {
    "period_s": _positive("periods", "s", 1.0, "ms"),
    "delay_s": Quantity("delays", "s", 1.0, "ms", 0.0),
    "resolution_deg": Quantity("resolutions", "deg", 10.0, low=0.0),
    "torque_step_nm": Quantity("torques", "N m", 1e4, low=0.0),
}
_DESIGN = {
    "natural_frequency": _positive("natural frequencies", "rad/s", 1000.0),
    "damping_ratio": _positive("damping ratios", "", 100.0),
}
_SINGULAR = {
    "near_singular": Quantity("sines", "", 1.0, low=0.0),
    "singular_damping": _positive("dampings", "", 10.0),
}
_CONTROLLER = {**_DESIGN, **_SINGULAR, **_SAMPLING}
_PATH = {
    "speed_m_s": _positive("path speeds", "m/s", 10.0, "mm/s"),
    "acceleration_m_s2": _positive("path accelerations", "m/s2", 100.0, "mm/s2"),
    "turning_deg_s": _positive("speeds", "deg/s", 3600.0),
    "turning_deg_s2": _positive("accelerations", "deg/s2", 36_000.0),
}
_PTP = {
    "speed_percent": _positive("speeds", "percent", 100.0),
    "acceleration_deg_s2": _positive("accelerations", "deg/s2", 1e5),
}
_VECTORS = {
    "q": [_ANGLE] * 6,
    "q_deg": [_ANGLE_DEG] * 6,
    "position_mm": [_PLACE] * 3,
    "offset_mm": [_PLACE] * 3,
    "abc_deg": [_ANGLE_DEG] * 3,
    "centre_offset_mm": [_PLACE] * 3,
    "normal": [_DIRECTION] * 3,
}
_NUMBERS = {**_PATH, **_PTP, "angle_deg": Quantity("angles", "deg", 7200.0), "start_s": _TIME}
_ALWAYS = ("kind", "start_s")
_KEYS: Mapping[str, tuple[str, ...]] = {
    "hold": ("q", "q_deg"),
    "ptp": ("q", "q_deg", "profile", *_PTP),
    "line": ("position_mm", "offset_mm", "abc_deg", "profile", *_PATH),
    "circle": ("centre_offset_mm", "normal", "angle_deg", "abc_deg", "profile", *_PATH),
    "csv": ("file",),
    "krl": ("file", "program", "profile", *_PTP, *_PATH),
}
_EITHER: Mapping[str, tuple[str, str]] = {
    "ptp": ("q", "q_deg"),
    "line": ("position_mm", "offset_mm"),
    "krl": ("file", "program"),
}
_NEEDED: Mapping[str, tuple[str, ...]] = {
    "circle": ("centre_offset_mm", "normal"),
    "csv": ("file",),
}


@dataclass(frozen=True)
class ControllerSpec:
    """A controller: gains by `frequency` (rad/s) and `damping` ratio, or `kp` and `kd`.

    kp and kd are N m/rad and N m s/rad for "pd", 1/s2 and 1/s for the others. A controller
    that does not know the payload computes with the bare arm. `near` and `strength` are those
    of `TaskComputedTorque`.
    """

    kind: ControllerKind
    frequency: float = 15.0
    damping: float = 1.0
    kp: Six | None = None
    kd: Six | None = None
    knows_payload: bool = True
    near: float = 0.1
    strength: float = 0.05
    sampling: Sampling | None = None


@dataclass(frozen=True)
class ReferenceSpec:
    """A wanted motion that begins at `start` (s) from the scenario's first configuration.

    Angles in rad, places in m, robroot. `end` is a configuration ("ptp", "hold"); `place` or
    `offset` the end of a "line"; `centre` (seen from the start), `normal` and `angle` make a
    "circle"; `abc` is the last orientation; "csv" and "krl" have a `file`, or `program` text.
    `speed_part` is the part of the joints' greatest speeds that "ptp" uses.
    """

    kind: ReferenceKind
    start: float = 0.0
    shape: Shape = "quintic"
    end: Six | None = None
    place: tuple[float, ...] | None = None
    offset: tuple[float, ...] | None = None
    abc: tuple[float, ...] | None = None
    centre: tuple[float, ...] | None = None
    normal: tuple[float, ...] | None = None
    angle: float = rad(360.0)
    file: str | None = None
    program: str | None = None
    speed_part: float = 1.0
    acceleration: tuple[float, ...] | None = None
    path: PathSpeed = field(default_factory=PathSpeed)


class MotionChecker(Checker):
    """The rules of [limits], [wrench], [controller] and [reference]."""

    def limits(self, table: Mapping[str, Any]) -> None:
        """Check [limits]."""
        self.keys(table, "limits", (), ("joint", "torque", "speed", "depth_deg", "bounce"))
        self.choice(table, "limits", "joint", LIMITS)
        self.flags(table, "limits", ("torque", "speed"))
        self.number(table, "limits", "depth_deg", _positive("depths", "deg", 10.0))
        self.number(table, "limits", "bounce", Quantity("bounces", "s/rad", 100.0, low=0.0))
        if table.get("joint", "report") in LIMITS[:2]:
            for key in ("depth_deg", "bounce"):
                if key in table:
                    self.fail(f"limits.{key}", table[key], 'belongs to joint = "contact"')

    def wrench(self, table: Mapping[str, Any]) -> None:
        """Check [wrench]."""
        self.keys(table, "wrench", (), ("force_n", "moment_nm", "axes", "start_s", "end_s"))
        self.numbers(table, "wrench", "force_n", [_FORCE] * 3)
        self.numbers(table, "wrench", "moment_nm", [_MOMENT] * 3)
        self.choice(table, "wrench", "axes", ("robroot", "flange"))
        if "force_n" not in table and "moment_nm" not in table:
            self.fail("wrench.force_n", None, "a wrench needs force_n, moment_nm or both")
        start = self.one_number(table.get("start_s", 0.0), "wrench.start_s", _TIME)
        end = table.get("end_s")
        end = None if end is None else self.one_number(end, "wrench.end_s", _TIME)
        if start is not None and end is not None and end <= start:
            self.fail("wrench.end_s", end, f"must come after start_s = {start:g}")

    def controller(self, table: Mapping[str, Any]) -> None:
        """Check [controller]."""
        self.keys(table, "controller", ("kind",), (*_CONTROLLER, "kp", "kd", "knows_payload"))
        self.choice(table, "controller", "kind", CONTROLLERS)
        for key, quantity in _CONTROLLER.items():
            self.number(table, "controller", key, quantity)
        self.flags(table, "controller", ("knows_payload",))
        for key, other in (("kp", "kd"), ("kd", "kp")):
            self.numbers(table, "controller", key, [_GAIN] * 6)
            if key in table and other not in table:
                self.fail(f"controller.{other}", None, f"{key} needs it")
        self._fitting(table)

    def _fitting(self, table: Mapping[str, Any]) -> None:
        """No key that means nothing beside the others."""
        kind = table.get("kind")
        for key in _DESIGN:
            if key in table and "kp" in table:
                self.fail(f"controller.{key}", table[key], "stands beside kp and kd; give one")
        if kind in CONTROLLERS and kind not in FOLLOWERS:
            unused = (*_DESIGN, "kp", "kd", *(("knows_payload",) if kind == "zero" else ()))
            for key in unused:
                if key in table:
                    self.fail(f"controller.{key}", table[key], f'means nothing to "{kind}"')
        for key in _SINGULAR:
            if key in table and kind in CONTROLLERS and kind != "task_space":
                self.fail(f"controller.{key}", table[key], 'belongs to kind = "task_space"')
        for key in _SAMPLING:
            if key in table and "period_s" not in table:
                self.fail("controller.period_s", None, f"{key} needs it")

    def reference(self, table: Mapping[str, Any]) -> None:
        """Check [reference]."""
        known = (*_NUMBERS, *_VECTORS, "profile", "file", "program")
        self.keys(table, "reference", ("kind",), known)
        self.choice(table, "reference", "kind", REFERENCES)
        self.choice(table, "reference", "profile", SHAPES)
        for key, quantity in _NUMBERS.items():
            if key != "acceleration_deg_s2" or not isinstance(table.get(key), list):
                self.number(table, "reference", key, quantity)
            else:
                self.numbers(table, "reference", key, [quantity] * 6)
        for key, quantities in _VECTORS.items():
            self.numbers(table, "reference", key, quantities)
        self.text(table, "reference", "file")
        self._program(table)
        kind = table.get("kind")
        if isinstance(kind, str) and kind in REFERENCES:
            self._kind_keys(table, kind)

    def _program(self, table: Mapping[str, Any]) -> None:
        program = table.get("program", "PTP")
        if not isinstance(program, str) or not program.strip():
            self.fail("reference.program", program, "must be text, a statement a line")

    def _kind_keys(self, table: Mapping[str, Any], kind: str) -> None:
        """The keys a kind needs are there, and no others."""
        for key in table:
            if key in (*_NUMBERS, *_VECTORS, "profile", "file", "program") and (
                key not in (*_ALWAYS, *_KEYS[kind])
            ):
                self.fail(f"reference.{key}", table[key], f'means nothing to kind = "{kind}"')
        for key in _NEEDED.get(kind, ()):
            if key not in table:
                self.fail(f"reference.{key}", None, f'kind = "{kind}" needs it')
        if kind in _EITHER and not set(_EITHER[kind]) & set(table):
            first, second = _EITHER[kind]
            self.fail(f"reference.{first}", None, f'kind = "{kind}" needs it, or {second}')
        for first, second in (("q", "q_deg"), *_EITHER.values()):
            if first in table and second in table:
                self.fail(f"reference.{first}", table[first], f"stands beside {second}; give one")
                break
        if kind == "circle":
            self._circle(table)

    def _circle(self, table: Mapping[str, Any]) -> None:
        offset = _three(table.get("centre_offset_mm"))
        normal = _three(table.get("normal"))
        if normal and not any(normal):
            self.fail("reference.normal", table["normal"], "must not be zero")
        elif offset and not any(offset):
            self.fail("reference.centre_offset_mm", table["centre_offset_mm"], "must not be zero")
        elif offset and normal:
            across = sum(a * b for a, b in zip(offset, normal, strict=True))
            size = sum(v * v for v in offset) * sum(v * v for v in normal)
            if across * across > 1e-18 * size:
                rule = "must stand at right angles to normal"
                self.fail("reference.centre_offset_mm", table["centre_offset_mm"], rule)

    def flags(self, table: Mapping[str, Any], at: str, names: tuple[str, ...]) -> None:
        """Check that values are true or false, where they are given."""
        for name in names:
            if not isinstance(table.get(name, False), bool):
                self.fail(f"{at}.{name}", table[name], "must be true or false")


def _three(value: Any) -> list[float] | None:
    """Three numbers, or None for anything else (which was complained about)."""
    if isinstance(value, list | tuple) and len(value) == 3:
        numbers = [v for v in value if isinstance(v, int | float)]
        return list(map(float, numbers)) if len(numbers) == 3 else None
    return None


def limits_of(table: Mapping[str, Any]) -> Limits:
    """[limits], checked, as the plant takes it."""
    default = Limits()
    return Limits(
        joint=table.get("joint", default.joint),
        torque=table.get("torque", default.torque),
        speed=table.get("speed", default.speed),
        depth=rad(table["depth_deg"]) if "depth_deg" in table else default.depth,
        bounce=float(table.get("bounce", default.bounce)),
    )


def wrench_of(table: Mapping[str, Any]) -> Wrench:
    """[wrench], checked, as the plant takes it."""
    end = table.get("end_s")
    return Wrench(
        force=_floats(table.get("force_n", (0.0,) * 3)),
        moment=_floats(table.get("moment_nm", (0.0,) * 3)),
        axes=table.get("axes", "robroot"),
        start=float(table.get("start_s", 0.0)),
        end=None if end is None else float(end),
    )


def controller_of(table: Mapping[str, Any]) -> ControllerSpec:
    """[controller], checked."""
    default = ControllerSpec("zero")
    sampling = None
    if "period_s" in table:
        sampling = Sampling(
            period=float(table["period_s"]),
            delay=float(table.get("delay_s", 0.0)),
            resolution=rad(table.get("resolution_deg", 0.0)),
            torque_step=float(table.get("torque_step_nm", 0.0)),
        )
    return ControllerSpec(
        kind=table["kind"],
        frequency=float(table.get("natural_frequency", default.frequency)),
        damping=float(table.get("damping_ratio", default.damping)),
        kp=cast("Six", _floats(table["kp"])) if "kp" in table else None,
        kd=cast("Six", _floats(table["kd"])) if "kd" in table else None,
        knows_payload=table.get("knows_payload", True),
        near=float(table.get("near_singular", default.near)),
        strength=float(table.get("singular_damping", default.strength)),
        sampling=sampling,
    )


def reference_of(table: Mapping[str, Any]) -> ReferenceSpec:
    """[reference], checked, in SI units."""
    default = ReferenceSpec("hold")
    end = [rad(v) for v in table["q_deg"]] if "q_deg" in table else table.get("q")
    ramp = table.get("acceleration_deg_s2")
    ramp = [ramp] * 6 if isinstance(ramp, int | float) else ramp

    def lengths(key: str) -> tuple[float, ...] | None:
        return tuple(metres(v) for v in table[key]) if key in table else None

    def angles(values: Any) -> tuple[float, ...] | None:
        return None if values is None else tuple(rad(v) for v in values)

    slow = default.path
    return ReferenceSpec(
        kind=table["kind"],
        start=float(table.get("start_s", 0.0)),
        shape=table.get("profile", default.shape),
        end=None if end is None else cast("Six", _floats(end)),
        place=lengths("position_mm"),
        offset=lengths("offset_mm"),
        abc=angles(table.get("abc_deg")),
        centre=lengths("centre_offset_mm"),
        normal=_floats(table["normal"]) if "normal" in table else None,
        angle=rad(table.get("angle_deg", 360.0)),
        file=table.get("file"),
        program=table.get("program"),
        speed_part=table.get("speed_percent", 100.0) / 100.0,
        acceleration=angles(ramp),
        path=PathSpeed(
            speed=float(table.get("speed_m_s", slow.speed)),
            acceleration=float(table.get("acceleration_m_s2", slow.acceleration)),
            turning=rad(table["turning_deg_s"]) if "turning_deg_s" in table else slow.turning,
            turning_acceleration=rad(table["turning_deg_s2"])
            if "turning_deg_s2" in table
            else slow.turning_acceleration,
        ),
    )


def _floats(values: Any) -> tuple[float, ...]:
    """Floats without negative zeros."""
    return tuple(float(v) + 0.0 for v in values)
