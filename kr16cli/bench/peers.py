"""The same questions to other engines, each in its best way; only those that are installed.

The arm given to them has the same joints; values are compared in `verify`, not here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from kr16cli.api import Robot
from kr16cli.bench.timing import Work
from kr16cli.export.mjcf import mjcf
from kr16cli.export.urdf import urdf

_LOOP = 500

LOOP = "Pinocchio, a loop"
THREADS = 2
"""Of a peer's own parallel batch, compared with one thread of this library."""


def works(robot: Robot, made: Mapping[str, Any]) -> dict[str, dict[str, Work]]:
    """Quantity -> peer -> its call, for the peers that are here."""
    table: dict[str, dict[str, Work]] = {}
    for peer in (_pinocchio, _mujoco, _toolbox, _eaik, _opw):
        try:
            for (quantity, label), work in peer(robot, made):
                table.setdefault(quantity, {})[label] = work
        except ImportError:
            continue
    return table


Works = Iterator[tuple[tuple[str, str], Work]]


def _looped(function: Callable[..., object], *columns: Any) -> Work:
    rows = list(zip(*(c[:_LOOP] for c in columns), strict=True))

    def call() -> None:
        for row in rows:
            function(*row)

    return call, len(rows)


def _pinocchio(robot: Robot, made: Mapping[str, Any]) -> Works:
    import pinocchio as pin

    model = pin.buildModelFromXML(urdf(robot.data))
    data = model.createData()
    q, qd, qdd, tau = (made[k] for k in ("q", "qd", "qdd", "tau"))
    frame = model.getFrameId("flange")

    def fk(a: Any) -> Any:
        pin.forwardKinematics(model, data, a)
        return pin.updateFramePlacement(model, data, frame).homogeneous

    def jacobian(a: Any) -> Any:
        return pin.computeFrameJacobian(model, data, a, frame, pin.LOCAL_WORLD_ALIGNED)

    def jacobian_dot(a: Any, b: Any) -> Any:
        pin.computeJointJacobiansTimeVariation(model, data, a, b)
        return pin.getFrameJacobianTimeVariation(model, data, frame, pin.LOCAL_WORLD_ALIGNED)

    label = LOOP
    yield ("fk", label), _looped(fk, q)
    yield ("jacobian", label), _looped(jacobian, q)
    yield ("jacobian_dot", label), _looped(jacobian_dot, q, qd)
    yield ("mass_matrix", label), _looped(lambda a: pin.crba(model, data, a), q)
    yield (
        ("coriolis_matrix", label),
        _looped(lambda a, b: pin.computeCoriolisMatrix(model, data, a, b), q, qd),
    )
    yield ("gravity", label), _looped(lambda a: pin.computeGeneralizedGravity(model, data, a), q)
    yield (
        ("inverse_dynamics", label),
        _looped(lambda a, b, c: pin.rnea(model, data, a, b, c), q, qd, qdd),
    )
    yield (
        ("forward_dynamics", label),
        _looped(lambda a, b, c: pin.aba(model, data, a, b, c), q, qd, tau),
    )
    pool = pin.ModelPool(model, THREADS)
    label = f"Pinocchio, {THREADS} threads"
    for name, call, columns in (
        ("inverse_dynamics", pin.rneaInParallel, (q, qd, qdd)),
        ("forward_dynamics", pin.abaInParallel, (q, qd, tau)),
    ):
        turned = [np.asfortranarray(c.T) for c in columns]
        yield (name, label), (partial(call, THREADS, pool, *turned), len(q))


def _mujoco(robot: Robot, made: Mapping[str, Any]) -> Works:
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf(robot.data))
    data = mujoco.MjData(model)

    def fk(q: Any) -> None:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)

    def inverse(q: Any, qd: Any, qdd: Any) -> None:
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)

    yield ("fk", "MuJoCo, a loop"), _looped(fk, made["q"])
    states = (made["q"], made["qd"], made["qdd"])
    yield ("inverse_dynamics", "MuJoCo, a loop"), _looped(inverse, *states)


def _toolbox(robot: Robot, made: Mapping[str, Any]) -> Works:
    from kr16cli.verify.engines.toolbox import build

    arm = build(robot.data, robot.payload).robot
    q, qd, qdd = (made[k][: _LOOP // 10] for k in ("q", "qd", "qdd"))  # it takes its time
    label = "Robotics Toolbox"
    yield ("fk", f"{label}, its batch"), (lambda: arm.fkine(q), len(q))
    yield ("jacobian", f"{label}, a loop"), _looped(arm.jacob0, q)
    yield ("inverse_dynamics", f"{label}, its batch"), (lambda: arm.rne(q, qd, qdd), len(q))


def _eaik(robot: Robot, made: Mapping[str, Any]) -> Works:
    from eaik.IK_DH import DhRobot

    g = robot.data.geometry
    quarter = np.pi / 2
    arm = DhRobot(  # a standard DH table of the same lengths
        np.array([-quarter, 0.0, quarter, -quarter, quarter, 0.0]),
        np.array([g.a1, g.a2, -g.a3, 0.0, 0.0, 0.0]),
        np.array([g.d1, 0.0, 0.0, g.d4, 0.0, g.d6]),
    )
    poses = [np.array(arm.fwdKin(q)) for q in made["q"][:_LOOP]]
    yield ("ik", "EAIK, its batch"), (lambda: arm.IK_batched(poses), len(poses))


def _opw(robot: Robot, made: Mapping[str, Any]) -> Works:
    import py_opw_kinematics as opw

    g = robot.data.geometry
    model = opw.KinematicModel(a1=g.a1, a2=-g.a3, b=0.0, c1=g.d1, c2=g.a2, c3=g.d4, c4=g.d6)
    arm = opw.Robot(model, degrees=False)
    joints = made["q"][: 20 * _LOOP]
    poses = arm.batch_forward(joints)
    yield ("fk", "py-opw, its batch"), (lambda: arm.batch_forward(joints), len(joints))
    yield ("ik", "py-opw, its reach"), (lambda: arm.reach(poses), len(joints))
