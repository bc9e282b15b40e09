"""Motion programs in the manner of KRL, as references that stop at every point.

One statement a line; what follows a semicolon is a comment:

    PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0}
    PTP {X 1000,Y 0,Z 900,A 0,B 90,C 0,S 2,T 2}
    $VEL.CP = 0.3
    LIN {X 1000,Y 300,Z 900,A 0,B 90,C 0}
    CIRC {X 1100,Y 150,Z 900},{X 1000,Y 0,Z 900,A 0,B 90,C 0}
    WAIT SEC 0.5

mm, degrees and m/s, in $ROBROOT, of the flange. LIN and CIRC keep the orientation where A, B
and C are left out. `DEF ... END` lines and FOLD comments are passed over. There is no
approximate positioning (C_PTP, C_DIS), no $BASE and no $TOOL; S and T select the configuration
of a PTP, and without them it is the nearest. Status and Turn of LIN and CIRC are ignored, as
on the controller.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from kr16cli import units
from kr16cli.errors import FileError, InputError, Kr16Error, NoAnswerError
from kr16cli.krl import AXIS_FIELDS, POSE_FIELDS, KrlRecord, parse_krl
from kr16cli.kuka import full_turn_variants, matrix_from_pose, status, turn
from kr16cli.simulate.core import Reference
from kr16cli.simulate.paths import Curve, Line, PathMove, PathSpeed, arc_through
from kr16cli.simulate.profiles import Shape
from kr16cli.simulate.references import Chain, Hold, JointMove
from kr16cli.single import Arm, Matrix

_WORD = re.compile(r"\s*([$A-Za-z_][\w.$]*)(.*)", re.DOTALL)
_NUMBER = re.compile(r"\s*=?\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*")
_PASSED_OVER = ("DEF", "END", "INI")
_LONGEST_WAIT = 3600.0


@dataclass(frozen=True)
class Pace:
    """How fast a program runs: `joint` speeds and accelerations (rad), `path` speeds."""

    shape: Shape
    joint_speed: Sequence[float]
    joint_acceleration: Sequence[float]
    path: PathSpeed


def load_program(path: str | Path, arm: Arm, start: Sequence[float], pace: Pace) -> Reference:
    """The reference of a program file, see `program`; errors name the file and its line."""
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(path, f"not UTF-8 text at byte {error.start}") from None
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror or error}") from None
    return program(text, arm, start, pace, str(path))


def program(
    text: str, arm: Arm, start: Sequence[float], pace: Pace, path: str = "program"
) -> Reference:
    """The reference that a program describes.

    Args:
        text: the program.
        arm: the robot.
        start: joint angles it starts from, rad.
        pace: speeds and accelerations; `$VEL.CP` and `$ACC.CP` (m/s, m/s2) change the path's.
        path: what messages call the file.

    Raises:
        FileError: a line that cannot be understood.
        NoAnswerError: a motion that the robot cannot do.
    """
    maker = _Maker(arm, start, pace)
    for number, line in enumerate(text.splitlines(), 1):
        try:
            maker.statement(line.split(";")[0].strip())
        except NoAnswerError as error:
            raise NoAnswerError(f"{path}: line {number}: {error}") from None
        except Kr16Error as error:
            raise FileError(path, f"line {number}: {error}") from None
    if not maker.parts:
        raise FileError(path, "holds no motion; write PTP, LIN or CIRC statements")
    return Chain(maker.parts)


class _Maker:
    """Turns statements into references, each from where the one before ends."""

    def __init__(self, arm: Arm, start: Sequence[float], pace: Pace) -> None:
        self._arm, self._q, self._pace = arm, list(start), pace
        self.parts: list[Reference] = []

    def statement(self, line: str) -> None:
        """Take in one statement; nothing for an empty line."""
        match = _WORD.match(line)
        if match is None:
            if line:
                raise InputError(f"no statement: {line[:40]}")
            return
        word, rest = match[1].upper(), match[2].strip()
        actions: dict[str, Callable[[str], None]] = {
            "PTP": self._ptp,
            "LIN": self._lin,
            "CIRC": self._circ,
            "WAIT": self._wait,
            "$VEL.CP": lambda text: self._set(word, text),
            "$ACC.CP": lambda text: self._set(word, text),
        }
        if word in _PASSED_OVER:
            return
        if word not in actions:
            raise InputError(f"unknown statement {word}; known: {', '.join(actions)}")
        actions[word](rest)

    def _add(self, part: Reference) -> None:
        self.parts.append(part)
        self._q = list(part.joint(part.duration).q)

    def _ptp(self, text: str) -> None:
        (record,) = _aggregates(text, 1)
        if record.type in ("E6AXIS", "AXIS"):
            q = [units.rad(v) for v in record.numbers(AXIS_FIELDS)]
        else:
            pose = matrix_from_pose(record.numbers(POSE_FIELDS))
            q = self._configuration(pose, record.whole("S"), record.whole("T"))
        pace = self._pace
        speeds = (pace.joint_speed, pace.joint_acceleration)
        self._add(JointMove(self._arm, self._q, q, pace.shape, *speeds))

    def _configuration(self, pose: Matrix, s: int | None, t: int | None) -> list[float]:
        """The solution of a PTP's pose: with its Status and Turn, nearest to where we are."""
        limits = [(j.lower, j.upper) for j in self._arm.data.joints]
        # Where A4 and A6 share a pose, A4 stays as it is, or is 0 if S and T ask for that.
        nears = (self._q, [*self._q[:3], 0.0, 0.0, 0.0])
        rows = [q for near in nears for q in self._arm.ik(pose, near).angles if q[0] == q[0]]
        if not rows:
            raise NoAnswerError("the pose is out of reach")
        found = [v for row in rows for v in full_turn_variants(row, limits)]
        chosen = [
            q
            for q in found
            if (s is None or status(q, self._arm.geometry) == s) and (t is None or turn(q) == t)
        ]
        if not chosen:
            raise NoAnswerError(f"no configuration of the pose has S {s}, T {t}; leave them out")
        inside = [
            q
            for q in chosen
            if all(low <= v <= high for v, (low, high) in zip(q, limits, strict=True))
        ]
        near = self._q
        return min(
            inside or chosen,
            key=lambda q: max(abs(a - b) for a, b in zip(q, near, strict=True)),
        )

    def _lin(self, text: str) -> None:
        (record,) = _aggregates(text, 1)
        here = self._arm.fk(self._q)
        place, rotation = _pose(record)
        self._path(Line([row[3] for row in here[:3]], place), rotation)

    def _circ(self, text: str) -> None:
        middle, end = _aggregates(text, 2)
        here = self._arm.fk(self._q)
        place, rotation = _pose(end)
        arc = arc_through([row[3] for row in here[:3]], _pose(middle)[0], place)
        self._path(arc, rotation)

    def _path(self, curve: Curve, rotation: Matrix | None) -> None:
        pace = self._pace
        self._add(PathMove(self._arm, self._q, curve, rotation, pace.shape, pace.path))

    def _wait(self, text: str) -> None:
        if not text.upper().startswith("SEC"):
            raise InputError("WAIT needs SEC and a time in s")
        seconds = _number(text[3:], "WAIT SEC")
        if not 0.0 <= seconds <= _LONGEST_WAIT:
            raise InputError(f"WAIT SEC {seconds:g}: must be 0 to {_LONGEST_WAIT:g} s")
        self._add(Hold(self._arm, self._q, seconds))

    def _set(self, name: str, text: str) -> None:
        value = _number(text, name)
        if not 0.0 < value <= 10.0:
            raise InputError(f"{name} = {value:g}: must be above 0 and at most 10")
        what = {"$VEL.CP": "speed", "$ACC.CP": "acceleration"}[name]
        self._pace = replace(self._pace, path=self._pace.path._replace(**{what: value}))


def _aggregates(text: str, count: int) -> list[KrlRecord]:
    """The aggregates of a statement."""
    texts = re.findall(r"\{[^{}]*\}", text)
    between = re.sub(r"\{[^{}]*\}", "", text)
    if len(texts) != count:
        raise InputError(f"needs {count} point{'s' * (count > 1)} in braces, found {len(texts)}")
    if between.replace(",", "").strip():
        left = between.replace(",", "").strip()
        raise InputError(f"{left[:20]} is not understood; every motion stops at its point")
    return [parse_krl(part) for part in texts]


def _pose(record: KrlRecord) -> tuple[list[float], Matrix | None]:
    """Place (m) and rotation of a LIN or CIRC point; None keeps the orientation."""
    place = [units.metres(v) for v in record.numbers(("X", "Y", "Z"))]
    given = [name for name in "ABC" if name in record.fields]
    if not given:
        return place, None
    return place, [row[:3] for row in matrix_from_pose(record.numbers(POSE_FIELDS))[:3]]


def _number(text: str, what: str) -> float:
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise InputError(f"{what} needs a number, found '{text.strip()[:20]}'")
    return float(match[1])
