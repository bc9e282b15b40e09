"""Frames, flange, wrist centre and mass centres, by formulas that share nothing."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np

from kr16cli import Robot
from kr16cli.model import chain, forward
from kr16cli.robot import Geometry
from kr16cli.single import Arm
from kr16cli.verify import exact, sampling
from kr16cli.verify.independent import exponentials as poe
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.independent.rotations import Array
from kr16cli.verify.measure import COUNT, finding, gap, largest
from kr16cli.verify.records import Finding, Setting
from kr16cli.verify.registry import case

_FK = ("kr16cli.Robot.fk", "kr16cli.model.forward.flange")


@case(
    "kinematics.closed-form",
    title="Closed form equals the product of DH transforms",
    statement="T_robroot_flange of (3.3)-(3.6) = T_0^b T_1^0 ... T_6^5 Rz(180 deg)",
    regime="all of joint space, round angles",
    method="model.forward against model.chain, entry by entry",
    grade="C",
    tolerance=2e-15,
    unit="m, 1",
    reason="both round a dozen products of numbers up to 2; a formula's error is larger than 1e-3",
    equations=("3.1", "3.2", "3.3", "3.4", "3.5", "3.6"),
    functions=(*_FK, "kr16cli.model.chain.frames"),
)
def closed_form(setting: Setting) -> Finding:
    """Two forms of the model."""
    rng, robot = sampling.random(setting, "closed-form"), setting.robot.with_tool(None)
    n = setting.samples(20000, 1000)
    q = np.concatenate([sampling.generic(rng, n), sampling.round_angles(rng, n // 4)])
    error = gap(robot.fk(q), robot.frames(q).flange, 2)
    return finding(error, "largest difference of any entry of the 4x4 pose", q=q)


@case(
    "kinematics.exponentials",
    title="Flange against a product of exponentials",
    statement="T_robroot_flange(q) = e^([xi_1] q_1) ... e^([xi_6] q_6) T_robroot_flange(0)",
    regime="all of joint space, round angles, limits",
    method="Rodrigues' formula about the six axes of the zero pose; no DH table",
    grade="B",
    tolerance=1e-14,
    unit="m, 1",
    reason="six 4x4 products of lengths up to 2 m round to a few 1e-15",
    equations=("3.3", "3.4", "3.5", "3.6"),
    functions=_FK,
)
def exponentials(setting: Setting) -> Finding:
    """Flange by another method."""
    rng, robot = sampling.random(setting, "exponentials"), setting.robot.with_tool(None)
    n = setting.samples(20000, 1000)
    parts = (sampling.generic, sampling.round_angles, sampling.within_limits)
    q = sampling.joined([draw(rng, n, robot.data) for draw in parts])
    error = gap(robot.fk(q), poe.flange(robot.data.geometry, q), 2)
    return finding(error, "largest difference of any entry of the 4x4 pose", q=q)


@case(
    "kinematics.other-arms",
    title="Flange and mass centres of other arms of the same structure",
    statement="Forward kinematics and (3.29) hold for any lengths, a3 < 0 included",
    regime="random lengths, links and configurations",
    method="product of exponentials with the same numbers",
    grade="B",
    tolerance=1e-14,
    unit="m, 1",
    reason="as for the KR 16-2; random lengths hide no zero and no coincidence",
    equations=("3.3", "3.4", "3.5", "3.6", "3.29"),
    functions=(*_FK, "kr16cli.Robot.mass_centres", "kr16cli.model.inertia.link_body"),
)
def other_arms(setting: Setting) -> Finding:
    """Nothing leans on one robot's numbers."""
    rng = sampling.random(setting, "other-arms")
    errors, angles = [], []
    for _ in range(setting.samples(20, 3)):
        data = sampling.random_robot(rng, setting.robot.data)
        robot, q = Robot(data, payload=sampling.LOAD), sampling.generic(rng, 50)
        frames = _gap_of_frames(robot, q)
        flange = gap(robot.fk(q), poe.flange(data.geometry, q), 2)
        centres = Lagrangian(data, sampling.LOAD).mass_centres(q)
        errors.append(largest(frames, flange, gap(robot.mass_centres(q), centres, 2)))
        angles.append(q)
    q = np.concatenate(angles)
    return finding(np.concatenate(errors), "flange, frames and mass centres", q=q)


