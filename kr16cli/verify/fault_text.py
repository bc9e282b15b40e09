"""What became of the seeded faults: counts and a table; nothing is computed here."""

from __future__ import annotations

from collections.abc import Sequence

from kr16cli.verify.fresh import ERROR, TIMEOUT
from kr16cli.verify.selftest import Fault


def counts(faults: Sequence[Fault]) -> dict[str, int]:
    """How many were seeded and detected, survived, and survived without a reason."""
    survived = [f for f in faults if f.by is None]
    return {
        "seeded": len(faults),
        "detected": len(faults) - len(survived),
        "survived": len(survived),
        "unexplained": sum(not f.explained for f in survived),
    }


def table(faults: Sequence[Fault]) -> str:
    """Counts by file and by kind, every survivor with its reason, and the verdict."""
    lines = [*_grouped(faults, "file"), "", *_grouped(faults, "kind")]
    for title, wanted in (("survivors with a reason", True), ("NOT DETECTED", False)):
        own = [f for f in faults if f.by is None and f.explained is wanted]
        lines += ["", title] if own else []
        for f in own:
            lines += [f"  {f.mutant.id}", f"    {f.mutant.change}"]
            lines += [f"    {f.reason}"] if f.reason else []
    return "\n".join([*lines, "", summary(faults), ""])


def summary(faults: Sequence[Fault]) -> str:
    """The verdict in a line."""
    n = counts(faults)
    broke = sum(f.by in (ERROR, TIMEOUT) for f in faults)
    verdict = (
        f"{n['unexplained']} of them without a reason" if n["unexplained"] else "all explained"
    )
    return (
        f"{n['seeded']} faults seeded, {n['detected']} detected ({broke} of them broke the model "
        f"before a case ran), {n['survived']} survived, {verdict}"
    )


def _grouped(faults: Sequence[Fault], by: str) -> list[str]:
    names = list(dict.fromkeys(getattr(f.mutant, by) for f in faults))
    lines = [f"{by:<24} seeded  detected  survived"]
    for name in names:
        own = [f for f in faults if getattr(f.mutant, by) == name]
        n = counts(own)
        lines.append(f"{name:<24} {n['seeded']:6}  {n['detected']:8}  {n['survived']:8}")
    return lines
