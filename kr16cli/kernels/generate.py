"""Write the C of all kernels: `python -m kr16cli.kernels.generate FILE [OWN]`. Build time only.

The model is run once on symbols; the robot's numbers stay parameters, so that one build serves
every robot of this structure. OWN gets the kernels of `OWN`, whose lanes have each their own.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from kr16cli.kernels import cprint
from kr16cli.kernels.parameters import COUNT, unpack
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, WIDTH, Quantity, variant
from kr16cli.kernels.trace import Graph, Node
from kr16cli.model.orientation import rotation_defect
from kr16cli.tolerances import TOLERANCES

Variant = tuple[str, Quantity, bool, bool]

OWN = (("forward_dynamics", False), ("forward_dynamics", True), ("jacobian", True), ("fk", True))
"""What a rollout asks of each robot of its own, and whether drives count; for any gravity."""


def own_kernels() -> Iterator[Variant]:
    """The kernels whose lanes have each their own parameters."""
    for name, drives in OWN:
        yield variant(name, vertical=False, drives=drives), QUANTITIES[name], False, drives


def kernels() -> Iterator[Variant]:
    """(name, quantity, vertical gravity, drives) of every kernel."""
    for name, quantity in QUANTITIES.items():
        for vertical in (False, True)[: 1 + quantity.gravity]:
            for drives in (False, True) if quantity.drives else (True,):
                yield variant(name, vertical=vertical, drives=drives), quantity, vertical, drives


def traced(quantity: Quantity, *, vertical: bool, drives: bool) -> tuple[list[Node], list[Node]]:
    """The result nodes of a kernel, and its guards: not 0 where an input is bad."""
    graph = Graph()
    parameters = unpack(graph.vector("parameter", COUNT), vertical=vertical, drives=drives)
    arguments: dict[str, Any] = {}
    row = 0
    for name in quantity.inputs:
        count = WIDTH.get(name, 6)
        rows = graph.vector("input", 2 * count if name in ANGLES else count, row)
        row += len(rows)
        pairs = list(zip(rows[:count], rows[count:], strict=True)) if name in ANGLES else rows
        arguments[name] = pairs
    results = quantity.results(parameters, *arguments.values(), graph.functions())
    guards = [_pose_guard(graph, arguments["T"])] if "T" in arguments else []
    return [graph.lift(v) for v in results], guards


def _pose_guard(graph: Graph, t: list[Node]) -> Node:
    """1 for a matrix that is no rigid pose; the limits of `arrays.reject_bad_poses`."""
    ns, limit = graph.functions(), TOLERANCES.rotation
    size, rest = rotation_defect([t[0:3], t[4:7], t[8:11]])
    last = t[12] * t[12] + t[13] * t[13] + t[14] * t[14] + (t[15] - 1) * (t[15] - 1)
    tests = ((size * size, 36 * limit**2), (rest * rest, 36 * limit**4), (last, 0))
    bad: Node = graph.constant(0)
    for value, most in tests:
        bad = ns.where(value <= most, bad, 1)
    return bad


def source(wanted: Iterable[Variant], *, own: bool = False) -> str:
    """The C text of kernels, and the table that names them; `own` as in `cprint.kernel`.

    The including file defines TILE, OMP_SIMD, CLONES, and NAMED(name) for its own names.
    """
    text, table = [f"#define PARAMETER_COUNT {COUNT}", ""], []
    for name, quantity, vertical, drives in wanted:
        results, guards = traced(quantity, vertical=vertical, drives=drives)
        text.append(cprint.kernel(f"NAMED({name})", [*results, *guards], own=own))
        groups = ", ".join(
            f"{{'{'t' if n in ANGLES else 'c'}', {WIDTH.get(n, 6)}}}" for n in quantity.inputs
        )
        table.append(
            f'    {{"{name}", NAMED({name}), {len(quantity.inputs)}, {{{groups}}}, '
            f"{len(results)}, {len(guards)}, {cprint.operations(results)}}},"
        )
    head = "const kr16_kernel NAMED(kernels)[] = {"
    return "\n".join([*text, head, *table, "    {0},", "};", ""])


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(source(kernels()), encoding="ascii")
    for path in sys.argv[2:]:
        Path(path).write_text(source(own_kernels(), own=True), encoding="ascii")
