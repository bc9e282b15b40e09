"""Maps against brute force: every branch judged by plain floats, reach by forward kinematics."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import kr16cli
from kr16cli.errors import InputError
from kr16cli.robot import Payload
from kr16cli.robot_file import load_data
from kr16cli.single import Arm
from kr16cli.study import map_facts, map_file, map_sections
from kr16cli.study.engine import Local
from kr16cli.study.grid import all_around, from_abc, make_grid
from kr16cli.study.maps import MOST_CONDITION, MOST_PAYLOAD, MapWork
from kr16cli.study.session import finished
from kr16cli.verify.suites.datasheet import reference

DATA = load_data()
DOWN = from_abc([(0.0, 180.0, 0.0)])
TOOL = ((1.0, 0.0, 0.0, 0.05), (0.0, 0.0, -1.0, 0.0), (0.0, 1.0, 0.0, 0.2), (0.0, 0.0, 0.0, 1.0))


def a_map(quantity, step=0.35, *, rotations=DOWN, kind="fixed", data=DATA, ranges=None, **more):
    grid = make_grid(data, step, rotations=rotations, kind=kind, ranges=ranges, longer=0.2)
    return MapWork(data, quantity, grid, **more)


def columns(work, **options):
    with finished(work, **options) as store:
        parts = list(store.chunks())
    return {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}


def inside(q, data):
    """Whether each angle, or one whole turns away, is in its range."""
    return all(
        any(j.lower - 1e-9 <= a + 2 * math.pi * k <= j.upper + 1e-9 for k in (-2, -1, 0, 1, 2))
        for a, j in zip(q, data.joints, strict=True)
    )


def poses_of(work):
    """Flange poses of every row of a fixed map, from the grid's definition."""
    g = work.grid
    tool = np.eye(4) if work.tool is None else np.array(work.tool)
    if work.point == "wrist":
        tool = np.eye(4)
        tool[2, 3] = -work.data.geometry.d6
    for x in g.x:
        for y in g.y:
            for z in g.z:
                pose = np.eye(4)
                pose[:3, :3], pose[:3, 3] = g.rotations[0], (x, y, z)
                yield pose @ np.linalg.inv(tool)


def branches_of(work):
    """The branches within limits of every row, by the scalar inverse kinematics."""
    arm = Arm(work.data)
    for pose in poses_of(work):
        angles = [q for q in arm.ik(pose.tolist()).angles if all(map(math.isfinite, q))]
        yield len(angles), np.array([q for q in angles if inside(q, work.data)]).reshape(-1, 6)


def widened(cells):
    """The cells and all that touch them, diagonally too."""
    for axis in range(3):
        cells = cells | np.roll(cells, 1, axis) | np.roll(cells, -1, axis)
    return cells


MORE = {"flange": {}, "tool": {"tool": TOOL}, "wrist": {}}


@pytest.mark.parametrize("point", MORE)
@pytest.mark.parametrize("robot", ["kr16_2", "kr16_l6"])
def test_reach_counts_the_branches_within_limits(point, robot):
    work = a_map("reach", data=load_data(robot), point=point, **MORE[point])
    found = columns(work)
    expected = list(branches_of(work))
    assert found["solutions"].tolist() == [n for n, _ in expected]
    assert found["branches"].tolist() == [len(q) for _, q in expected]
    assert {0, 2, 4} <= set(found["branches"].tolist())
    lower, upper = (np.array([getattr(j, s) for j in work.data.joints]) for s in ("lower", "upper"))
    for margin, (_, q) in zip(found["limit_margin"], expected, strict=True):
        turned = q[..., None] + 2 * np.pi * np.arange(-2, 3)
        room = np.minimum(turned - lower[:, None], upper[:, None] - turned).max(axis=2)
        if len(q):
            assert margin == pytest.approx(room.min(axis=1).max(), abs=1e-6)
        else:
            assert np.isnan(margin)


