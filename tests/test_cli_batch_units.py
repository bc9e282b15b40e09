"""Units that a file says: read in their own only, refused in others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from command_line import complains, kr16
from joint_tables import HEADER


@pytest.mark.parametrize("suffix", ["csv", "npz"])
@pytest.mark.parametrize("si", [(), ("--si",)])
def test_joint_angles_of_ik_are_read_in_their_own_units_only(
    tmp_path: Path, suffix: str, si: tuple[str, ...]
) -> None:
    file = tmp_path / f"q.{suffix}"
    pose = (1.2, 0.1, 0.9, 0, 2, 0) if si else (1200, 100, 900, 0, 120, 0)
    assert kr16("ik", *pose, *si, "-o", file).code == 0
    other = () if si else ("--si",)
    do = "give --si" if si else "leave out --si"
    complains(kr16("fk", "--input", file, *other, "--json"), str(file), "rad" if si else "deg", do)
    (row,) = kr16("fk", "--input", file, *si, "--json").json()["result"]["rows"]
    assert [row["pose"][k] for k in "xyz"] == pytest.approx(pose[:3])


def test_poses_of_fk_are_read_in_their_own_units_only(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    assert kr16("fk", "-", "--si", "-o", file, stdin=f"{HEADER}\n0,-1,1,0,0.5,0\n").code == 0
    complains(kr16("ik", "--input", file, "--json"), str(file), "m rad", "give --si")
    assert kr16("ik", "--input", file, "--si", "--json").code == 0
    # Transforms are in m whatever was typed, so npz is read with and without.
    archive = tmp_path / "poses.npz"
    assert kr16("fk", 0, -1, 1, 0, 0.5, 0, "--si", "-o", archive).code == 0
    deg = kr16("ik", "--input", archive, "--json").json()["result"]["rows"][0]["solutions"][0]
    rad = kr16("ik", "--input", archive, "--si", "--json").json()["result"]["rows"][0]
    assert np.radians(deg["q"]) == pytest.approx(rad["solutions"][0]["q"])


def test_a_run_is_read_in_rad_only(tmp_path: Path) -> None:
    table, archive = tmp_path / "run.csv", tmp_path / "run.npz"
    words = "simulate --q 0 -60 60 10 30 20 --duration 0.02"
    for file in (table, archive):
        assert kr16(*words.split(), "-o", file).code == 0
        complains(kr16("dynamics", "--input", file, "--json"), str(file), "rad", "give --si")
    one = kr16("dynamics", "--input", table, "--si", "--json")
    two = kr16("dynamics", "--input", archive, "--si", "--json")
    assert (one.code, one.json()["warnings"]) == (0, [])
    assert one.json()["result"] == two.json()["result"]
    first = kr16("dynamics 0 -60 60 10 30 20 --json").result()
    assert one.json()["result"]["rows"][0]["gravity"] == pytest.approx(first["gravity"])
    complains(kr16("ik", "--input", table), "give --si")


@pytest.mark.parametrize(
    ("text", "si", "words"),
    [
        ("a1,a2,a3,a4,a5,a6,units\n1,2,3,4,5,6,deg\n1,2,3,4,5,6,rad\n", False, ("rad", "give")),
        ("a1 [rad],a2,a3,a4,a5,a6\n1,2,3,4,5,6\n", False, ("in rad", "give --si")),
        ("a1,a2,a3,a4,a5,a6 [deg]\n1,2,3,4,5,6\n", True, ("in deg", "leave out --si")),
        ("a1,a2,a3,a4,a5,a6,qd1 [rad/s],qd2,qd3,qd4,qd5,qd6\n", False, ("rad/s", "give --si")),
    ],
)
def test_units_that_differ_from_those_read_are_refused(
    text: str, si: bool, words: tuple[str, ...]
) -> None:
    complains(kr16("dynamics", "-", "--json", *["--si"] * si, stdin=text), "stdin", *words)


def test_a_file_in_mixed_units_must_be_converted() -> None:
    text = "x,y,z,a,b,c,units\n1,2,3,4,5,6,mm rad\n"
    for options in ((), ("--si",)):
        complains(kr16("ik", "-", "--json", *options, stdin=text), "mm rad", "convert it")


@pytest.mark.parametrize("units", ["furlongs", "", "[1, 2]", '{"q": "deg"}'])
def test_units_of_somebody_elses_are_let_be(tmp_path: Path, units: str) -> None:
    text = f"{HEADER},units\n1,2,3,4,5,6,{units if units == 'furlongs' else ''}\n"
    assert kr16("fk", "-", stdin=text).code == 0
    np.savez(tmp_path / "q.npz", q=np.zeros((1, 6)), units=np.array(units))
    assert kr16("fk", "--input", tmp_path / "q.npz").code == 0
    np.savez(tmp_path / "q.npz", q=np.zeros((1, 6)), units=np.array([1.0]))
    assert kr16("fk", "--input", tmp_path / "q.npz").code == 0
