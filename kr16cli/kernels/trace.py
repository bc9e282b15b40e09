"""A tracer: run the scalar-generic model on symbols and keep the graph of its operations.

Equal operations are one node; what is constant is folded. Build time only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from kr16cli.model.scalars import ZERO, Functions, Scalar, _Zero

COMMUTATIVE = frozenset({"add", "mul"})


@dataclass(frozen=True, eq=False)
class Node:
    """One operation. `op` is input, parameter, constant, or a function of `args`.

    `value` is the constant, or the index of an input or parameter.
    """

    graph: Graph
    number: int
    op: str
    args: tuple[Node, ...] = ()
    value: float = 0.0

    def __add__(self, other: Scalar) -> Scalar:
        return self.graph.binary("add", self, other)

    def __radd__(self, other: Scalar) -> Scalar:
        return self.graph.binary("add", other, self)

    def __sub__(self, other: Scalar) -> Scalar:
        return self.graph.binary("sub", self, other)

    def __rsub__(self, other: Scalar) -> Scalar:
        return self.graph.binary("sub", other, self)

    def __mul__(self, other: Scalar) -> Scalar:
        return self.graph.binary("mul", self, other)

    def __rmul__(self, other: Scalar) -> Scalar:
        return self.graph.binary("mul", other, self)

    def __truediv__(self, other: Scalar) -> Scalar:
        return self.graph.binary("div", self, other)

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return self.graph.binary("div", other, self)

    def __neg__(self) -> Scalar:
        return self.graph.negative(self)

    def __lt__(self, other: Scalar) -> Scalar:
        return self.graph.binary("lt", self, other)

    def __le__(self, other: Scalar) -> Scalar:
        return self.graph.binary("le", self, other)

    def __gt__(self, other: Scalar) -> Scalar:
        return self.graph.binary("lt", other, self)

    def __hash__(self) -> int:
        return self.number


@dataclass
class Graph:
    """Nodes in the order of their creation, which is an order of evaluation."""

    nodes: list[Node] = field(default_factory=list)
    _known: dict[tuple[object, ...], Node] = field(default_factory=dict)

    def node(self, op: str, *args: Node, value: float = 0.0) -> Node:
        """The node of an operation, made if new."""
        numbers = tuple(a.number for a in args)
        if op in COMMUTATIVE:
            numbers = tuple(sorted(numbers))
        key = (op, numbers, math.copysign(1.0, value), "nan" if math.isnan(value) else value)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = Node(self, len(self.nodes), op, args, value)
            self.nodes.append(found)
        return found

    def constant(self, value: float) -> Node:
        """A constant."""
        return self.node("constant", value=float(value))

    def vector(self, op: str, count: int, start: int = 0) -> list[Node]:
        """`count` inputs or parameters from index `start`."""
        return [self.node(op, value=float(i)) for i in range(start, start + count)]

    def lift(self, value: Scalar) -> Node:
        """A scalar of the model as a node."""
        return value if isinstance(value, Node) else self.constant(float(value))

    def negative(self, a: Node) -> Node:
        """-a, folded."""
        if a.op == "constant":
            return self.constant(-a.value)
        return a.args[0] if a.op == "neg" else self.node("neg", a)

    def binary(self, op: str, left: Scalar, right: Scalar) -> Scalar:
        """A binary operation, folded where that is exact for every value or a term cancels."""
        if isinstance(left, _Zero) or isinstance(right, _Zero):
            return NotImplemented
        a, b = self.lift(left), self.lift(right)
        if a.op == b.op == "constant":
            return self._fold(op, a.value, b.value)
        if op in ("mul", "div"):
            return self._product(op, a, b)
        if op == "add" and a.op == "neg":
            op, a, b = "sub", b, a.args[0]
        elif op in ("add", "sub") and b.op == "neg":
            op, b = ("sub" if op == "add" else "add"), b.args[0]
        if op == "sub":
            return self._difference(a, b)
        if op == "add":
            for taken, other in ((a, b), (b, a)):
                if taken.op == "sub" and taken.args[1] is other:
                    return taken.args[0]
        return self.node(op, a, b)

    def _difference(self, a: Node, b: Node) -> Scalar:
        """a - b; what was added and is taken away again cancels: kernels get finite numbers."""
        if a is b:
            return ZERO
        if a.op == "neg":
            return -self.binary("add", a.args[0], b)
        if a.op == "add" and b in a.args:
            return a.args[1 - a.args.index(b)]
        if b.op == "sub" and b.args[0] is a:
            return b.args[1]
        turned = (b.op == "add" and a in b.args) or (a.op == "sub" and a.args[0] is b)
        if turned or ("sub", (b.number, a.number), 1.0, 0.0) in self._known:
            return -self._difference(b, a)
        return self.node("sub", a, b)

    def _product(self, op: str, a: Node, b: Node) -> Node:
        if b.op == "constant" and abs(b.value) == 1.0:
            return a if b.value == 1.0 else self.negative(a)
        if op == "mul" and a.op == "constant" and abs(a.value) == 1.0:
            return b if a.value == 1.0 else self.negative(b)
        if a.op == "neg" or b.op == "neg":
            inner = self._product(op, *(v.args[0] if v.op == "neg" else v for v in (a, b)))
            return inner if a.op == b.op else self.negative(inner)
        if op == "mul" and a is b:
            return self.node("mul", a, a)
        return self.node(op, a, b)

    def _fold(self, op: str, a: float, b: float) -> Node:
        value = {"add": a + b, "sub": a - b, "mul": a * b}.get(op)
        return self.constant(a / b if value is None else value)

    def functions(self) -> Functions:
        """The functions of symbols."""
        return Functions(
            sqrt=lambda a: self.node("sqrt", self.lift(a)),
            sin=lambda a: self.node("sin", self.lift(a)),
            cos=lambda a: self.node("cos", self.lift(a)),
            atan2=lambda a, b: self.node("atan2", self.lift(a), self.lift(b)),
            where=lambda c, a, b: self.node("where", c, self.lift(a), self.lift(b)),
            pi=math.pi,
        )


def needed(results: Sequence[Node]) -> list[Node]:
    """The nodes that the results depend on, in order of evaluation."""
    wanted: set[int] = set()
    stack = list(results)
    while stack:
        node = stack.pop()
        if node.number not in wanted:
            wanted.add(node.number)
            stack.extend(node.args)
    return [node for node in results[0].graph.nodes if node.number in wanted]
