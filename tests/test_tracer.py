"""The tracer and what is generated from its graphs; nothing here needs a compiler."""

from __future__ import annotations

import numpy as np
import pytest

import kr16cli
from kr16cli.kernels import cprint, generate
from kr16cli.kernels.parameters import COUNT, pack, parameters, unpack
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, WIDTH
from kr16cli.kernels.trace import Graph, Node
from kr16cli.model.scalars import ZERO


def test_parameters_survive_packing() -> None:
    k = parameters(kr16cli.load_robot(drives=True).arm)
    values = pack(k)
    assert len(values) == COUNT
    again = unpack(values, vertical=False, drives=True)
    assert pack(again) == values
    assert tuple(map(float, again.gravity)) == (0.0, 0.0, -9.81)


def test_equal_operations_are_one_node() -> None:
    a, b = Graph().vector("input", 2)
    assert a + b is b + a
    assert a * b is b * a
    assert a - b is -(b - a)
    negative = -a
    assert -negative is a
    assert (a - (-b)) is (a + b)
    assert (-a) - b is -(a + b)
    assert (-a) * b is -(a * b)
    assert a * 1 is a
    assert -1 * a is -a


def test_what_is_taken_away_again_cancels() -> None:
    a, b = Graph().vector("input", 2)
    assert a - a is ZERO
    assert (a + b) - b is a
    assert (a - b) + b is a
    assert b + (a - b) is a
    assert a - (a - b) is b
    assert (a - b) - a is -b
    assert a - (a + b) is -b


def test_tracer_folds_nothing_that_depends_on_numbers() -> None:
    graph = Graph()
    a, b = graph.vector("input", 2)
    assert (a * 0).op == "mul"  # NaN times 0 is NaN
    assert (a / a).op == "div"
    assert ((a + b) + b).op == "add"
    assert graph.lift(2.0) * 3.0 is graph.constant(6.0)
    assert graph.lift(float("nan")) is graph.constant(float("nan"))


def _run(results: list[Node], inputs: list[float], numbers: list[float]) -> list[float]:
    """The graph itself as the program, in Python's floats."""
    values: dict[int, float] = {}
    infix = {
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b,
        "lt": lambda a, b: a < b,
        "le": lambda a, b: a <= b,
        "neg": lambda a: -a,
        "sqrt": np.sqrt,
        "atan2": np.arctan2,
        "where": lambda c, a, b: a if c else b,
    }
    for node in results[0].graph.nodes:
        if node.op == "constant":
            values[node.number] = node.value
        elif node.args:
            values[node.number] = infix[node.op](*(values[a.number] for a in node.args))
        else:
            values[node.number] = (inputs if node.op == "input" else numbers)[int(node.value)]
    return [values[node.number] for node in results]


@pytest.mark.parametrize("name", [n for n in QUANTITIES if n not in ("ik", "branches")])
def test_graphs_say_what_the_model_says(name: str) -> None:
    """The traced operations, one by one, against the model on arrays."""
    robot = kr16cli.load_robot(drives=True).with_gravity((1.0, -2.0, -9.0))
    rng = np.random.default_rng(11)
    given = [rng.uniform(-2.0, 2.0, 6) for _ in QUANTITIES[name].inputs]
    rows = [np.concatenate([np.cos(given[0]), np.sin(given[0])]), *given[1:]]
    results, _ = generate.traced(QUANTITIES[name], vertical=False, drives=True)
    ours = _run(results, np.concatenate(rows).tolist(), pack(parameters(robot.arm)))
    theirs = robot._ask(name, tuple(given), None, 1).ravel()
    assert np.abs(np.array(ours) - theirs).max() <= 1e-12 * np.abs(theirs).max()


def test_generated_code_keeps_to_its_budget() -> None:
    """Operations per configuration: a change that costs more must be meant."""
    budget = {
        **{"fk": 80, "jacobian": 100, "jacobian_dot": 271, "mass_matrix": 262},
        **{"coriolis_matrix": 1083, "inverse_dynamics": 530, "forward_dynamics": 912},
        **{"inverse_dynamics_derivatives": 2272, "forward_dynamics_derivatives": 3745},
    }
    for name, most in budget.items():
        quantity = QUANTITIES[name]
        vertical, drives = quantity.gravity, not quantity.drives
        results, _ = generate.traced(quantity, vertical=vertical, drives=drives)
        assert cprint.operations(results) <= most, name


def test_every_kernel_has_room_and_a_name() -> None:
    names = [name for name, *_ in generate.kernels()]
    assert len(names) == len(set(names))
    for quantity in QUANTITIES.values():
        counts = (WIDTH.get(n, 6) * (2 if n in ANGLES else 1) for n in quantity.inputs)
        assert sum(counts) <= 32
        assert int(np.prod(quantity.shape)) + 1 <= 224
