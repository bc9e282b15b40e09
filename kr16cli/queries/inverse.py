"""kr16 ik: a pose to all configurations, with limits, Status, Turn and what is missing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from kr16cli import kuka, units
from kr16cli.errors import InputError
from kr16cli.krl import parse_krl
from kr16cli.model.inverse import Solutions
from kr16cli.queries.common import Answer, Matrix, Question, chained, inverse_pose, limit_text
from kr16cli.robot import RobotData
from kr16cli.single import Arm
from kr16cli.tolerances import TOLERANCES

if TYPE_CHECKING:
    from kr16cli.queries.many import Many

_JOINTS = ("a1", "a2", "a3", "a4", "a5", "a6")
# Rows that differ by less (rad) are one solution: a merged elbow pair differs by at most twice
# the merged angle, on each of its joints.
_SAME = 4 * TOLERANCES.merged
_POSTURE_BITS = 0b111
_JOINT_BITS, _A1_BIT, _A4_A6_BITS = 0b111111, 0b1, 0b101000


class InverseQuestion(Question):
    """Inverse kinematics.

    Args:
        data: the robot.
        si: angles in rad, lengths in m.
        tool: pose of the tool in the flange, six numbers as typed.
        base: pose of the base in robroot.
        near: configuration (as typed) that orders solutions and supplies free angles.
        turns: list every full-turn variant of A1, A4 and A6 within limits.
        status: keep solutions of this Status only.
        turn: keep solutions of this Turn only, full-turn variants considered.
    """

    name = "ik"
    reads = "pose"

    def __init__(
        self,
        data: RobotData,
        *,
        si: bool = False,
        tool: Sequence[float] | None = None,
        base: Sequence[float] | None = None,
        near: Sequence[float] | None = None,
        turns: bool = False,
        status: int | None = None,
        turn: int | None = None,
    ) -> None:
        super().__init__(data, si=si)
        self.arm = Arm(data)
        tool_matrix = self.pose_matrix(tool)
        self.base = self.pose_matrix(base)
        self.from_tool = None if tool_matrix is None else inverse_pose(tool_matrix)
        self.near = [0.0] * 6 if near is None else self.radians(near)
        self.turns, self.status, self.turn = turns, status, turn
        self.limits = [(joint.lower, joint.upper) for joint in data.joints]
        length, angle = self.length_unit, self.angle_unit
        self.column_units = dict.fromkeys(_JOINTS, angle)
        self.units = {
            "q": angle,
            "pose": f"{length}, {angle}",
            "violations": angle,
            "residual": "the larger of position error in m and rotation error in rad",
            "krl": "mm, deg",
        }
        self.options = {"near": [0.0] * 6 if near is None else list(near)}
        given = {"tool": tool, "base": base, "status": status, "turn": turn}
        self.options |= {key: value for key, value in given.items() if value is not None}
        self.notes: list[str] = []

    def read_krl(self, text: str) -> list[float]:
        """The pose from KRL text; its S and T select solutions, as on the controller."""
        record = parse_krl(text)
        pose = record.numbers(kuka.POSE_FIELDS)
        self.status = record.whole("S") if self.status is None else self.status
        self.turn = record.whole("T") if self.turn is None else self.turn
        chosen = {"status": self.status, "turn": self.turn}
        self.options |= {key: value for key, value in chosen.items() if value is not None}
        if any(record.fields.get(f"E{i}") for i in range(1, 7)):
            self.notes.append("external axes E1 to E6 are not part of this robot and are ignored")
        if not self.si:
            return pose
        return [units.metres(v) if i < 3 else units.rad(v) for i, v in enumerate(pose)]

    def follow(self, answer: Answer) -> None:
        """Stay near the solution just given."""
        self.near = answer.q or self.near

    def answer(self, values: Mapping[str, Any]) -> Answer:
        """All solutions for `values["pose"]` (six typed numbers) or `values["T"]` (4x4, m)."""
        T = kuka.matrix_from_pose(values["pose"], si=self.si) if "pose" in values else values["T"]
        _check_transform(T)
        flange = chained(self.base, T, self.from_tool)
        found = self.arm.ik(flange, self.near)
        kept: list[tuple[int, list[float]]] = []
        missing: list[dict[str, Any]] = []
        solutions: list[dict[str, Any]] = []
        for index, principal in enumerate(found.angles):
            reason = self._absent(found, index, kept)
            if reason is None:
                kept.append((index, list(principal)))
                chosen, reason = self._chosen(found, index)
                solutions += [self._solution(index, q, flange) for q in chosen]
            if reason is not None:
                missing.append({"branch": _branch(index), "reason": reason})
        solutions.sort(key=lambda one: (*self._distance(self.radians(one["q"])), one["index"]))
        for one in solutions:
            del one["index"]
        result = {
            "solutions": solutions,
            "missing": missing,
            "singularity": self._singularity(found, [index for index, _ in kept]),
        }
        return self._judged(result, bool(kept))

    def takes_many(self, kind: str) -> bool:
        """A choice of Turn and the variants of --turns are asked row by row."""
        return super().takes_many(kind) and self.turn is None and not self.turns

    def many(self, values: Mapping[str, Any]) -> Many:
        """The best solutions for `values["pose"]` (n, 6) or `values["T"]` (n, 4, 4)."""
        from kr16cli.queries.many_inverse import inverse_kinematics

        return inverse_kinematics(self, values, _SAME)

    def _judged(self, result: dict[str, Any], reached: bool) -> Answer:
        """The answer with its status, problem, warnings and the solution to follow."""
        solutions = result["solutions"]
        warnings = list(self.notes)
        inside = next((one for one in solutions if one["within_limits"]), None)
        if inside is not None:
            q = self.radians(inside["q"])
            switch = [f"A{i + 1}" for i in kuka.near_turn_switch(q)]
            if switch and self.turn is not None:
                warnings.append(
                    f"{', '.join(switch)} within 2 deg of 0: a controller may ignore this Turn "
                    "bit (unconfirmed)"
                )
            return Answer(result, warnings, q=q)
        if solutions:
            nearest = "; ".join(limit_text(v, self.angle_unit) for v in solutions[0]["violations"])
            text = f"no solution within limits: {len(solutions)} outside; the nearest: {nearest}"
            return Answer(result, warnings, "outside-limits", text)
        if reached:
            text = f"no solution has {self._wanted()}; leave it out to see all"
            return Answer(result, warnings, "not-selected", text)
        reasons = dict.fromkeys(one["reason"] for one in result["missing"])
        text = f"no solution: {'; '.join(reasons)}"
        return Answer(result, warnings, "unreachable", text)

    def _wanted(self) -> str:
        words = ((f"Status {self.status}", self.status), (f"Turn {self.turn}", self.turn))
        return " and ".join(text for text, value in words if value is not None)

    def _absent(
        self, found: Solutions, index: int, kept: Sequence[tuple[int, list[float]]]
    ) -> str | None:
        """Why a branch is no solution of its own, or None."""
        q = found.angles[index]
        if math.isnan(q[1]):
            return self._out_of_reach(*found.reach[index // 4])
        for other, angles in kept:
            if all(
                abs(math.remainder(a - b, math.tau)) < _SAME for a, b in zip(q, angles, strict=True)
            ):
                return f"coincides with branch {_words(other)}"
        return None

    def _out_of_reach(self, square: float, cosine: float) -> str:
        g = self.data.geometry
        forearm = math.hypot(g.a3, g.d4)
        distance = math.sqrt(square)
        if not math.isfinite(units.mm(distance)):
            return "out of reach: farther away than a number can say"
        if cosine > 0:
            limit, side, excess = g.a2 + forearm, "at most", distance - (g.a2 + forearm)
        else:
            limit, side, excess = abs(g.a2 - forearm), "at least", abs(g.a2 - forearm) - distance
        return (
            f"out of reach by {units.mm(excess):.3f} mm: the wrist centre is "
            f"{units.mm(distance):.3f} mm from the A2 axis, the arm spans {side} "
            f"{units.mm(limit):.3f} mm"
        )

    def _distance(self, q: Sequence[float]) -> tuple[float, float]:
        """Largest joint move from `near`, then the sum of all; rounding must not decide."""
        moves = [abs(a - b) for a, b in zip(q, self.near, strict=True)]
        return round(max(moves), 9), round(sum(moves), 9)

    def _chosen(self, found: Solutions, index: int) -> tuple[list[list[float]], str | None]:
        """The full-turn variants to list for a branch, or why none is listed.

        Status has three bits of posture and Turn one for each joint; higher bits (accuracy flag,
        external axes) say nothing here, nor do the Turn bits of joints that a singularity frees.
        """
        principal = found.angles[index]
        s = kuka.status(principal, self.data.geometry)
        if self.status is not None and (s ^ self.status) & _POSTURE_BITS:
            return [], f"not selected: its Status is {s}"
        variants = kuka.full_turn_variants(principal, self.limits)
        if self.turn is not None:
            free = _A1_BIT * bool(found.on_axis) | _A4_A6_BITS * bool(
                found.straight_wrist[index // 2]
            )
            judged = _JOINT_BITS & ~free
            matching = [q for q in variants if not (kuka.turn(q) ^ self.turn) & judged]
            if not matching:
                turns = ", ".join(str(kuka.turn(q)) for q in variants)
                return [], f"not selected: its Turn can be {turns}"
            variants = matching
        if self.turns:
            return variants, None
        return [min(variants, key=self._distance)], None

    def _solution(self, index: int, q: list[float], flange: Matrix) -> dict[str, Any]:
        violations = self.violations(q)
        return {
            "index": index,
            "q": self.angles(q),
            "status": kuka.status(q, self.data.geometry),
            "turn": kuka.turn(q),
            "branch": _branch(index),
            "within_limits": not violations,
            "violations": violations,
            "residual": max(self.arm.closure(flange, q)),
            "krl": kuka.format_e6axis([units.deg(v) for v in q]),
        }

    def _singularity(self, found: Solutions, kept: Sequence[int]) -> dict[str, Any] | None:
        """The singular case, if any: shoulder before wrist before elbow."""
        if not kept:
            return None
        near = self.angles(self.near)
        if found.on_axis:
            return _case("shoulder", "A1", near[0], self.angle_unit, "wrist centre on the A1 axis")
        if any(found.folded[i // 4] for i in kept):
            return _case("elbow", "A2", near[1], self.angle_unit, "arm folded onto its shoulder")
        if any(found.straight_wrist[i // 2] for i in kept):
            return _case("wrist", "A4", near[3], self.angle_unit, "A5 is 0: A4 and A6 in line")
        if any(abs(1.0 - abs(found.reach[i // 4][1])) < TOLERANCES.merged**2 for i in kept):
            rule = "arm stretched or folded: the elbow pair merges into one solution"
            return {"kind": "elbow", "free_joint": None, "rule": rule}
        return None

    def columns(self, result: Mapping[str, Any] | None) -> dict[str, Any]:
        """The nearest solution within limits, else the nearest: a1..a6, s, t, residual."""
        best = _best(result)
        if best is None:
            return dict.fromkeys((*_JOINTS, "s", "t", "solutions", "residual")) | (
                {"solutions": 0} if result else {}
            )
        return {
            **dict(zip(_JOINTS, best["q"], strict=True)),
            "s": best["status"],
            "t": best["turn"],
            "solutions": len(result["solutions"]) if result else 0,
            "residual": best["residual"],
        }

    @property
    def beyond_columns(self) -> dict[str, str]:
        """All solutions but one."""
        return {"the variants of --turns": "they are in json"} if self.turns else {}

    def arrays(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """q of the best solution; Q by branch (NaN where missing); s, t, residual."""
        by_branch = [[math.nan] * 6 for _ in range(8)]
        for one in reversed(result["solutions"]):
            b = one["branch"]
            by_branch[4 * b["shoulder"] + 2 * b["elbow"] + b["wrist"]] = one["q"]
        best = _best(result)
        nothing: dict[str, Any] = {"q": [math.nan] * 6, "status": math.nan, "turn": math.nan}
        one = best or {**nothing, "residual": math.nan}
        return {
            "q": one["q"],
            "Q": by_branch,
            "s": float(one["status"]),
            "t": float(one["turn"]),
            "residual": one["residual"],
        }


def _best(result: Mapping[str, Any] | None) -> dict[str, Any] | None:
    solutions: list[dict[str, Any]] = result["solutions"] if result else []
    inside = [one for one in solutions if one["within_limits"]]
    return next(iter(inside or solutions), None)


def _case(kind: str, joint: str, value: float, unit: str, what: str) -> dict[str, Any]:
    rule = f"{what}; {joint} is free and keeps the value of --near, {value:.6g} {unit}"
    return {"kind": kind, "free_joint": joint, "rule": rule}


def _branch(index: int) -> dict[str, int]:
    return {"shoulder": index >> 2 & 1, "elbow": index >> 1 & 1, "wrist": index & 1}


def _words(index: int) -> str:
    return ", ".join(f"{name} {bit}" for name, bit in _branch(index).items())


def _check_transform(T: Sequence[Sequence[float]]) -> None:
    """InputError unless the matrix read is a rigid transform."""
    if any(
        abs(v - w) > TOLERANCES.rotation for v, w in zip(T[3], (0.0, 0.0, 0.0, 1.0), strict=True)
    ):
        raise InputError("T: the last row must be 0 0 0 1")
    worst = max(
        abs(sum(T[k][i] * T[k][j] for k in range(3)) - (i == j)) for i in range(3) for j in range(3)
    )
    (a, b, c), (d, e, f), (g, h, i) = (row[:3] for row in T[:3])
    if (
        worst > TOLERANCES.rotation
        or a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0
    ):
        raise InputError(
            f"T: its 3x3 part is no rotation (R^T R differs from 1 by {worst:.1e}, "
            f"limit {TOLERANCES.rotation:.0e})"
        )
