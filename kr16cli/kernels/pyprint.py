"""Print a traced graph as straight-line Python for one configuration on floats."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from kr16cli.kernels.trace import Node, needed

_DEEP = 12
"""Nesting of an expression beyond which it gets a name, for the sake of Python's parser."""

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}


def function(
    name: str,
    arguments: Sequence[str],
    lead: Sequence[str],
    results: Sequence[Node],
) -> str:
    """Text of a function that returns its results as one flat list.

    What is used once stands where it is used, the rest gets a name.

    Args:
        name: of the function.
        arguments: their names.
        lead: lines before the operations; they name input i of the graph `x<i>`.
        results: nodes. A parameter i of the graph is read from `p[i]`.
    """
    nodes = needed(results)
    used = sorted(int(n.value) for n in nodes if n.op == "parameter")
    lines = [*lead, *(f"p{i} = p[{i}]" for i in used)]
    uses = Counter(id(n) for n in (*results, *(a for node in nodes for a in node.args)))
    texts: dict[int, tuple[str, int]] = {}
    for node in nodes:
        text, depth = _expression(node, texts)
        if node.args and (uses[id(node)] > 1 or depth >= _DEEP):
            lines.append(f"v{node.number} = {text[1:-1]}")
            text, depth = f"v{node.number}", 0
        texts[node.number] = text, depth
    lines.append(f"return [{', '.join(texts[result.number][0] for result in results)}]")
    body = "".join(f"    {line}\n" for line in lines)
    return f"def {name}({', '.join(arguments)}):\n{body}"


def _expression(node: Node, texts: dict[int, tuple[str, int]]) -> tuple[str, int]:
    """Text of a node in brackets, and how deep it is nested."""
    if node.op == "constant":
        return "nan" if math.isnan(node.value) else f"({node.value!r})", 0
    if not node.args:
        return ("x" if node.op == "input" else "p") + str(int(node.value)), 0
    parts = [texts[a.number][0] for a in node.args]
    depth = 1 + max(texts[a.number][1] for a in node.args)
    if node.op == "neg":
        return f"(-{parts[0]})", depth
    if node.op == "where":
        return f"({parts[1]} if {parts[0]} else {parts[2]})", depth
    if node.op in _INFIX:
        return f"({parts[0]} {_INFIX[node.op]} {parts[1]})", depth
    return f"({node.op}({', '.join(parts)}))", depth
