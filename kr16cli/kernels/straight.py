"""The model as straight-line Python: the same formulas, written out once for one configuration.

The tracer notes each operation of the model; here they are printed as Python. Written-out
functions need neither NumPy nor a compiler and run ten times faster than the model on floats.
Writing one takes as long as a hundred answers of the model, so they serve where many
evaluations follow: a simulation without the compiled kernels, and inside an FMU.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from kr16cli.kernels import pyprint
from kr16cli.kernels.parameters import COUNT, Parameters, unpack
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, WIDTH, Flat, flat
from kr16cli.kernels.straight_arm import NAMES, StraightArm
from kr16cli.kernels.trace import Graph, Node
from kr16cli.model import chain, dynamics, inverse
from kr16cli.robot import Payload, RobotData

HEAD = "from math import atan2, cos, nan, sin, sqrt\n"
"""What the text of a function needs before it."""


def _frames(k: Parameters, cs: Any, _: Any) -> Flat:
    links = chain.frames(cs, k.geometry)
    return flat(row for f in (*links, chain.flange_of_frame6(links[6])) for row in f.rows())


def _ik(k: Parameters, t: Any, near: Any, ns: Any) -> Flat:
    rotation = [t[0:3], t[4:7], t[8:11]]
    found = inverse.solve_near(rotation, (t[3], t[7], t[11]), k.geometry, near, ns)
    yield from flat(found.angles)
    yield from flat(found.reach)
    yield found.on_axis
    for values in found[3:]:
        yield from values


def _friction(k: Parameters, qd: Any, ns: Any) -> Flat:
    return dynamics.friction(qd, k.coulomb, k.viscous, ns)


_OWN: dict[str, tuple[tuple[str, ...], Callable[..., Flat]]] = {
    "frames": (("q",), _frames),
    "ik": (("T", "near"), _ik),
    "friction": (("qd",), _friction),
}


def text(name: str, inputs: Sequence[tuple[str, bool, int]], results: Sequence[Node]) -> str:
    """Python text of a function `name(p, ...)` that returns its results as one flat list.

    Args:
        name: of the function.
        inputs: (name, whether it is angles, how many numbers) of each; angles enter the graph as
            cosines, then sines.
        results: nodes of the graph; its parameters are read from p, `parameters.pack`.
    """
    lead: list[str] = []
    first = 0
    for argument, is_angles, count in inputs:
        rows = [f"x{i}" for i in range(first, first + (2 * count if is_angles else count))]
        first += len(rows)
        if not is_angles:
            lead.append(f"{', '.join(rows)} = {argument}")
            continue
        angles = [f"{argument}{i}" for i in range(count)]
        lead.append(f"{', '.join(angles)} = {argument}")
        lead += [
            f"{c}, {s} = cos({angle}), sin({angle})"
            for c, s, angle in zip(rows[:count], rows[count:], angles, strict=True)
        ]
    return pyprint.function(name, ["p", *(argument for argument, *_ in inputs)], lead, results)


class Functions(dict[str, Callable[..., list[float]]]):
    """Functions by name of `NAMES`, each written when it is first asked for."""

    def __contains__(self, name: object) -> bool:
        return name in NAMES

    def __missing__(self, name: str) -> Callable[..., list[float]]:
        space: dict[str, Any] = {}
        exec(compile(f"{HEAD}\n\n{_written(name)}", f"<straight {name}>", "exec"), space)
        self[name] = space[name]
        return self[name]


@lru_cache(maxsize=1)
def functions() -> Functions:
    """The functions of this process; they serve every robot."""
    return Functions()


def straight_arm(
    data: RobotData, *, payload: Payload | None = None, drives: bool = False
) -> StraightArm:
    """An arm on the functions of this process."""
    return StraightArm(data, functions(), payload=payload, drives=drives)


def _written(name: str) -> str:
    """The text of a function of `NAMES`."""
    if name not in NAMES:
        raise KeyError(name)
    inputs, results = _OWN.get(name) or (QUANTITIES[name].inputs, QUANTITIES[name].results)
    graph = Graph()
    parameters = graph.vector("parameter", COUNT)
    # Friction is a function of its own, no part of the dynamics.
    k = unpack(parameters, vertical=False, drives=name == "friction")
    arguments: list[Any] = []
    shapes = []
    row = 0
    for argument in inputs:
        is_angles, count = argument in ANGLES, WIDTH.get(argument, 6)
        rows = graph.vector("input", 2 * count if is_angles else count, row)
        row += len(rows)
        arguments.append(list(zip(rows[:count], rows[count:], strict=True)) if is_angles else rows)
        shapes.append((argument, is_angles, count))
    nodes = [graph.lift(v) for v in results(k, *arguments, graph.functions())]
    return text(name, shapes, nodes)
