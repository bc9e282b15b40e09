"""kr16 fk: joint angles to the pose of flange or tool, with Status, Turn and frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from kr16cli import kuka
from kr16cli.errors import InputError
from kr16cli.model import forward
from kr16cli.model.scalars import FLOATS
from kr16cli.queries.common import Answer, Question, chained, inverse_pose, plain
from kr16cli.robot import RobotData
from kr16cli.single import Arm, Base

if TYPE_CHECKING:
    from kr16cli.queries.many import Many

_POSE = ("x", "y", "z", "a", "b", "c", "s", "t")
FRAMES = ("all", "robroot", "chapter")


class ForwardQuestion(Question):
    """Forward kinematics.

    Args:
        data: the robot.
        si: angles in rad, lengths in m.
        tool: pose of the tool in the flange, six numbers as typed; None: the flange itself.
        base: pose of the base in robroot; None: robroot.
        frames: "all" (or "robroot") adds every frame in robroot, "chapter" in the chapter's
            base frame.
        mass_centres: add the six mass centres.
    """

    name = "fk"

    def __init__(
        self,
        data: RobotData,
        *,
        si: bool = False,
        tool: Sequence[float] | None = None,
        base: Sequence[float] | None = None,
        frames: str | None = None,
        mass_centres: bool = False,
    ) -> None:
        super().__init__(data, si=si)
        if frames is not None and frames not in FRAMES:
            raise InputError(f"--frames is {frames}; it must be one of {', '.join(FRAMES)}")
        self.arm = Arm(data)
        self.tool = self.pose_matrix(tool)
        base_matrix = self.pose_matrix(base)
        self.to_base = None if base_matrix is None else inverse_pose(base_matrix)
        self.frames, self.mass_centres = frames, mass_centres
        self.of = "flange" if tool is None else "tool"
        self.seen_from = "robroot" if base is None else "base"
        length, angle = self.length_unit, self.angle_unit
        self.column_units = {**dict.fromkeys("xyz", length), **dict.fromkeys("abc", angle)}
        self.units = {"q": angle, **self.column_units, "matrix": "m", "krl": "mm, deg"}
        if frames is not None:
            self.units |= {"frames": "m", "wrist_centre": length, "R36": "1"}
        if mass_centres:
            self.units |= {"mass_centres": length}
        given = {"tool": tool, "base": base, "frames": frames}
        self.options = {key: value for key, value in given.items() if value is not None}

    def answer(self, values: Mapping[str, Any]) -> Answer:
        """Pose of flange or tool for `values["q"]`, six typed joint angles."""
        q, cs = self.radians(values["q"]), self.trig(values["q"])
        T = chained(self.to_base, self.arm.fk(q, cs), self.tool)
        s, t = kuka.status(q, self.data.geometry), kuka.turn(q)
        numbers = kuka.pose_from_matrix(T, si=self.si)
        result: dict[str, Any] = {
            "of": self.of,
            "in": self.seen_from,
            "pose": dict(zip(_POSE, [*numbers, s, t], strict=True)),
            "matrix": T,
            "krl": kuka.format_e6pos(plain(kuka.pose_from_matrix(T)), s, t),
        }
        if self.frames is not None:
            result |= self._frames(q, cs or FLOATS.trig(q))
        if self.mass_centres:
            axes: Base = "chapter" if self.frames == "chapter" else "robroot"
            points = self.arm.mass_centres(q, axes)
            result["mass_centres"] = [self.lengths(p) for p in points]
        return Answer(result, self.warnings(q))

    def warnings(self, q: Sequence[float]) -> list[str]:
        """Joints outside their limits, and where Turn may be ignored."""
        warnings = self.limit_warnings(q)
        switch = [f"A{i + 1}" for i in kuka.near_turn_switch(q)]
        if switch:
            warnings.append(
                f"{', '.join(switch)} within 2 deg of 0: a controller may ignore this Turn bit "
                "(unconfirmed)"
            )
        return warnings

    def takes_many(self, kind: str) -> bool:
        """Frames are asked row by row."""
        return super().takes_many(kind) and (self.frames is None or kind == "csv")

    def many(self, values: Mapping[str, Any]) -> Many:
        """Poses for `values["q"]` (n, 6)."""
        from kr16cli.queries.many import forward_kinematics

        return forward_kinematics(self, values)

    def _frames(self, q: list[float], cs: Sequence[tuple[float, float]]) -> dict[str, Any]:
        axes: Base = "chapter" if self.frames == "chapter" else "robroot"
        frames = {name: plain(T) for name, T in self.arm.frames(q, axes, cs).items()}
        wrist = [row[3] for row in frames["frame5"][:3]]
        return {
            "frames_in": axes,
            "frames": frames,
            "wrist_centre": self.lengths(wrist),
            "R36": plain(forward.r36(cs)),
        }

    def columns(self, result: Mapping[str, Any] | None) -> dict[str, Any]:
        """x, y, z, a, b, c, s, t, and the mass centres where asked for."""
        if result is None:
            return dict.fromkeys(_POSE)
        extra = {
            f"{axis}_com{i}": value
            for i, point in enumerate(result.get("mass_centres", ()), 1)
            for axis, value in zip("xyz", point, strict=True)
        }
        return {**result["pose"], **extra}

    @property
    def beyond_columns(self) -> dict[str, str]:
        """The frames, 16 numbers each, with wrist centre and R36."""
        return {} if self.frames is None else {f"--frames {self.frames}": "it is in json and npz"}

    def arrays(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """T (m), pose, s, t; frames and mass centres where asked for."""
        pose = result["pose"]
        arrays: dict[str, Any] = {
            "T": result["matrix"],
            "pose": [pose[name] for name in _POSE[:6]],
            "s": float(pose["s"]),
            "t": float(pose["t"]),
        }
        arrays |= {f"T_{name}": T for name, T in result.get("frames", {}).items()}
        for name in ("wrist_centre", "R36", "mass_centres"):
            if name in result:
                arrays[name] = result[name]
        return arrays
