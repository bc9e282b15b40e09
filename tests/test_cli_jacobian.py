"""kr16 jacobian: points, axes, rates, measures, singular poses."""

from __future__ import annotations

import math
import re

import pytest

from command_line import complains, kr16
from joint_tables import GENERIC, HOME, radians
from kr16cli import Arm


def test_jacobian_is_the_models_and_measures_agree(arm: Arm) -> None:
    result = kr16("jacobian", *GENERIC, "--json").result()
    want = arm.jacobian(radians(GENERIC))
    for row, expected in zip(result["jacobian"], want, strict=True):
        assert row == pytest.approx(expected, abs=1e-14)
    product = math.prod(result["singular_values"])
    assert abs(result["determinant"]) == pytest.approx(product)
    assert result["manipulability"] == pytest.approx(product)
    largest, *_, smallest = result["singular_values"]
    assert result["condition"] == pytest.approx(largest / smallest)


@pytest.mark.parametrize("point", ["flange", "wrist", "tool", "com", "10 -20 30"])
def test_jacobian_moves_its_named_point(arm: Arm, point: str) -> None:
    """The linear rows against a difference quotient of the point itself."""
    tool = ["--tool", 5, 6, 7, 10, 20, 30]
    result = kr16("jacobian", *GENERIC, *tool, "--point", *point.split(), "--json").result()
    local = {"flange": (0, 0, 0), "wrist": (0, 0, -0.158), "tool": (0.005, 0.006, 0.007)}

    def position(q: list[float]) -> list[float]:
        if point == "com":
            return arm.mass_centres(q)[5]
        T = arm.fk(q)
        p = local.get(point, (0.010, -0.020, 0.030))
        return [sum(T[i][k] * p[k] for k in range(3)) + T[i][3] for i in range(3)]

    q, h = radians(GENERIC), 1e-6
    for j in range(6):
        ahead = position([v + h * (i == j) for i, v in enumerate(q)])
        behind = position([v - h * (i == j) for i, v in enumerate(q)])
        for row in range(3):
            slope = (ahead[row] - behind[row]) / (2 * h)
            assert result["jacobian"][row][j] == pytest.approx(slope, abs=1e-8)


def test_jacobian_rate_is_a_difference_quotient(arm: Arm) -> None:
    qd = (10, -20, 30, -40, 50, 60)
    result = kr16("jacobian", *GENERIC, "--qd", *qd, "--json").result()
    h, q = 1e-6, radians(GENERIC)
    ahead, behind = (
        arm.jacobian([a + s * h * v for a, v in zip(q, radians(qd), strict=True)]) for s in (1, -1)
    )
    for rate, a, b in zip(result["jacobian_dot"], ahead, behind, strict=True):
        slope = [(x - y) / (2 * h) for x, y in zip(a, b, strict=True)]
        assert rate == pytest.approx(slope, abs=1e-8)


def test_singular_jacobian_has_no_condition_but_a_reason() -> None:
    done = kr16(f"jacobian {HOME} --json")
    result = done.result()
    assert result["condition"] is None
    assert "zero to rounding" in result["condition_reason"]
    assert result["rate_matrix_inverse"] is None
    assert "B = +-90" in result["rate_matrix_inverse_reason"]
    assert [one["kind"] for one in result["singularities"] if one["near"]] == ["wrist"]
    assert re.search(r"\bnan\b", kr16(f"jacobian {HOME}").out) is None


def test_axes_turn_the_rows() -> None:
    robroot = kr16("jacobian", *GENERIC, "--json").result()
    flange = kr16("jacobian", *GENERIC, "--axes", "flange", "--json").result()
    assert flange["singular_values"] == pytest.approx(robroot["singular_values"])
    # In flange axes A6 turns about -z.
    assert [row[5] for row in flange["jacobian"]] == pytest.approx([0, 0, 0, 0, 0, -1], abs=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--link 7", ("--link", "7", "1 to 6")),
        ("--axes world", ("--axes", "world", "robroot")),
        ("--point elbow", ("--point", "elbow", "wrist")),
        ("--point 1 2", ("--point", "3 numbers", "got 2")),
        ("--point tool", ("--point tool", "--tool")),
        ("--point wrist --link 3", ("--point wrist", "link 6")),
    ],
)
def test_jacobian_refuses(options: str, words: tuple[str, ...]) -> None:
    complains(kr16(f"jacobian {HOME} {options}"), *words)