def test_manipulability_and_condition_are_those_of_the_jacobian():
    robot = kr16cli.load_robot()
    work, other = a_map("manipulability"), a_map("condition", length=0.5)
    found, sharp = columns(work), columns(other)
    for i, (_, q) in enumerate(branches_of(work)):
        assert found["branches"][i] == sharp["branches"][i] == len(q)
        if not len(q):
            assert np.isnan(found["best"][i])
            assert np.isnan(sharp["condition_best"][i])
            continue
        J = robot.jacobian(q)
        w = np.sqrt(np.abs(np.linalg.det(J @ J.swapaxes(1, 2))))
        assert found["best"][i] == pytest.approx(w.max(), rel=1e-5, abs=1e-7)
        assert found["worst"][i] == pytest.approx(w.min(), rel=1e-5, abs=1e-7)
        J[:, :3] /= 0.5
        sigma = np.linalg.svd(J, compute_uv=False)
        assert sharp["smallest_best"][i] == pytest.approx(sigma[:, -1].max(), rel=1e-5)
        assert sharp["smallest_worst"][i] == pytest.approx(sigma[:, -1].min(), rel=1e-5, abs=1e-9)
        ratio = sigma[:, 0] / sigma[:, -1]
        for name, value in (("best", ratio.min()), ("worst", ratio.max())):
            if value < 1e8:  # beyond, rounding decides
                assert sharp[f"condition_{name}"][i] == pytest.approx(value, rel=1e-5)
            else:
                assert 1e8 < sharp[f"condition_{name}"][i] <= MOST_CONDITION


def test_singular_margin_is_the_least_share_of_the_determinant_s_factors():
    work = a_map("manipulability", 0.41)
    g, found = DATA.geometry, columns(work)
    robot, forearm = kr16cli.load_robot(), math.hypot(DATA.geometry.a3, DATA.geometry.d4)
    for margin, (_, q) in zip(found["singular_margin"], branches_of(work), strict=True):
        if len(q):
            f = robot.singularity(q)
            shares = [f.shoulder / (g.a1 + g.a2 + forearm), f.elbow / forearm, f.wrist]
            assert margin == pytest.approx(np.abs(shares).min(axis=0).max(), abs=1e-6)


def test_torque_and_payload_are_those_of_static_loads():
    load = Payload(12.0, (0.05, 0.0, 0.1))
    held, most = a_map("torque", 0.4, payload=load), a_map("payload", 0.4, payload=load)
    found, mass = columns(held), columns(most)
    limits = np.array([j.torque for j in DATA.joints])
    bare = kr16cli.load_robot()
    loaded = bare.with_payload(12.0, load.com)
    for i, (_, q) in enumerate(branches_of(held)):
        if not len(q):
            assert found["joint"][i] == mass["joint"][i] == 0
            assert np.isnan([found["load_best"][i], mass["mass_best"][i]]).all()
            continue
        share = np.abs(loaded.gravity(q)) / limits
        assert found["load_best"][i] == pytest.approx(share.max(axis=1).min(), rel=1e-5)
        assert found["load_worst"][i] == pytest.approx(share.max(axis=1).max(), rel=1e-5)
        best = share[share.max(axis=1).argmin()]
        assert best[found["joint"][i] - 1] == pytest.approx(best.max())
        # At the largest mass some joint of some branch is just at its limit, of the others not.
        heaviest = float(mass["mass_best"][i])
        assert 0.0 < heaviest < MOST_PAYLOAD
        at = np.abs(bare.with_payload(heaviest, load.com).gravity(q)) / limits
        assert at.max(axis=1).min() == pytest.approx(1.0, rel=1e-5)
        lightest = float(mass["mass_worst"][i])
        at = np.abs(bare.with_payload(lightest, load.com).gravity(q)) / limits
        assert at.max() == pytest.approx(1.0, rel=1e-5)


def test_what_forward_kinematics_reaches_is_on_the_map_and_nothing_else():
    """Wrist centres of random joints in range fall into cells that the map reaches, and back."""
    step = 0.05
    work = a_map("reach", step, kind="free", rotations=all_around(30), point="wrist")
    reached = columns(work)["branches"].reshape(work.grid.shape) > 0
    lower, upper = (np.array([getattr(j, s) for j in DATA.joints]) for s in ("lower", "upper"))
    q = np.random.default_rng(2).uniform(lower, upper, (400_000, 6))
    at = kr16cli.load_robot().frames(q).wrist_centre
    index = [np.rint((at[:, i] - axis[0]) / step).astype(int)
             for i, axis in enumerate((work.grid.x, work.grid.y, work.grid.z))]  # fmt: skip
    visited = np.zeros(reached.shape, dtype=bool)
    visited[tuple(index)] = True
    assert (visited & ~widened(reached)).sum() == 0
    assert (reached & ~widened(visited)).sum() < 0.005 * reached.sum()


