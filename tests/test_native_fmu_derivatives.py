"""Derivatives of native FMUs: against the model on complex numbers, and among themselves."""

from __future__ import annotations

import cmath
import ctypes
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

import kr16cli
import native_fmus as native
from kr16cli.fmi import compiling
from kr16cli.fmi.native import library
from kr16cli.fmi.variables import Part, Start, six
from kr16cli.kernels.parameters import parameters
from kr16cli.kernels.quantities import QUANTITIES
from kr16cli.model import forward, jacobian
from kr16cli.model.scalars import Functions
from kr16cli.robot import Payload
from kr16cli.single import Arm

pytestmark = pytest.mark.skipif(
    compiling.find_compiler() is None and library.prebuilt() is None, reason="no C compiler"
)

BENT = tuple(map(math.radians, (0.0, -60.0, 60.0, 0.0, 30.0, 0.0)))
STATES = [*six("q"), *six("qd")]
INPUTS = [n for name in ("tau", "q_ref", "qd_ref", "qdd_ref", "wrench") for n in six(name)]
_STEP = 1e-30
_SMOOTH = [*six("qd"), *six("qdd"), *six("tau_applied"),
           *(f"pose.{k}" for k in ("x", "y", "z", "a", "b", "c")),
           "energy.kinetic", "energy.potential"]  # fmt: skip


def _complex() -> Functions:
    return Functions(
        sqrt=cmath.sqrt, sin=cmath.sin, cos=cmath.cos, atan2=math.atan2,
        where=lambda c, a, b: a if c else b, pi=math.pi,
    )  # fmt: skip


def _point() -> dict[str, float]:
    rng = np.random.default_rng(5)
    values = dict(zip(six("q"), np.array(BENT) + rng.uniform(-0.3, 0.3, 6), strict=True))
    values |= dict(zip(six("qd"), rng.uniform(-1, 1, 6), strict=True))
    values |= dict(zip(six("tau"), rng.uniform(-90, 90, 6), strict=True))
    values |= dict(zip(six("q_ref"), rng.uniform(-0.05, 0.05, 6), strict=True))
    for i in range(1, 7):
        values[f"q_ref[{i}]"] += values[f"q[{i}]"]
    for name in ("qd_ref", "qdd_ref"):
        values |= dict(zip(six(name), rng.uniform(-1, 1, 6), strict=True))
    return values | dict(zip(six("wrench"), rng.uniform(-50, 50, 6), strict=True))


def _at(point: dict[str, float], version: int = 3, **parameters_: float) -> native.Instance:
    """An instance of model exchange at a state and inputs."""
    instance = native.Instance(native.file(version, start=Start(q=BENT)), exchange=True)
    instance.begin(**parameters_)
    instance.fmu.enterContinuousTimeMode()
    instance.states([point[name] for name in STATES])
    instance.set(INPUTS, [point[name] for name in INPUTS])
    return instance


def _directional(instance: native.Instance, unknowns: Sequence[str], knowns: Sequence[str]) -> Any:
    """The matrix of derivatives, column by column."""
    references = instance.references(unknowns)
    columns = [
        instance.fmu.getDirectionalDerivative(references, instance.references([name]), [1.0])
        for name in knowns
    ]
    return np.array(columns).T


def test_accelerations_against_complex_steps_of_the_model() -> None:
    data = kr16cli.load_data()
    load = Payload(12.0, (0.01, -0.02, 0.1), (0.2, 0.2, 0.1, 0.0, 0.0, 0.0))
    arm = Arm(replace(data, gravity=(1.0, -2.0, -9.0)), payload=load, drives=True)
    numbers, ns, point = parameters(arm), _complex(), _point()

    def accelerations(values: dict[str, complex]) -> Any:
        cs = [(cmath.cos(values[n]), cmath.sin(values[n])) for n in six("q")]
        a = forward.arm(cs, numbers.geometry)
        J = jacobian.jacobian(a, a.flange_p)
        push = [values[n] for n in six("wrench")]
        tau = [
            values[f"tau[{j + 1}]"] + sum(complex(J[i][j]) * push[i] for i in range(6))
            for j in range(6)
        ]
        qd = [values[n] for n in six("qd")]
        return list(QUANTITIES["forward_dynamics"].results(numbers, cs, qd, tau, ns))

    knowns = [*STATES, *six("tau"), *six("wrench")]
    expected = np.array([
        [complex(v).imag / _STEP for v in accelerations(point | {name: point[name] + 1j * _STEP})]
        for name in knowns
    ]).T  # fmt: skip
    instance = _at(
        point, drives=True, payload__mass=load.mass, payload__com__x=0.01, payload__com__y=-0.02,
        payload__com__z=0.1, payload__inertia__xx=0.2, payload__inertia__yy=0.2,
        payload__inertia__zz=0.1, gravity__x=1.0, gravity__y=-2.0, gravity__z=-9.0,
    )  # fmt: skip
    found = _directional(instance, six("qdd"), knowns)
    assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("mode", [1, 2, 3, 4, 5])
