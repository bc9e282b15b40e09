"""Print a traced graph as straight-line C over a tile of configurations. Build time only."""

from __future__ import annotations

import math
from collections.abc import Sequence

from kr16cli.kernels.trace import Node, needed

_CALLS = {"sqrt": "sqrt", "atan2": "kr16_atan2"}
_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}


def kernel(name: str, results: Sequence[Node], *, own: bool = False) -> str:
    """A C function that maps input rows x[row*TILE + i] to result rows y, for every lane i.

    What depends on parameters p alone is computed once, before the loop. With `own` parameters
    are rows as well, p[index*TILE + i]: each lane has its own.
    """
    nodes = needed(results)
    fixed = _lane_independent(nodes, own=own)
    head = [_statement(n, "    ") for n in nodes if n.number in fixed and n.op != "constant"]
    lane = "TILE + i" if own else ""
    body = [_statement(n, "        ", lane) for n in nodes if n.number not in fixed]
    store = [f"        y[{i} * TILE + i] = {_name(node)};" for i, node in enumerate(results)]
    return "\n".join(
        [
            f"CLONES static void {name}(const double *restrict p, const double *restrict x,",
            "                   double *restrict y)",
            "{",
            *head,
            "    OMP_SIMD",
            "    for (int i = 0; i < TILE; i++) {",
            *body,
            *store,
            "    }",
            "}",
            "",
        ]
    )


def operations(results: Sequence[Node]) -> int:
    """Arithmetic operations per configuration, parameters' own left out."""
    nodes = needed(results)
    fixed = _lane_independent(nodes)
    return sum(n.number not in fixed and n.op not in ("input", "neg") for n in nodes)


def _lane_independent(nodes: Sequence[Node], *, own: bool = False) -> set[int]:
    same = ("constant",) if own else ("constant", "parameter")
    fixed: set[int] = set()
    for node in nodes:
        if node.op in same or (node.args and all(a.number in fixed for a in node.args)):
            fixed.add(node.number)
    return fixed


def _name(node: Node) -> str:
    if node.op == "constant":
        return _literal(node.value)
    return f"v{node.number}"


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    text = repr(value)
    return f"({text})" if value < 0 else text


def _statement(node: Node, indent: str, lane: str = "") -> str:
    kind = "int" if node.op in ("lt", "le") else "double"
    return f"{indent}const {kind} v{node.number} = {_expression(node, lane)};"


def _expression(node: Node, lane: str) -> str:
    args = [_name(a) for a in node.args]
    if node.op == "input":
        return f"x[{int(node.value)} * TILE + i]"
    if node.op == "parameter":
        return f"p[{int(node.value)} * {lane}]" if lane else f"p[{int(node.value)}]"
    if node.op in _INFIX:
        return f"{args[0]} {_INFIX[node.op]} {args[1]}"
    if node.op == "neg":
        return f"-{args[0]}"
    if node.op == "where":
        return f"{args[0]} ? {args[1]} : {args[2]}"
    return f"{_CALLS[node.op]}({', '.join(args)})"
