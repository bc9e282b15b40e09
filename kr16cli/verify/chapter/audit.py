"""Judges the whole chapter, in its order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from kr16cli.verify.chapter import (
    model_side,
    printed_dynamics,
    printed_forward,
    printed_inverse,
    printed_singularities,
    printed_task,
    printed_velocity,
    printed_wrist,
)
from kr16cli.verify.chapter.bench import shared_bench
from kr16cli.verify.chapter.judge import judge
from kr16cli.verify.chapter.records import Equation, Statement
from kr16cli.verify.records import Setting

SECTIONS: Mapping[str, Sequence[Statement]] = {
    "forward": printed_forward.STATEMENTS,
    "inverse": printed_inverse.STATEMENTS,
    "wrist": printed_wrist.STATEMENTS,
    "velocity": printed_velocity.STATEMENTS,
    "singularities": printed_singularities.STATEMENTS,
    "dynamics": printed_dynamics.STATEMENTS,
    "task": printed_task.STATEMENTS,
}
"""Section 3.1, section 3.2 to (3.20) and from (3.21), sections 3.3 to 3.6."""


def audit(setting: Setting) -> list[Equation]:
    """Every statement of the chapter with its verdict and proof, in the chapter's order.

    The arm of the audit is `data/chapter3.toml` (and random rational arms), whatever robot is
    set; `setting` gives the seed and whether to draw fewer points.
    """
    return [e for name in SECTIONS for e in audit_section(name, setting)]


def audit_section(name: str, setting: Setting) -> list[Equation]:
    """The statements of one of `SECTIONS`."""
    model_side.forget()
    bench = shared_bench(setting.seed, setting.quick)
    return [judge(name, s, bench) for s in SECTIONS[name]]


def to_json(equation: Equation) -> dict[str, Any]:
    """An equation as `result.equations` has it: JSON-ready, `part` a list or null.

    A residual or error that could not be computed is null.
    """
    return {
        "id": equation.id,
        "part": None if equation.part is None else list(equation.part),
        "says": equation.says,
        "verdict": equation.verdict,
        "correction": equation.correction,
        "convention": equation.convention,
        "evidence": equation.evidence,
        "proof": equation.proof,
        "proved": equation.proved,
        "kind": equation.kind,
        "residual": _finite(equation.residual),
        "error": _finite(equation.error),
        "unit": equation.unit,
        "section": equation.section,
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
