"""The variables of the FMU: names, types, units, ranges, start values, and what depends on what.

The order of the table is the order in the model description; the place in it is the value
reference.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

from kr16cli.robot import JointData, Payload, RobotData
from kr16cli.units import MM_PER_M, RAD_PER_DEG

JOINTS = range(1, 7)
AXES = ("x", "y", "z")
ANGLES = ("a", "b", "c")
TENSOR = ("xx", "yy", "zz", "xy", "xz", "yz")
_FAR = 1e6
_FAST, _HEAVY, _LONG = 1800.0, 1e5, 100.0


class Unit(NamedTuple):
    """Exponents of SI's base units, and one display unit with its factor."""

    kg: int = 0
    m: int = 0
    s: int = 0
    rad: int = 0
    display: str = ""
    factor: float = 1.0


UNITS = {
    "rad": Unit(rad=1, display="deg", factor=1.0 / RAD_PER_DEG),
    "rad/s": Unit(rad=1, s=-1, display="deg/s", factor=1.0 / RAD_PER_DEG),
    "rad/s2": Unit(rad=1, s=-2, display="deg/s2", factor=1.0 / RAD_PER_DEG),
    "m": Unit(m=1, display="mm", factor=MM_PER_M),
    "m/s2": Unit(m=1, s=-2),
    "s": Unit(s=1, display="ms", factor=1000.0),
    "kg": Unit(kg=1),
    "kg.m2": Unit(kg=1, m=2),
    "N": Unit(kg=1, m=1, s=-2),
    "N.m": Unit(kg=1, m=2, s=-2),
    "N.m.s/rad": Unit(kg=1, m=2, s=-1, rad=-1),
    "J": Unit(kg=1, m=2, s=-2),
    "1": Unit(),
}
"""Units by name. The radian counts as a base unit, as FMI has it."""


class Type(NamedTuple):
    """A type of variables: base, quantity, unit, size to expect; the meanings of whole numbers.

    Choices are Integers, not Enumerations: some importers leave out variables of that type.
    """

    base: str
    quantity: str = ""
    unit: str = ""
    nominal: float | None = None
    description: str = ""
    items: Sequence[tuple[str, str]] = ()


MODES = (
    ("torque", "The drives give tau"),
    ("gravity", "Compensation of gravity, plus tau"),
    ("pd", "PD control of q_ref and qd_ref with compensation of gravity, plus tau"),
    ("computed_torque", "Computed torque in joint space for q_ref, qd_ref, qdd_ref, plus tau"),
    (
        "task_space",
        "Computed torque in task space for the flange of q_ref, qd_ref, qdd_ref, plus tau",
    ),
)
LIMITS = (
    ("report", "Limits are flagged, not enforced"),
    ("contact", "Stops of rubber push back"),
)
METHODS = (
    ("auto", "rk4, or rosenbrock with drives or stops, which are stiff"),
    ("rk4", "Runge-Kutta, order 4"),
    ("semi_implicit_euler", "Semi-implicit Euler, order 1"),
    ("rosenbrock", "Linearly implicit, order 2, for friction and stops"),
)

TYPES = {
    "Angle": Type("Real", "Angle", "rad", 1.0, "Joint angle or orientation"),
    "AngularVelocity": Type("Real", "AngularVelocity", "rad/s", 1.0, "Joint speed"),
    "AngularAcceleration": Type("Real", "AngularAcceleration", "rad/s2", 10.0, "Of a joint"),
    "Torque": Type("Real", "Torque", "N.m", 1000.0, "Torque at a joint, or moment"),
    "Force": Type("Real", "Force", "N", 100.0, "Force"),
    "Length": Type("Real", "Length", "m", 1.0, "Length or coordinate"),
    "Mass": Type("Real", "Mass", "kg", 10.0, "Mass"),
    "Inertia": Type("Real", "MomentOfInertia", "kg.m2", 1.0, "Entry of an inertia tensor"),
    "Acceleration": Type("Real", "Acceleration", "m/s2", 10.0, "Acceleration"),
    "Energy": Type("Real", "Energy", "J", 1000.0, "Energy"),
    "Damping": Type("Real", "RotationalDampingConstant", "N.m.s/rad", 10.0, "Viscous friction"),
    "Friction": Type("Real", "Torque", "N.m", 10.0, "Coulomb friction"),
    "Ratio": Type("Real", "DampingRatio", "1", 1.0, "Number without unit"),
    "Time": Type("Real", "Time", "s", 1e-3, "Duration"),
    "Flag": Type("Boolean", description="Yes or no"),
    "Mode": Type("Integer", description="What drives the joints", items=MODES),
    "Limits": Type("Integer", description="What happens at joint limits", items=LIMITS),
    "Method": Type("Integer", description="How motion is integrated", items=METHODS),
}
"""Types by name."""


