"""How far torques and motions can be trusted, given how far the robot's numbers can be.

Two ways that must agree where the spread is small: Monte-Carlo, robots drawn from the tolerances
and the whole model run for each, and first order, sigma^2 = sum (dy/dp sigma_p)^2 with exact
derivatives (GUM, JCGM 100:2008, 5.1.2). Shares of that sum are first-order indices; Sobol's, by
SciPy, also see what parameters do together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from kr16cli.arrays import Array
from kr16cli.errors import InputError
from kr16cli.robot import Payload, RobotData
from kr16cli.simulate.scenario import Scenario
from kr16cli.study import rollouts
from kr16cli.study.family import Family, slopes
from kr16cli.study.spread import Distribution, Uncertain, drawn, standard, uncertain
from kr16cli.study.streams import uniforms
from kr16cli.study.work import Chunk, Column

_STREAM = 1  # which of a seed's tables of random numbers
_CHUNK = 256
_TIMES = 101
"""Most times of a motion at which torques are compared."""


@dataclass(frozen=True)
class Motion:
    """The motion of a robot in a scenario, seen at some times: (n,) s and (n, 6) rad."""

    time: Array
    q: Array
    qd: Array
    qdd: Array


@dataclass(frozen=True)
class UncertaintyWork:
    """Monte-Carlo samples: one robot drawn from the tolerances is a row.

    Attributes:
        data: the robot as its file says.
        poses: (p, 6) where gravity torque and, at the first, M are asked, rad.
        samples: how many robots.
        seed: of the random numbers.
        distribution: normal, with 95 % inside the tolerance, or uniform over it.
        scenario: with a motion; its payload and drives hold for all.
        motion: the nominal motion, whose torque is asked of every robot.
    """

    data: RobotData
    poses: Array
    samples: int
    seed: int = 1
    distribution: Distribution = "normal"
    scenario: Scenario | None = None
    motion: Motion | None = None
    payload: Payload | None = None
    drives: bool = False
    prefers: Literal["threads", "processes"] = field(default="threads", init=False)

    def __post_init__(self) -> None:
        if self.samples < 2:
            raise InputError(f"--samples is {self.samples}; it must be 2 or more")
        _ = self.sources

    @cached_property
    def sources(self) -> list[Uncertain]:
        """What is uncertain."""
        return uncertain(self.data, drives=self.drives)

    @property
    def rows(self) -> int:
        """See `work.Work`."""
        return self.samples

    @property
    def chunk_rows(self) -> int:
        """See `work.Work`."""
        return _CHUNK

    @cached_property
    def steps(self) -> rollouts.Steps | None:
        """Steps of the motions that are simulated; None where a controller would interfere."""
        if self.scenario is None or not rollouts.is_open(self.scenario):
            return None
        return rollouts.steps_of(self.scenario)

    def columns(self) -> dict[str, Column]:
        """See `work.Work`."""
        made = {
            "deviation": Column("f8", (len(self.sources),)),
            "gravity": Column("f8", (len(self.poses), 6), "N m"),
            "mass_matrix": Column("f8", (6, 6), "kg m2"),
        }
        if self.motion is not None:
            made["torque"] = Column("f8", (len(self.motion.time), 6), "N m")
        if self.steps is not None:
            made["motion"] = Column("f8", (len(self.steps.time), 6), "rad")
        return made

    def describe(self) -> dict[str, Any]:
        """See `work.Work`."""
        return {
            "study": "uncertainty",
            "robot": self.data.name,
            "model_sha256": self.data.sha256,
            "sources": [[s.name, s.half, s.unit] for s in self.sources],
            "poses": self.poses.tolist(),
            "samples": self.samples,
            "seed": self.seed,
            "distribution": self.distribution,
            "scenario": None if self.scenario is None else self.scenario.describe(),
            "payload": None if self.payload is None else vars(self.payload),
            "drives": self.drives,
        }

    def family(self, deviations: Array) -> Family:
        """Robots with these deviations (n, d)."""
        return Family(self.placed, self.sources, deviations, payload=self.payload,
                      drives=self.drives)  # fmt: skip

    @property
    def placed(self) -> RobotData:
        """The robot under the scenario's gravity."""
        gravity = None if self.scenario is None else self.scenario.gravity
        return self.data if gravity is None else self.data.with_gravity(gravity)

    def compute(self, start: int, stop: int) -> Chunk:
        """See `work.Work`."""
        numbers = uniforms(self.seed, _STREAM, start, stop, len(self.sources))
        deviations = drawn(self.sources, numbers, self.distribution)
        return {"deviation": deviations, **self.answers(self.family(deviations))}

    def answers(self, family: Family) -> Chunk:
        """The columns that a family gives."""
        made: Chunk = {
            "gravity": family.ask("gravity", self.poses),
            "mass_matrix": family.ask("mass_matrix", self.poses[:1])[:, 0],
        }
        if self.motion is not None:
            m = self.motion
            made["torque"] = family.ask("inverse_dynamics", m.q, m.qd, m.qdd)
        if self.steps is not None and self.scenario is not None:
            made["motion"] = rollouts.motions(family, self.scenario, self.steps)
        return made

    def slopes(self) -> dict[str, Array]:
        """Derivatives of the columns with respect to each source, (d, *shape), by name."""

        def ask(name: str, *inputs: Array) -> Array:
            return slopes(self.placed, self.sources, name, *inputs, payload=self.payload,
                          drives=self.drives)  # fmt: skip

        made = {
            "gravity": ask("gravity", self.poses),
            "mass_matrix": ask("mass_matrix", self.poses[:1])[:, 0],
        }
        if self.motion is not None:
            m = self.motion
            made["torque"] = ask("inverse_dynamics", m.q, m.qd, m.qdd)
        if self.steps is not None and self.scenario is not None:
            found = rollouts.sensitivities(self.data, self.sources, self.scenario, self.steps)
            made["motion"] = np.moveaxis(found, 1, 0)
        return made


