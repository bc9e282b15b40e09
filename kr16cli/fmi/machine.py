"""One instance of the robot in a co-simulation: its values, its phases, its steps. Plain floats.

Knows nothing of pythonfmu: the slave in an FMU forwards calls and reports errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from kr16cli.errors import InputError
from kr16cli.fmi import outputs
from kr16cli.fmi.settings import Settings
from kr16cli.fmi.variables import TYPES, Part, Variable, six
from kr16cli.robot import RobotData
from kr16cli.single import Arm

INSTANTIATED, INITIALIZING, STEPPING, TERMINATED, FAILED = (
    "instantiated", "initializing", "stepping", "terminated", "failed",
)  # fmt: skip
MakeArm = Callable[..., Arm]

_BASES = ("Real", "Integer", "Boolean", "String")
_STATE_SCHEMA = "kr16.fmu_state/1"
_REMEMBERED = 256
"""Lists of references, as a host asks for them, that need no check again."""

_SLACK = 1e-9
"""Relative difference of two times that is rounding of a host's clock."""


class Machine:
    """The robot between two communication points.

    Args:
        variables: the table; a value's reference is its place.
        data: the robot.
        make_arm: makes the arm of `data`, `payload=` and `drives=`.
        part: the robot, whose state moves by steps, or its controller, which has none.
        identity: of the build; states of another build are refused.
        warn: told of what deserves a warning.
    """

    def __init__(
        self,
        variables: Sequence[Variable],
        data: RobotData,
        make_arm: MakeArm,
        part: Part = Part.ROBOT,
        identity: str = "",
        warn: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.variables, self._data, self._make_arm = tuple(variables), data, make_arm
        self._part, self._identity, self._warn = part, identity, warn
        self.phase = INSTANTIATED
        self.time = 0.0
        self._stop = math.inf
        self._values: list[Any] = [v.start for v in variables]
        self._state: list[float] = []
        self._places = {v.name: place for place, v in enumerate(variables)}
        self._groups = [outputs.group(v.name) if v.causality == "output" else "" for v in variables]
        self._members: dict[str, list[int]] = {}
        for place, group in enumerate(self._groups):
            self._members.setdefault(group, []).append(place)
        own = ("q", "qd") if part is Part.CONTROLLER else ("q_start", "qd_start")
        self._state_names = own
        inputs = {v.name for v in variables if v.causality == "input"}
        self._inputs = [name for name in outputs.INPUTS if f"{name}[1]" in inputs]
        self._fresh: set[str] = {""}
        self._settings: Settings | None = None
        self._beyond: set[str] = set()
        self._asked: dict[tuple[tuple[int, ...], Sequence[str]], frozenset[str]] = {}

    # Values ---------------------------------------------------------------------------------

    def get(self, places: Sequence[int], bases: Sequence[str] = _BASES) -> list[Any]:
        """Values by reference, of types of the given bases.

        Outputs are computed when they are asked for.
        """
        asked = (tuple(places), bases)
        groups = self._asked.get(asked)
        if groups is None:
            self._must_be_of(places, bases)
            if len(self._asked) >= _REMEMBERED:
                self._asked.clear()
            groups = self._asked[asked] = frozenset(self._groups[place] for place in places)
        for group in groups - self._fresh:
            self._compute(group)
        values = self._values
        return [values[place] for place in places]

    def set(
        self, places: Sequence[int], values: Sequence[Any], bases: Sequence[str] = _BASES
    ) -> None:
        """Set inputs and parameters, of types of the given bases; all or, with an error, none."""
        self._must_be_of(places, bases)
        checked = [
            (place, self._checked(place, value))
            for place, value in zip(places, values, strict=True)
        ]
        for place, value in checked:
            self._values[place] = value
            if self.variables[place].causality != "input":
                self._settings = None
        if self._settings is not None:
            self._settings.inputs_changed()
        self._fresh = {""}

    def _must_be_of(self, places: Sequence[int], bases: Sequence[str]) -> None:
        """Refuse references of variables whose type is not of one of the bases."""
        for place in places:
            if not 0 <= place < len(self.variables):
                self._unknown(place)
            variable = self.variables[place]
            if variable.base not in bases:
                raise InputError(f"{variable.name} is of type {variable.base}, not {bases[0]}")

    def _checked(self, place: int, value: Any) -> Any:
        """The value as the variable's type has it."""
        variable = self.variables[place]
        if self.phase in (TERMINATED, FAILED):
            raise InputError(f"{variable.name} cannot be set: the instance is {self.phase}; reset")
        if variable.causality == "output":
            raise InputError(f"{variable.name} is an output; it cannot be set")
        if variable.variability == "fixed" and self.phase == STEPPING:
            raise InputError(
                f"{variable.name} is fixed; set it before the initialization ends, or reset"
            )
        items = TYPES[variable.type].items
        if items:
            if value not in range(1, len(items) + 1):
                raise InputError(f"{variable.name} = {value}: must be 1 to {len(items)}")
            return int(value)
        if variable.base == "Boolean":
            return bool(value)
        if not math.isfinite(value):
            raise InputError(f"{variable.name} = {value}: must be a finite number")
        if variable.low is not None and variable.causality == "parameter":
            self._in_range(variable, value)
        return float(value)

    @staticmethod
    def _in_range(variable: Variable, value: float) -> None:
        """Refuses what no robot has; angles of the start may lie beyond joint limits."""
        low, high = variable.low, variable.high
        if variable.type == "Angle" or low is None or high is None or low <= value <= high:
            return
        unit = TYPES[variable.type].unit
        raise InputError(f"{variable.name} = {value:g} {unit}: must be {low:g} to {high:g}")

    def _unknown(self, place: int) -> NoReturn:
        last = len(self.variables) - 1
        raise InputError(f"no variable has the value reference {place}; they go from 0 to {last}")

    # Phases ---------------------------------------------------------------------------------

    def setup(self, start: float, stop: float | None, tolerance: float | None) -> None:
        """The experiment's times (s). A tolerance changes nothing: steps are fixed."""
        self._must_be("setupExperiment", INSTANTIATED)
        if not math.isfinite(start):
            raise InputError(f"start time {start}: must be a finite number")
        if stop is not None and not stop >= start:
            raise InputError(f"stop time {stop}: must not lie before the start time {start}")
        if tolerance is not None and not 0.0 < tolerance < math.inf:
            raise InputError(f"tolerance {tolerance}: must be a positive number")
        self.time, self._stop = start, math.inf if stop is None else stop

    def enter(self) -> None:
        """Enter the initialization."""
        self._must_be("enterInitializationMode", INSTANTIATED)
        self.phase = INITIALIZING

    def leave(self) -> None:
        """End the initialization: from here on the state moves by steps alone."""
        self._must_be("exitInitializationMode", INITIALIZING)
        self._ready()
        self._state = [] if self._part is Part.CONTROLLER else self._current_state()
        self.phase = STEPPING

    def terminate(self) -> None:
        """End the simulation; values can still be read."""
        self._must_be("terminate", INSTANTIATED, INITIALIZING, STEPPING, FAILED)
        self.phase = TERMINATED

    def _must_be(self, call: str, *phases: str) -> None:
        if self.phase not in phases:
            wanted = " or ".join(phases)
            raise InputError(
                f"{call} in the wrong order: the instance is {self.phase}, not {wanted}"
            )

    # Steps ----------------------------------------------------------------------------------

    def step(self, time: float, size: float) -> None:
        """Move from `time` by `size` (s), the inputs held.

        Raises:
            InputError: the call, the time or the size cannot be used, or the motion left the
                range of numbers; the state stays as it was.
        """
        self._must_be("doStep", STEPPING)
        if not (math.isfinite(size) and size > 0.0):
            raise InputError(f"communication step {size} s: must be a positive number")
        slack = _SLACK * max(1.0, abs(time), abs(self.time))
        if not (math.isfinite(time) and abs(time - self.time) <= max(slack, 1e-6 * size)):
            raise InputError(
                f"communication point {time} s: the instance stands at {self.time} s; go on from "
                "there, or set back its state first"
            )
        if not time + size <= self._stop + max(slack, 1e-6 * size):
            raise InputError(
                f"communication step of {size} s at {time} s: it goes past the stop time, "
                f"{self._stop} s; make it smaller"
            )
        if self._part is Part.ROBOT:
            self._state = self._moved(time, size)
            self._watch(time + size)
        self.time, self._fresh = time + size, {""}

    def _moved(self, time: float, size: float) -> list[float]:
        """The state after a step, cut into equal internal ones."""
        settings = self._ready()
        parts = max(1, math.ceil(size / settings.step - 1e-9))
        state, h = self._state, size / parts
        for k in range(parts):
            state = settings.advance(time + k * h, state, h)
            if not all(map(math.isfinite, state)):
                self._diverged(time + k * h, settings)
        return state

    def _diverged(self, time: float, settings: Settings) -> NoReturn:
        self.phase = FAILED
        reason = settings.plant.trouble or "the motion is faster than the step can follow"
        q, qd = self._state[:6], self._state[6:]
        numbers = (" ".join(f"{v:.6g}" for v in row) for row in (q, qd))
        raise InputError(
            "at {:.6g} s the state leaves the range of numbers: {}; before, q = {} rad, qd = {} "
            "rad/s; reset, then try smaller torques or a smaller solver.step".format(
                time, reason, *numbers
            )
        )

    def _watch(self, time: float) -> None:
        """Warn of each joint that newly is beyond its limits."""
        for joint, angle in zip(self._data.joints, self._state, strict=False):
            inside = joint.lower <= angle <= joint.upper
            if inside:
                self._beyond.discard(joint.name)
            elif joint.name not in self._beyond:
                self._beyond.add(joint.name)
                self._warn(
                    f"at {time:.6g} s {joint.name} is at {angle:.4g} rad, outside its range "
                    f"of {joint.lower:.4g} to {joint.upper:.4g} rad"
                )

    # State ----------------------------------------------------------------------------------

    def save(self) -> dict[str, Any]:
        """All there is to know of the instance, JSON-ready."""
        known = [v for v, variable in zip(self._values, self.variables, strict=True)
                 if variable.causality != "output"]  # fmt: skip
        return {
            "schema": _STATE_SCHEMA, "identity": self._identity, "phase": self.phase,
            "time": self.time, "state": list(self._state), "values": known,
            "beyond": sorted(self._beyond),
        }  # fmt: skip

    def restore(self, saved: Any) -> None:
        """Go back to what `save` gave."""
        if not isinstance(saved, dict) or saved.get("schema") != _STATE_SCHEMA:
            raise InputError("the bytes are no state of this FMU; use those it serialized")
        if saved["identity"] != self._identity:
            raise InputError("the state is of another build of this FMU; use the same build")
        known = iter(saved["values"])
        self._values = [None if v.causality == "output" else next(known) for v in self.variables]
        self.phase, self.time = saved["phase"], saved["time"]
        self._state, self._beyond = list(saved["state"]), set(saved["beyond"])
        self._settings, self._fresh = None, {""}

    # What is behind --------------------------------------------------------------------------

    def _current_state(self) -> list[float]:
        """Angles and speeds; those of the start until the initialization has ended.

        For a controller, those measured.
        """
        if self._state:
            return self._state
        return [v for name in self._state_names for v in self._six(name)]

    def _ready(self) -> Settings:
        """The plant and controller of the values as they are."""
        if self._settings is None:
            names = {v.name: x for v, x in zip(self.variables, self._values, strict=True)}
            self._settings = Settings(self._data, names, self._make_arm)
        if self._settings.stale:
            self._settings.take_inputs({name: self._six(name) for name in self._inputs})
        return self._settings

    def _six(self, name: str) -> list[float]:
        first = self._places[six(name)[0]]
        return list(self._values[first : first + 6])

    def _compute(self, group: str) -> None:
        """Compute one group of outputs."""
        state, settings = self._current_state(), self._ready()
        found = outputs.compute(group, settings, self.time, state[:6], state[6:])
        for place, value in zip(self._members[group], found, strict=True):
            self._values[place] = value
        self._fresh.add(group)
