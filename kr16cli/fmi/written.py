"""The model's functions written out once: as Python, and as C for a Python extension.

The text travels inside an FMU, whose target may have neither NumPy nor a compiler. Each function
takes the vector p of `kernels.parameters` and lists of floats, and gives one flat list. Python and
C do the same operations in the same order of arguments, so their results are equal.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

from kr16cli.fmi.native import cwrite, traced
from kr16cli.fmi.written_arm import NAMES
from kr16cli.kernels import straight
from kr16cli.kernels.parameters import COUNT, Parameters
from kr16cli.kernels.quantities import QUANTITIES
from kr16cli.kernels.straight_arm import Functions
from kr16cli.kernels.trace import Node
from kr16cli.model.scalars import Scalar

_Q, _QD = ("q", traced.TRIG), ("qd", 6)


def _task(
    k: Parameters, cs: Any, qd: Any, target: Any, kp: Any, kd: Any, ns: Any
) -> Iterable[Scalar]:
    """Both steps of the law in task space as one function."""
    motion = list(traced.FUNCTIONS["motion"].results(k, cs, qd, ns))
    return traced.FUNCTIONS["task"].results(k, cs, qd, motion, target, kp, kd, ns)


_TARGET = (("target", 24), ("kp", 6), ("kd", 6))
_MORE = {
    name: traced.Function(comment, inputs, QUANTITIES[name].results)
    for name, comment, inputs in (
        ("fk", "T_robroot_flange, row by row", (_Q,)),
        ("jacobian", "J of the flange, robroot, row by row", (_Q,)),
        ("jacobian_dot", "Its rate", (_Q, _QD)),
        ("mass_matrix", "M(q), row by row", (_Q,)),
        ("gravity", "G(q), N m", (_Q,)),
        ("energy", "Kinetic and potential energy, J", (_Q, _QD)),
    )
} | {
    "task": traced.Function(
        "qdd that moves the flange to its target, and cos of the pitch error",
        (_Q, _QD, *_TARGET), _task,
    )
}  # fmt: skip
"""Beside or instead of the functions that native FMUs are made of."""


def _function(name: str) -> traced.Function:
    return _MORE.get(name) or traced.FUNCTIONS[name]


@lru_cache(maxsize=1)
def _graphs() -> dict[str, list[Node]]:
    return {name: traced.trace(_function(name)) for name in NAMES}


@lru_cache(maxsize=1)
def python() -> str:
    """Python text of the functions; it holds no number of a robot."""
    head = f'"""Kinematics and dynamics, written out by kr16cli."""\n\n{straight.HEAD}'
    return "\n\n".join([head, *map(_python, NAMES)])


def functions(text: str) -> Functions:
    """The functions of a text that `python` wrote."""
    space: dict[str, Any] = {}
    exec(compile(text, "<written>", "exec"), space)
    return {name: space[name] for name in NAMES}


@lru_cache(maxsize=1)
def c() -> str:
    """C text of the functions and of the table that `fmu/quick/quick.c` makes a module of."""
    texts, rows = [], []
    for name in NAMES:
        function, results = _function(name), _graphs()[name]
        texts.append("static " + cwrite.function(name, function.comment, results).lstrip())
        groups = ", ".join(
            f"{{{int(width == traced.TRIG)}, {6 if width == traced.TRIG else width}}}"
            for _, width in function.inputs
        )
        rows.append(f"    ENTRY({name}, {len(results)}, {len(function.inputs)}, {groups})")
    # The C library's own sine, cosine and arc tangent: they are Python's, too.
    own = [f"#define {called} {op}" for op, called in cwrite.CALLS.items() if called != op]
    head = [f"#define PARAMETERS {COUNT}", *own, ""]
    return "\n".join([*head, *texts, " \\\n".join(["#define ENTRIES", *rows]), ""])


def _python(name: str) -> str:
    """The text of one function."""
    inputs = [
        (argument, width == traced.TRIG, 6 if width == traced.TRIG else width)
        for argument, width in _function(name).inputs
    ]
    return straight.text(name, inputs, _graphs()[name])
