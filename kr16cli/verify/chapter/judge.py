"""Executes a statement and finds whether its verdict is borne out."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.verify.chapter.bench import CHOICES, Bench
from kr16cli.verify.chapter.records import Equation, Found, Kind, Statement, Values
from kr16cli.verify.chapter.scalars import DIGITS, Degree, Scalar

PRECISE = 1e-40
"""Largest difference of 50-digit values that counts as rounding."""

SEEN = 1e-9
"""A float64 difference above this is an error and no rounding."""


def judge(section: str, s: Statement, bench: Bench) -> Equation:
    """Execute one statement; a check that raises leaves the verdict unproved."""
    try:
        kind, found = _found(s, bench)
    except Exception as reason:  # whatever a broken model meets, the other statements still run
        text = f"{type(reason).__name__}: {reason}"
        kind, found = "none", Found(False, float("inf"), text, "could not be executed")
    proof = found.proof if found.proved else f"NOT PROVED: {found.proof}"
    return Equation(
        section=section,
        id=s.id,
        part=s.part,
        says=s.says,
        verdict=s.verdict,
        correction=s.correction,
        convention=s.convention,
        evidence=_sentences(s.convention and f"Convention: {s.convention}", found.evidence, s.note),
        proof=proof,
        kind=kind,
        residual=found.residual,
        error=found.error,
        unit=s.unit,
        proved=found.proved,
    )


def _sentences(*parts: str | None) -> str:
    return " ".join(p if p.endswith(".") else f"{p}." for p in parts if p)


def _found(s: Statement, bench: Bench) -> tuple[Kind, Found]:
    if s.check is not None:
        return "counted", s.check(bench)
    if s.truth is None:
        return "none", Found(True, 0.0, "a definition: nothing to prove", "")
    return ("exact" if s.exact else "50 digits"), _compared(s, s.truth, bench)


def _compared(s: Statement, truth: Values, bench: Bench) -> Found:
    """Compare all forms of an equation at the points its kind asks for."""
    points = bench.exact if s.exact else bench.precise
    true = [[*truth(p)] for p in points]
    accepted = s.corrected or s.printed

    def same(form: Values) -> bool:
        return all(equal(form(p), t, s.exact) for p, t in zip(points, true, strict=True))

    failures: list[str] = []
    if accepted and not same(accepted):
        failures.append(f"{'corrected' if s.corrected else 'printed'} form and Table 3.1 differ")
    if s.corrected and s.printed and same(s.printed):
        failures.append("the printed form holds")
    if any(same(other) for other in s.otherwise):
        failures.append("another reading holds as well")
    if s.model and not all(
        equal(s.model(p), t, s.exact) for p, t in zip(points, true, strict=True)
    ):
        failures.append("the model differs")
    forms = [f for f in (accepted, s.model) if f]
    how = _exactly(forms, truth, bench) if s.exact else _precisely(len(points), bench)

    floats = [(p, truth(p)) for p in bench.floats]
    residual = max((spread(f(p), t) for f in forms for p, t in floats), default=0.0)
    wrong = [f for f in (s.printed if s.corrected else None, *s.otherwise) if f]
    errors = [max(spread(f(p), t) for p, t in floats) for f in wrong]
    if any(error < SEEN for error in errors):
        failures.append("a wrong reading is not seen in float64")
    return Found(
        proved=not failures,
        residual=residual,
        proof="; ".join(failures) or how,
        evidence=_evidence(s, residual, errors, len(floats)),
        error=errors[0] if s.corrected and errors else None,
    )


def _evidence(s: Statement, residual: float, errors: Sequence[float], count: int) -> str:
    with_model = " and the model" if s.model else ""
    unit = "" if s.unit == "1" else f" {s.unit}"
    if s.verdict == "misprint":
        text = (
            f"Printed form off by up to {errors[0]:.3g}{unit}; corrected form agrees with "
            f"Table 3.1{with_model} to {residual:.1e} (float64, {count} configurations)."
        )
        rest = errors[1:]
        return text + (f" Other readings off by {_list(rest)}{unit}." if rest else "")
    form = "Supplied form" if s.verdict == "missing" else "Printed form"
    subject = f"{form} agrees with Table 3.1{with_model}" if s.printed or s.corrected else (
        "The model agrees with Table 3.1")  # fmt: skip
    text = f"{subject} to {residual:.1e}{unit} (float64, {count} configurations)."
    return text + (f" Read otherwise it is off by {_list(errors)}{unit}." if errors else "")


def _list(errors: Sequence[float]) -> str:
    return ", ".join(f"{error:.3g}" for error in errors)


def _exactly(forms: Sequence[Values], truth: Values, bench: Bench) -> str:
    """How sure the exact comparison is: Schwartz and Zippel with the degree as counted."""
    sides = [*truth(bench.degree), *(v for form in forms for v in form(bench.degree))]
    degree = max((v.bound for v in sides if isinstance(v, Degree)), default=0)
    n = len(bench.exact)
    if degree == 0:
        return "exact: constants"
    return (
        f"exact: fractions at {n} random rational point{'s' * (n > 1)} (seed {bench.seed}), "
        f"degree <= {degree}, "
        f"each variable from {CHOICES} values: a false identity passes with probability "
        f"<= {(degree / CHOICES) ** n:.0e}"
    )


def _precisely(count: int, bench: Bench) -> str:
    return (
        f"{DIGITS} digits: equal to {PRECISE:.0e} at {count} random configurations "
        f"(seed {bench.seed + 1})"
    )


def equal(a: Sequence[Scalar], b: Sequence[Scalar], exact: bool) -> bool:
    """Whether `a` is `b`, or `b` repeated (the same thing computed in several ways)."""
    if not a or len(a) % len(b):
        return False
    gaps = [x - b[i % len(b)] for i, x in enumerate(a)]
    return all(gap == 0 if exact else abs(gap) <= PRECISE for gap in gaps)


def spread(a: Sequence[Scalar], b: Sequence[Scalar]) -> float:
    """Largest difference of components in float64."""
    return max(abs(float(x - b[i % len(b)])) for i, x in enumerate(a))
