"""Kinematics of the array API, the base of `api.Robot`: rad, m, robroot axes.

Every method takes configurations (..., 6) and returns (..., shape) in float64. `out=` receives
the result where given; `threads=` spreads a batch. One configuration runs on plain floats,
a batch on the engine. A wrong shape or a non-finite input raises and names argument and index.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kr16cli import arrays
from kr16cli.arrays import Array
from kr16cli.errors import InputError, NoAnswerError, ShapeError
from kr16cli.kernels import engine_name
from kr16cli.kernels.columns import ARRAYS, ColumnEngine
from kr16cli.kernels.parameters import Parameters, parameters
from kr16cli.kernels.quantities import ANGLES, QUANTITIES, WIDTH, Quantity
from kr16cli.kernels.quantities import flat as flatten
from kr16cli.model import orientation
from kr16cli.model.scalars import FLOATS, Functions, Scalar
from kr16cli.model.view import Axes, View
from kr16cli.robot import Payload, RobotData
from kr16cli.single import Arm

if TYPE_CHECKING:
    from kr16cli.kernels.native_engine import NativeKernels

Like = npt.ArrayLike


def _defect(_: Parameters, t: Any, __: Functions) -> Iterable[Scalar]:
    return orientation.rotation_defect([t[0:3], t[4:7], t[8:11]])


_DEFECT = Quantity(("T",), (2,), _defect)


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
        self._columns = ColumnEngine()
        self._native: NativeKernels | None = None
        if engine_name() == "native":
            from kr16cli.kernels.native_engine import NativeKernels

            self._native = NativeKernels(self._numbers)
        self.tool = None if tool is None else self._poses("tool", tool)

    # Plumbing -------------------------------------------------------------------------------

    @cached_property
    def _numbers(self) -> Parameters:
        """What the kernels are told about the robot."""
        return parameters(self.arm)

    def _ask(
        self, name: str, inputs: tuple[Like | None, ...], out: Array | None, threads: int
    ) -> Array:
        """A quantity of `kernels.quantities`: compiled where nothing needs care."""
        if self._native is not None:
            result = self._native[name](*inputs, out, threads)
            if result is not None:
                return result  # type: ignore[no-any-return]  # the kernel's array
        return self._ask_with_care(name, inputs, out, threads)

    def _ask_with_care(
        self, name: str, inputs: tuple[Like | None, ...], out: Array | None, threads: int
    ) -> Array:
        """The same after checks and conversions, on floats for one configuration."""
        quantity = QUANTITIES[name]
        values = {
            n: self._checked(n, v)
            for n, v in zip(quantity.inputs, inputs, strict=True)
            if v is not None or n != "near"
        }
        ranks = [2 if n == "T" else 1 for n in values]
        lead = arrays.batch(list(values), list(values.values()), ranks)
        target = arrays.result(out, lead + quantity.shape)
        threads = arrays.checked_threads(threads)
        if not lead and self._native is None:
            target[...] = self._one(name, *(v.tolist() for v in values.values()))
            return target
        flat = {n: arrays.flat(v, lead, k) for (n, v), k in zip(values.items(), ranks, strict=True)}
        self._fill(name, flat, target, len(lead), threads)
        return target

    def _checked(self, name: str, value: Any) -> Array:
        if name == "T":
            return self._poses(name, value)
        return arrays.checked(name, value, WIDTH.get(name, 6))

    def _one(self, name: str, *inputs: Any) -> npt.ArrayLike:
        """A quantity for one configuration of lists of floats; `single.Arm` by name."""
        if name == "ik":
            return self.arm.ik(*inputs).angles
        if hasattr(self.arm, name) and name not in ("frames", "singularity"):
            return getattr(self.arm, name)(*inputs)  # type: ignore[no-any-return]
        quantity = QUANTITIES[name]
        arguments = [
            FLOATS.trig(v) if n in ANGLES else v
            for n, v in zip(quantity.inputs, inputs, strict=True)
        ]
        values = [float(v) for v in quantity.results(self._numbers, *arguments, FLOATS)]
        return np.array(values).reshape(quantity.shape)

    def _fill(
        self, name: str, flat: Mapping[str, Array], target: Array, lead: int, threads: int
    ) -> None:
        """Fill `target`, whose first `lead` axes are the batch, from flat inputs (n, k)."""
        quantity = QUANTITIES[name]
        n = int(np.prod(target.shape[:lead], dtype=int))
        inputs = [flat.get(i) for i in quantity.inputs]
        apart = not any(np.may_share_memory(v, target) for v in flat.values())
        direct = target.flags.carray and apart
        table = target if direct else np.empty(target.shape)
        table = table.reshape(n, -1 if n else int(np.prod(quantity.shape)))
        if self._native is not None and n:
            clean = [None if v is None else np.require(v, requirements=["C", "A"]) for v in inputs]
            if quantity.inputs[0] == "T" and clean[0] is not None:
                clean[0] = clean[0].reshape(n, 4, 4)
            if self._native[name](*clean, table.reshape(n, *quantity.shape), threads) is None:
                raise RuntimeError(f"the kernel {name} refused checked input")
        else:
            self._columns.run(quantity, self._numbers, inputs, table, threads)
        if not direct:
            target[...] = table.reshape(target.shape)

    # Kinematics -----------------------------------------------------------------------------

    def fk(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """T_robroot_flange (or T_robroot_tool), (..., 4, 4): the closed form (3.3)-(3.6)."""
        pose = self._ask("fk", (q,), out, threads)
        if self.tool is not None:
            pose[...] = pose @ self.tool
        return pose

    def frames(self, q: Like, *, threads: int = 1) -> Frames:
        """All frames of Table 3.1 as products of DH transforms, and what derives from them."""
        table = self._ask("frames", (q,), None, threads)
        lead = table.shape[:-1]
        return Frames(
            table[..., :112].reshape(*lead, 7, 4, 4),
            table[..., 112:128].reshape(*lead, 4, 4),
            table[..., 128:131].copy(),
            table[..., 131:].reshape(*lead, 3, 3),
        )

    def mass_centres(self, q: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """The six mass centres (3.29) in robroot, (..., 6, 3); the payload counts to link 6."""
        self.arm.require_inertia()
        return self._ask("mass_centres", (q,), out, threads)

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
        if self.tool is not None:
            T = self._flange_poses(T)
        return self._ask("ik", (T, near), out, threads)

    def judge_branches(self, T: Like, *, out: Array | None = None, threads: int = 1) -> Array:
        """What the eight branches of poses (..., 4, 4) are worth, (..., 6); `model.branches`.

        Solutions in reach, solutions within the joint limits; largest and smallest |det J| of
        those (m3); the best one's distance to its nearest limit (rad, negative outside, -1e9
        out of reach) and from the singularities (0 to 1).
        """
        if self.tool is not None:
            T = self._flange_poses(T)
        lead = np.shape(T)[:-2]
        few = len(lead) == 1 and lead[0] <= len(self._ranges)
        rows = self._ranges[: lead[0]] if few else np.broadcast_to(self._ranges[0], (*lead, 12))
        return self._ask("branches", (T, np.ascontiguousarray(rows)), out, threads)

    @cached_property
    def _ranges(self) -> Array:
        return np.tile(arrays.ranges([(j.lower, j.upper) for j in self.data.joints]), (4096, 1))

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
        if q.shape[-1:] != (6,):
            raise ShapeError("Q", q.shape, "(..., 6)")
        arrays.batch(["T", "Q"], [poses, q], [2, 1])
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

        self._columns.run(_DEFECT, self._numbers, [flat], defects)
        arrays.reject_bad_poses(name, poses, defects)
        return poses

    def _flange_poses(self, T: Like) -> Array:
        poses = self._poses("T", T)
        return poses if self.tool is None else poses @ np.linalg.inv(self.tool)

    def _view(self, link: int, point: Like | None, axes: str) -> View:
        """The checked choice of a Jacobian."""
        p: list[float] | None = None
        if point is not None:
            if np.shape(point) != (3,):
                raise ShapeError("point", np.shape(point), "(3,)")
            p = arrays.checked("point", point, 3).tolist()
        elif self.tool is not None and link == 6:
            p = self.tool[:3, 3].tolist()
        return View.of(self.data.geometry, link, p, axes)

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
        if link == 6 and point is None and axes == "robroot" and self.tool is None:
            return self._ask("jacobian", (q,), out, threads)
        view = self._view(link, point, axes)
        return self._seen("jacobian", view, {"q": q}, out, threads)

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
        if link == 6 and point is None and axes == "robroot" and self.tool is None:
            return self._ask("jacobian_dot", (q, qd), out, threads)
        view = self._view(link, point, axes)
        return self._seen("jacobian_dot", view, {"q": q, "qd": qd}, out, threads)

    def _seen(
        self, name: str, view: View, named: Mapping[str, Like], out: Array | None, threads: int
    ) -> Array:
        """A Jacobian or its rate of any point in any axes, on columns."""
        values = [arrays.checked(n, v, 6) for n, v in named.items()]
        lead = arrays.batch(list(named), values, [1] * len(values))
        target = arrays.result(out, (*lead, 6, 6))
        flat = [arrays.flat(v, lead, 1) for v in values]
        table = np.empty((len(flat[0]), 36))

        def rows(_: Parameters, *arguments: Any) -> Iterable[Scalar]:
            return flatten(getattr(view, name)(*arguments[:-1]))

        quantity = Quantity(tuple(named), (6, 6), rows)
        self._columns.run(quantity, self._numbers, flat, table, threads)
        target[...] = table.reshape(target.shape)
        return target

    def mass_centre_jacobians(
        self, q: Like, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """J of each link's mass centre (3.31)-(3.36), (..., 6, 6, 6): link first, robroot axes."""
        self.arm.require_inertia()
        return self._ask("mass_centre_jacobians", (q,), out, threads)

    def singularity(self, q: Like) -> SingularityFactors:
        """The factors of det J at q, each of the leading shape."""
        table = self._ask("singularity", (q,), None, 1)
        return SingularityFactors(*(table[..., i].copy() for i in range(4)))

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


def pose_rows(poses: Array) -> list[list[Array]]:
    """The first three rows of poses (..., 4, 4) as model scalars."""
    return [[poses[..., i, j] for j in range(4)] for i in range(3)]