class Variable(NamedTuple):
    """One variable; `start` is None for outputs, `low` and `high` bound what makes sense."""

    name: str
    type: str
    causality: str
    variability: str
    description: str
    start: Any = None
    low: float | None = None
    high: float | None = None

    @property
    def base(self) -> str:
        """Real, Boolean or Integer."""
        return TYPES[self.type].base


class Part(StrEnum):
    """What an FMU is: the robot, or its controller alone for closing the loop in a host."""

    ROBOT = "robot"
    CONTROLLER = "controller"


class Start(NamedTuple):
    """Start values of parameters and inputs, SI units: those of a scenario."""

    q: Sequence[float]
    qd: Sequence[float] = (0.0,) * 6
    tau: Sequence[float] = (0.0,) * 6
    gravity: Sequence[float] = (0.0, 0.0, -9.81)
    payload: Payload = Payload()
    drives: bool = False
    mode: int = 1
    frequency: Sequence[float] = (15.0,) * 6
    damping: float = 1.0
    limits: int = 1
    limit_torque: bool = False
    limit_speed: bool = False
    method: int = 1
    step: float = 1e-3


def six(name: str) -> list[str]:
    """name[1] to name[6]."""
    return [f"{name}[{i}]" for i in JOINTS]


WRENCH = six("wrench")
POSE = [f"pose.{k}" for k in (*AXES, *ANGLES)]
COM = [f"payload.com.{k}" for k in AXES]
INERTIA = [f"payload.inertia.{k}" for k in TENSOR]
GRAVITY = [f"gravity.{k}" for k in AXES]


def table(data: RobotData, start: Start, part: Part = Part.ROBOT) -> tuple[Variable, ...]:
    """All variables of the FMU of a robot or of its controller."""
    variables = (*_inputs(data, start), *_parameters(data, start), *_outputs(data))
    if part is Part.ROBOT:
        return variables
    measured = (_measured(v) for v in variables if group(v.name) in ("q", "qd"))
    kept = [v for v in variables if group(v.name) in _OF_CONTROLLER]
    given = (_given(v) for v in variables if group(v.name) == "tau")
    return (*measured, *kept, *given)


_OF_CONTROLLER = (
    *("q_ref", "qd_ref", "qdd_ref", "q_start", "payload", "gravity", "drives"),
    *("rotor_inertia", "friction", "control"),
)


def group(name: str) -> str:
    """The first part of a name, without index."""
    return name.partition("[")[0].partition(".")[0]


def _measured(output: Variable) -> Variable:
    """An output of the robot as an input of its controller."""
    return output._replace(causality="input", start=0.0)


def _given(command: Variable) -> Variable:
    """An input of the robot as an output of its controller."""
    text = command.description.partition(" on ")[0] + " that the controller wants"
    return command._replace(causality="output", description=text, start=None, low=None, high=None)


def _range(joint: JointData, start: float) -> tuple[float, float]:
    """A joint's limits, stretched to include its start."""
    return min(joint.lower, start), max(joint.upper, start)


