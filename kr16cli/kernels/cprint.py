"""Print a traced graph as straight-line C over a tile of configurations. Build time only."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from kr16cli.kernels.trace import Node, needed

_CALLS = {"sqrt": "sqrt", "atan2": "kr16_atan2"}
_INDENT = " " * 8
_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}


def kernel(name: str, results: Sequence[Node], *, own: bool = False) -> str:
    """A C function that maps input rows x[row*TILE + i] to result rows y, for every lane i.

    What depends on parameters p alone is computed once, before the loop. With `own` parameters
    are rows as well, p[index*TILE + i]: each lane has its own.
    """
    nodes = needed(results)
    fixed = lane_independent(nodes, own=own)
    head = [_statement(n, "    ") for n in nodes if n.number in fixed and n.op != "constant"]
    lane = "TILE + i" if own else ""
    body = _body([n for n in nodes if n.number not in fixed], lane)
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


PACKED = 4
"""So many arctangents at least, that need nothing of each other, are taken together."""


def _body(nodes: Sequence[Node], lane: str) -> list[str]:
    """The statements of one lane, an ordered graph's.

    A tile's lanes fill the vectors. A single configuration's arctangents do where they are many,
    as in the postures of the inverse kinematics: a level of them at a time.
    """
    level: dict[int, int] = {}  # arctangents on the way to a node
    for node in nodes:
        before = max((level.get(a.number, 0) for a in node.args), default=0)
        level[node.number] = before + (node.op == "atan2")
    levels = Counter(level[n.number] for n in nodes if n.op == "atan2")
    if max(levels.values(), default=0) < PACKED:
        return _plain(nodes, lane)
    lines = []
    for at in range(max(levels) + 1):
        pack = [n for n in nodes if n.op == "atan2" and level[n.number] == at]
        lines += _pack(pack, lane) if len(pack) >= PACKED else _plain(pack, lane)
        lines += _plain([n for n in nodes if n.op != "atan2" and level[n.number] == at], lane)
    return lines


def _plain(nodes: Sequence[Node], lane: str) -> list[str]:
    return [_statement(n, _INDENT, lane) for n in nodes]


def _pack(nodes: Sequence[Node], lane: str) -> list[str]:
    """Arctangents one by one in a tile, all at once for a single configuration."""
    first, count = nodes[0].number, len(nodes)
    y, x = (", ".join(_name(n.args[i]) for n in nodes) for i in range(2))
    taken = ", ".join(f"v{n.number} = a{first}[{i}]" for i, n in enumerate(nodes))
    return [
        "#if TILE > 1",
        *_plain(nodes, lane),
        "#else",
        f"{_INDENT}const double y{first}[] = {{{y}}}, x{first}[] = {{{x}}};",
        f"{_INDENT}double a{first}[{count}];",
        f"{_INDENT}kr16_atan2_all({count}, y{first}, x{first}, a{first});",
        f"{_INDENT}const double {taken};",
        "#endif",
    ]


def operations(results: Sequence[Node]) -> int:
    """Arithmetic operations per configuration, parameters' own left out."""
    nodes = needed(results)
    fixed = lane_independent(nodes)
    return sum(n.number not in fixed and n.op not in ("input", "neg") for n in nodes)


def lane_independent(nodes: Sequence[Node], *, own: bool = False) -> set[int]:
    """Numbers of the nodes that no input enters; with `own` parameters are inputs, too."""
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
