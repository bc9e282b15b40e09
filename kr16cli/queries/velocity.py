"""kr16 jacobian: the Jacobian of a named point in named axes, its rate, and singularities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, cast

from kr16cli import linear, units
from kr16cli.errors import InputError
from kr16cli.model import orientation
from kr16cli.model.scalars import FLOATS
from kr16cli.queries.common import Answer, Question, flat, plain
from kr16cli.robot import RobotData
from kr16cli.single import Arm
from kr16cli.tolerances import TOLERANCES

if TYPE_CHECKING:
    from kr16cli.queries.many import Many

ROWS = ("vx", "vy", "vz", "wx", "wy", "wz")
AXES = ("robroot", "flange", "chapter")
POINTS = ("flange", "wrist", "tool", "com")
_MEANING = {
    "shoulder": "distance of the wrist centre from the A1 axis",
    "elbow": "a3 c3 + d4 s3, zero with the arm stretched or folded",
    "wrist": "sin A5, zero with A4 and A6 in line",
}


class JacobianQuestion(Question):
    """Velocity kinematics.

    Args:
        data: the robot.
        si: typed angles in rad, lengths in m; results are SI always.
        link: link (1 to 6) the point is fixed to.
        point: a name of POINTS or three typed numbers in the link's frame; None: the tool where
            there is one, else the origin of the link's frame (the flange for link 6).
        tool: pose of the tool in the flange, six numbers as typed.
        axes: axes of the rows, a name of AXES.
        qd: joint speeds as typed; adds the Jacobian's rate.
    """

    name = "jacobian"
    optional = ("qd",)

    def __init__(
        self,
        data: RobotData,
        *,
        si: bool = False,
        link: int = 6,
        point: str | Sequence[float] | None = None,
        tool: Sequence[float] | None = None,
        axes: str = "robroot",
        qd: Sequence[float] | None = None,
    ) -> None:
        super().__init__(data, si=si)
        if link not in range(1, 7):
            raise InputError(f"--link is {link}; it must be 1 to 6")
        if axes not in AXES:
            raise InputError(f"--axes is {axes}; it must be one of {', '.join(AXES)}")
        if isinstance(point, str) and point not in POINTS:
            raise InputError(
                f"--point is {point}; it must be one of {', '.join(POINTS)} or three numbers"
            )
        self.arm = Arm(data)
        self.link, self.qd = link, qd
        self.axes = cast("Literal['robroot', 'flange', 'chapter']", axes)
        self.tool = self.pose_matrix(tool)
        if point is None:
            point = "tool" if tool is not None and link == 6 else None
        self.point = point
        self.point_name = self._named()
        self.column_units: dict[str, str] = {}
        self.units = {
            "q": self.angle_unit,
            "jacobian": "rows 1-3 m/rad, rows 4-6 rad/rad",
            "determinant": "m3",
            "singular_values": "mixed, lengths in m",
            "condition": "mixed, lengths in m",
            "manipulability": "m3",
            "singularities": "factor m (shoulder, elbow) or 1 (wrist), sine 1",
            "rpy": "rad",
            "rate_matrix": "1",
        }
        if qd is not None:
            self.units["jacobian_dot"] = "rows 1-3 m/(rad s), rows 4-6 rad/(rad s)"
        given = {"link": link, "point": point, "axes": axes, "tool": tool, "qd": qd}
        self.options = {key: value for key, value in given.items() if value is not None}

    def _named(self) -> str:
        """The point in words; InputError where link and point do not go together."""
        if self.point in ("flange", "wrist", "tool") and self.link != 6:
            raise InputError(f"--point {self.point} is on link 6, not on --link {self.link}")
        if self.point == "tool" and self.tool is None:
            raise InputError("--point tool needs --tool X Y Z A B C")
        if self.point is None:
            return "flange" if self.link == 6 else f"origin of frame {self.link} of Table 3.1"
        if self.point == "com":
            return f"mass centre of link {self.link}"
        if isinstance(self.point, str):
            return {"wrist": "wrist centre", "tool": "tool"}.get(self.point, self.point)
        frame = "the flange" if self.link == 6 else f"frame {self.link} of Table 3.1"
        shown = ", ".join(f"{v:g}" for v in self.point)
        return f"({shown}) {self.length_unit} in {frame}"

    def local(self, q: Sequence[float]) -> list[float] | None:
        """The point in the link's frame, m; None is its origin."""
        if self.point is None or self.point == "flange":
            return None
        if self.point == "wrist":
            return [0.0, 0.0, -self.data.geometry.d6]
        if self.point == "tool" and self.tool is not None:
            return [row[3] for row in self.tool[:3]]
        if self.point == "com":
            frames = self.arm.frames(q)
            T = frames["flange" if self.link == 6 else f"frame{self.link}"]
            p = self.arm.mass_centres(q)[self.link - 1]
            return [sum(T[k][i] * (p[k] - T[k][3]) for k in range(3)) for i in range(3)]
        numbers = cast("Sequence[float]", self.point)
        return list(numbers) if self.si else [units.metres(v) for v in numbers]

    def answer(self, values: Mapping[str, Any]) -> Answer:
        """The Jacobian for `values["q"]`, and its rate for `values["qd"]` or the option's qd."""
        q = self.radians(values["q"])
        point = self.local(q)
        J = plain(self.arm.jacobian(q, link=self.link, point=point, axes=self.axes))
        sigma = linear.singular_values(J)
        determinant = self.arm.determinant(q) if self.link == 6 else 0.0
        result: dict[str, Any] = {
            "point": self.point_name,
            "link": self.link,
            "axes": self.axes,
            "rows": list(ROWS),
            "jacobian": J,
            "determinant": plain(determinant),
            "singular_values": sigma,
            **_condition(sigma),
            "manipulability": math.prod(sigma),
            "singularities": [
                {
                    "kind": one.family,
                    "factor": one.factor + 0.0,
                    "sine": one.sine + 0.0,
                    "near": one.near,
                    "meaning": _MEANING[one.family],
                }
                for one in self.arm.singularities(q)
            ],
            **self._rates(q),
        }
        qd = values.get("qd", self.qd)
        if qd is not None:
            rate = self.arm.jacobian_dot(
                q, self.radians(qd), link=self.link, point=point, axes=self.axes
            )
            result["jacobian_dot"] = plain(rate)
        return Answer(result, self.warnings(q))

    def warnings(self, q: Sequence[float]) -> list[str]:
        """Joints outside their limits, and singularities nearby."""
        return self.limit_warnings(q) + [
            f"near the {one.family} singularity: {_MEANING[one.family]} is {one.factor + 0.0:.3g}"
            for one in self.arm.singularities(q)
            if one.near
        ]

    def many(self, values: Mapping[str, Any]) -> Many:
        """Jacobians for `values["q"]`, and rates for `values["qd"]`, (n, 6) each."""
        from kr16cli.queries.many_rates import velocity

        return velocity(self, values)

    def _rates(self, q: Sequence[float]) -> dict[str, Any]:
        """Roll, pitch and yaw of the flange, B of (3.46) and its inverse, or why it has none."""
        rotation = [row[:3] for row in self.arm.fk(q)[:3]]
        rpy = plain(orientation.rpy_from_rotation(rotation, FLOATS))
        cs = FLOATS.trig(rpy)
        result: dict[str, Any] = {"rpy": rpy, "rate_matrix": plain(orientation.rate_matrix(cs))}
        if abs(cs[1][0]) < TOLERANCES.pole:
            reason = "B = +-90 deg: the rate matrix is singular"
            return {**result, "rate_matrix_inverse": None, "rate_matrix_inverse_reason": reason}
        return {**result, "rate_matrix_inverse": plain(orientation.inverse_rate_matrix(cs))}

    def columns(self, result: Mapping[str, Any] | None) -> dict[str, Any]:
        """j_11..j_66, determinant to manipulability, sigma_1..sigma_6, jd_11..jd_66 with qd."""
        empty = [[None] * 6 for _ in range(6)]
        r = result or {}
        row = {
            **flat("j", r.get("jacobian", empty)),
            **{key: r.get(key) for key in ("determinant", "condition", "manipulability")},
            **flat("sigma", r.get("singular_values", [None] * 6)),
        }
        if "jacobian_dot" in r or self.qd is not None:
            row |= flat("jd", r.get("jacobian_dot", empty))
        return row

    @property
    def csv_units(self) -> str:
        """SI, whatever was typed."""
        return "m rad"

    def arrays(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """jacobian, determinant, singular_values, manipulability, jacobian_dot."""
        names = ("jacobian", "determinant", "singular_values", "manipulability", "jacobian_dot")
        return {name: result[name] for name in names if name in result}


def _condition(sigma: Sequence[float]) -> dict[str, Any]:
    """Ratio of largest to smallest singular value, or the reason why there is none."""
    if sigma[-1] <= 6 * math.ulp(sigma[0]):
        reason = "the smallest singular value is zero to rounding"
        return {"condition": None, "condition_reason": reason}
    return {"condition": sigma[0] / sigma[-1]}
