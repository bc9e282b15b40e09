"""The audit of the chapter as cases, one for each of its parts."""

from __future__ import annotations

import math
from collections import Counter

from kr16cli.verify.chapter import SECTIONS, audit_section, to_json
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case

_TITLES = {
    "forward": "Section 3.1: Table 3.1 and (3.1) to (3.6)",
    "inverse": "Section 3.2: wrist centre and first three joints, (3.7) to (3.20)",
    "wrist": "Section 3.2: last three joints and singularities, (3.21) to (3.28)",
    "velocity": "Section 3.3: mass centres and Jacobians, (3.29) to (3.36)",
    "singularities": "Section 3.4: singularities of the Jacobian, (3.37)",
    "dynamics": "Section 3.5: mass matrix, Coriolis matrix, gravity, (3.38) to (3.43)",
    "task": "Section 3.6: roll-pitch-yaw and the rate of the Jacobian, (3.44) to (3.51)",
}

_FUNCTIONS = {
    "forward": ("chain.frames", "chain.dh_table", "forward.flange"),
    "inverse": ("forward.arm", "inverse.wrist_centre"),
    "wrist": ("forward.r36", "inverse.solve"),
    "velocity": ("energy.mass_centres", "jacobian.jacobian"),
    "singularities": ("jacobian.determinant",),
    "dynamics": (
        "dynamics.mass_matrix",
        "dynamics.inverse_dynamics",
        "dynamics.gravity_torque",
        "coriolis.coriolis_matrix",
        "coriolis.christoffel",
        "energy.potential",
        "inertia.link_body",
        "inertia.regroup",
    ),
    "task": (
        "orientation.rotation_from_rpy",
        "orientation.rpy_from_rotation",
        "orientation.rate_matrix",
        "jacobian.jacobian_dot",
    ),
}


def _found(section: str, setting: Setting) -> Finding:
    """All statements of a section proved: the worst float64 residual; else infinite."""
    equations = audit_section(section, setting)
    open_ones = [e for e in equations if not e.proved]
    worst = max(equations, key=lambda e: e.residual)
    count = Counter(e.verdict for e in equations)
    verdicts = ", ".join(f"{n} {verdict}" for verdict, n in sorted(count.items()))
    evidence = f"{len(equations)} statements of the chapter proved: {verdicts}"
    if open_ones:
        named = "; ".join(f"{_name(e.id, e.part)}: {e.proof}" for e in open_ones[:3])
        evidence = f"{len(open_ones)} of {len(equations)} statements not proved: {named}"
    return Finding(
        error=math.inf if open_ones else worst.residual,
        samples=len(equations),
        worst={"statement": _name(worst.id, worst.part), "unit": worst.unit},
        evidence=evidence,
        figures={"equations": [to_json(e) for e in equations]},
    )


def _name(id: str, part: tuple[int, ...] | None) -> str:
    return id if part is None else f"{id} {list(part)}"


def _register(section: str) -> None:
    @case(
        f"chapter.{section}",
        title=_TITLES[section],
        statement="every printed statement has the verdict the audit gives it, and the model "
        "agrees with each statement that holds and each correction",
        regime="random rational arms and angles; 50-digit and float64 angles of chapter3.toml",
        method="the printed text executed against the arm of Table 3.1 and the model: exact "
        "fractions where both sides are polynomial, 50 digits elsewhere; float64 beside",
        grade="B",
        tolerance=1e-11,
        unit="SI, of the statement",
        reason="the verdicts are proved apart from float64; its residual is rounding of values "
        "up to 1e3 (J, N m). An unproved verdict fails whatever the residual",
        equations=tuple(dict.fromkeys(s.id for s in SECTIONS[section])),
        functions=tuple(f"kr16cli.model.{name}" for name in _FUNCTIONS[section]),
    )
    def run(setting: Setting) -> Finding:
        return _found(section, setting)


for _section in SECTIONS:
    _register(_section)
