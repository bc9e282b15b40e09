"""Runs a printed formula as it stands: text of plain mathematics on any kind of number.

Products are written `*`, powers `^`. `c1 s1 c23 s46` are cosines and sines of (sums of) joint
angles as in the chapter, `cos(q5) sin(2*q6)` too. The text that a reader sees in the audit is
the text that is executed.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from functools import cache
from typing import Protocol

from kr16cli.verify.chapter.scalars import Functions, Pair, Scalar

_SHORT = re.compile(r"([cs])(\d+)")
_OPERATIONS: dict[type[ast.operator], Callable[[Scalar, Scalar], Scalar]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


class Numbers(Protocol):
    """What formulas are run on: named angles, named values, and functions where needed."""

    @property
    def angles(self) -> Mapping[str, Pair]:
        """(cos, sin) by the angle's name."""

    @property
    def values(self) -> Mapping[str, Scalar]:
        """Everything else by name."""

    @property
    def functions(self) -> Functions | None:
        """None where only + - * / are at hand."""


@cache
def _parsed(text: str) -> ast.expr:
    return ast.parse(text.replace("^", "**"), mode="eval").body


def evaluate(text: str, p: Numbers, **more: Scalar) -> Scalar:
    """The value of a formula; a bracketed list gives a list.

    `more` are further names, a different reading of `Atan2` among them.
    """
    return _Run(p, more).value(_parsed(text))


def angle(text: str, p: Numbers) -> Pair:
    """(cos, sin) of an angle written as a sum of named angles and multiples of pi/2."""
    return _Run(p, {}).pair(_parsed(text))


def sum_of_angles(a: Pair, b: Pair) -> Pair:
    """(cos, sin) of a sum; additions of a quarter turn stay exact."""
    return a[0] * b[0] - a[1] * b[1], a[1] * b[0] + a[0] * b[1]


class _Run:
    def __init__(self, p: Numbers, more: Mapping[str, Scalar]) -> None:
        self.p, self.more = p, more

    def value(self, node: ast.expr) -> Scalar:  # noqa: PLR0911  # one for each form
        match node:
            case ast.Constant(value=int() as number):
                return number
            case ast.Name(id=name):
                return self.name(name)
            case ast.List(elts=items):
                return [self.value(item) for item in items]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -self.value(inner)
            case ast.BinOp(left=base, op=ast.Pow(), right=ast.Constant(value=int() as n)):
                return _power(self.value(base), n)
            case ast.BinOp(left=left, op=op, right=right):
                return _OPERATIONS[type(op)](self.value(left), self.value(right))
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self.call(name, arguments)
        raise ValueError(f"{ast.unparse(node)} is no formula of this language")

    def name(self, name: str) -> Scalar:
        if name in self.more:
            return self.more[name]
        if name in self.p.values:
            return self.p.values[name]
        if name == "pi" and self.p.functions:
            return self.p.functions.pi
        if short := _SHORT.fullmatch(name):
            total = self.p.angles[f"q{short[2][0]}"]
            for digit in short[2][1:]:
                total = sum_of_angles(total, self.p.angles[f"q{digit}"])
            return total[short[1] == "s"]
        raise ValueError(f"{name} has no value here")

    def call(self, name: str, arguments: list[ast.expr]) -> Scalar:
        if name in {"cos", "sin"} and self.is_named_angle(arguments[0]):
            return self.pair(arguments[0])[name == "sin"]
        values = [self.value(argument) for argument in arguments]
        if name in self.more:
            return self.more[name](*values)
        f = self.p.functions
        if f is None:
            raise ValueError(f"{name} needs more than + - * /")
        if name == "atan":
            return f.atan2(values[0], 1)
        if name == "acos":
            return f.atan2(f.sqrt((1 - values[0]) * (1 + values[0])), values[0])
        if name == "Atan2":
            return f.sine_first(*values)
        return getattr(f, name)(*values)

    def is_named_angle(self, node: ast.expr) -> bool:
        names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
        return names <= {*self.p.angles, "pi"} and not names & set(self.more)

    def pair(self, node: ast.expr) -> Pair:  # noqa: PLR0911  # one for each form
        match node:
            case ast.Constant(value=0):
                return 1, 0
            case ast.Name(id="pi"):
                return -1, 0
            case ast.Name(id=name):
                return self.p.angles[name]
            case ast.BinOp(left=left, op=ast.Div(), right=ast.Constant(value=2)):
                return {"pi": (0, 1), "-pi": (0, -1)}[ast.unparse(left)]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                c, s = self.pair(inner)
                return c, -s
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return sum_of_angles(self.pair(left), self.pair(right))
            case ast.BinOp(left=ast.Constant(value=2), op=ast.Mult(), right=right):
                return sum_of_angles(self.pair(right), self.pair(right))
        raise ValueError(f"{ast.unparse(node)} is no angle of this language")


def _power(base: Scalar, n: int) -> Scalar:
    result = base
    for _ in range(n - 1):
        result = result * base
    return result