def test_outline_and_volume_are_those_of_the_published_envelope():
    work = a_map("reach", 0.04, kind="free", rotations=all_around(20), point="wrist")
    with finished(work, runner=Local(2)) as store:
        told = map_facts.facts(work, store)
    published = {row["figure"]: float(row["value"]) for row in reference("envelope")}
    found = {row["figure"]: row for row in told["envelope"]}
    assert set(found) == {"reach", "wrist_height", "total_height", "working_volume"}
    assert all(row["within"] for row in found.values())
    for name in ("reach", "wrist_height", "total_height"):
        assert published[name] - 80.0 < found[name]["map"] <= published[name] + 0.5
    assert told["volume"] == pytest.approx(14.40, abs=0.06)


def test_free_orientation_is_the_best_and_the_worst_of_all():
    rotations = all_around(7, 2)
    free = columns(a_map("manipulability", 0.4, kind="free", rotations=rotations))
    listed = columns(a_map("manipulability", 0.4, kind="list", rotations=rotations))
    table = {name: values.reshape(-1, 14) for name, values in listed.items()}
    assert (free["orientations"] == (table["branches"] > 0).sum(axis=1)).all()
    assert (free["branches"] == table["branches"].max(axis=1)).all()
    for name, pick in (("best", np.fmax), ("worst", np.fmin), ("singular_margin", np.fmax)):
        assert np.array_equal(free[name], pick.reduce(table[name], axis=1), equal_nan=True)


def test_free_payload_names_the_joint_of_the_best_orientation():
    rotations = all_around(5)
    load = Payload(1.0, (0.1, 0.0, 0.3))
    free = columns(a_map("payload", 0.5, kind="free", rotations=rotations, payload=load))
    listed = columns(a_map("payload", 0.5, kind="list", rotations=rotations, payload=load))
    table = {name: values.reshape(-1, 5) for name, values in listed.items()}
    there = free["branches"] > 0
    best = np.nan_to_num(table["mass_best"], nan=-1.0).argmax(axis=1)
    chosen = np.take_along_axis(table["joint"], best[:, None], 1)[:, 0]
    assert (free["joint"][there] == chosen[there]).all()
    assert (free["joint"][~there] == 0).all()


def test_a_tool_s_orientation_and_chunks_cut_between_orientations_make_the_same_map(monkeypatch):
    work = a_map("reach", 0.5, kind="list", rotations=all_around(6), point="tool", tool=TOOL)
    whole = columns(work)
    monkeypatch.setattr(MapWork, "chunk_rows", property(lambda self: 7))
    cut = columns(work)
    for name, values in whole.items():
        assert values.tobytes() == cut[name].tobytes()


def test_directions_are_spread_evenly_and_are_rotations():
    r = all_around(400, 3)
    assert r.shape == (1200, 3, 3)
    assert np.abs(r @ r.transpose(0, 2, 1) - np.eye(3)).max() < 1e-14
    assert np.linalg.det(r) == pytest.approx(1.0)
    z = r[::3, :, 2]
    assert np.abs(z.mean(axis=0)).max() < 0.005
    gaps = np.arccos(np.clip(z @ z.T - 3 * np.eye(400), -1, 1)).min(axis=1)
    assert gaps.min() > 0.5 * math.sqrt(4 * math.pi / 400)


def test_a_map_is_written_with_its_axes_and_read_back(tmp_path):
    work = a_map("reach", 0.3, ranges={"y": [0.0]})
    with finished(work) as store:
        answer = map_facts.answer(work, store)
        map_file.write(tmp_path / "m.npz", work, store, answer)
        layer = map_sections.sections(work, store)[0]
    with np.load(tmp_path / "m.npz") as archive:
        assert archive["branches"].shape == (len(archive["x"]), 1, len(archive["z"]))
        assert json.loads(str(archive["metadata"])) == answer
        shown = np.where(archive["branches"][:, 0] == 0, np.nan, archive["branches"][:, 0]).T
        assert np.array_equal(layer.values, shown, equal_nan=True)
    assert (layer.normal, layer.across, layer.up, layer.at) == ("y", "x", "z", 0.0)
    assert sum(answer["result"]["branches"].values()) == work.rows


