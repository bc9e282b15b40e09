"""The functions an FMU carries are the model's, in Python and compiled."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import kr16cli
import strategies as own
from kr16cli import Payload
from kr16cli.fmi import compiling, quick, written
from kr16cli.fmi.written_arm import NAMES, WrittenArm, WrittenTaskControl
from kr16cli.kernels.straight_arm import Functions
from kr16cli.model.dynamics import solve_symmetric
from kr16cli.simulate.core import JointTarget, Setpoint, task_target
from kr16cli.simulate.task_control import TaskComputedTorque
from kr16cli.single import Arm

_PAYLOAD = Payload(16.0, (0.02, -0.03, 0.12), (0.2, 0.3, 0.25, 0.01, -0.02, 0.03))
_Q, _QD = (0.3, -1.0, 1.2, 0.4, 0.7, -0.2), (0.5, -0.4, 0.3, 0.8, -0.6, 0.9)
_COMPILER = compiling.find_compiler()
_needs_compiler = pytest.mark.skipif(
    _COMPILER is None or quick.headers() is None, reason="no C compiler, or no Python.h"
)


@lru_cache
def _arms(name: str, *, drives: bool) -> tuple[Arm, WrittenArm]:
    data = kr16cli.load_data(None if name == "kr16_2" else name)
    tilted = data.with_gravity((1.0, -2.0, -9.0))
    functions = written.functions(written.python())
    return (
        Arm(tilted, payload=_PAYLOAD, drives=drives),
        WrittenArm(tilted, functions, payload=_PAYLOAD, drives=drives),
    )


def _flat(value: Any) -> list[float]:
    return [v for part in value for v in _flat(part)] if hasattr(value, "__iter__") else [value]


@pytest.mark.parametrize("name", ["kr16_2", "chapter3"])
@given(q=own.generic, qd=own.rates, load=own.loads, drives=st.booleans())
def test_written_functions_equal_the_models(
    name: str, q: list[float], qd: list[float], load: list[float], drives: bool
) -> None:
    plain, quickly = _arms(name, drives=drives)
    asked: list[Callable[[Arm], Any]] = [
        lambda arm: arm.fk(q),
        lambda arm: arm.jacobian(q),
        lambda arm: arm.jacobian_dot(q, qd),
        lambda arm: arm.mass_matrix(q),
        lambda arm: arm.gravity(q),
        lambda arm: arm.friction(qd),
        lambda arm: arm.inverse_dynamics(q, qd, load),
        lambda arm: arm.forward_dynamics(q, qd, load),
        lambda arm: arm.energy(q, qd),
    ]
    for ask in asked:
        one, other = _flat(ask(plain)), _flat(ask(quickly))
        size = max(1.0, *map(abs, one))
        assert max(abs(a - b) for a, b in zip(one, other, strict=True)) <= 1e-12 * size


def test_written_solution_is_the_models() -> None:
    plain, quickly = _arms("kr16_2", drives=True)
    M = plain.mass_matrix(_Q)
    assert quickly.solve(M, list(_QD)) == pytest.approx(solve_symmetric(M, _QD), rel=1e-13)


@pytest.mark.parametrize("bend", [0.7, 0.05, 0.0])
def test_written_task_control_is_the_controllers(bend: float) -> None:
    """Away from singularities, near one, and on it."""
    plain, quickly = _arms("kr16_2", drives=False)
    q = [*_Q[:4], bend, _Q[5]]
    target = task_target(plain, JointTarget([v + 0.05 for v in q], _QD, _Q))
    one = TaskComputedTorque(plain, 100.0, 20.0).acceleration(q, _QD, target)
    other = WrittenTaskControl(quickly, 100.0, 20.0).acceleration(q, _QD, target)
    assert other == pytest.approx(one, rel=1e-9, abs=1e-9)


def test_written_task_control_says_what_is_wrong() -> None:
    _, quickly = _arms("kr16_2", drives=False)
    control = WrittenTaskControl(quickly, 100.0, 20.0)
    target = Setpoint(quickly, _Q).task(0.0)
    turned = [[-c, b, a] for a, b, c in target.rotation]  # by 90 deg about its y
    with pytest.raises(ArithmeticError, match="pitch"):
        control.acceleration(_Q, _QD, target._replace(rotation=turned))


def test_what_is_written_has_no_number_of_a_robot() -> None:
    for value in (0.675, 0.26, 0.68, 0.035, 0.67, 0.158):
        assert repr(value) not in written.python()
        assert repr(value) not in written.c()


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Functions:
    """The compiled functions, imported from a file."""
    path = tmp_path_factory.mktemp("quick") / quick.MODULE
    path.write_bytes(quick.compiled(str(_COMPILER)))
    return _imported(path)


def _imported(path: Path) -> Functions:
    spec = importlib.util.spec_from_file_location("quick", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return {name: getattr(module, name) for name in NAMES}


@_needs_compiler
@pytest.mark.parametrize("drives", [False, True])
def test_compiled_functions_equal_the_python_ones_to_the_last_bit(
    compiled: Functions, drives: bool
) -> None:
    _, quickly = _arms("kr16_2", drives=drives)
    p = quickly._numbers
    target = Setpoint(quickly, _Q).task(0.0)
    given = [*target.position, *_flat(target.rotation), *target.twist, *target.acceleration]
    arguments: dict[str, tuple[Any, ...]] = {
        **dict.fromkeys(("fk", "jacobian", "mass_matrix", "gravity"), (_Q,)),
        **dict.fromkeys(("jacobian_dot", "energy"), (_Q, _QD)),
        **dict.fromkeys(("inverse_dynamics", "forward_dynamics"), (_Q, _QD, _QD)),
        "friction": (_QD,),
        "solve": (_flat(quickly.mass_matrix(_Q)), _QD),
        "task": (_Q, _QD, given, [9.0] * 6, [6.0] * 6),
    }
    assert set(arguments) == set(NAMES)
    for name, values in arguments.items():
        assert compiled[name](p, *values) == quickly._functions[name](p, *values), name


@_needs_compiler
@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ((), TypeError, "expected 2 arguments, not 0"),
        (([1.0], _Q), ValueError, "numbers, not 1"),
        ((None, _Q), TypeError, "list or tuple"),
        (("numbers", _Q[:5]), ValueError, "expected 6 numbers, not 5"),
        (("numbers", [*_Q[:5], "x"]), TypeError, "must be real number"),
    ],
)
def test_compiled_functions_refuse_what_is_no_list_of_floats(
    compiled: Functions, arguments: tuple[Any, ...], error: type[Exception], words: str
) -> None:
    numbers = _arms("kr16_2", drives=False)[1]._numbers
    given = [numbers if a == "numbers" else a for a in arguments]
    with pytest.raises(error, match=words):
        compiled["fk"](*given)


@_needs_compiler
def test_compiling_twice_gives_the_same_bytes() -> None:
    first = quick.compiled(str(_COMPILER))
    quick.compiled.cache_clear()
    assert quick.compiled(str(_COMPILER)) == first


def test_without_headers_nothing_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quick, "headers", lambda: None)
    quick.compiled.cache_clear()
    assert quick.compiled("cc") == b""
    quick.compiled.cache_clear()