def _inputs(data: RobotData, start: Start) -> Iterator[Variable]:
    def make(name: str, type_: str, text: str, value: float, *range_: float) -> Variable:
        return Variable(name, type_, "input", "continuous", text, float(value), *range_)

    for i, name in enumerate(six("tau")):
        text = f"Torque at {data.joints[i].name} on the link side of the gear, held over a step"
        yield make(name, "Torque", text, start.tau[i], -_FAR, _FAR)
    for name, kind, what in (
        ("q_ref", "Angle", "angle"),
        ("qd_ref", "AngularVelocity", "speed"),
        ("qdd_ref", "AngularAcceleration", "acceleration"),
    ):
        for i, joint in enumerate(data.joints):
            value = 0.0
            range_: tuple[float, ...] = ()
            if name == "q_ref":
                value = start.q[i]
                range_ = _range(joint, value)
            text = f"Wanted {what} of {joint.name}; control.mode says who follows it"
            yield make(f"{name}[{i + 1}]", kind, text, value, *range_)
    for i, name in enumerate(WRENCH):
        what = "Force on" if i < 3 else "Moment about"
        text = f"{what} the flange's origin along {AXES[i % 3]} of robroot"
        yield make(name, "Force" if i < 3 else "Torque", text, 0.0, -_FAR, _FAR)


def _parameters(data: RobotData, start: Start) -> Iterator[Variable]:
    def make(
        name: str, type_: str, text: str, value: Any, *range_: float, tunable: bool = False
    ) -> Variable:
        variability = "tunable" if tunable else "fixed"
        items = TYPES[type_].items
        if items:
            text += ": " + ", ".join(f"{k} {item}" for k, (item, _) in enumerate(items, 1))
            range_ = (1.0, float(len(items)))
        return Variable(name, type_, "parameter", variability, text, value, *range_)

    joints, load = data.joints, start.payload
    for i, joint in enumerate(joints):
        text = f"Angle of {joint.name} at the start"
        yield make(f"q_start[{i + 1}]", "Angle", text, start.q[i], *_range(joint, start.q[i]))
    for i, joint in enumerate(joints):
        text = f"Speed of {joint.name} at the start"
        yield make(f"qd_start[{i + 1}]", "AngularVelocity", text, start.qd[i], -_FAST, _FAST)
    yield make("payload.mass", "Mass", "Mass of the load on the flange", load.mass, 0.0, _HEAVY)
    for name, value in zip(COM, load.com, strict=True):
        text = "Mass centre of the load from the flange's origin, flange axes"
        yield make(name, "Length", text, value, -_LONG, _LONG)
    for name, value in zip(INERTIA, load.inertia, strict=True):
        text = "Inertia tensor of the load about its mass centre, flange axes"
        yield make(name, "Inertia", text, value, -_FAR, _FAR)
    for name, value in zip(GRAVITY, start.gravity, strict=True):
        yield make(name, "Acceleration", "Gravity in robroot", float(value), -_LONG, _LONG)
    yield make("drives", "Flag", "Count rotor inertia and friction", start.drives)
    for name, kind, text, key in (
        ("rotor_inertia", "Inertia", "Rotor inertia seen at", "reflected_inertia"),
        ("friction.coulomb", "Friction", "Coulomb friction of", "coulomb"),
        ("friction.viscous", "Damping", "Viscous friction of", "viscous"),
    ):
        for i, joint in enumerate(joints):
            value = float(getattr(joint, key) or 0.0)
            yield make(f"{name}[{i + 1}]", kind, f"{text} {joint.name}", value, 0.0, _FAR)
    yield make("control.mode", "Mode", "What drives the joints", start.mode)
    for i, joint in enumerate(joints):
        text = f"Natural frequency of the control of {joint.name}"
        value = float(start.frequency[i])
        yield make(
            f"control.frequency[{i + 1}]", "AngularVelocity", text, value, 0.0, 1e4, tunable=True
        )
    text = "Damping ratio of the control; 1 does not overshoot"
    yield make("control.damping", "Ratio", text, float(start.damping), 0.0, 100.0, tunable=True)
    yield make("limits.joint", "Limits", "What happens at joint limits", start.limits)
    text = "Drives give no more than their greatest torque"
    yield make("limits.torque", "Flag", text, start.limit_torque)
    text = "A drive's torque fades out above its joint's speed limit"
    yield make("limits.speed", "Flag", text, start.limit_speed)
    yield make("solver.method", "Method", "How motion is integrated", start.method)
    text = "Longest internal step; a communication step is cut into equal ones"
    yield make("solver.step", "Time", text, start.step, 1e-6, 0.1)


