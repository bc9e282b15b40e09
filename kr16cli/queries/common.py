"""What the questions share: the answer, the base class, limits, and poses as 4x4 lists."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from kr16cli import kuka, units
from kr16cli.errors import InputError, Kr16Error
from kr16cli.krl import parse_krl
from kr16cli.model.task import product
from kr16cli.robot import RobotData
from kr16cli.single import Arm
from kr16cli.tolerances import TOLERANCES

if TYPE_CHECKING:
    from kr16cli.api import Robot
    from kr16cli.queries.many import Many

Matrix = list[list[float]]

# Beyond this nothing is a length, speed or mass, and what fails to be computed is no bug.
_HUGE = 1e30


class Answer(NamedTuple):
    """The result of one question.

    `status` is "ok", or a word for why there is no full answer, which `problem` then says in a
    sentence. `q` is the configuration that a following row should stay near, rad.
    """

    result: dict[str, Any]
    warnings: list[str]
    status: str = "ok"
    problem: str | None = None
    q: list[float] | None = None


def _all_finite(value: Any) -> bool:
    """Whether every number in a result is finite."""
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, Mapping):
        return all(map(_all_finite, value.values()))
    if isinstance(value, (list, tuple)):
        return all(map(_all_finite, value))
    return True


def _is_huge(value: Any) -> bool:
    """Whether a number is so large that its powers may overflow."""
    if isinstance(value, (float, int)):
        return abs(value) > _HUGE
    if isinstance(value, Mapping):
        return any(map(_is_huge, value.values()))
    return isinstance(value, (list, tuple)) and any(map(_is_huge, value))


class Question(ABC):
    """A question asked once or for each row of a batch.

    `reads` names its input, "q" or "pose"; `optional` further groups of numbers a row may
    have. `units` are those of the result; `options` what was asked beside the input.
    """

    name: ClassVar[str]
    reads: ClassVar[str] = "q"
    optional: ClassVar[tuple[str, ...]] = ()

    units: dict[str, str]
    column_units: dict[str, str]
    options: dict[str, Any]
    arm: Arm

    def __init__(self, data: RobotData, *, si: bool) -> None:
        self.data, self.si = data, si
        self.angle_unit, self.length_unit = ("rad", "m") if si else ("deg", "mm")

    @abstractmethod
    def answer(self, values: Mapping[str, Any]) -> Answer:
        """Answer for one set of input numbers, as typed, by group."""

    def finite_answer(self, values: Mapping[str, Any]) -> Answer:
        """The answer; InputError where its numbers exceed what a double can hold."""
        try:
            answer = self.answer(values)
        except Kr16Error:
            raise
        except (ArithmeticError, ValueError):  # inf - inf in a sum, a number lost beside another
            if not _is_huge((values, self.options)):
                raise
            answer = None
        if answer is None or not _all_finite(answer.result):
            raise InputError(
                f"{self.name}: the numbers typed are so large that the result overflows "
                "(1.8e308); give smaller ones"
            )
        return answer

    # Many rows ------------------------------------------------------------------------------

    @cached_property
    def robot(self) -> Robot:
        """The arm on arrays."""
        from kr16cli.api import Robot

        return Robot(self.arm.data, payload=self.arm.payload, drives=self.arm.drives)

    def quicken(self) -> None:
        """Prepare for thousands of answers one by one: the arm's functions are written out."""
        from kr16cli.kernels.straight import straight_arm

        self.arm = straight_arm(self.arm.data, payload=self.arm.payload, drives=self.arm.drives)

    def takes_many(self, kind: str) -> bool:
        """Whether `many` gives all that an output of a kind (csv, npz) holds."""
        return kind in ("csv", "npz")

    @abstractmethod
    def many(self, values: Mapping[str, Any]) -> Many:
        """Answers to typed numbers by group: arrays (n, 6), or (n, 4, 4) as `T`."""

    @property
    def beyond_columns(self) -> dict[str, str]:
        """What was asked for that a CSV row has no columns for, and where it is."""
        return {}

    @abstractmethod
    def columns(self, result: Mapping[str, Any] | None) -> dict[str, Any]:
        """One CSV row of a result; with None, the same columns without values."""

    @abstractmethod
    def arrays(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """Arrays of a result for npz, as nested lists."""

    def envelope(
        self, inputs: Mapping[str, Any], result: Mapping[str, Any], warnings: Sequence[str]
    ) -> dict[str, Any]:
        """A result in the envelope that all commands share."""
        return {
            "schema": f"kr16.{self.name}/1",
            "robot": self.data.name,
            "model_sha256": self.data.sha256,
            "units": self.units,
            "input": inputs,
            "result": result,
            "warnings": list(warnings),
        }

    @property
    def csv_units(self) -> str:
        """The units of a CSV row in a word or two."""
        return f"{self.length_unit} {self.angle_unit}"

    def follow(self, answer: Answer) -> None:  # noqa: B027  (only inverse kinematics cares)
        """Let the next row stay near this answer."""

    def read_krl(self, text: str) -> list[float]:
        """The input from KRL text: joint angles here."""
        values = parse_krl(text).numbers(kuka.AXIS_FIELDS)
        return [units.rad(v) for v in values] if self.si else values

    # Conversions ----------------------------------------------------------------------------

    def radians(self, angles: Sequence[float]) -> list[float]:
        """Typed angles in rad."""
        return list(angles) if self.si else [units.rad(v) for v in angles]

    def angles(self, values: Sequence[float]) -> list[float]:
        """Angles (rad) in the unit of the result."""
        return [v + 0.0 if self.si else units.deg(v) + 0.0 for v in values]

    def lengths(self, values: Sequence[float]) -> list[float]:
        """Lengths (m) in the unit of the result."""
        return [v + 0.0 if self.si else units.mm(v) + 0.0 for v in values]

    def trig(self, angles: Sequence[float]) -> list[tuple[float, float]] | None:
        """(cos, sin) of typed degrees, exact at quarter turns; None in rad: nothing to gain."""
        return None if self.si else [units.cos_sin_deg(v) for v in angles]

    def pose_matrix(self, pose: Sequence[float] | None) -> Matrix | None:
        """A typed pose as 4x4 (m)."""
        return None if pose is None else kuka.matrix_from_pose(pose, si=self.si)

    def violations(self, q: Sequence[float]) -> list[dict[str, Any]]:
        """Joints outside their limits: joint, value, limit and excess, in the result's unit."""
        found = []
        for angle, joint in zip(q, self.data.joints, strict=True):
            limit = joint.lower if angle < joint.lower else joint.upper
            excess = abs(angle - limit)
            if not joint.lower <= angle <= joint.upper and excess > TOLERANCES.limit:
                value, shown, over = self.angles((angle, limit, excess))
                found.append({"joint": joint.name, "value": value, "limit": shown, "excess": over})
        return found

    def limit_warnings(self, q: Sequence[float]) -> list[str]:
        """A sentence for each joint outside its limits."""
        return [limit_text(v, self.angle_unit) for v in self.violations(q)]


def limit_text(violation: Mapping[str, Any], unit: str) -> str:
    """A violation in words."""
    return (
        f"{violation['joint']} is {violation['value']:.6g} {unit}, beyond its limit "
        f"{violation['limit']:.6g} {unit} by {violation['excess']:.4g} {unit}"
    )


def inverse_pose(T: Sequence[Sequence[float]]) -> Matrix:
    """Inverse of a 4x4 rigid transform."""
    rotation = [[T[j][i] for j in range(3)] for i in range(3)]
    rows = [[*row, -sum(r * T[k][3] for k, r in enumerate(row))] for row in rotation]
    return [*rows, [0.0, 0.0, 0.0, 1.0]]


def chained(before: Matrix | None, pose: Matrix, after: Matrix | None) -> Matrix:
    """Product of three 4x4 transforms; None stands for the identity."""
    result = pose if before is None else product(before, pose)
    result = result if after is None else product(result, after)
    finite: Matrix = plain(result)
    return finite


def plain(value: Any) -> Any:
    """Numbers as floats without -0.0, in lists of the same shape; InputError on overflow."""
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    number = float(value) + 0.0
    if not math.isfinite(number):
        raise InputError("the result is not finite: a number of the input is too large")
    return number


def flat(name: str, value: Any) -> dict[str, Any]:
    """A vector or matrix as columns name_1 or name_11; a number as itself."""
    if not isinstance(value, list):
        return {name: value}
    if value and isinstance(value[0], list):
        return {f"{name}_{i}{j}": v for i, row in enumerate(value, 1) for j, v in enumerate(row, 1)}
    return {f"{name}_{i}": v for i, v in enumerate(value, 1)}
