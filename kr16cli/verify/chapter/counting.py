"""The chapter's claims on which and how many solutions there are: (3.17) to (3.20), (3.26)."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

from kr16cli.verify.chapter import model_side
from kr16cli.verify.chapter.arm import Matrix, Point, flat
from kr16cli.verify.chapter.bench import Bench
from kr16cli.verify.chapter.judge import PRECISE, SEEN, spread
from kr16cli.verify.chapter.recipe import Recipe, placed
from kr16cli.verify.chapter.records import Found, Statement
from kr16cli.verify.chapter.scalars import DIGITS, FLOATS, Scalar, digits50

Keys = set[tuple[int, int]]
"""Triplets by (i, k) of q_1i and q_3k."""

SETS: dict[str, tuple[str, str, Keys]] = {
    "3.17": (
        "Delta_1,2 > 0",
        "Q_1 = {{q11, q21, q31}, {q11, q22, q32}, {q12, q21, q31}, {q12, q22, q32}}",
        {(1, 1), (1, 2), (2, 1), (2, 2)},
    ),
    "3.18": (
        "Delta_1 > 0, Delta_2 < 0",
        "Q_2 = {{q11, q21, q31}, {q11, q22, q32}}",
        {(1, 1), (1, 2)},
    ),
    "3.19": (
        "Delta_1 < 0, Delta_2 > 0",
        "Q_3 = {{q12, q21, q31}, {q12, q22, q32}}",
        {(2, 1), (2, 2)},
    ),
    "": ("Delta_1,2 < 0", "the empty set", set()),
}
"""What is printed for each sign pattern of the two discriminants."""


def _centres(bench: Bench) -> dict[str, tuple[float, float]]:
    """A wrist centre (m from the A1 axis, height) for each sign pattern, by plane geometry."""
    v = bench.values
    forearm = float((v["a3"] ** 2 + v["d4"] ** 2) ** 0.5)
    reach, hole = v["a2"] + forearm, abs(v["a2"] - forearm)
    return {
        "3.17": (reach / 2, v["d1"] + 0.1),
        "3.18": (reach, v["d1"] + 0.1),
        "3.19": (v["a1"] + 0.3 * hole, v["d1"] + 0.3 * hole),
        "": (2 * reach, v["d1"]),
    }


def _centre(p: Point, bench: Bench, id: str, q1: float) -> list[Scalar]:
    f = p.functions or FLOATS
    r, z = (f.number(repr(x)) for x in _centres(bench)[id])
    c, s = f.pair(f.number(q1))
    return [s * r, c * r, z]


def _set_found(ids: Sequence[str]) -> Callable[[Bench], Found]:
    """Check that exactly the printed triplets exist, close and differ."""

    def check(bench: Bench) -> Found:
        failures, worst = [], {}
        for f in (digits50(), FLOATS):
            p = bench.point(f, {})
            gap = 0.0
            for id in ids:
                o_c = _centre(p, bench, id, 0.7)
                arms = Recipe(p).arms(o_c)
                if set(arms) != SETS[id][2]:
                    failures.append(f"{SETS[id][0]} gives {sorted(arms)}")
                ends = [placed(p, [*arm, 0, 0, 0]) for arm in arms.values()]
                gap = max((spread(end.o(4), o_c) for end in ends), default=gap)
                if not _differ([flat(end.R(3)) for end in ends]):
                    failures.append("two triplets are the same")
            worst[f is FLOATS] = gap
        if worst[False] > PRECISE:
            failures.append(f"a triplet misses o_c by {worst[False]:.1e} m")
        return Found(
            not failures,
            worst[True],
            "; ".join(failures)
            or f"{DIGITS} digits: exactly the printed triplets are real, "
            "each closes, no two are the same; (3.10) and (3.13) have no further roots",
            f"Every triplet brings the wrist centre to o_c within {worst[True]:.1e} m (float64)",
        )

    return check


def _differ(postures: Sequence[Sequence[Scalar]]) -> bool:
    return all(spread(a, b) > SEEN for i, a in enumerate(postures) for b in postures[:i])


def branch_sets() -> list[Statement]:
    """(3.17) to (3.19) and the display of cases."""
    numbered = [
        Statement(id, None, says, "holds", check=_set_found([id]), unit="m",
                  note=f"At a wrist centre with {when}")
        for id, (when, says, _) in SETS.items() if id
    ]  # fmt: skip
    cases = "; ".join(f"{says.split(' =')[0]} if {when}" for when, says, _ in SETS.values())
    display = Statement(
        "cases, display after 3.19",
        None,
        f"{{q1, q2, q3}} in: {cases}",
        "holds",
        check=_set_found(list(SETS)),
        unit="m",
        note="Delta_i = 0 is the elbow singularity, excluded by the assumption of section 3.2.1",
    )
    return [*numbered, display]


def _random_centres(bench: Bench, count: int) -> list[list[float]]:
    """Wrist centres in a box around the arm, no discriminant near zero."""
    draw = random.Random(bench.seed + 3)
    p = bench.point(FLOATS, {})
    result: list[list[float]] = []
    while len(result) < count:
        o_c = [draw.uniform(-1.8, 1.8), draw.uniform(-1.8, 1.8), draw.uniform(-1, 2.4)]
        if min(map(abs, Recipe(p).discriminants(o_c))) > 1e-3:
            result.append(o_c)
    return result


def _arms_found(bench: Bench) -> Found:
    """Number of triplets against plane geometry: two circles meet in two points or in none."""
    p = bench.point(FLOATS, {})
    v = bench.values
    forearm = (v["a3"] ** 2 + v["d4"] ** 2) ** 0.5
    counts: dict[int, int] = {}
    failures, gap = [], 0.0
    for x, y, z in _random_centres(bench, 40 if bench.quick else 200):
        arms = Recipe(p).arms([x, y, z])
        side = (x * x + y * y) ** 0.5
        far = [((s * side - v["a1"]) ** 2 + (z - v["d1"]) ** 2) ** 0.5 for s in (1, -1)]
        expected = sum(2 for d in far if abs(v["a2"] - forearm) < d < v["a2"] + forearm)
        counts[len(arms)] = counts.get(len(arms), 0) + 1
        if len(arms) != expected:
            failures.append(f"{len(arms)} triplets at o_c = {x, y, z}, {expected} circle points")
        ends = (placed(p, [*arm, 0, 0, 0]).o(4) for arm in arms.values())
        gap = max([gap, *(spread(end, [x, y, z]) for end in ends)])
    if set(counts) != {0, 2, 4}:
        failures.append(f"counts {sorted(counts)}")
    if gap > SEEN:
        failures.append(f"a triplet misses o_c by {gap:.1e} m")
    return Found(
        not failures,
        gap,
        "; ".join(failures[:2])
        or "counted: as many triplets as circles about A2 and o_c have "
        f"common points, at {sum(counts.values())} random wrist centres",
        "; ".join(f"{n} triplets at {k} centres" for n, k in sorted(counts.items())),
    )


def arm_counts() -> Statement:
    """Zero, two or four."""
    return Statement(
        "text after 3.20",
        None,
        "there are either zero, two or four solutions for the first three angles",
        "holds",
        check=_arms_found,
        note="Delta_i = 0 (elbow stretched or folded) is excluded as singular",
        unit="m",
    )


def _all_found(bench: Bench) -> Found:
    """The recipe from end to end against the model's solutions."""
    counts: dict[int, int] = {}
    failures: list[str] = []
    gap = 0.0
    centres = _random_centres(bench, len(bench.floats) * (4 if bench.quick else 3))
    for i, centre in enumerate(centres):
        p = bench.floats[i % len(bench.floats)]
        pose = [[*p.R(6)[k], c + p.values["d6"] * p.z(6)[k]] for k, c in enumerate(centre)]
        gap = max(gap, _closure(p, pose, failures, counts))
    if set(counts) != {0, 4, 8}:
        failures.append(f"counts {sorted(counts)}")
    if gap > SEEN:
        failures.append(f"a solution misses its pose by {gap:.1e}")
    precise = max(_closure(p, p.frames[6][:3], failures, {}) for p in bench.precise[:2])
    if precise > PRECISE:
        failures.append(f"a solution misses its pose by {precise:.1e} in {DIGITS} digits")
    return Found(
        not failures,
        gap,
        "; ".join(failures[:2])
        or f"counted: the recipe (3.8) to (3.26) gives the model's "
        f"solutions, all different and all closing, for {sum(counts.values())} random poses; "
        f"two poses in {DIGITS} digits",
        "; ".join(f"{n} solutions of {k} poses" for n, k in sorted(counts.items())),
    )