def test_sections_of_a_solid_map_are_its_layers():
    work = a_map("reach", 0.25)
    cube = columns(work)["branches"].reshape(work.grid.shape).astype(float)
    cube[cube == 0] = np.nan
    with finished(work) as store:
        layers = map_sections.sections(work, store)
    assert [s.normal for s in layers] == ["y", "z", "x"]
    for s in layers:
        axis = "xyz".index(s.normal)
        at = int(np.abs(work.axes()[s.normal] - s.at).argmin())
        assert np.array_equal(s.values, np.take(cube, at, axis).T, equal_nan=True)


def test_extremes_are_where_they_are_said_to_be():
    work = a_map("manipulability", 0.3)
    found = columns(work)["best"].reshape(work.grid.shape)
    with finished(work) as store:
        told = map_facts.facts(work, store)["measures"]["best"]
    at = np.unravel_index(np.nanargmax(found), found.shape)
    assert told["largest"] == found[at]
    place = [axis[i] for axis, i in zip(work.axes().values(), at, strict=True)]
    assert [told["largest_at"][k] for k in "xyz"] == place


def test_the_mean_of_a_condition_number_is_the_geometric_one():
    work = a_map("condition", 0.3)
    found = columns(work)["condition_best"]
    with finished(work) as store:
        told = map_facts.facts(work, store)["measures"]["condition_best"]
    known = found[~np.isnan(found)].astype(float)
    assert told["mean"] == pytest.approx(np.exp(np.log(known).mean()))
    assert told["mean"] < 20.0 < known.mean()  # one singular posture decides the other mean


@pytest.mark.parametrize(
    "ranges", [None, {"y": [0.0]}, {"z": [0.5]}, {"x": [1.0], "y": [0.0]}, {"x": [1.0], "z": [0]}]
)
def test_points_are_those_of_the_axes_from_any_one_to_any_other(ranges):
    grid = make_grid(DATA, 0.11, rotations=DOWN, ranges=ranges)
    every = np.stack(np.meshgrid(grid.x, grid.y, grid.z, indexing="ij"), -1).reshape(-1, 3)
    rng = np.random.default_rng(1)
    for start in [0, grid.points - 1, *rng.integers(0, grid.points, 40).tolist()]:
        stop = int(rng.integers(start + 1, min(grid.points, start + 6000) + 1))
        found = grid.positions(start, stop, np.empty((stop - start, 3)))
        assert (found == every[start:stop]).all()


def test_the_outline_behind_the_arm_is_the_one_in_front_turned_over():
    wrist = map_sections.outline(a_map("reach", point="wrist"))
    flange = map_sections.outline(a_map("reach"))  # down: 158 mm below the wrist centre
    down = np.array([0.0, -0.158])
    for name, points in wrist.front.items():
        assert wrist.behind[name] == pytest.approx(points * [-1, 1])
        assert flange.front[name] == pytest.approx(points + down)
        assert flange.behind[name] == pytest.approx(points * [-1, 1] + down)
    first = replace(DATA.joints[0], lower=-3.0, upper=3.0)
    short = replace(DATA, joints=(first, *DATA.joints[1:]))
    assert map_sections.outline(a_map("reach", data=short)).behind == {}


@pytest.mark.parametrize(
    ("step", "ranges", "words"),
    [
        (0.0, {}, "must be more than 0"),
        (-0.1, {}, "must be more than 0"),
        (math.nan, {}, "must be more than 0"),
        (1e-4, {}, "poses; at most"),
        (1e-6, {}, "points along x"),
        (1e-300, {}, "points along x"),
        (0.1, {"x": [1.0, 0.5]}, "is empty"),
        (0.1, {"z": [0.51, 0.59]}, "holds no multiple of the spacing"),
    ],
)
def test_impossible_grids_are_refused(step, ranges, words):
    with pytest.raises(InputError, match=words):
        make_grid(DATA, step, ranges=ranges, rotations=DOWN)


def test_a_map_without_its_numbers_is_refused():
    bare = load_data("chapter3")
    with pytest.raises(InputError, match="torque"):
        a_map("torque", data=bare)
    with pytest.raises(InputError, match="--point tool needs --tool"):
        a_map("reach", point="tool")
    with pytest.raises(InputError, match="--length is 0"):
        a_map("condition", length=0.0)
    for count in ((0, 1), (1, 0)):
        with pytest.raises(InputError, match="whole number of 1 or more"):
            all_around(*count)
