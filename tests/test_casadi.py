"""CasADi as a check: the same model on its symbols, its derivatives, its operation counts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import kr16cli
from kernel_cases import inputs
from kr16cli.kernels import cprint, generate
from kr16cli.kernels.parameters import COUNT, pack, parameters, unpack
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, WIDTH
from kr16cli.model import dynamics
from kr16cli.model.scalars import Functions, _Zero

ca = pytest.importorskip("casadi")


class Symbol:
    """A CasADi expression that leaves structural zeros to themselves."""

    __array_ufunc__ = None

    def __init__(self, sx: Any) -> None:
        self.sx = sx

    def __neg__(self) -> Symbol:
        return Symbol(-self.sx)


def _operator(name: str, apply: Callable[[Any, Any], Any], *, turned: bool) -> None:
    def method(self: Symbol, other: Any) -> Any:
        if isinstance(other, _Zero):
            return NotImplemented
        value = other.sx if isinstance(other, Symbol) else other
        return Symbol(apply(value, self.sx) if turned else apply(self.sx, value))

    setattr(Symbol, name, method)


for _name, _apply in {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "truediv": lambda a, b: a / b,
}.items():
    _operator(f"__{_name}__", _apply, turned=False)
    _operator(f"__r{_name}__", _apply, turned=True)
_operator("__lt__", lambda a, b: a < b, turned=False)
_operator("__gt__", lambda a, b: a > b, turned=False)
_operator("__le__", lambda a, b: a <= b, turned=False)


def _sx(value: Any) -> Any:
    return value.sx if isinstance(value, Symbol) else ca.SX(float(value))


def _lifted(function: Callable[..., Any]) -> Callable[..., Symbol]:
    return lambda *values: Symbol(function(*map(_sx, values)))


SYMBOLS = Functions(
    sqrt=_lifted(ca.sqrt),
    sin=_lifted(ca.sin),
    cos=_lifted(ca.cos),
    atan2=_lifted(ca.atan2),
    where=_lifted(ca.if_else),
    pi=np.pi,
)
NAMES = list(QUANTITIES)


def _vector(name: str, count: int) -> tuple[Any, list[Symbol]]:
    whole = ca.SX.sym(name, count)
    return whole, [Symbol(whole[i]) for i in range(count)]


def _traced(name: str, *, pairs: bool) -> tuple[list[Any], Any]:
    """CasADi's inputs and results of a quantity with drives; the first input are parameters.

    Angles enter as cosines and sines if `pairs` (what kernels take), else as angles.
    """
    whole, numbers = _vector("p", COUNT)
    symbols: list[Any] = [whole]
    arguments: list[Any] = []
    for argument in QUANTITIES[name].inputs:
        width = WIDTH.get(argument, 6)
        doubled = pairs and argument in ANGLES
        whole, scalars = _vector(argument, 2 * width if doubled else width)
        symbols.append(whole)
        if doubled:
            arguments.append(list(zip(scalars[:width], scalars[width:], strict=True)))
        else:
            arguments.append(SYMBOLS.trig(scalars) if argument in ANGLES else scalars)
    k = unpack(numbers, vertical=False, drives=True)
    results = QUANTITIES[name].results(k, *arguments, SYMBOLS)
    return symbols, ca.vertcat(*map(_sx, results))


def _packed(robot: kr16cli.Robot) -> list[float]:
    return pack(parameters(robot.arm))


@pytest.mark.parametrize("name", NAMES)
def test_values(name: str) -> None:
    """Every quantity, run by CasADi's own virtual machine."""
    robot = kr16cli.load_robot(drives=True)
    symbols, results = _traced(name, pairs=False)
    function = ca.Function("f", symbols, [results])
    given = inputs(name, 20, robot)
    ours = robot._ask(name, tuple(given), None, 1).reshape(20, -1)
    rows = [[v[i].ravel() for v in given] for i in range(20)]
    theirs = np.array([function(_packed(robot), *row).full().ravel() for row in rows])
    if name == "ik":
        assert (np.isnan(ours) == np.isnan(theirs)).all()
        ours = np.remainder(ours - theirs + np.pi, 2 * np.pi) - np.pi + theirs
    assert np.nanmax(np.abs(ours - theirs)) <= 1e-12 * max(1.0, np.nanmax(np.abs(theirs)))


@pytest.mark.parametrize("kind", ["inverse_dynamics", "forward_dynamics"])
def test_derivatives_are_casadis_jacobians(kind: str) -> None:
    """Friction and rotors among them; CasADi differentiates the function, not our formulas."""
    robot = kr16cli.load_robot(drives=True).with_gravity((1.0, -2.0, -9.0))
    symbols, results = _traced(kind, pairs=False)
    jacobians = [ca.jacobian(results, x) for x in symbols[1:]]
    function = ca.Function("d", symbols, jacobians)
    given = inputs(kind, 20, robot)
    if kind == "forward_dynamics":
        given[2] = robot.inverse_dynamics(given[0], given[1], given[2] / 100)
    found = getattr(robot, f"{kind}_derivatives")(*given)
    for i in range(20):
        theirs = function(_packed(robot), *(v[i] for v in given))
        for ours, matrix in zip(found, theirs, strict=True):
            expected = matrix.full()
            assert np.abs(ours[i] - expected).max() <= 1e-10 * np.abs(expected).max()


FREE = (ca.OP_NEG, ca.OP_ASSIGN)


def operations(symbols: list[Any], results: Any) -> int:
    """Instructions of CasADi's function that compute, signs and what parameters alone fix apart.

    Equal expressions are first made one, which CasADi does on request only.
    """
    results = ca.cse(results)
    function = ca.Function("f", symbols, [results])
    fixed: dict[int, bool] = {}  # whether a place of the work vector holds a function of parameters
    count = 0
    for i in range(function.n_instructions()):
        op, taken = function.instruction_id(i), function.instruction_input(i)
        if op == ca.OP_OUTPUT:
            continue
        if op == ca.OP_INPUT:
            fixed[function.instruction_output(i)[0]] = taken[0] == 0
        elif op == ca.OP_CONST:
            fixed[function.instruction_output(i)[0]] = True
        else:
            same = all(fixed[t] for t in taken)
            fixed[function.instruction_output(i)[0]] = same
            count += not same and op not in FREE
    return count


@pytest.mark.parametrize(
    "name",
    ["fk", "jacobian", "mass_matrix", "coriolis_matrix", "inverse_dynamics", "forward_dynamics"],
)
def test_our_tracer_needs_no_more_operations(name: str) -> None:
    results, _ = generate.traced(QUANTITIES[name], vertical=False, drives=True)
    assert cprint.operations(results) <= operations(*_traced(name, pairs=True))


@pytest.mark.parametrize("kind", ["inverse_dynamics", "forward_dynamics"])
def test_closed_forms_need_fewer_operations_than_differentiation(kind: str) -> None:
    """About half of what CasADi's differentiation of the same recursion costs."""
    quantity = QUANTITIES[f"{kind}_derivatives"]
    ours, _ = generate.traced(quantity, vertical=False, drives=True)
    symbols, results = _traced(kind, pairs=False)
    theirs = ca.vertcat(*(ca.vec(ca.jacobian(results, x)) for x in symbols[1:]))
    assert cprint.operations(ours) < 0.6 * operations(symbols, theirs)


def test_structural_zeros_cost_nothing() -> None:
    """The adapter keeps them: a matrix of zeros has no operation."""
    x = Symbol(ca.SX.sym("x"))
    zero = dynamics.AT_REST[0]
    assert (zero + x) is x
    assert isinstance(x * zero, _Zero)