@case(
    "kinematics.table",
    title="All frames of Table 3.1, wrist centre and R36",
    statement="Frames 0..6 = products of Rot_z Trans_z Trans_x Rot_x of Table 3.1; "
    "o_c = o_4 = p - d6 z; R36 = R03^T R06",
    regime="all of joint space",
    method="the table's rows as literal 4x4 matrices, multiplied",
    grade="B",
    tolerance=1e-14,
    unit="m, 1",
    reason="products of seven rounded matrices with entries up to 2",
    equations=("3.1", "3.2", "3.8", "3.22", "Table 3.1"),
    functions=(
        "kr16cli.Robot.frames",
        "kr16cli.model.chain.frames",
        "kr16cli.model.forward.r36",
        "kr16cli.Arm.wrist_centre",
    ),
)
def table(setting: Setting) -> Finding:
    """Every intermediate frame."""
    rng = sampling.random(setting, "table")
    q = sampling.generic(rng, setting.samples(10000, 500))
    return finding(_gap_of_frames(setting.robot, q), "frames 0..6, flange, o_c and R36", q=q)


def _gap_of_frames(robot: Robot, q: Array) -> Array:
    """Largest difference of frames 0..6, flange, wrist centre and R36 from the literal table."""
    g = robot.data.geometry
    inside = poe.dh_frames(g, q)
    frames = robot.frames(q)
    literal = np.stack([poe.ROBROOT_OF_BASE @ frame for frame in inside], axis=-3)
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    r36 = np.swapaxes(inside[3], -1, -2)[..., :3, :3] @ inside[6][..., :3, :3]
    return largest(
        gap(frames.dh, literal, 3),
        gap(frames.flange, literal[..., 6, :, :] @ half_turn, 2),
        gap(frames.wrist_centre, poe.wrist_centre(g, q)),
        gap(frames.R36, r36, 2),
    )


@case(
    "kinematics.single",
    title="One configuration on floats",
    statement="Arm.fk, frames (robroot and the chapter's base b), wrist_centre, r36, mass_centres",
    regime="all of joint space, round angles",
    method="literal Table 3.1 and product of exponentials, one configuration at a time",
    grade="B",
    tolerance=1e-14,
    unit="m, 1",
    reason="as for arrays; the path on plain floats serves single queries",
    equations=("3.1", "3.2", "3.8", "3.22", "3.29"),
    functions=("kr16cli.Arm.fk", "kr16cli.Arm.frames", "kr16cli.Arm.wrist_centre"),
)
def single(setting: Setting) -> Finding:
    """The float path, chapter frames included."""
    rng, arm = sampling.random(setting, "single"), setting.robot.arm
    n = setting.samples(300, 15)
    q = np.concatenate([sampling.generic(rng, n), sampling.round_angles(rng, n)])
    found: dict[str, list[object]] = {name: [] for name in _expected(arm, q[:1])}
    for angles in q.tolist():
        for name, value in _answers(arm, angles).items():
            found[name].append(value)
    expected = _expected(arm, q)
    error = largest(*(gap(found[k], v, v.ndim - 1) for k, v in expected.items()))
    return finding(error, f"{', '.join(expected)}", q=q)


def _answers(arm: Arm, q: list[float]) -> dict[str, object]:
    """All that the float path says of one configuration."""
    answers: dict[str, object] = {"fk": arm.fk(q), "wrist centre": arm.wrist_centre(q)}
    answers["R36"] = arm.r36(q)
    answers["frames in robroot"] = list(arm.frames(q).values())
    answers["frames in b"] = list(arm.frames(q, base="chapter").values())
    if arm.data.links:
        answers["mass centres in robroot"] = arm.mass_centres(q)
        answers["mass centres in b"] = arm.mass_centres(q, base="chapter")
    return answers


