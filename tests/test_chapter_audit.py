"""The audit of the chapter: complete, proved, and quick to see a wrong sign anywhere."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import kr16cli
from kr16cli.assets import asset
from kr16cli.model import chain, coriolis, dynamics, forward, inverse, jacobian, orientation
from kr16cli.verify import registry
from kr16cli.verify.chapter import SECTIONS, Equation, audit, audit_section, bench, motion, to_json
from kr16cli.verify.chapter.arm import Point, flat, product, rate
from kr16cli.verify.chapter.judge import judge
from kr16cli.verify.chapter.language import angle, evaluate
from kr16cli.verify.chapter.recipe import Recipe, placed
from kr16cli.verify.chapter.records import Statement, element, formula
from kr16cli.verify.chapter.scalars import FLOATS, Degree, Dual
from kr16cli.verify.records import Setting

MISPRINTS = {
    ("3.4", (3,)),
    ("3.13", None),
    ("text after 3.13", None),
    ("text after 3.14", None),
    ("3.21", None),
    ("3.24", None),
    ("3.28", None),
    ("text after 3.30", None),
    ("3.32", None),
    ("3.32", (2,)),
    ("3.32", (6,)),
    ("text after 3.32", None),
    ("3.33", None),
    ("3.33", (6,)),
    ("text after 3.36", None),
    ("3.39", (2, 2)),
    ("3.41", None),
    ("3.43", None),
    ("text after 3.43", None),
    ("3.48", None),
    ("text after 3.48", None),
    ("text after 3.51", None),
}

CONVENTIONS = {
    "3.1", "3.2", "3.11", "3.12", "3.16", "3.23", "3.25", "3.29", "3.45", "3.50", "3.51",
    "diffeomorphism, text after 3.36", "text after 3.46",
}  # fmt: skip

ELEMENTS = {
    "3.3": 4, "3.4": 4, "3.5": 4, "3.6": 4, "3.9": 3, "3.15": 2, "3.22": 9, "3.27": 9,
    "3.34": 6, "3.36": 36, "3.39": 9, "3.45": 3, "3.46": 9, "Table 3.1": 7,
}  # fmt: skip


@pytest.fixture(scope="module")
def setting(robot: kr16cli.Robot) -> Setting:
    return Setting(robot, quick=True)


@pytest.fixture(scope="module")
def equations(setting: Setting) -> list[Equation]:
    return audit(setting)


def named(equations: list[Equation], id: str, part: tuple[int, ...] | None = None) -> Equation:
    (found,) = [e for e in equations if (e.id, e.part) == (id, part)]
    return found


def test_every_verdict_is_proved(equations: list[Equation]) -> None:
    assert [(e.id, e.part, e.proof) for e in equations if not e.proved] == []


@pytest.mark.slow
def test_every_verdict_is_proved_with_more_points_and_another_seed(robot: kr16cli.Robot) -> None:
    assert all(e.proved for e in audit(Setting(robot, seed=7)))


def test_every_number_of_the_chapter_is_there(equations: list[Equation]) -> None:
    ids = {e.id for e in equations}
    assert {f"3.{k}" for k in range(1, 52)} <= ids
    assert {i for i in ids if i[0].isdigit()} == {f"3.{k}" for k in range(1, 52)}


def test_every_printed_element_is_judged_by_itself(equations: list[Equation]) -> None:
    counts = {id: sum(e.id == id and e.part is not None for e in equations) for id in ELEMENTS}
    assert counts == ELEMENTS


def test_no_statement_is_listed_twice(equations: list[Equation]) -> None:
    keys = [(e.id, e.part) for e in equations]
    assert len(keys) == len(set(keys))


def test_misprints_are_these_and_no_others(equations: list[Equation]) -> None:
    assert {(e.id, e.part) for e in equations if e.verdict == "misprint"} == MISPRINTS


def test_conventions_are_these_and_no_others(equations: list[Equation]) -> None:
    found = {e.id for e in equations if e.verdict == "holds-under-convention"}
    assert found == CONVENTIONS
    assert all(e.convention for e in equations if e.id in CONVENTIONS and e.part is None
               and e.verdict == "holds-under-convention")  # fmt: skip


def test_missing_parts_are_supplied(equations: list[Equation]) -> None:
    missing = {(e.id, e.part): e.correction for e in equations if e.verdict == "missing"}
    assert set(missing) == {("3.3", (4,)), ("3.35", None)}
    assert all(missing.values())


def test_every_misprint_has_a_correction_and_a_size(equations: list[Equation]) -> None:
    for e in equations:
        if e.verdict == "misprint":
            assert e.correction
            assert e.error is not None
            assert e.error > 0.05
        else:
            assert e.error is None


def test_float64_residuals_are_rounding(equations: list[Equation]) -> None:
    assert max(e.residual for e in equations) < 1e-11


def test_exact_proofs_state_how_sure_they_are(equations: list[Equation]) -> None:
    for e in equations:
        if e.kind == "exact" and e.proof != "exact: constants":
            bound = re.search(r"probability <= (\S+)", e.proof)
            assert bound is not None
            assert float(bound[1]) < 1e-4


def test_json_obeys_its_schema(equations: list[Equation]) -> None:
    schema = json.loads(asset("data/schemas/verify_chapter.json").read_text(encoding="utf-8"))
    result = json.loads(json.dumps({"equations": [to_json(e) for e in equations]}, allow_nan=False))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(result, schema)
    broken = {"equations": [{**result["equations"][0], "verdict": "right"}]}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(broken, schema)


def test_printed_size_of_an_error_is_what_its_formula_gives() -> None:
    """(3.4)[3] at q = 0 but q6 = 90 deg: printed -1, right 1."""
    angles = {f"q{i}": (1, 0) for i in range(1, 6)} | {"q6": (0, 1)}
    p = Point(angles, {})
    assert evaluate("(s23*s5 - c23*c4*c5)", p) == -1
    assert evaluate("c23*c6*s4 - s6*(s23*s5 - c23*c4*c5)", p) == 1


def test_printed_special_cases_cannot_see_the_misprint_of_3_41() -> None:
    p = bench.Bench(1, quick=True).exact[0]
    right = motion.coriolis(p, motion.christoffel(p))
    wrong = motion.coriolis(p, motion.christoffel(p, printed=True))
    same = {(i + 1, j + 1) for i in range(6) for j in range(6) if right[i][j] == wrong[i][j]}
    assert {(5, 5), (6, 6)} <= same
    assert (5, 6) not in same


def test_printed_recipe_misses_the_pose_and_the_corrected_one_does_not() -> None:
    p = bench.Bench(3, quick=True).floats[0]
    pose = p.frames[6][:3]

    def miss(changes: dict[str, str]) -> float:
        ends = [placed(p, q).frames[6] for q in Recipe(p, changes).solutions(pose)]
        gaps = [abs(e[i][j] - pose[i][j]) for e in ends for i in range(3) for j in range(4)]
        return max(gaps, default=9.0)

    assert miss({}) < 1e-12
    assert miss({"d": "((o_c1 - a1)^2 + (o_c2 - d1)^2)^2"}) > 1e-2
    assert miss({"q51": "acos(r33)", "q52": "-acos(r33)"}) > 1e-2


# The judge itself ---------------------------------------------------------------------------


def judged(s: Statement) -> Equation:
    return judge("forward", s, bench.Bench(5, quick=True))


def statement(id: str, part: tuple[int, ...] | None) -> Statement:
    (found,) = [s for x in SECTIONS.values() for s in x if (s.id, s.part) == (id, part)]
    return found


@pytest.mark.parametrize(("id", "part"), sorted(MISPRINTS, key=str))
def test_the_printed_form_is_no_correction(id: str, part: tuple[int, ...] | None) -> None:
    s = statement(id, part)
    wrong = judged(dataclasses.replace(s, corrected=s.printed))
    assert not wrong.proved
    assert wrong.proof.startswith("NOT PROVED: corrected form and Table 3.1 differ")


@pytest.mark.parametrize(("id", "part"), sorted(MISPRINTS, key=str))
def test_what_is_right_cannot_be_called_a_misprint(id: str, part: tuple[int, ...] | None) -> None:
    s = statement(id, part)
    wrong = judged(dataclasses.replace(s, printed=s.corrected))
    assert not wrong.proved
    assert "the printed form holds" in wrong.proof


@pytest.mark.parametrize(("id", "part"), sorted(MISPRINTS, key=str))
def test_a_misprint_cannot_be_said_to_hold(id: str, part: tuple[int, ...] | None) -> None:
    s = statement(id, part)
    assert not judged(dataclasses.replace(s, corrected=None, verdict="holds")).proved


@pytest.mark.parametrize("id", sorted(CONVENTIONS - {"diffeomorphism, text after 3.36", "3.45"}))
def test_a_convention_that_does_not_matter_is_refused(id: str) -> None:
    s = statement(id, None)
    assert s.printed is not None
    wrong = judged(dataclasses.replace(s, otherwise=(s.printed,)))
    assert "another reading holds as well" in wrong.proof


def test_a_wrong_correction_is_refused_in_its_smallest_part() -> None:
    text = "c23*c6*s4 - s6*(s23*s5 - c23*c4*c5)"
    s = statement("3.4", (3,))
    for wrong in (text.replace("c4*c5", "c5*c4*c4"), text.replace("- s6", "+ s6")):
        assert not judged(dataclasses.replace(s, corrected=formula(wrong))).proved
    assert judged(dataclasses.replace(s, corrected=formula(text))).proved


def test_a_statement_that_raises_is_unproved_and_says_why() -> None:
    found = judged(element("3.3", None, "x", "no_such_name", lambda p: [0]))
    assert not found.proved
    assert found.proof == "NOT PROVED: ValueError: no_such_name has no value here"
    assert to_json(found)["residual"] is None


# The language and its numbers ---------------------------------------------------------------


def test_formulas_follow_the_usual_precedence() -> None:
    p = Point({"q2": (Fraction(3, 5), Fraction(4, 5)), "q3": (0, 1)}, {"a": 2, "b": 7})
    assert evaluate("-a^2 + b*a", p) == 10
    assert evaluate("c2*s2", p) == Fraction(12, 25)
    assert (evaluate("c23", p), evaluate("s23", p)) == (Fraction(-4, 5), Fraction(3, 5))
    assert evaluate("sin(2*q2)", p) == Fraction(24, 25)
    assert evaluate("[a, b]", p) == [2, 7]
    assert angle("q2 + pi/2", p) == (Fraction(-4, 5), Fraction(3, 5))
    assert angle("-pi/2", p) == (0, -1)


@pytest.mark.parametrize("text", ["__import__('os')", "a.b", "a if b else c", "lambda: a", "a@a"])
def test_formulas_are_no_programs(text: str) -> None:
    with pytest.raises((ValueError, KeyError)):
        evaluate(text, Point({}, {"a": 1, "b": 2, "c": 3}))


def test_atan2_is_read_with_the_sine_first_from_0_to_2_pi() -> None:
    p = Point({}, {"x": -1.0, "y": 0.0}, FLOATS)
    assert evaluate("Atan2(x, y)", p) == pytest.approx(1.5 * FLOATS.pi, abs=1e-15)


def test_dual_numbers_differentiate() -> None:
    x = Dual(Fraction(3), Fraction(1))
    y = (2 - x) * x / 2 + x * x
    assert (y.value, y.derivative) == (Fraction(15, 2), 4)


def test_degrees_are_counted() -> None:
    c = Degree((1, *[0] * 8))
    length = Degree(rest=1)
    assert (c * c * length + length * 3 - 1).bound == 2 * 2 + 1
    assert (1 / length + c).bound == 2 + 2


def test_what_points_share_is_what_they_would_compute_alone() -> None:
    p = bench.Bench(2, quick=True).exact[0]
    turned = p.at(q4=(Fraction(3, 5), Fraction(4, 5)))
    assert turned.frames == Point(turned.angles, p.values).frames
    assert turned.frames[3] is p.frames[3]
    assert turned.frames[4] != p.frames[4]
    for moving in (p.along, *p.partials):
        alone = Point(moving.angles, p.values)
        for shared, own in zip(moving.frames, alone.frames, strict=True):
            for a, b in zip(flat(shared), flat(own), strict=True):
                assert rate(a) == rate(b)
                assert (a.value if isinstance(a, Dual) else a) == (
                    b.value if isinstance(b, Dual) else b
                )


def test_products_leave_out_structural_zeros_and_ones_and_nothing_else() -> None:
    a: list[list[Any]] = [[0, 1, Fraction(2, 3)], [-1, 0, 5], [Fraction(1, 7), 3, 0]]
    b: list[list[Any]] = [[1, Fraction(3, 2), 0], [0, 0, -2], [4, 1, Fraction(5, 9)]]
    assert product(a, b) == [
        [sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)
    ]


# Faults in the model ------------------------------------------------------------------------


def _turned_sign(f: Callable[..., Any]) -> Callable[..., Any]:
    def wrong(*arguments: Any) -> Any:
        rows = f(*arguments)
        return [[-rows[0][0], *rows[0][1:]], *rows[1:]]

    return wrong


def _longer_a3(f: Callable[..., Any]) -> Callable[..., Any]:
    def wrong(g: Any) -> Any:
        return f(g._replace(a3=g.a3 + Fraction(1, 10**4)))

    return wrong


def _other_way(f: Callable[..., Any]) -> Callable[..., Any]:
    def wrong(*arguments: Any) -> Any:
        *rest, last = f(*arguments)
        return [*rest, -last]

    return wrong


FAULTS = [
    (chain, "dh_table", _longer_a3, "forward"),
    (forward, "r36", _turned_sign, "wrist"),
    (inverse, "wrist_centre", _other_way, "inverse"),
    (jacobian, "jacobian", _turned_sign, "velocity"),
    (jacobian, "determinant", lambda f: lambda *a: -f(*a), "singularities"),
    (dynamics, "mass_matrix", _turned_sign, "dynamics"),
    (coriolis, "coriolis_matrix", _turned_sign, "dynamics"),
    (dynamics, "gravity_torque", lambda f: lambda *a: f(*a)[::-1], "dynamics"),
    (jacobian, "jacobian_dot", _turned_sign, "task"),
    (orientation, "rate_matrix", lambda f: lambda cs: f(cs)[::-1], "task"),
    (orientation, "rpy_from_rotation", _other_way, "task"),
]


@pytest.mark.parametrize(
    ("module", "name", "fault", "section"), FAULTS, ids=[f"{m.__name__}.{n}" for m, n, *_ in FAULTS]
)
def test_a_fault_in_the_model_is_seen(
    monkeypatch: pytest.MonkeyPatch,
    setting: Setting,
    module: Any,
    name: str,
    fault: Callable[[Callable[..., Any]], Callable[..., Any]],
    section: str,
) -> None:
    monkeypatch.setattr(module, name, fault(getattr(module, name)))
    (chosen,) = [c for c in registry.cases(["chapter"]) if c.id == f"chapter.{section}"]
    (result,) = registry.run([chosen], setting)
    assert result.status == "failed"
    assert "not proved" in result.evidence


def test_suite_passes_and_carries_the_equations(setting: Setting) -> None:
    results = list(registry.run(registry.cases(["chapter"]), setting))
    assert [r.id for r in results] == [f"chapter.{name}" for name in SECTIONS]
    assert {r.status for r in results} == {"passed"}
    assert sum(len(r.figures["equations"]) for r in results) == sum(map(len, SECTIONS.values()))


def test_a_section_is_part_of_the_audit(setting: Setting, equations: list[Equation]) -> None:
    assert audit_section("task", setting) == [e for e in equations if e.section == "task"]


def test_the_arm_of_the_audit_does_not_know_the_model() -> None:
    folder = Path(motion.__file__).parent
    users = {f.name for f in folder.glob("*.py") if "kr16cli.model" in f.read_text("utf-8")}
    imports = {n for n in users if "from kr16cli.model" in (folder / n).read_text("utf-8")}
    assert imports == {"model_side.py"}