@pytest.mark.parametrize(
    "more",
    [{}, {"drives": True, "limits__joint": 2, "limits__torque": True, "limits__speed": True}],
)
def test_all_outputs_against_differences(mode: int, more: dict[str, float]) -> None:
    point = _point()
    if more:  # beyond a stop, above a speed limit, and some torques at theirs
        point["q[2]"], point["qd[1]"] = 0.62, 2.8
        point["q_ref[2]"] = 0.6
    instance = _at(point, control__mode=mode, **more)
    knowns = [*STATES, *INPUTS]
    unknowns = [*_SMOOTH, *(v for v in instance.variables if v.startswith("margin"))]

    def values(at: dict[str, float]) -> Any:
        instance.states([at[name] for name in STATES])
        instance.set(INPUTS, [at[name] for name in INPUTS])
        return np.array(instance.get(unknowns))

    found = _directional(instance, unknowns, knowns)
    for column, name in zip(found.T, knowns, strict=True):
        h = 1e-5 * max(1.0, abs(point[name]))
        f = {k: values(point | {name: point[name] + k * h}) for k in (-2, -1, 1, 2)}
        estimate = (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12.0 * h)
        assert np.abs(column - estimate) == pytest.approx(
            0.0, abs=1e-5 * max(1.0, np.abs(estimate).max())
        ), name


def test_adjoint_derivatives_are_the_transpose() -> None:
    point = _point()
    instance = _at(point, control__mode=5)
    knowns = [*STATES, *INPUTS]
    J = _directional(instance, _SMOOTH, knowns)
    seeds = np.random.default_rng(2).normal(size=len(_SMOOTH))
    unknowns, known = instance.references(_SMOOTH), instance.references(knowns)
    result = (ctypes.c_double * len(known))()
    instance.fmu.fmi3GetAdjointDerivative(
        instance.fmu.component, (ctypes.c_uint32 * len(unknowns))(*unknowns), len(unknowns),
        (ctypes.c_uint32 * len(known))(*known), len(known),
        (ctypes.c_double * len(seeds))(*seeds), len(seeds), result, len(known),
    )  # fmt: skip
    assert np.array(result) == pytest.approx(seeds @ J, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("version", [2, 3])
def test_both_versions_give_the_same_and_refuse_the_same(version: int) -> None:
    point = _point()
    instance = _at(point, version, control__mode=4)
    reference = _directional(_at(point, 3, control__mode=4), _SMOOTH, STATES)
    assert np.array_equal(_directional(instance, _SMOOTH, STATES), reference)
    for unknown, known in (("limit.speed[1]", "q[1]"), ("qdd[1]", "payload.mass")):
        with pytest.raises(FMICallException):
            _directional(instance, [unknown], [known])
        assert "no derivatives" in instance.messages[-1]


def test_controllers_derivatives() -> None:
    path = native.file(2, Part.CONTROLLER, Start(q=BENT))
    robot = _at(_point(), 2, control__mode=5)
    controller = native.Instance(path)
    point = _point()
    values = {
        n: point[n] for n in (*STATES, *INPUTS) if n in controller.variables and n[:3] != "tau"
    }
    controller.fmu.setupExperiment(startTime=0.0)
    controller.fmu.enterInitializationMode()
    controller.set([*values, "control.mode"], [*values.values(), 5])
    controller.fmu.exitInitializationMode()
    knowns = [*values]
    found = _directional(controller, six("tau"), knowns)
    expected = _directional(robot, six("tau_applied"), knowns)
    assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


def test_outputs_rise_as_they_do_in_time() -> None:
    instance = native.Instance(native.file(2, start=Start(q=BENT)))
    instance.begin(control__mode=4)
    instance.set(six("q_ref"), [q + 0.05 for q in BENT])
    instance.step(0.0, 0.1)
    references = instance.references(_SMOOTH)
    rises = np.array(instance.fmu.getRealOutputDerivatives(references, [1] * len(references)))
    samples = [instance.get(_SMOOTH)]
    for k in range(4):
        instance.step(0.1 + 1e-3 * k, 1e-3)
        samples.append(instance.get(_SMOOTH))
    f = np.array(samples)
    estimate = (-25 * f[0] + 48 * f[1] - 36 * f[2] + 16 * f[3] - 3 * f[4]) / 12e-3
    assert rises == pytest.approx(estimate, rel=1e-4, abs=1e-3)
