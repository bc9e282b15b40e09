"""Kinematics of the array API, the base of `api.Robot`: rad, m, robroot axes.

Every method takes configurations (..., 6) and returns (..., shape) in float64. `out=` receives
the result where given; `threads=` spreads a batch. One configuration runs on plain floats,
a batch on the engine. A wrong shape or a non-finite input raises and names argument and index.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli import arrays
from kr16cli.arrays import Array
from kr16cli.errors import InputError, NoAnswerError
from kr16cli.kernels import engine
from kr16cli.kernels.columns import ARRAYS, Trig
from kr16cli.model import chain, energy, forward, inverse, jacobian, orientation
from kr16cli.model.scalars import FLOATS, Scalar
from kr16cli.model.view import Axes, View
from kr16cli.robot import Payload, RobotData
from kr16cli.single import Arm

Like = npt.ArrayLike


class Frames(NamedTuple):
    """Every frame of a configuration, in robroot, m.

    `dh` (..., 7, 4, 4) are frames 0..6 of Table 3.1, `flange` (..., 4, 4), `wrist_centre`
    (..., 3) of (3.8), `R36` (..., 3, 3) of (3.22).
    """

    dh: Array
    flange: Array
    wrist_centre: Array
    R36: Array


class SingularityFactors(NamedTuple):
    """The three factors of det J = a2 wrist elbow shoulder (3.37), zero on each family.

    `shoulder` m, `elbow` m, `wrist` 1; `determinant` m3.
    """

    shoulder: Array
    elbow: Array
    wrist: Array
    determinant: Array


class Kinematics:
    """Poses, inverse kinematics and Jacobians of a robot, on arrays.

    Args:
        data: checked numbers (`load_robot`, `Robot.from_parameters`).
        payload: load on the flange, joins link 6.
        drives: count rotor inertia and friction of the data file.
        tool: T_flange_tool (4, 4); fk, ik and jacobian then speak of the tool.
    """

    def __init__(
        self,
        data: RobotData,
        *,
        payload: Payload | None = None,
        drives: bool = False,
        tool: Like | None = None,
    ) -> None:
        self.data, self.payload, self.drives = data, payload, drives
        self.arm = Arm(data, payload=payload, drives=drives)
        self._engine = engine()
        self.tool = None if tool is None else self._poses("tool", tool)

    # Plumbing -------------------------------------------------------------------------------

    def _evaluate(
        self,
        named: Mapping[str, Like],
        shape: tuple[int, ...],
        one: Callable[..., npt.ArrayLike],
        kernel: Callable[..., Iterable[Scalar]],
        out: Array | None = None,
        threads: int = 1,
    ) -> Array:
        """Run on floats for one configuration, on the engine for a batch.

        The first argument enters the kernel as (cos, sin) pairs, the others as columns.
        """
        values = [arrays.checked(name, value, 6) for name, value in named.items()]
        lead = arrays.batch(list(named), values, [1] * len(values))
        target = arrays.result(out, lead + shape)
        if not lead:
            target[...] = one(*(v.tolist() for v in values))
            return target
        flat = [arrays.flat(v, lead, 1) for v in values]
        self._run(kernel, [Trig(flat[0]), *flat[1:]], target, len(lead), threads)
        return target

    def _run(
        self,
        kernel: Callable[..., Iterable[Scalar]],
        inputs: Sequence[Array | Trig],
        target: Array,
        lead: int,
        threads: int,
    ) -> None:
        """Fill `target`, whose first `lead` axes are the batch, through a flat table."""
        n = int(np.prod(target.shape[:lead], dtype=int))
        width = int(np.prod(target.shape[lead:], dtype=int))
        if target.flags.c_contiguous:
            self._engine.run(kernel, inputs, target.reshape(n, width), threads)
            return
        table = np.empty((n, width))
        self._engine.run(kernel, inputs, table, threads)
        target[...] = table.reshape(target.shape)

    # Kinematics -----------------------------------------------------------------------------

    def fk(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """T_robroot_flange (or T_robroot_tool), (..., 4, 4): the closed form (3.3)-(3.6)."""
        g = self.data.geometry
        pose = self._evaluate(
            {"q": q},
            (4, 4),
            self.arm.fk,
            lambda cs: flat_rows(forward.flange(cs, g).rows()),
            out,
            threads,
        )
        if self.tool is not None:
            pose[...] = pose @ self.tool
        return pose

    def frames(self, q: Like, *, threads: int = 1) -> Frames:
        """All frames of Table 3.1 as products of DH transforms, and what derives from them."""
        g = self.data.geometry

        def kernel(cs: Any) -> Iterable[Scalar]:
            links = chain.frames(cs, g)
            yield from (v for frame in links for v in flat_rows(frame.rows()))
            yield from flat_rows(chain.flange_of_frame6(links[6]).rows())
            yield from links[4].p
            yield from flat_rows(forward.r36(cs))

        def one(angles: Sequence[float]) -> list[float]:
            return [float(v) for v in kernel(FLOATS.trig(angles))]

        table = self._evaluate({"q": q}, (140,), one, kernel, None, threads)
        lead = table.shape[:-1]
        return Frames(
            table[..., :112].reshape(*lead, 7, 4, 4),
            table[..., 112:128].reshape(*lead, 4, 4),
            table[..., 128:131],
            table[..., 131:].reshape(*lead, 3, 3),
        )

    def mass_centres(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """The six mass centres (3.29) in robroot, (..., 6, 3); the payload counts to link 6."""
        g, bodies = self.data.geometry, self.arm.bodies
        return self._evaluate(
            {"q": q},
            (6, 3),
            self.arm.mass_centres,
            lambda cs: flat_rows(energy.mass_centres(chain.frames(cs, g), bodies, g)),
            out,
            threads,
        )

    def ik(
        self,
        T: Like,
        near: Like | None = None,
        *,
        out: Array | None = None,
        threads: int = 1,
    ) -> Array:
        """All inverse kinematic solutions of poses (..., 4, 4): (..., 8, 6), rad.

        Row 4*shoulder + 2*elbow + wrist (shoulder 0: q1 = atan2(x_c, y_c) of the chapter's
        frame; elbow 0: a3 c3 + d4 s3 <= 0; wrist 0: q5 >= 0). Angles in (-pi, pi]; joint limits
        are ignored; rows out of reach are NaN. `near` (..., 6), default zero, supplies the free
        angle of a singular pose; the rows of a merged pair are equal.

        Raises:
            InputError: a matrix that is no rigid pose. Never for an unreachable one.
        """
        poses = self._flange_poses(T)
        start = arrays.checked("near", np.zeros(6) if near is None else near, 6)
        lead = arrays.batch(["T", "near"], [poses, start], [2, 1])
        target = arrays.result(out, (*lead, 8, 6))
        if not lead:
            target[...] = self.arm.ik(poses.tolist(), start.tolist()).angles
            return target
        g = self.data.geometry

        zero = (0.0,) * 6

        def kernel(t: Sequence[Scalar], last: Sequence[Scalar] = zero) -> Iterable[Scalar]:
            rotation = [t[0:3], t[4:7], t[8:11]]
            return flat_rows(inverse.solve(rotation, (t[3], t[7], t[11]), g, last, ARRAYS).angles)

        inputs = [arrays.flat(poses, lead, 2)]
        if near is not None:
            inputs.append(arrays.flat(start, lead, 1))
        self._run(kernel, inputs, target, len(lead), threads)
        return target

    def ik_path(self, T: Like, near: Like | None = None) -> Array:
        """One configuration per pose of a path (n, 4, 4): (n, 6), each nearest to the one before.

        The largest joint move decides; whole turns are added to stay near, so that angles may
        leave (-pi, pi]. Free angles of singular poses keep their last value (section 3.2.3).

        Raises:
            NoAnswerError: a pose out of reach, with its index.
        """
        poses = self._flange_poses(T)
        if poses.ndim != 3:
            raise InputError(f"T has shape {poses.shape}; a path is (n, 4, 4)")
        last = arrays.checked("near", np.zeros(6) if near is None else near, 6)
        path = np.empty((len(poses), 6))
        for i, pose in enumerate(poses.tolist()):
            rows: Array = np.array(self.arm.ik(pose, last.tolist()).angles)
            rows = rows[np.isfinite(rows).all(axis=1)]
            if not len(rows):
                raise NoAnswerError(f"T[{i}] is out of reach; the path has no solution there")
            rows = last + np.remainder(rows - last + np.pi, 2 * np.pi) - np.pi
            last = path[i] = rows[np.abs(rows - last).max(axis=1).argmin()]
        return path

    def closure(self, T: Like, Q: Like) -> tuple[Array, Array]:
        """How far fk(Q) is from T: position error (m), rotation angle (rad); NaN for NaN rows."""
        q = np.asarray(Q, dtype=np.float64)
        poses = self._poses("T", T)
        known = np.asarray(np.isfinite(q).all(axis=-1, keepdims=True))
        made = self.fk(np.where(known, q, 0.0))
        gaps = orientation.pose_distance(pose_rows(made), pose_rows(poses), ARRAYS)
        position, angle = (np.where(known[..., 0], gap, np.nan) for gap in gaps)
        return position, angle

    def _poses(self, name: str, T: Like) -> Array:
        """Rigid poses (..., 4, 4), checked."""
        poses = arrays.checked(name, T, 4, 4)
        flat = poses.reshape(-1, 16)
        defects = np.empty((len(flat), 2))

        def kernel(t: Sequence[Scalar]) -> Iterable[Scalar]:
            return orientation.rotation_defect([t[0:3], t[4:7], t[8:11]])

        self._engine.run(kernel, [flat], defects)
        arrays.reject_bad_poses(name, poses, defects)
        return poses

    def _flange_poses(self, T: Like) -> Array:
        poses = self._poses("T", T)
        return poses if self.tool is None else poses @ np.linalg.inv(self.tool)

    def _jacobian_options(self, link: int, point: Like | None) -> tuple[int, list[float] | None]:
        if point is not None:
            values = arrays.checked("point", point, 3)
            if values.ndim != 1:
                raise InputError(f"point has shape {values.shape}; expected (3,)")
            return link, values.tolist()
        return link, self.tool[:3, 3].tolist() if self.tool is not None and link == 6 else None

    def jacobian(
        self,
        q: Like,
        *,
        link: int = 6,
        point: Like | None = None,
        axes: Axes = "robroot",
        out: Array | None = None,
        threads: int = 1,
    ) -> Array:
        """Geometric Jacobian (..., 6, 6), linear rows first (m, rad).

        Of the point (3,) fixed to `link` (1..6) and given in its frame (frame i of Table 3.1;
        the flange for link 6). None is the flange or tool, else that frame's origin. `axes` of
        the rows: robroot, flange or chapter (the chapter's base b).
        """
        link, p = self._jacobian_options(link, point)
        view = View.of(self.data.geometry, link, p, axes)
        return self._evaluate(
            {"q": q},
            (6, 6),
            lambda angles: self.arm.jacobian(angles, link=link, point=p, axes=axes),
            lambda cs: flat_rows(view.jacobian(cs)),
            out,
            threads,
        )

    def jacobian_dot(
        self,
        q: Like,
        qd: Like,
        *,
        link: int = 6,
        point: Like | None = None,
        axes: Axes = "robroot",
        out: Array | None = None,
        threads: int = 1,
    ) -> Array:
        """Rate of `jacobian` along qd, (3.47)-(3.51), (..., 6, 6); `axes` stand still."""
        link, p = self._jacobian_options(link, point)
        view = View.of(self.data.geometry, link, p, axes)
        return self._evaluate(
            {"q": q, "qd": qd},
            (6, 6),
            lambda a, r: self.arm.jacobian_dot(a, r, link=link, point=p, axes=axes),
            lambda cs, rates: flat_rows(view.jacobian_dot(cs, rates)),
            out,
            threads,
        )

    def mass_centre_jacobians(
        self, q: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """J of each link's mass centre (3.31)-(3.36), (..., 6, 6, 6): link first, robroot axes."""
        g, bodies = self.data.geometry, self.arm.bodies

        def kernel(cs: Any) -> Iterable[Scalar]:
            a = forward.arm(cs, g)
            centres = energy.mass_centres(chain.frames(cs, g), bodies, g)
            for link, centre in enumerate(centres, 1):
                yield from flat_rows(jacobian.jacobian(a, centre, link))

        def one(angles: Sequence[float]) -> Array:
            values = [float(v) for v in kernel(FLOATS.trig(angles))]
            return np.array(values).reshape(6, 6, 6)

        return self._evaluate({"q": q}, (6, 6, 6), one, kernel, out, threads)

    def singularity(self, q: Like) -> SingularityFactors:
        """The factors of det J at q, each of the leading shape."""
        g = self.data.geometry

        def kernel(cs: Any) -> Iterable[Scalar]:
            yield jacobian.shoulder_factor(cs, g)
            yield jacobian.elbow_factor(cs, g)
            yield jacobian.wrist_factor(cs)
            yield jacobian.determinant(cs, g)

        table = self._evaluate({"q": q}, (4,), lambda a: list(kernel(FLOATS.trig(a))), kernel)
        return SingularityFactors(*(table[..., i] for i in range(4)))

    def rpy(self, T: Like) -> Array:
        """(phi, theta, psi) of (3.45), KUKA's A, B, C in rad, (..., 3) of poses (..., 4, 4).

        phi = 0 where theta = +-90 deg, so that the orientation is reproduced there too.
        """
        poses = self._poses("T", T)
        angles = orientation.rpy_from_rotation(pose_rows(poses), ARRAYS)
        return np.stack([np.asarray(a) for a in angles], axis=-1)

    def rate_matrix(self, rpy: Like) -> Array:
        """B of (3.46), (..., 3, 3): omega = B (phi', theta', psi'), from rpy (..., 3) in rad."""
        return self._of_rpy(orientation.rate_matrix, rpy)

    def inverse_rate_matrix(self, rpy: Like) -> Array:
        """B^-1, (..., 3, 3); grows without bound towards theta = +-90 deg."""
        return self._of_rpy(orientation.inverse_rate_matrix, rpy)

    @staticmethod
    def _of_rpy(matrix: Callable[[Any], list[list[Scalar]]], rpy: Like) -> Array:
        angles = arrays.checked("rpy", rpy, 3)
        rows = matrix(ARRAYS.trig([angles[..., i] for i in range(3)]))
        out = np.zeros((*angles.shape[:-1], 3, 3))
        for i, row in enumerate(rows):
            for j, value in enumerate(row):
                out[..., i, j] = value
        return out


def flat_rows(rows: Iterable[Iterable[Scalar]]) -> Iterable[Scalar]:
    """The elements of row lists, row by row."""
    return (value for row in rows for value in row)


def pose_rows(poses: Array) -> list[list[Array]]:
    """The first three rows of poses (..., 4, 4) as model scalars."""
    return [[poses[..., i, j] for j in range(4)] for i in range(3)]
