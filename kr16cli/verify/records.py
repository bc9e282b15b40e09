"""What a verification case states and what it found; plain data that JSON can carry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from kr16cli.api import Robot

Grade = Literal["A", "B", "C", "D"]
"""Independence. A: an outside number with its source, or another engine. B: code that imports
nothing from kr16cli.model. C: an identity. D: a self round trip."""

Outcome = Literal["passed", "failed", "skipped"]


@dataclass(frozen=True)
class Setting:
    """What a run is made with: the robot, the seed, and whether to be quick."""

    robot: Robot
    seed: int = 20161
    quick: bool = False

    def samples(self, full: int, quick: int) -> int:
        """How many samples to draw."""
        return quick if self.quick else full


@dataclass(frozen=True)
class Finding:
    """What one evaluation of a case found.

    `error` is the worst measured value, compared with the case's tolerance; `worst` names the
    inputs of it (degrees and mm, to be pasted into `kr16 fk`); `evidence` says in words what
    was compared; `figures` holds numbers a report draws (name -> list).
    """

    error: float
    samples: int
    worst: Mapping[str, Any]
    evidence: str
    figures: Mapping[str, Any] = field(default_factory=dict)


class SkipCase(Exception):  # noqa: N818  # no error: the case does not apply here
    """Raised by a case that cannot run here; the message says what is missing."""


@dataclass(frozen=True)
class Case:
    """One property: what holds, where it was sampled, how well it must hold and why.

    `method` says what was computed against what; `equations` the chapter's numbers it bears on;
    `functions` the dotted names it exercises (for the traceability table); `engine` names
    somebody else's engine that it needs.
    """

    id: str
    suite: str
    title: str
    statement: str
    regime: str
    method: str
    grade: Grade
    tolerance: float
    unit: str
    reason: str
    run: Callable[[Setting], Finding]
    equations: tuple[str, ...] = ()
    functions: tuple[str, ...] = ()
    engine: str | None = None


@dataclass(frozen=True)
class Result:
    """A case together with what a run found; `error` is None where it did not run."""

    id: str
    group: str
    title: str
    statement: str
    regime: str
    method: str
    grade: Grade
    error: float | None
    tolerance: float
    unit: str
    reason: str
    status: Outcome
    samples: int
    seed: int
    worst: Mapping[str, Any]
    evidence: str
    equations: tuple[str, ...] = ()
    functions: tuple[str, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)

    @property
    def margin(self) -> float | None:
        """Error over tolerance; below 1 passes."""
        return None if self.error is None else self.error / self.tolerance
