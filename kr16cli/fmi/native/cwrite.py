"""Print a traced graph as a straight-line C function of one configuration. Build time only."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence

from kr16cli.kernels.trace import Node, needed

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}
CALLS = {"sqrt": "sqrt", "atan2": "kr16_angle", "sin": "kr16_sin", "cos": "kr16_cos"}
"""Functions of the C library, and of trig.h."""

_LEAVES = frozenset({"constant", "input", "parameter"})


def function(
    name: str,
    comment: str,
    results: Sequence[Node],
    kept: Mapping[int, int] | None = None,
    *,
    quick: bool = True,
) -> str:
    """`void name(const double *p, const double *x, double *y)`: parameters, inputs, results.

    `kept` are places in p of nodes, by their numbers, that are there and not computed again.
    Operations are listed for a processor not to wait, or, if not `quick`, as the model does
    them, which makes a fifth less code.
    """
    there = kept or {}
    nodes = ordered(results, there) if quick else _computed(results, there)
    body = [f"    {_typed(n)} = {_expression(n, there)};" for n in nodes]
    store = [f"    y[{i}] = {_name(node, there)};" for i, node in enumerate(results)]
    head = f"void {name}(const double *restrict p, const double *restrict x, double *restrict y)"
    nodes = needed(results)
    unused = [
        f"    (void){letter};"
        for letter, op in (("p", "parameter"), ("x", "input"))
        if not any(n.op == op for n in nodes)
    ]
    return "\n".join([f"/* {comment} */", head, "{", *unused, *body, *store, "}", ""])


def ordered(results: Sequence[Node], kept: Mapping[int, int] | None = None) -> list[Node]:
    """The operations in an order in which a processor need not wait much, without those kept.

    The longest chain of operations decides the time of such code, and a processor looks ahead
    only some hundred operations: so each step takes, of what is ready, what the most depends on.
    """
    nodes = _computed(results, kept or {})
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


def _computed(results: Sequence[Node], kept: Mapping[int, int]) -> list[Node]:
    """The operations that are needed where some nodes are there already, as the model has them."""
    wanted: set[int] = set()
    stack = list(results)
    while stack:
        node = stack.pop()
        if node.number not in wanted and node.number not in kept:
            wanted.add(node.number)
            stack.extend(node.args)
    return [n for n in needed(results) if n.number in wanted and n.op not in _LEAVES]


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


def _name(node: Node, kept: Mapping[int, int]) -> str:
    if node.number in kept:
        return f"p[{kept[node.number]}]"
    if node.op == "constant":
        text = repr(node.value)
        return f"({text})" if node.value < 0 else text
    if node.op in ("input", "parameter"):
        return f"{node.op[0] if node.op == 'parameter' else 'x'}[{int(node.value)}]"
    return f"v{node.number}"


def _typed(node: Node) -> str:
    return f"const {'int' if node.op in ('lt', 'le') else 'double'} v{node.number}"


def _expression(node: Node, kept: Mapping[int, int]) -> str:
    args = [_name(a, kept) for a in node.args]
    if node.op in _INFIX:
        return f"{args[0]} {_INFIX[node.op]} {args[1]}"
    if node.op == "neg":
        return f"-{args[0]}"
    if node.op == "where":
        return f"{args[0]} ? {args[1]} : {args[2]}"
    return f"{CALLS[node.op]}({', '.join(args)})"
