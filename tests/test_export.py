"""URDF and MJCF as Pinocchio and MuJoCo read them: the same robot, by other people's code."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import kr16cli
from kr16cli.export.mjcf import mjcf
from kr16cli.export.urdf import NO_LIMIT, notes, urdf

Array = npt.NDArray[np.float64]

LOAD = kr16cli.Payload(16.0, (0.02, -0.03, 0.12), (0.4, 0.36, 0.3, 0.01, -0.02, 0.015))
POINT_LOAD = kr16cli.Payload(10.0, (0.05, 0.0, 0.1))
TILTED = (1.5, -2.5, -9.0)
ROBOTS = ("kr16_2", "chapter3")


@dataclass
class Case:
    """One export: the library's robot and the numbers another engine gives at q."""

    robot: kr16cli.Robot
    data: kr16cli.RobotData
    payload: kr16cli.Payload | None


@pytest.fixture(params=ROBOTS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=[None, LOAD, POINT_LOAD], ids=["bare", "load", "point_load"])
def case(name: str, request: pytest.FixtureRequest) -> Case:
    data = kr16cli.load_data(name).with_gravity(TILTED)
    return Case(kr16cli.Robot(data, payload=request.param), data, request.param)


def configurations(data: kr16cli.RobotData, n: int = 20) -> Array:
    """Random configurations within the limits, seeded."""
    lower, upper = ([getattr(j, key) for j in data.joints] for key in ("lower", "upper"))
    return np.random.default_rng(16).uniform(lower, upper, (n, 6))


def in_pinocchio(text: str, gravity: tuple[float, float, float] = (0, 0, -9.81)) -> pin.Model:
    model = pin.buildModelFromXML(text)
    model.gravity = pin.Motion(np.array(gravity), np.zeros(3))
    return model


