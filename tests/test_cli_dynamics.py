"""kr16 dynamics: torques, accelerations, payload, gravity, task space, friction."""

from __future__ import annotations

import re

import pytest

from command_line import complains, kr16
from joint_tables import GENERIC, HOME, radians
from kr16cli import Arm, Payload, RobotData, units


def test_dynamics_is_the_models(data: RobotData) -> None:
    qd, qdd, tau = (10, 20, -30, 40, 50, 60), (1, 2, 3, 4, -5, 6), (1, 2, 3, 4, 5, -6)
    load = ["--payload", 10, 5, 6, 100, 0.1, 0.2, 0.25]
    words = ["dynamics", *GENERIC, "--qd", *qd, "--qdd", *qdd, "--tau", *tau, *load, "--drives"]
    result = kr16(*words, "--json").result()
    payload = Payload(10, (0.005, 0.006, 0.1), (0.1, 0.2, 0.25, 0, 0, 0))
    arm = Arm(data, payload=payload, drives=True)
    q, qd_rad = radians(GENERIC), radians(qd)
    assert result["torque"] == pytest.approx(arm.inverse_dynamics(q, qd_rad, radians(qdd)))
    assert result["acceleration"] == pytest.approx(arm.forward_dynamics(q, qd_rad, tau))
    assert result["gravity"] == pytest.approx(arm.gravity(q))
    assert tuple(result["energy"].values()) == pytest.approx(arm.energy(q, qd_rad))
    assert result["base_wrench"] == pytest.approx(arm.base_wrench(q, qd_rad, radians(qdd)))
    for row, expected in zip(result["mass_matrix"], arm.mass_matrix(q), strict=True):
        assert row == pytest.approx(expected, abs=1e-12)


def test_torque_from_the_parts() -> None:
    """M qdd + C qd + G of the printed result is its printed torque."""
    qd, qdd = (10, 20, -30, 40, 50, 60), (1, 2, 3, 4, -5, 6)
    words = ["dynamics", *GENERIC, "--qd", *qd, "--qdd", *qdd, "--json"]
    r = kr16(*words).result()
    for i in range(6):
        parts = sum(r["mass_matrix"][i][j] * units.rad(qdd[j]) for j in range(6))
        parts += sum(r["coriolis_matrix"][i][j] * units.rad(qd[j]) for j in range(6))
        assert r["torque"][i] == pytest.approx(parts + r["gravity"][i], abs=1e-9)


@pytest.mark.parametrize(
    "words",
    [
        ("--payload", "{M 16,CM {X 0,Y 0,Z 120,A 0,B 0,C 0},J {X 0.36,Y 0.36,Z 0.36}}"),
        ("--load-data", "{M 16,CM {X 0,Y 0,Z 120,A 0,B 0,C 0},J {X 0.36,Y 0.36,Z 0.36}}"),
        ("--payload", 16, 0, 0, 120, 0.36, 0.36, 0.36),
        ("--payload", 16, 0, 0, 0.12, 0.36, 0.36, 0.36, "--si"),
    ],
)
def test_payload_in_every_form(words: tuple[object, ...]) -> None:
    result = kr16("dynamics", 0, 0, 0, 0, 0, 0, *words, "--json").result()
    empty = kr16("dynamics 0 0 0 0 0 0 --json").result()
    more = result["base_wrench"][2] - empty["base_wrench"][2]
    assert more == pytest.approx(16 * 9.81)


def test_payload_before_the_joint_angles() -> None:
    one = kr16(f"dynamics --payload 16 0 0 -120 {HOME} --json").result()
    two = kr16(f"dynamics {HOME} --payload 16 0 0 -120 --json").result()
    three = kr16(f"dynamics --payload 16 0 0 -120 0.1 0.1 0.1 {HOME} --json").result()
    assert one == two != three


def test_gravity_points_where_it_is_told() -> None:
    r = kr16(f"dynamics {HOME} --gravity 0 0 0 --json").result()
    assert r["gravity"] == pytest.approx([0] * 6)
    r = kr16(f"dynamics {HOME} --gravity 0 -5 0 --json").result()
    assert r["base_wrench"][:3] == pytest.approx([0, 5 * 171.628, 0])


def test_overload_is_warned_about() -> None:
    done = kr16("dynamics 0 0 0 0 0 0 --payload 200 0 0 500 --qdd 0 0 0 0 0 0")
    assert done.code == 0
    assert "payload 200 kg exceeds the rated 16 kg" in done.err
    assert "A2 needs" in done.err


def test_task_space_or_the_reason() -> None:
    r = kr16("dynamics 10 -70 80 35 -40 20 --task --json").result()
    assert len(r["task"]["mass_matrix"]) == 6
    home = kr16(f"dynamics {HOME} --task --json").json()
    assert home["result"]["task"] is None
    assert "singular" in home["result"]["task_reason"]
    assert home["warnings"]


def test_no_inertial_data_no_dynamics() -> None:
    complains(kr16(f"dynamics {HOME} --robot kr16_l6"), "KR 16 L6", "no inertial data")


def test_help_says_how_coulomb_friction_is_regularised(data: RobotData) -> None:
    text = " ".join(kr16("dynamics --help").out.split())
    assert "qd/sqrt(qd^2 + 0.01^2)" in text
    (percent,) = map(float, re.findall(r"within ([0-9.]+) % of its value at 20 deg/s", text))
    qd = units.rad(20.0)
    torque = Arm(data, drives=True).friction([qd] * 6)
    for joint, value in zip(data.joints, torque, strict=True):
        coulomb = joint.coulomb or 0.0
        lost = 1 - (value - (joint.viscous or 0.0) * qd) / coulomb
        assert round(100 * lost, 2) == percent