def _outputs(data: RobotData) -> Iterator[Variable]:
    for name, kind, what in (
        ("q", "Angle", "Angle of"),
        ("qd", "AngularVelocity", "Speed of"),
        ("qdd", "AngularAcceleration", "Acceleration of"),
        ("tau_applied", "Torque", "Torque that the drive gives at"),
    ):
        for i, joint in enumerate(data.joints):
            text = f"{what} {joint.name}"
            yield Variable(f"{name}[{i + 1}]", kind, "output", "continuous", text)
    for name, key in zip(POSE, ("X", "Y", "Z", "A", "B", "C"), strict=True):
        kind = "Length" if key in "XYZ" else "Angle"
        text = f"{key} of the flange in robroot, as KUKA writes poses"
        yield Variable(name, kind, "output", "continuous", text)
    for name in ("kinetic", "potential"):
        text = f"{name.capitalize()} energy"
        yield Variable(f"energy.{name}", "Energy", "output", "continuous", text)
    for name, text in (
        ("position", "outside its range"),
        ("speed", "faster than its limit"),
        ("torque", "asked for more than its greatest torque"),
    ):
        for i, joint in enumerate(data.joints):
            text_ = f"{joint.name} is {text}"
            yield Variable(f"limit.{name}[{i + 1}]", "Flag", "output", "discrete", text_)


STATE = ("q_start", "qd_start")
_COMMANDS = ("tau", "q", "qd", "q_ref", "qd_ref", "qdd_ref")
_LOADS = ("payload", "gravity")
_DRIVES = ("drives", "rotor_inertia", "friction")
_CONTROL = ("control", *_LOADS, *_DRIVES)

# What an output follows from, by the first part of its name or of the parts of a name: inputs
# at every communication point, and inputs and parameters at the start.
_FOLLOWS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "q": ((), ("q_start",)),
    "qd": ((), ("qd_start",)),
    "qdd": ((*_COMMANDS, "wrench"), (*STATE, *_CONTROL, "limits")),
    "tau_applied": (_COMMANDS, (*STATE, *_CONTROL, "limits")),
    "tau": (_COMMANDS, ("q_start", *_CONTROL)),
    "pose": ((), ("q_start",)),
    "energy.kinetic": ((), (*STATE, "payload", "drives", "rotor_inertia")),
    "energy.potential": ((), ("q_start", *_LOADS)),
    "limit.position": ((), ("q_start",)),
    "limit.speed": ((), ("qd_start",)),
    "limit.torque": (_COMMANDS, (*STATE, *_CONTROL)),
}
_OWN = ("q", "qd", "limit.position", "limit.speed")


def dependencies(variables: Sequence[Variable], name: str, *, start: bool) -> list[int]:
    """Places (from 1) of what an output depends on directly.

    Args:
        variables: the table.
        name: the output's.
        start: at the start, parameters included; else at any communication point.
    """
    stem, _, index = name.rstrip("]").partition("[")
    key = next(k for k in (stem, stem.split(".")[0]) if k in _FOLLOWS)
    inputs, parameters = _FOLLOWS[key]
    wanted = {*inputs, *(parameters if start else ())}
    return [
        place
        for place, variable in enumerate(variables, 1)
        if variable.causality != "output"
        and _belongs(variable.name, wanted, index if key in _OWN else "")
    ]


def _belongs(name: str, wanted: Iterable[str], index: str) -> bool:
    stem, _, own = name.rstrip("]").partition("[")
    group = stem.split(".")[0]
    return (stem in wanted or group in wanted) and (not index or own == index)
