"""The model's dynamics as straight-line Python: the same formulas, written out once.

The kernels' tracer notes each operation of the model; here they are printed as Python. The text
travels inside an FMU, whose target may have neither NumPy nor a compiler, and runs many times
faster there than the model on floats.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from kr16cli.fmi.straight_arm import NAMES, Functions
from kr16cli.kernels import parameters
from kr16cli.kernels.trace import Graph, Node, needed
from kr16cli.model import dynamics
from kr16cli.robot import Geometry, RobotData

_DEEP = 12
"""Nesting of an expression beyond which it gets a name, for the sake of Python's parser."""

_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/"}


def source(data: RobotData) -> str:
    """Python text of the functions for the geometry of a robot.

    `acceleration(q, qd, tau, p)` is `dynamics.forward_dynamics`, `torque(q, qd, qdd, p)`
    `dynamics.inverse_dynamics`, `gravity(q, p)` `dynamics.gravity_torque`, `masses(q, p)` the
    lower triangle of `dynamics.mass_matrix` row by row; `p` is what `kernels.parameters.pack`
    gives, so that payload, gravity and rotors stay free.
    """
    head = '"""Dynamics of one robot, written out by kr16cli."""\n\nfrom math import cos, sin'
    return "\n\n\n".join([head, *(_function(name, data.geometry) for name in NAMES)]) + "\n"


def functions(text: str) -> Functions:
    """The functions of a text that `source` wrote."""
    space: dict[str, Any] = {}
    exec(compile(text, "<straight>", "exec"), space)
    return {name: space[name] for name in NAMES}


def _function(name: str, geometry: Geometry) -> str:
    """The text of one function."""
    graph = Graph()
    symbols = graph.vector("parameter", parameters.COUNT)
    k = parameters.unpack(symbols, vertical=False, drives=False)
    angles = graph.vector("input", 12)
    cs = list(zip(angles[:6], angles[6:], strict=True))
    v, w = (graph.vector("input", 6, start) for start in (12, 18))
    rest = (k.base, geometry, k.gravity)
    if name == "acceleration":
        head, values = "q, qd, tau, p", dynamics.forward_dynamics(cs, v, w, *rest, k.rotors)
    elif name == "torque":
        head, values = "q, qd, qdd, p", dynamics.inverse_dynamics(cs, v, w, *rest, k.rotors)
    elif name == "gravity":
        head, values = "q, p", dynamics.gravity_torque(cs, *rest)
    else:
        M = dynamics.mass_matrix(cs, k.base, geometry, k.rotors)
        head, values = "q, p", [M[i][j] for i in range(6) for j in range(i + 1)]
    results = [graph.lift(value) for value in values]
    return "\n".join([f"def {name}({head}):", *_lead(head, needed(results)), *_body(results)])


def _lead(head: str, nodes: Sequence[Node]) -> list[str]:
    """Lines that name the inputs and those parameters that are used."""
    lines = ["    a0, a1, a2, a3, a4, a5 = q"]
    lines += [f"    x{i}, x{i + 6} = cos(a{i}), sin(a{i})" for i in range(6)]
    for first, argument in zip((12, 18), head.split(", ")[1:-1], strict=False):
        lines.append("    " + ", ".join(f"x{first + i}" for i in range(6)) + f" = {argument}")
    used = sorted(int(n.value) for n in nodes if n.op == "parameter")
    return [*lines, *(f"    p{i} = p[{i}]" for i in used)]


def _body(results: Sequence[Node]) -> list[str]:
    """Lines of the operations in order; what is used once stands where it is used."""
    nodes = needed(results)
    uses = Counter(id(n) for n in (*results, *(a for node in nodes for a in node.args)))
    texts: dict[int, tuple[str, int]] = {}
    lines = []
    for node in nodes:
        text, depth = _expression(node, texts)
        if node.args and (uses[id(node)] > 1 or depth >= _DEEP):
            lines.append(f"    v{node.number} = {text[1:-1]}")
            text, depth = f"v{node.number}", 0
        texts[node.number] = text, depth
    shown = ", ".join(texts[result.number][0] for result in results)
    return [*lines, f"    return [{shown}]"]


def _expression(node: Node, texts: dict[int, tuple[str, int]]) -> tuple[str, int]:
    """Text of a node in brackets, and how deep it is nested."""
    if node.op == "constant":
        return f"({node.value!r})", 0
    if not node.args:
        return ("x" if node.op == "input" else "p") + str(int(node.value)), 0
    parts = [texts[a.number] for a in node.args]
    depth = 1 + max(part[1] for part in parts)
    if node.op == "neg":
        return f"(-{parts[0][0]})", depth
    return f"({parts[0][0]} {_INFIX[node.op]} {parts[1][0]})", depth
