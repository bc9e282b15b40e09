"""The functions of the model that a native FMU needs, traced and printed as C. Build time only.

Formulas come from `model` and `simulate.task_law`; here is only what is asked of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from kr16cli.fmi.native import cwrite, slots, stepped, tape
from kr16cli.fmi.stiff import GAMMA, STEP
from kr16cli.kernels.parameters import COUNT, Parameters, flatten, unpack
from kr16cli.kernels.quantities import QUANTITIES, flat
from kr16cli.kernels.trace import Graph, Node
from kr16cli.model import chain, dynamics, energy, forward, inertia, jacobian, orientation
from kr16cli.model.inertia import Body
from kr16cli.model.scalars import Functions, Scalar, Trig, matvec
from kr16cli.robot import Geometry, Payload
from kr16cli.simulate import core, plant, task_law
from kr16cli.tolerances import TOLERANCES

TRIG = 12
"""Numbers of six angles: their cosines, then their sines."""

Flat = Iterable[Scalar]


class Function(NamedTuple):
    """A C function: what it is, its inputs and their widths, and its formula.

    Six angles enter as pairs (cos, sin). The formula takes the parameters, the inputs, and the
    functions of the scalars.
    """

    comment: str
    inputs: tuple[tuple[str, int], ...]
    results: Callable[..., Flat]


def _of_model(name: str) -> Callable[..., Flat]:
    return QUANTITIES[name].results


def _forward_dynamics(k: Parameters, cs: Trig, qd: Any, tau: Any, _: Functions) -> Flat:
    return stepped.solved(k, cs, qd, tau)


def _friction(k: Parameters, qd: Any, ns: Functions) -> Flat:
    return dynamics.friction(qd, k.coulomb, k.viscous, ns)


def _pose(k: Parameters, cs: Trig, ns: Functions) -> Flat:
    flange = forward.flange(cs, k.geometry).rows()
    rotation = [row[:3] for row in flange[:3]]
    return (*(row[3] for row in flange[:3]), *orientation.rpy_from_rotation(rotation, ns))


def _solve(_: Parameters, matrix: Any, right: Any, __: Functions) -> Flat:
    return dynamics.solve_symmetric(_rows(matrix, 6), right)


def _motion(k: Parameters, cs: Trig, qd: Any, _: Functions) -> Flat:
    """Position, rotation, Jacobian and J' qd of the flange: 3, 9, 36 and 6 numbers."""
    a, T = forward.arm(cs, k.geometry), forward.flange(cs, k.geometry).rows()
    J = jacobian.jacobian(a, a.flange_p)
    drift = matvec(jacobian.jacobian_dot(a, a.flange_p, qd), qd)
    rotation = flat(row[:3] for row in T[:3])
    return (*(row[3] for row in T[:3]), *rotation, *flat(J), *drift)


def _rows(values: Sequence[Scalar], width: int) -> list[Sequence[Scalar]]:
    return [values[i : i + width] for i in range(0, len(values), width)]


def _task(
    k: Parameters, cs: Trig, qd: Any, motion: Any, given: Any, kp: Any, kd: Any, ns: Functions
) -> Iterator[Scalar]:
    target = core.TaskTarget(given[:3], _rows(given[3:12], 3), given[12:18], given[18:24])  # type: ignore[arg-type]  # symbols
    position, rotation, J, drift = motion[:3], _rows(motion[3:12], 3), motion[12:48], motion[48:]
    twist = matvec(_rows(J, 6), qd)
    error = task_law.orientation_error(rotation, twist[3:], target, ns)
    a = task_law.flange_acceleration(position, twist, error, target, kp, kd)
    sines = [sine for _, _, sine in jacobian.singular_families(cs, k.geometry, ns)]
    square = task_law.damping(sines, ns)
    brake = ns.where(square <= 0.0, kd[0] * 0.0, kd[0])
    yield from task_law.joint_acceleration(_rows(J, 6), drift, qd, a, square, brake)
    yield error.trig[1][0]


def _potential(k: Parameters, cs: Trig, _: Functions) -> Flat:
    return [energy.potential(chain.frames(cs, k.geometry), k.full, k.geometry, k.gravity)]


def _parameters(_: Parameters, x: Any, __: Functions) -> Flat:
    """The parameter vector of a robot: geometry, six links, load, gravity, rotors, friction."""
    rest = iter(x)

    def take(count: int) -> list[Scalar]:
        return [next(rest) for _ in range(count)]

    g = Geometry(*take(6))
    bodies = [_body(take(10)) for _ in range(6)]
    mass, (cx, cy, cz), tensor = take(1)[0], take(3), take(6)
    load = Payload(mass, (cx, cy, cz), tuple(tensor))
    gravity, rotors, coulomb, viscous = (take(n) for n in (3, 6, 6, 6))
    full = [*bodies[:5], bodies[5] + inertia.payload_body(load, g)]
    base = inertia.regroup(full, g)
    return flatten(Parameters(g, gravity, base, rotors, full, coulomb, viscous))


def _body(values: Sequence[Scalar]) -> Body:
    m, x, y, z, *rest = values
    return Body(m, (x, y, z), *rest)


