"""The JSON of `kr16 map`, `sweep` and `uncertainty` against the schemas that ship."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import pytest

from command_line import kr16
from kr16cli.assets import asset

_SHORT = (
    'schema = "kr16.scenario/1"\nname = "short"\nduration_s = 0.02\n'
    "[initial]\nq_deg = [0, -60, 60, 0, 30, 0]\n"
)


def _valid(name: str, envelope: dict[str, Any]) -> None:
    schema = json.loads(asset(f"data/schemas/{name}.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(envelope, schema)


@pytest.mark.parametrize("quantity", ["reach", "manipulability", "condition", "torque", "payload"])
@pytest.mark.parametrize(
    "words",
    [
        "--grid 800 --tool 0,0,100,0,0,0 --point tool --payload 5,0,0,100",
        "--grid 900 --orientation free --directions 3 --y 0",
        "--grid 900 --orientation list --abc 0,180,0 --abc 0,90,0",
        "--grid 500 --y 9000",
    ],
)
def test_maps_fit_their_schema(quantity: str, words: str) -> None:
    _valid("map", kr16(f"map {quantity} {words} --json").json())


@pytest.mark.parametrize(
    "words",
    [
        "--vary duration_s=0.02,-1 --vary payload.mass=0,8",
        "--vary duration_s=-1",
        "--vary duration_s=0.02:0.04 --monte-carlo 3",
        "--vary duration_s=0.02:0.04 --latin 3 --seed 5",
    ],
)
def test_sweeps_fit_their_schema(words: str) -> None:
    _valid("sweep", kr16(f"sweep free_swing --workers 1 {words} --json").json())


def test_uncertainties_fit_their_schema(tmp_path: Any) -> None:
    scene = tmp_path / "short.toml"
    scene.write_text(_SHORT)
    plain = kr16("uncertainty --samples 20 --distribution uniform --drives --json").json()
    along = kr16("uncertainty", scene, "--samples", 20, "--json").json()
    for envelope in (plain, along):
        _valid("uncertainty", envelope)
    assert "motion" in along["result"] and "motion" not in plain["result"]


def test_a_schema_refuses_what_is_wrong() -> None:
    reach = kr16("map reach --grid 800 --y 0 --json").json()
    for key, value in (("share", 1.5), ("branches", {"9": 1}), ("volume", "none")):
        wrong = {**reach, "result": {**reach["result"], key: value}}
        with pytest.raises(jsonschema.ValidationError):
            _valid("map", wrong)
    sweep = kr16("sweep free_swing --workers 1 --vary duration_s=0.02 --json").json()
    sweep["result"]["figures"]["time_end"]["sigma"] = -1.0
    with pytest.raises(jsonschema.ValidationError):
        _valid("sweep", sweep)
    trust = kr16("uncertainty --samples 5 --json").json()
    trust["result"]["gravity"]["low"][0].pop()
    with pytest.raises(jsonschema.ValidationError):
        _valid("uncertainty", trust)