def _closure(p: Point, pose: Matrix, failures: list[str], counts: dict[int, int]) -> float:
    """Largest miss of the recipe's solutions; counts them against the model's."""
    found = [placed(p, q) for q in Recipe(p).solutions(pose)]
    theirs = [placed(p, q) for q in model_side.solutions(p, pose)]
    counts[len(found)] = counts.get(len(found), 0) + 1
    if len(theirs) != len(found):
        failures.append(f"{len(found)} solutions, the model has {len(theirs)}")
    ours = [_posture(end) for end in found]
    if not _differ(ours):
        failures.append("two solutions are the same")
    if any(min((spread(t, o) for o in ours), default=1.0) > SEEN for t in map(_posture, theirs)):
        failures.append("the model has another solution")
    return max((spread(flat(end.frames[6][:3]), flat(pose)) for end in found), default=0.0)


def _posture(p: Point) -> list[Scalar]:
    return [v for i in range(1, 7) for v in p.angles[f"q{i}"]]


def all_counts() -> Statement:
    """Zero, four or eight."""
    return Statement(
        "text after 3.26",
        None,
        "we either have zero, four or eight solutions for the nonsingular inverse kinematics",
        "holds",
        check=_all_found,
        note="Orientation of the pose and of each solution compared element by element",
    )