def work_for(
    data: RobotData,
    poses: Array,
    samples: int,
    *,
    seed: int = 1,
    distribution: Distribution = "normal",
    scenario: Scenario | None = None,
    payload: Payload | None = None,
    drives: bool = False,
) -> UncertaintyWork:
    """The study of a robot, at poses (p, 6) in rad and along the motion of a scenario.

    The scenario's payload and drives take the place of those given.
    """
    motion = None
    if scenario is not None:
        motion = nominal_motion(data, scenario)
        payload, drives = scenario.payload, scenario.drives
    return UncertaintyWork(
        data, poses, samples, seed, distribution, scenario, motion, payload, drives
    )


def nominal_motion(data: RobotData, scenario: Scenario) -> Motion:
    """What the robot of the file does in a scenario, at no more than a hundred times or so."""
    from kr16cli.simulate.experiment import simulate

    run = simulate(data, scenario)
    pick = np.unique(np.linspace(0, len(run.time) - 1, _TIMES).round().astype(int))
    return Motion(*(np.ascontiguousarray(v[pick]) for v in (run.time, run.q, run.qd, run.qdd)))


def torque_bands(
    data: RobotData,
    q: Array,
    qd: Array,
    qdd: Array,
    *,
    payload: Payload | None = None,
    drives: bool = False,
) -> Array:
    """Half widths of the 95 % bands of the torque of a motion, (n, 6) N m: two sigma, first order.

    Args:
        data: the robot; without a tolerance the bands have no width.
        q: (n, 6) angles, rad.
        qd: (n, 6) speeds, rad/s.
        qdd: (n, 6) accelerations, rad/s2.
        payload: on the flange.
        drives: count rotor inertia and friction.
    """
    try:
        sources = uncertain(data, drives=drives)
    except InputError:
        return np.zeros_like(q)
    found = slopes(data, sources, "inverse_dynamics", q, qd, qdd, payload=payload, drives=drives)
    sigma = standard(sources, "normal").reshape(-1, 1, 1)
    band: Array = 2.0 * np.sqrt(((found * sigma) ** 2).sum(axis=0))
    return band


def shares(slopes_: Array, sigma: Array, axes: tuple[int, ...]) -> Array:
    """First-order indices: each source's share of the variance, summed over `axes` of a column.

    Args:
        slopes_: (d, *shape).
        sigma: (d,).
        axes: of the column, counted from 0.

    Returns:
        (d, rest); 0 where nothing varies.
    """
    part = (slopes_ * sigma.reshape(-1, *[1] * (slopes_.ndim - 1))) ** 2
    part = part.sum(axis=tuple(axis + 1 for axis in axes))
    whole = part.sum(axis=0)
    made: Array = np.divide(part, whole, out=np.zeros_like(part), where=whole > 0.0)
    return made


def sobol(work: UncertaintyWork, points: int = 1024) -> Mapping[str, Array]:
    """Sobol indices of the gravity torques at the first pose: `first` and `total`, (6, d).

    Rows of joints whose torque does not vary are 0.

    Args:
        work: the study.
        points: a power of two; the model is run (d + 2) times as often.
    """
    from scipy.stats import norm, sobol_indices
    from scipy.stats import uniform as flat

    sigma = standard(work.sources, work.distribution)
    wide = [s.half for s in work.sources]
    dists = (
        [norm(0.0, s) for s in sigma]
        if work.distribution == "normal"
        else [flat(-h, 2.0 * h) for h in wide]
    )
    nominal = work.family(np.zeros((1, len(sigma)))).ask("gravity", work.poses[:1])[0, 0]
    spread = np.abs(slopes(work.placed, work.sources, "gravity", work.poses[:1],
                           payload=work.payload, drives=work.drives)[:, 0])  # fmt: skip
    varies = (spread * sigma[:, None]).sum(axis=0) > 1e-9 * (1.0 + np.abs(nominal))
    made = {name: np.zeros((6, len(sigma))) for name in ("first", "total")}
    if not varies.any():
        return made

    def torque(deviations: Array) -> Array:
        return work.family(deviations.T).ask("gravity", work.poses[:1])[:, 0, varies].T

    found = sobol_indices(func=torque, n=points, dists=dists, rng=work.seed)
    made["first"][varies] = np.atleast_2d(found.first_order)
    made["total"][varies] = np.atleast_2d(found.total_order)
    return made
