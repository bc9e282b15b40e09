"""Print a traced graph as a straight-line C function of one configuration. Build time only."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from kr16cli.kernels.trace import Node, needed

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}
CALLS = {"sqrt": "sqrt", "atan2": "kr16_angle", "sin": "kr16_sin", "cos": "kr16_cos"}
"""Functions of the C library, and of trig.h."""

_LEAVES = frozenset({"constant", "input", "parameter"})


def function(name: str, comment: str, results: Sequence[Node]) -> str:
    """`void name(const double *p, const double *x, double *y)`: parameters, inputs, results."""
    body = [_statement(node) for node in ordered(results)]
    store = [f"    y[{i}] = {_name(node)};" for i, node in enumerate(results)]
    head = f"void {name}(const double *restrict p, const double *restrict x, double *restrict y)"
    nodes = needed(results)
    unused = [
        f"    (void){letter};"
        for letter, op in (("p", "parameter"), ("x", "input"))
        if not any(n.op == op for n in nodes)
    ]
    return "\n".join([f"/* {comment} */", head, "{", *unused, *body, *store, "}", ""])


def ordered(results: Sequence[Node]) -> list[Node]:
    """The operations in an order in which a processor need not wait much.

    The longest chain of operations decides the time of such code, and a processor looks ahead
    only some hundred operations: so each step takes, of what is ready, what the most depends on.
    """
    nodes = [n for n in needed(results) if n.op not in _LEAVES]
    users: dict[int, list[Node]] = {n.number: [] for n in nodes}
    for node in nodes:
        for argument in node.args:
            if argument.number in users:
                users[argument.number].append(node)
    height: dict[int, int] = {}
    for node in reversed(nodes):
        rest = max((height[u.number] for u in users[node.number]), default=0)
        height[node.number] = rest + _LATENCY.get(node.op, 4)
    waits = {n.number: sum(a.number in users for a in n.args) for n in nodes}
    return _listed(nodes, users, height, waits)


_LATENCY = {"div": 14, "sqrt": 18, "neg": 1, "lt": 4, "le": 4, "where": 2, "atan2": 80,
            "sin": 80, "cos": 80}  # fmt: skip
_WIDTH = 2


def _listed(
    nodes: Sequence[Node],
    users: dict[int, list[Node]],
    height: dict[int, int],
    waits: dict[int, int],
) -> list[Node]:
    """List scheduling: two operations a cycle, of those whose arguments are there."""
    due = [(0, n.number, n) for n in nodes if not waits[n.number]]
    heapq.heapify(due)
    ready: list[tuple[int, int, Node]] = []
    found: list[Node] = []
    cycle = 0
    while due or ready:
        while due and due[0][0] <= cycle:
            _, number, node = heapq.heappop(due)
            heapq.heappush(ready, (-height[number], number, node))
        for _ in range(min(_WIDTH, len(ready))):
            _, number, node = heapq.heappop(ready)
            found.append(node)
            for user in users[number]:
                waits[user.number] -= 1
                if not waits[user.number]:
                    when = cycle + _LATENCY.get(node.op, 4)
                    heapq.heappush(due, (when, user.number, user))
        cycle += 1
    return found


def _name(node: Node) -> str:
    if node.op == "constant":
        text = repr(node.value)
        return f"({text})" if node.value < 0 else text
    if node.op in ("input", "parameter"):
        return f"{node.op[0] if node.op == 'parameter' else 'x'}[{int(node.value)}]"
    return f"v{node.number}"


def _statement(node: Node) -> str:
    kind = "int" if node.op in ("lt", "le") else "double"
    return f"    const {kind} v{node.number} = {_expression(node)};"


def _expression(node: Node) -> str:
    args = [_name(a) for a in node.args]
    if node.op in _INFIX:
        return f"{args[0]} {_INFIX[node.op]} {args[1]}"
    if node.op == "neg":
        return f"-{args[0]}"
    if node.op == "where":
        return f"{args[0]} ? {args[1]} : {args[2]}"
    return f"{CALLS[node.op]}({', '.join(args)})"
