"""What the cases on dynamics share: variants of a robot, and motions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from kr16cli import Robot
from kr16cli.verify import sampling
from kr16cli.verify.independent.lagrange import Lagrangian
from kr16cli.verify.measure import finding, largest
from kr16cli.verify.records import Finding, Setting


class Motion(NamedTuple):
    """Configurations with speeds and accelerations, (n, 6) each."""

    q: sampling.Array
    qd: sampling.Array
    qdd: sampling.Array


def motion(setting: Setting, name: str, full: int, quick: int) -> Motion:
    """Random motions, anywhere in joint space."""
    sampling.need_links(setting.robot.data)
    rng, n = sampling.random(setting, name), setting.samples(full, quick)
    return Motion(sampling.generic(rng, n), sampling.rates(rng, n), sampling.rates(rng, n))


def variants(setting: Setting) -> Iterator[tuple[Robot, Lagrangian]]:
    """The robot, with a payload, on a slope with both: each beside its Lagrangian."""
    data = setting.robot.data
    sampling.need_links(data)
    for load, field in ((None, None), (sampling.LOAD, None), (sampling.LOAD, sampling.TILTED)):
        own = data if field is None else data.with_gravity(field)
        yield Robot(own, payload=load), Lagrangian(own, load)


def over_variants(
    setting: Setting,
    name: str,
    samples: tuple[int, int],
    compare: Callable[[Robot, Lagrangian, Motion], sampling.Array],
    text: str,
    inputs: str = "q qd qdd",
) -> Finding:
    """The worst of a comparison at the same random motions of all variants.

    Args:
        setting: of the run.
        name: seeds the motions.
        samples: how many, full and quick.
        compare: error of each motion, of a robot beside its Lagrangian.
        text: what was compared.
        inputs: which of q, qd, qdd the comparison depends on.
    """
    m = motion(setting, name, *samples)
    errors = [compare(robot, other, m) for robot, other in variants(setting)]
    shown = {k: v for k, v in m._asdict().items() if k in inputs.split()}
    return finding(largest(*errors), f"{text}, three variants", **shown)


def other_arms(setting: Setting, name: str) -> Iterator[tuple[Robot, Lagrangian, Motion]]:
    """Random arms of the same structure, each with its Lagrangian and random motions."""
    rng = sampling.random(setting, name)
    for _ in range(setting.samples(12, 2)):
        data = sampling.random_robot(rng, setting.robot.data)
        n = setting.samples(100, 20)
        moving = Motion(sampling.generic(rng, n), sampling.rates(rng, n), sampling.rates(rng, n))
        yield Robot(data, payload=sampling.LOAD), Lagrangian(data, sampling.LOAD), moving


LAGRANGE = "kinetic energy summed over links (product of exponentials), complex steps"
VARIANTS = "all of joint space; bare, with a payload, and on a slope with a payload"
FROM_ROUNDING = (
    "six levels of recursion round to 1e-14 of the largest entry; a wrong term shows above 1e-6"
)