def _expected(arm: Arm, q: Array) -> dict[str, Array]:
    """The same for configurations (n, 6), from independent formulas."""
    g = arm.geometry
    inside = poe.dh_frames(g, q)
    in_base = np.stack([*inside, inside[6] @ np.diag([-1.0, -1.0, 1.0, 1.0])], axis=1)
    expected = {
        "fk": poe.flange(g, q),
        "wrist centre": poe.wrist_centre(g, q),
        "R36": np.swapaxes(inside[3], -1, -2)[:, :3, :3] @ inside[6][:, :3, :3],
        "frames in robroot": poe.ROBROOT_OF_BASE @ in_base,
        "frames in b": in_base,
    }
    if arm.data.links:
        centres = Lagrangian(arm.data, arm.payload).mass_centres(q)
        expected["mass centres in robroot"] = centres
        expected["mass centres in b"] = centres @ poe.ROBROOT_OF_BASE[:3, :3]
    return expected


@case(
    "kinematics.rotations",
    title="Every frame is a rotation and a position",
    statement="R^T R = 1 and det R = +1 for frames 0..6 and the flange",
    regime="all of joint space",
    method="Gram matrix and determinant",
    grade="C",
    tolerance=4e-15,
    unit="1",
    reason="each column is rounded a dozen times near 1",
    equations=("3.1",),
    functions=("kr16cli.Robot.frames", "kr16cli.Robot.fk"),
)
def rotations(setting: Setting) -> Finding:
    """SO(3)."""
    rng, robot = sampling.random(setting, "rotations"), setting.robot
    q = sampling.generic(rng, setting.samples(10000, 500))
    frames = robot.frames(q)
    poses = np.concatenate([frames.dh, robot.fk(q)[:, None], frames.flange[:, None]], axis=1)
    R = poses[..., :3, :3]
    gram = gap(np.swapaxes(R, -1, -2) @ R, np.eye(3), 2)
    bottom = gap(poses[..., 3, :], np.array([0.0, 0.0, 0.0, 1.0]))
    error = largest(gram, np.abs(np.linalg.det(R) - 1.0), bottom).max(axis=1)
    return finding(error, "R^T R - 1, det R - 1 and the last row of nine frames", q=q)


@case(
    "kinematics.exact",
    title="Closed form, DH product and R36 agree exactly",
    statement="The polynomials in cosines and sines are the same: no rounding, difference 0",
    regime="rational points of the unit circle, random rational lengths",
    method="fractions; a false identity survives one point with a chance below 1e-2",
    grade="C",
    tolerance=COUNT,
    unit="entries that differ",
    reason="exact arithmetic: none may differ",
    equations=("3.3", "3.4", "3.5", "3.6", "3.8", "3.22"),
    functions=(*_FK, "kr16cli.model.chain.frames", "kr16cli.model.forward.r36"),
)
def exactly(setting: Setting) -> Finding:
    """An identity proved at random points."""
    source = random.Random(setting.seed)
    n, wrong = setting.samples(40, 6), 0
    for _ in range(n):
        g = Geometry(*(abs(exact.number(source)) for _ in range(6)))  # type: ignore[arg-type]
        cs = exact.turns(source)
        links = chain.frames(cs, g)
        a = forward.arm(cs, g)
        flange = forward.flange(cs, g)
        wrong += exact.unequal(flange.rows(), chain.flange_of_frame6(links[6]).rows())
        wrong += exact.unequal([a.wrist], [links[4].p])
        wrong += exact.unequal(a.axes, [frame.z for frame in links[:6]])
        turned = [links[3].unrotate(axis) for axis in (links[6].x, links[6].y, links[6].z)]
        wrong += exact.unequal(zip(*turned, strict=True), forward.r36(cs))
        unit = [
            [sum(p * q for p, q in zip(x, y, strict=True)) for y in flange[:3]] for x in flange[:3]
        ]
        wrong += exact.unequal(unit, [[Fraction(i == j) for j in range(3)] for i in range(3)])
    text = f"flange, wrist centre, joint axes, R36, R^T R at {n} points with other lengths each"
    return Finding(float(wrong), n, {}, text)