def in_mujoco(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def mujoco_mass_matrix(model: mujoco.MjModel, state: mujoco.MjData) -> Array:
    """M by columns of inverse dynamics: what MuJoCo answers to unit accelerations.

    The packed inertia's layout differs between MuJoCo's versions, this does not.
    """
    columns = []
    for unit in np.eye(6):
        state.qvel[:], state.qacc[:] = 0.0, unit
        mujoco.mj_inverse(model, state)
        columns.append(state.qfrc_inverse - mujoco_gravity(model, state))
    return np.array(columns).T


def mujoco_gravity(model: mujoco.MjModel, state: mujoco.MjData) -> Array:
    """G: the bias force at rest."""
    state.qvel[:] = 0.0
    mujoco.mj_forward(model, state)
    return np.array(state.qfrc_bias)


def relative(actual: npt.ArrayLike, expected: Array) -> float:
    """Largest difference over the largest expected entry."""
    return float(np.abs(np.asarray(actual) - expected).max() / np.abs(expected).max())


def test_urdf_in_pinocchio_is_the_same_robot(case: Case) -> None:
    model = in_pinocchio(urdf(case.data, case.payload), TILTED)
    state = model.createData()
    flange, tool0 = (model.getFrameId(frame) for frame in ("flange", "tool0"))
    assert list(model.names)[1:] == ["A1", "A2", "A3", "A4", "A5", "A6"]
    for q in configurations(case.data):
        pin.framesForwardKinematics(model, state, q)
        T = case.robot.fk(q)
        assert np.abs(state.oMf[flange].homogeneous - T).max() < 1e-12
        assert np.abs(state.oMf[tool0].homogeneous - T).max() < 1e-12
        M = np.triu(pin.crba(model, state, q))
        assert relative(M, np.triu(case.robot.mass_matrix(q))) < 1e-12
        G = pin.computeGeneralizedGravity(model, state, q)
        assert relative(G, case.robot.gravity(q)) < 1e-12


def test_mjcf_in_mujoco_is_the_same_robot(case: Case) -> None:
    model, state = in_mujoco(mjcf(case.data, case.payload))
    site = model.site("flange").id
    for q in configurations(case.data):
        state.qpos[:] = q
        G = mujoco_gravity(model, state)
        T = case.robot.fk(q)
        assert np.abs(state.site_xpos[site] - T[:3, 3]).max() < 1e-12
        assert np.abs(state.site_xmat[site].reshape(3, 3) - T[:3, :3]).max() < 1e-12
        assert relative(G, case.robot.gravity(q)) < 1e-10
        assert relative(mujoco_mass_matrix(model, state), case.robot.mass_matrix(q)) < 1e-10


def test_urdf_in_mujoco_is_the_same_robot(case: Case) -> None:
    model, state = in_mujoco(urdf(case.data, case.payload))
    model.opt.gravity[:] = TILTED
    for q in configurations(case.data, 5):
        state.qpos[:] = q
        assert relative(mujoco_gravity(model, state), case.robot.gravity(q)) < 1e-10


def test_motion_in_pinocchio_has_the_same_coriolis_and_acceleration(case: Case) -> None:
    model = in_pinocchio(urdf(case.data, case.payload), TILTED)
    state = model.createData()
    rng = np.random.default_rng(5)
    for q in configurations(case.data, 5):
        qd, tau = rng.normal(size=6), rng.normal(scale=100.0, size=6)
        expected = case.robot.forward_dynamics(q, qd, tau)
        assert relative(pin.aba(model, state, q, qd, tau), expected) < 1e-10


def test_limits_effort_and_velocity_are_those_of_the_file() -> None:
    data = kr16cli.load_data()
    model = in_pinocchio(urdf(data))
    assert model.lowerPositionLimit.tolist() == [j.lower for j in data.joints]
    assert model.upperPositionLimit.tolist() == [j.upper for j in data.joints]
    assert model.velocityLimit.tolist() == [j.speed for j in data.joints]
    assert model.effortLimit.tolist() == [j.torque for j in data.joints]
    mj, _ = in_mujoco(mjcf(data))
    assert mj.jnt_limited.all()
    assert mj.jnt_range.tolist() == [[j.lower, j.upper] for j in data.joints]
    assert mj.actuator_ctrlrange[:, 1].tolist() == [j.torque for j in data.joints]
    assert mj.nu == 6


def test_limits_the_file_does_not_say_are_announced() -> None:
    data = kr16cli.load_data("chapter3")
    assert all(joint.torque is None for joint in data.joints)
    assert in_pinocchio(urdf(data)).effortLimit.tolist() == [NO_LIMIT] * 6
    assert any("torque limit" in note and "A1" in note for note in notes(data))
    assert not in_mujoco(mjcf(data))[0].actuator_ctrllimited.any()


def test_drives_reach_both_formats() -> None:
    data = kr16cli.load_data()
    model, state = in_mujoco(mjcf(data, None, True))
    assert model.dof_armature.tolist() == [j.reflected_inertia for j in data.joints]
    assert model.dof_damping.ravel().tolist() == [j.viscous for j in data.joints]
    assert model.dof_frictionloss.tolist() == [j.coulomb for j in data.joints]
    robot = kr16cli.Robot(data, drives=True)
    q = configurations(data, 1)[0]
    state.qpos[:] = q
    model.dof_frictionloss[:] = 0.0
    assert relative(mujoco_mass_matrix(model, state), robot.mass_matrix(q)) < 1e-10
    root = ET.fromstring(urdf(data, None, True))
    dynamics = [joint.find("dynamics") for joint in root.iter("joint")][:6]
    assert [float(d.get("damping", "nan")) for d in dynamics if d is not None] == [
        j.viscous for j in data.joints
    ]
    assert any("rotor inertia" in note for note in notes(data, drives=True))
    assert in_mujoco(mjcf(data))[0].dof_armature.tolist() == [0.0] * 6


def test_gravity_of_the_mjcf_is_the_files_or_the_one_asked_for() -> None:
    data = kr16cli.load_data()
    assert in_mujoco(mjcf(data))[0].opt.gravity.tolist() == list(data.gravity)
    assert in_mujoco(mjcf(data, gravity=TILTED))[0].opt.gravity.tolist() == list(TILTED)


def test_numbers_of_zero_pose_links_are_written_as_they_stand() -> None:
    data = kr16cli.load_data()
    root = ET.fromstring(urdf(data))
    for link, element in zip(data.links, root.iterfind("link/inertial"), strict=True):
        origin, inertia = element.find("origin"), element.find("inertia")
        assert origin is not None and inertia is not None
        assert tuple(map(float, origin.attrib["xyz"].split())) == link.com
        assert tuple(map(float, inertia.attrib.values())) == link.inertia


def test_kinematics_only_robot_goes_as_urdf_without_inertials() -> None:
    data = kr16cli.load_data("kr16_l6")
    text = urdf(data)
    assert "<inertial>" not in text
    assert any("no inertial data" in note for note in notes(data))
    model = in_pinocchio(text)
    state = model.createData()
    for q in configurations(data, 5):
        pin.framesForwardKinematics(model, state, q)
        T = state.oMf[model.getFrameId("flange")].homogeneous
        assert np.abs(T - kr16cli.Robot(data).fk(q)).max() < 1e-12


def test_what_needs_inertia_refuses_a_kinematics_only_robot() -> None:
    data = kr16cli.load_data("kr16_l6")
    with pytest.raises(kr16cli.InputError, match=r"0 of 6 links.*export urdf"):
        mjcf(data)
    with pytest.raises(kr16cli.InputError, match="payload of 16 kg"):
        urdf(data, LOAD)


def test_names_and_comments_are_safe_xml(tmp_path: Path) -> None:
    data = replace(kr16cli.load_data(), name='KR <16> & "2" -- test--')
    for text, tag in ((urdf(data), "name"), (mjcf(data), "model")):
        assert ET.fromstring(text).attrib[tag] == data.name
        (tmp_path / "robot.xml").write_text(text, encoding="utf-8")
        mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
