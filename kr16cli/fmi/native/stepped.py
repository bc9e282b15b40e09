"""The forward dynamics as it is run at every stage of a step. Build time only.

One function for robots whose parameters are zero where those of the KR 16-2 are: gravity upright,
wrist bodies that are round or have their principal axes along the joints'. It takes a third less
time than for any robot, where the C puts inverse dynamics, mass matrix and solving together. What
depends on parameters alone is computed when they change, and kept behind them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from kr16cli.fmi.native import cwrite
from kr16cli.kernels.cprint import lane_independent
from kr16cli.kernels.parameters import COUNT, Parameters, pack, parameters, unpack
from kr16cli.kernels.trace import Graph, Node, needed
from kr16cli.model import dynamics
from kr16cli.model.scalars import ZERO, Scalar, Trig
from kr16cli.robot import Payload
from kr16cli.robot_file import load_data
from kr16cli.single import Arm

_LOAD = Payload(10.0, (0.0, 0.0, 0.1), (0.2, 0.2, 0.1, 0.0, 0.0, 0.0))


def solved(k: Parameters, cs: Trig, qd: Sequence[Scalar], tau: Sequence[Scalar]) -> list[Scalar]:
    """`dynamics.forward_dynamics`, solved from joint 6 on: its row is the first to be known."""
    rest = dynamics.bias(cs, qd, k.base, k.geometry, k.gravity)
    matrix = dynamics.mass_matrix(cs, k.base, k.geometry, k.rotors)
    turned = [row[::-1] for row in matrix[::-1]]
    right = [t - b for t, b in zip(tau, rest, strict=True)][::-1]
    return dynamics.solve_symmetric(turned, right)[::-1]


@lru_cache(maxsize=1)
def zeros() -> tuple[int, ...]:
    """Places of parameters that are zero for the KR 16-2, empty or with a round load, with drives.

    Only those of base bodies and gravity: the forward dynamics takes no others.
    """
    data = load_data()
    arms = [Arm(data, payload=load, drives=True) for load in (None, _LOAD)]
    rows = zip(*(pack(parameters(arm)) for arm in arms), strict=True)
    taken = {int(n.value) for n in needed(_traced(())) if n.op == "parameter"}
    return tuple(k for k, row in enumerate(rows) if k in taken and all(v == 0.0 for v in row))


def _traced(absent: Sequence[int]) -> list[Node]:
    """The accelerations, with some parameters being zero."""
    graph = Graph()
    values = [
        ZERO if k in absent else symbol for k, symbol in enumerate(graph.vector("parameter", COUNT))
    ]
    rows = graph.vector("input", 24)
    cs = list(zip(rows[:6], rows[6:12], strict=True))
    k = unpack(values, vertical=False, drives=True)
    return [graph.lift(v) for v in solved(k, cs, rows[12:18], rows[18:])]


@lru_cache(maxsize=1)
def _results() -> list[Node]:
    return _traced(zeros())


@lru_cache(maxsize=1)
def _kept() -> list[Node]:
    """What other operations take and no input enters."""
    nodes = needed(_results())
    fixed = lane_independent(nodes)
    taken = {a.number for n in nodes if n.number not in fixed for a in n.args}
    return [n for n in nodes if n.args and n.number in fixed and n.number in taken]


_COMMENT = "qdd of M qdd + C qd + G = tau, rad/s2"


def header() -> list[str]:
    """Lines of C: declarations."""
    head = "(const double *restrict p, const double *restrict x, double *restrict y);"
    return [
        f"/* {_COMMENT}: x is q 12, qd 6, tau 6; y is 6. For parameters that are 0 at the places",
        " * KR16_ZEROS; behind them is what kr16_keep gives. */",
        f"#define KR16_ZEROS {{{', '.join(map(str, zeros()))}}}",
        f"#define KR16_KEPT {len(_kept())}",
        *(f"void kr16_{name}{head}" for name in ("forward_dynamics", "keep")),
    ]


def functions() -> list[str]:
    """The functions in C: the first takes most of the time of a step."""
    places = {node.number: COUNT + k for k, node in enumerate(_kept())}
    about = "What depends on parameters alone"
    return [
        cwrite.function("kr16_forward_dynamics", _COMMENT, _results(), places),
        cwrite.function("kr16_keep", about, _kept(), quick=False),
    ]
