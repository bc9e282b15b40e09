"""Single queries of every kind: their JSON fits its schema, and what overflows is said."""

from __future__ import annotations

import json
import re
from typing import Any

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from command_line import complains, kr16
from joint_tables import HOME
from kr16cli import Arm
from kr16cli.assets import asset

# schemas ----------------------------------------------------------------------------------------


def _valid(name: str, envelope: dict[str, Any]) -> None:
    schema = json.loads(asset(f"data/schemas/{name}.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(envelope, schema)


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("fk 1 -2 3 4 -5 6", "fk"),
        ("fk 1 -2 3 4 -5 6 --frames all --mass-centres --tool 1 2 3 4 5 6", "fk"),
        ("fk 1 -2 3 4 -5 6 --base 1 2 3 4 5 6", "fk"),
        ("fk 1 -2 3 4 -5 6 --si --frames chapter", "fk"),
        ("ik 1088 0 1320 0 90 0", "ik"),
        ("ik 1200 300 900 20 100 5 --turns", "ik"),
        ("jacobian 1 -2 3 4 -5 6", "jacobian"),
        ("jacobian 0 -90 90 0 0 0 --qd 1 2 3 4 5 -6 --link 3 --point com", "jacobian"),
        ("dynamics 1 -2 3 4 -5 6", "dynamics"),
        ("dynamics 1 -2 3 4 -5 6 --qd 1 2 3 4 5 6 --qdd 1 2 3 4 5 6 --tau 1 2 3 4 5 6 --task "
         "--christoffel --drives --payload 5 0 0 100 1 1 1 --gravity 0 1 -9", "dynamics"),
        ("dynamics 0 -90 90 0 0 0 --task", "dynamics"),
        ("info", "info"),
        ("info --robot kr16_l6", "info"),
    ],
)  # fmt: skip
def test_envelopes_fit_their_schemas(command: str, name: str) -> None:
    _valid(name, kr16(f"{command} --json").json())


def test_a_schema_refuses_what_is_wrong() -> None:
    envelope = kr16(f"fk {HOME} --json").json()
    envelope["result"]["pose"]["s"] = 9
    with pytest.raises(jsonschema.ValidationError):
        _valid("fk", envelope)


# numbers beyond what a double holds -------------------------------------------------------------

_LOAD = "--payload 1e308 0 0 1e308"


@pytest.mark.parametrize(
    "command",
    [
        "dynamics 0 -60 90 0 30 0 --payload 1e300 0 0 100 --tau 1 1 1 1 1 1",
        f"dynamics 0 -60 90 0 30 0 {_LOAD}",
        "dynamics 0 -60 90 0 30 0 --qd 1e200 1e200 0 0 0 0",
        "dynamics 0 -60 90 0 30 0 --gravity 1e308 1e308 1e308",
        "dynamics 0 -60 90 0 30 0 --tau 1e308 1e308 1e308 1e308 1e308 1e308",
        "jacobian 0 0 0 0 0 0 --tool 1e200 0 0 0 0 0",
        "jacobian 0 0 0 0 0 0 --qd 1e308 1e308 1e308 1e308 1e308 1e308 --si --axes flange",
        "jacobian 0 0 0 0 0 0 --point 1e308 1e308 1e308 --si",
        "fk 0 -90 90 0 0 0 --tool 1e308 1e308 1e308 45 45 45 "
        "--base 1.7e308 1.7e308 1.7e308 45 45 45",
        "fk 0 -90 90 0 0 0 --si --base 1e308 1e308 1e308 0 0 0",
        f"export urdf {_LOAD}",
        f"export mjcf {_LOAD}",
        "export urdf --payload 1 0 0 1e300",
    ],
)
def test_overflow_is_said_in_one_line(command: str) -> None:
    for form in ("--json", "") if not command.startswith("export") else ("",):
        done = kr16(f"{command} {form}")
        complains(done, "large")


@given(st.lists(st.sampled_from([0.0, 1.0, 1e-320, -1e150, 1e200, -1e308, 1.7e308]), min_size=25))
@settings(max_examples=40)
def test_no_number_is_our_bug(numbers: list[float]) -> None:
    q, six, more, (mass, *centre) = numbers[:6], numbers[6:12], numbers[12:18], numbers[18:22]
    for words in (
        ["fk", *q, "--tool", *six, "--base", *more],
        ["ik", *q, "--tool", *six, "--near", *more],
        ["jacobian", *q, "--tool", *six, "--qd", *more],
        ["dynamics", *q, "--qd", *six, "--tau", *more, "--payload", abs(mass), *centre, "--task"],
        ["export", "urdf", "--payload", abs(mass), *centre],
    ):
        done = kr16(*words, *["--json"] * (words[0] != "export"))
        assert done.code in (0, 2, 3), done.err
        assert not re.search(r"\b(inf|nan)\b", done.out, re.IGNORECASE)


def test_arithmetic_that_fails_on_ordinary_numbers_is_our_bug(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def divide(arm: Arm, q: list[float]) -> float:
        return 1.0 / 0.0

    monkeypatch.setattr(Arm, "determinant", divide)
    complains(kr16(f"jacobian {HOME}"), "our bug", "ZeroDivisionError", code=70)
    complains(kr16("jacobian 1e40 0 0 0 0 0"), "large")
