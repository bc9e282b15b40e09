"""What the audit states about the chapter and what it found."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from kr16cli.verify.chapter.arm import Point
from kr16cli.verify.chapter.language import evaluate
from kr16cli.verify.chapter.scalars import Scalar

if TYPE_CHECKING:
    from kr16cli.verify.chapter.bench import Bench

Verdict = Literal["holds", "holds-under-convention", "misprint", "definition", "missing"]
Kind = Literal["exact", "50 digits", "counted", "none"]
Values = Callable[[Point], Sequence[Scalar]]
"""One side of an equation: its components at a configuration."""


@dataclass(frozen=True)
class Found:
    """What a claim's own check found: whether the verdict is borne out, and how.

    `residual` is of the accepted form, `error` of a wrong printed form; both float64.
    """

    proved: bool
    residual: float
    proof: str
    evidence: str
    error: float | None = None


@dataclass(frozen=True)
class Statement:
    """A statement of the chapter with the verdict to be proved.

    `printed`, `truth` (from Table 3.1 and derivatives), `corrected` and `model` (the same
    quantity by kr16cli.model, one or several times) are executed. `otherwise` are other
    readings of the printed form that must fail: of a convention, the other convention; of a
    misprint, readings that might have saved it. `check` replaces all of these for a claim that
    is no equation. `exact` asks for rational points, else 50 digits.
    """

    id: str
    part: tuple[int, ...] | None
    says: str
    verdict: Verdict
    printed: Values | None = None
    truth: Values | None = None
    corrected: Values | None = None
    correction: str | None = None
    convention: str | None = None
    otherwise: tuple[Values, ...] = ()
    model: Values | None = None
    check: Callable[[Bench], Found] | None = None
    note: str = ""
    unit: str = "1"
    exact: bool = True


@dataclass(frozen=True)
class Equation:
    """A judged statement.

    `residual` is the largest float64 difference between the accepted form and the truth,
    `error` that of a wrong printed form, both in `unit` at configurations of the chapter's arm.
    `proved` says whether the proof bears the verdict out; `section` is the audit's own.
    """

    section: str
    id: str
    part: tuple[int, ...] | None
    says: str
    verdict: Verdict
    correction: str | None
    convention: str | None
    evidence: str
    proof: str
    kind: Kind
    residual: float
    error: float | None
    unit: str
    proved: bool


def formula(text: str, **more: Scalar) -> Values:
    """A printed right-hand side as one side of an equation (a bracketed list: all of it)."""

    def run(p: Point) -> Sequence[Scalar]:
        value = evaluate(text, p, **more)
        return value if isinstance(value, list) else [value]

    return run


def element(
    id: str,
    part: tuple[int, ...] | None,
    name: str,
    text: str,
    truth: Values,
    *,
    model: Values | None = None,
    unit: str = "1",
    correction: str | None = None,
    note: str = "",
) -> Statement:
    """A printed scalar `name = text`: holds, or is a misprint where `correction` has a text."""
    return Statement(
        id,
        part,
        f"{name} = {text}",
        "holds" if correction is None else "misprint",
        printed=formula(text),
        truth=truth,
        corrected=None if correction is None else formula(correction),
        correction=None if correction is None else f"{name} = {correction}",
        model=model,
        note=note,
        unit=unit,
    )


def definition(
    id: str, says: str, note: str = "", part: tuple[int, ...] | None = None
) -> Statement:
    """A statement that names something; there is nothing to prove."""
    return Statement(id, part, says, "definition", note=note)
