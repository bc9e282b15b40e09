"""What pages show of uncertainty, computed before any page is drawn, by kr16cli.study."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from kr16cli.errors import InputError
from kr16cli.robot import RobotData
from kr16cli.verify.drawings import Drawing
from kr16cli.verify.records import SkipCase
from kr16cli.verify.sampling import need_links

if TYPE_CHECKING:
    from kr16cli.simulate.run import Run

SAMPLES = 1000
"""Robots drawn for a report."""


def studied(
    pages: Collection[str], data: RobotData, made: Mapping[str, Drawing], run: Run | None
) -> tuple[dict[str, Drawing], dict[str, str]]:
    """Drawing data on uncertainty, and for what could not be made the reason.

    Args:
        pages: what the report consists of.
        data: the robot.
        made: other drawing data; bands go around its motions.
        run: a recorded motion, or None.
    """
    from kr16cli.study import bands

    found: dict[str, Drawing] = {}
    absent: dict[str, str] = {}
    if "trust" in pages:
        try:
            found["trust"] = _trust(data)
        except SkipCase as reason:
            absent["trust"] = str(reason)
    if "torques" in made:
        d = made["torques"]
        around = bands.of_motion(data, d["q"], d["qd"], d["qdd"], payload=d["payload"], drives=True)
        share = None
        if around.half is not None:
            share = float(((np.abs(d["tau"]) + around.half) / d["limit"]).max())
        found["torque_bands"] = {**around._asdict(), "largest_share": share}
    if run is not None and "run" in pages:
        found["run_bands"] = bands.of_run(data, run)._asdict()
    return found, absent


def _trust(data: RobotData) -> Drawing:
    """The record of `kr16 uncertainty` for the zero pose and home.

    Raises:
        SkipCase: the robot has no inertial data, or states no tolerance.
    """
    from kr16cli.study import trust

    need_links(data)
    try:
        return trust.record(data, SAMPLES)
    except InputError:  # it names the file's path, which is not the same everywhere
        raise SkipCase(f"{data.name} states no tolerance of any mass or inertia") from None
