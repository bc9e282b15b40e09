"""Write the C of all kernels: `python -m kr16cli.kernels.generate FILE`. Build time only.

The model is run once on symbols; the robot's numbers stay parameters, so that one build serves
every robot of this structure.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from kr16cli.kernels import cprint
from kr16cli.kernels.parameters import COUNT, Parameters, unpack
from kr16cli.kernels.trace import Graph, Node
from kr16cli.model import chain, coriolis, dynamics, energy, forward, inverse, jacobian, orientation
from kr16cli.model.scalars import Functions, Scalar
from kr16cli.tolerances import TOLERANCES

Flat = Iterable[Scalar]


class Kernel(NamedTuple):
    """A kernel: its inputs (t6: angles as cosines and sines; cN: N columns) and its function.

    The function takes the parameters, one list per input, and the functions of the scalars. The
    last `guards` of its results are no results but say, other than 0, that the input is bad.
    """

    inputs: tuple[str, ...]
    results: Callable[..., Flat]
    vertical: bool = False
    guards: int = 0


def _flat(rows: Iterable[Iterable[Scalar]]) -> Flat:
    return (v for row in rows for v in row)


def _fk(k: Parameters, cs: Any, _: Functions) -> Flat:
    return _flat(forward.flange(cs, k.geometry).rows())


def _frames(k: Parameters, cs: Any, _: Functions) -> Flat:
    links = chain.frames(cs, k.geometry)
    yield from _flat(row for frame in links for row in frame.rows())
    yield from _flat(chain.flange_of_frame6(links[6]).rows())
    yield from links[4].p
    yield from _flat(forward.r36(cs))


def _jacobian(k: Parameters, cs: Any, _: Functions) -> Flat:
    a = forward.arm(cs, k.geometry)
    return _flat(jacobian.jacobian(a, a.flange_p))


def _jacobian_dot(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    a = forward.arm(cs, k.geometry)
    return _flat(jacobian.jacobian_dot(a, a.flange_p, qd))


def _ik(k: Parameters, t: Any, near: Any, ns: Functions) -> Flat:
    rotation = [t[0:3], t[4:7], t[8:11]]
    solved = inverse.solve_near(rotation, (t[3], t[7], t[11]), k.geometry, near, ns)
    yield from _flat(solved.angles)
    size, rest = orientation.rotation_defect(rotation)
    limit = TOLERANCES.rotation
    off = ns.where(size * size <= (6 * limit) ** 2, ns.where(rest * rest <= 36 * limit**4, 0, 1), 1)
    last = t[12] * t[12] + t[13] * t[13] + t[14] * t[14] + (t[15] - 1) * (t[15] - 1)
    yield ns.where(last <= 0, off, 1)


def _mass_matrix(k: Parameters, cs: Any, _: Functions) -> Flat:
    return _flat(dynamics.mass_matrix(cs, k.base, k.geometry, k.rotors))


def _coriolis(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    return _flat(coriolis.coriolis_matrix(cs, qd, k.base, k.geometry))


def _gravity(k: Parameters, cs: Any, _: Functions) -> Flat:
    return dynamics.gravity_torque(cs, k.base, k.geometry, k.gravity)


def _bias(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    return dynamics.bias(cs, qd, k.base, k.geometry, k.gravity)


def _inverse_dynamics(k: Parameters, cs: Any, qd: Any, qdd: Any, _: Functions) -> Flat:
    return dynamics.inverse_dynamics(cs, qd, qdd, k.base, k.geometry, k.gravity, k.rotors)


def _forward_dynamics(k: Parameters, cs: Any, qd: Any, tau: Any, _: Functions) -> Flat:
    return dynamics.forward_dynamics(cs, qd, tau, k.base, k.geometry, k.gravity, k.rotors)


def _inverse_drives(k: Parameters, cs: Any, qd: Any, qdd: Any, ns: Functions) -> Flat:
    lost = dynamics.friction(qd, k.coulomb, k.viscous, ns)
    return (t + f for t, f in zip(_inverse_dynamics(k, cs, qd, qdd, ns), lost, strict=True))


def _forward_drives(k: Parameters, cs: Any, qd: Any, tau: Any, ns: Functions) -> Flat:
    lost = dynamics.friction(qd, k.coulomb, k.viscous, ns)
    net = [t - f for t, f in zip(tau, lost, strict=True)]
    return _forward_dynamics(k, cs, qd, net, ns)


def _equation(k: Parameters, cs: Any, qd: Any, ns: Functions) -> Flat:
    yield from _mass_matrix(k, cs, ns)
    yield from _coriolis(k, cs, qd, ns)
    yield from _gravity(k, cs, ns)


def _energy(k: Parameters, cs: Any, qd: Any, _: Functions) -> Flat:
    m = dynamics.mass_matrix(cs, k.base, k.geometry, k.rotors)
    yield energy.kinetic(m, qd)
    yield energy.potential(chain.frames(cs, k.geometry), k.full, k.geometry, k.gravity)


_MOTION = ("t6", "c6")
_DYNAMIC: dict[str, Kernel] = {
    "gravity": Kernel(("t6",), _gravity),
    "bias": Kernel(_MOTION, _bias),
    "equation": Kernel(_MOTION, _equation),
    "energy": Kernel(_MOTION, _energy),
    "inverse_dynamics": Kernel((*_MOTION, "c6"), _inverse_dynamics),
    "forward_dynamics": Kernel((*_MOTION, "c6"), _forward_dynamics),
    "inverse_dynamics_drives": Kernel((*_MOTION, "c6"), _inverse_drives),
    "forward_dynamics_drives": Kernel((*_MOTION, "c6"), _forward_drives),
}
KERNELS: dict[str, Kernel] = {
    "fk": Kernel(("t6",), _fk),
    "frames": Kernel(("t6",), _frames),
    "jacobian": Kernel(("t6",), _jacobian),
    "jacobian_dot": Kernel(_MOTION, _jacobian_dot),
    "ik": Kernel(("c16", "t6"), _ik, guards=1),
    "mass_matrix": Kernel(("t6",), _mass_matrix),
    "coriolis_matrix": Kernel(_MOTION, _coriolis),
    **_DYNAMIC,
    **{f"{name}_vertical": k._replace(vertical=True) for name, k in _DYNAMIC.items()},
}


def traced(kernel: Kernel) -> list[Node]:
    """The result nodes of a kernel."""
    graph = Graph()
    parameters = unpack(graph.vector("parameter", COUNT), vertical=kernel.vertical)
    arguments: list[Any] = []
    row = 0
    for group in kernel.inputs:
        count = int(group[1:])
        if group[0] == "t":
            rows = graph.vector("input", 2 * count, row)
            arguments.append(list(zip(rows[:count], rows[count:], strict=True)))
            row += 2 * count
        else:
            arguments.append(graph.vector("input", count, row))
            row += count
    return [graph.lift(v) for v in kernel.results(parameters, *arguments, graph.functions())]


def source(kernels: dict[str, Kernel]) -> str:
    """The C text: every kernel, and the table that names them.

    The including file defines TILE, OMP_SIMD, CLONES, and NAMED(name) for its own names.
    """
    text, table = [], []
    for name, kernel in kernels.items():
        results = traced(kernel)
        text.append(cprint.kernel(f"NAMED({name})", results))
        groups = ", ".join(f"{{'{g[0]}', {g[1:]}}}" for g in kernel.inputs)
        table.append(
            f'    {{"{name}", NAMED({name}), {len(kernel.inputs)}, {{{groups}}}, '
            f"{len(results) - kernel.guards}, {kernel.guards}, {cprint.operations(results)}}},"
        )
    return "\n".join([f"#define PARAMETER_COUNT {COUNT}", *text, "const kr16_kernel NAMED(kernels)[] = {", *table, "    {0},", "};", ""])


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(source(KERNELS), encoding="ascii")