@case(
    "kinematics.mass-centres",
    title="Mass centres of the links",
    statement="p_ci of (3.29), the payload counted to link 6",
    regime="all of joint space; with and without a payload",
    method="zero-pose mass centres carried by the product of exponentials",
    grade="B",
    tolerance=1e-14,
    unit="m",
    reason="positions up to 2 m after six rounded products",
    equations=("3.29",),
    functions=("kr16cli.Robot.mass_centres", "kr16cli.model.energy.mass_centres"),
)
def mass_centres(setting: Setting) -> Finding:
    """Where the masses are."""
    data = setting.robot.data
    sampling.need_links(data)
    rng = sampling.random(setting, "mass-centres")
    q = sampling.generic(rng, setting.samples(5000, 300))
    errors = [
        gap(Robot(data, payload=load).mass_centres(q), Lagrangian(data, load).mass_centres(q), 2)
        for load in (None, sampling.LOAD)
    ]
    return finding(largest(*errors), "six mass centres, twice", q=q)


@case(
    "kinematics.batch",
    title="A batch is its single configurations",
    statement="any leading shape, two threads and `out=` give what a loop gives",
    regime="more configurations than a chunk of the engine",
    method="one call against flat calls, and against single configurations",
    grade="D",
    tolerance=1e-12,
    unit="m, rad, relative",
    reason="the same formulas; angles amplify the rounding of sines near singularities",
    functions=("kr16cli.Robot.fk", "kr16cli.Robot.ik", "kr16cli.Robot.jacobian"),
)
def batch(setting: Setting) -> Finding:
    """Shapes, chunks and threads."""
    rng, robot = sampling.random(setting, "batch"), setting.robot.with_tool(None)
    q = sampling.regular(rng, 4200, robot.data)
    shaped = q.reshape(2, 3, 700, 6)
    poses, out = robot.fk(q), np.empty((2, 3, 700, 4, 4))
    robot.fk(shaped, out=out, threads=2)
    error = gap(out.reshape(-1, 4, 4), poses, 2)
    error = largest(error, gap(robot.jacobian(shaped).reshape(-1, 6, 6), robot.jacobian(q), 2))
    rows = robot.ik(out.reshape(2, 3, 700, 4, 4), threads=2).reshape(-1, 8, 6)
    differ = ~np.isclose(rows, robot.ik(poses), rtol=0, atol=1e-12, equal_nan=True).all((1, 2))
    singles = np.array([robot.fk(row) for row in q[::60]])
    error[::60] = largest(error[::60], gap(singles, poses[::60], 2))
    return finding(np.where(differ, np.inf, error), f"{len(q)} configurations", q=q)


@case(
    "kinematics.tool",
    title="A tool on the flange",
    statement="fk with a tool = T_robroot_flange T_flange_tool; ik and Jacobian are the tool's",
    regime="all of joint space, random tools",
    method="product of exponentials times the tool; the tool's velocity by complex step",
    grade="B",
    tolerance=1e-10,
    unit="m, 1",
    reason="ik adds the rounding of one inverse; 1e-2 off singularities, twice",
    functions=("kr16cli.Robot.with_tool", "kr16cli.Robot.fk", "kr16cli.Robot.jacobian"),
)
def tool(setting: Setting) -> Finding:
    """Tools."""
    rng, g = sampling.random(setting, "tool"), setting.robot.data.geometry
    q = sampling.regular(rng, setting.samples(500, 60), setting.robot.data)
    place = np.eye(4)
    place[:3, :3] = poe.flange(g, rng.uniform(-3, 3, 6))[:3, :3]
    place[:3, 3] = rng.uniform(-0.3, 0.3, 3)
    robot = setting.robot.with_tool(place)
    expected = poe.flange(g, q) @ place
    solutions = robot.ik(expected)
    remade = poe.flange(g, np.nan_to_num(solutions)) @ place
    closure = np.where(np.isnan(solutions).any(-1), 0.0, gap(remade, expected[:, None], 2))
    own = gap(solutions, q[:, None, :])  # the configuration itself is among the solutions
    at_zero = (poe.zero_flange(g) @ place)[:3, 3]
    return finding(
        largest(
            gap(robot.fk(q), expected, 2),
            closure.max(axis=1),
            np.nanmin(np.where(np.isnan(own), np.inf, own), axis=1),
            gap(robot.jacobian(q), poe.jacobian(g, q, at_zero), 2),
        ),
        "fk, ik and Jacobian of a turned and shifted tool",
        q=q,
    )