_Q, _QD = ("q", TRIG), ("qd", 6)
FUNCTIONS = {
    "forward_dynamics": Function(
        "qdd of M qdd + C qd + G = tau, rad/s2", (_Q, _QD, ("tau", 6)), _forward_dynamics
    ),
    "inverse_dynamics": Function(
        "M qdd + C qd + G, N m",
        (_Q, _QD, ("qdd", 6)),
        lambda k, cs, qd, qdd, ns: dynamics.inverse_dynamics(
            cs, qd, qdd, k.base, k.geometry, k.gravity, k.rotors
        ),
    ),
    "gravity": Function("G(q), N m", (_Q,), _of_model("gravity")),
    "friction": Function("Friction against qd, N m", (_QD,), _friction),
    "mass_matrix": Function("M(q), row by row", (_Q,), _of_model("mass_matrix")),
    "solve": Function("x of A x = b, A symmetric", (("A", 36), ("b", 6)), _solve),
    "pose": Function("Position and A, B, C of the flange", (_Q,), _pose),
    "potential": Function("Potential energy, J", (_Q,), _potential),
    "motion": Function(
        "Flange's position 3, rotation 9, Jacobian 36, and J' qd 6", (_Q, _QD), _motion
    ),
    "task": Function(
        "qdd that moves the flange to its target, and cos of the pitch error",
        (_Q, _QD, ("motion", 54), ("target", 24), ("kp", 6), ("kd", 6)),
        _task,
    ),
    "parameters": Function(
        "The vector p of all functions",
        ((
            "geometry 6, links 60, load 10, gravity 3, rotors 6, coulomb 6, viscous 6", 97
        ),),
        _parameters,
    ),
}  # fmt: skip


TAPES = ("inverse_dynamics", "friction", "pose", "motion", "task", "parameters")
"""Functions that derivatives are taken of, the others' follow from these; and one run rarely."""


def trace(function: Function) -> list[Node]:
    """The results of a function as nodes of a graph."""
    graph = Graph()
    k = unpack(graph.vector("parameter", COUNT), vertical=False, drives=True)
    arguments: list[Any] = []
    first = 0
    for _, width in function.inputs:
        row = graph.vector("input", width, first)
        first += width
        arguments.append(list(zip(row[:6], row[6:], strict=True)) if width == TRIG else row)
    results = function.results(k, *arguments, graph.functions())
    return [graph.lift(value) for value in results]


def _printed() -> dict[str, Function]:
    """All but what `stepped` prints, and what is a tape only."""
    other = ("forward_dynamics", "parameters")
    return {name: f for name, f in FUNCTIONS.items() if name not in other}


def model_h() -> str:
    """The header of the functions, with the constants that the hand-written C shares."""
    constants = {
        "KR16_PARAMETERS": COUNT,
        "KR16_FARTHEST": slots.FARTHEST,
        "KR16_OUTSIDE": TOLERANCES.limit,
        "KR16_FOLD": task_law.FOLD,
        "KR16_FADE": plant.FADE,
        "KR16_STOP_TORQUE": plant.STOP_TORQUE,
        "KR16_STOP_DEPTH": plant.Limits.depth,
        "KR16_STOP_BOUNCE": plant.Limits.bounce,
        "KR16_GAMMA": GAMMA,
        "KR16_SLOPE_STEP": STEP,
    }
    lines = [
        "/* Written by kr16cli from its model; do not edit. SI units, angles as (cos, sin). */",
        "#ifndef KR16_MODEL_H",
        "#define KR16_MODEL_H",
        "",
        "#include <stdint.h>",
        "",
        *(f"#define {name} {value!r}" for name, value in constants.items()),
        "",
        *slots.header(),
        "",
    ]
    for name, function in _printed().items():
        widths = ", ".join(f"{what} {n}" for what, n in function.inputs)
        lines += [
            f"/* {function.comment}: x is {widths}; y is {len(trace(function))}. */",
            f"void kr16_{name}(const double *restrict p, const double *restrict x, "
            "double *restrict y);",
        ]
    lines += ["", *stepped.header(), "", *tape.header(TAPES, max(_tape(name)[1] for name in TAPES))]
    return "\n".join([*lines, "", "#endif", ""])


def _tape(name: str) -> tuple[list[str], int]:
    function = FUNCTIONS[name]
    return tape.lines(name, sum(width for _, width in function.inputs), trace(function))


def model_c() -> str:
    """The functions."""
    head = ["/* Written by kr16cli from its model; do not edit. */", "#include <math.h>", "",
            '#include "kr16_model.h"', '#include "trig.h"', ""]  # fmt: skip
    texts = [
        cwrite.function(f"kr16_{name}", function.comment, trace(function), quick=False)
        for name, function in _printed().items()
    ]
    return "\n".join([*head, *texts])


def stepped_c() -> str:
    """The functions that take most of the time of a step."""
    head = ["/* Written by kr16cli from its model; do not edit. */", '#include "kr16_model.h"', ""]
    return "\n".join([*head, *stepped.functions()])


def tapes_c() -> str:
    """The tapes."""
    head = ["/* Written by kr16cli from its model; do not edit. */", '#include "kr16_model.h"', ""]
    return "\n".join([*head, *(line for name in TAPES for line in _tape(name)[0])])
