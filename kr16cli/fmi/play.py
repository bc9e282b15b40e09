"""Run an FMU in a process of its own and give its outputs as a table."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from kr16cli.errors import CheckFailedError, InputError, MissingPartError
from kr16cli.fmi.reading import Fmu

_LONGEST = 3600.0
_MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class Signals:
    """Inputs over time: rising times (s), and a column of values for each name."""

    times: Sequence[float] = ()
    columns: Mapping[str, Sequence[float]] = field(default_factory=dict)


def play(
    fmu: Fmu,
    signals: Signals,
    stop: float,
    step: float,
    start_values: Mapping[str, float],
    kind: str = "",
    tolerance: float | None = None,
) -> tuple[dict[str, list[float]], list[str]]:
    """Simulate an FMU from 0 to `stop` (s) with a communication step of `step` (s).

    Args:
        fmu: the FMU.
        signals: inputs, straight lines between their rows, held beyond the last.
        stop: end, s.
        step: communication step, s.
        start_values: of parameters, by name; elements of an array as `q_start[2]`.
        kind: one of `fmu.kinds`; where none is given, co-simulation is preferred.
        tolerance: relative, of FMPy's solver in model exchange; FMPy's own where none is given.

    Returns:
        Columns by name, `time` first, then the outputs; and what the FMU warned of.

    Raises:
        InputError: a name the FMU does not have, or times that cannot be used.
        CheckFailedError: the FMU failed, with its reason.
        MissingPartError: FMPy is not installed.
    """
    _check(fmu, signals, stop, step, start_values)
    outputs = [v.name for v in fmu.variables if v.causality == "output" and v.base != "String"]
    starts, length = fmu.starts(), len(signals.times)
    columns = {name: list(column) for name, column in signals.columns.items()}
    answer = ask(
        "simulate", fmu=str(Path(fmu.path).resolve()), stop=stop, step=step, outputs=outputs,
        times=list(signals.times),
        inputs=_gathered(fmu, columns, lambda name: [starts.get(name, 0.0)] * length),
        start_values=_gathered(fmu, _typed(fmu, start_values), lambda name: starts.get(name, 0.0)),
        tolerance=tolerance,
        kind="".join(part.capitalize() for part in (kind or interface(fmu)).split("-")),
    )  # fmt: skip
    if "failure" in answer:
        raise CheckFailedError(f"{fmu.path}: the run failed: {answer['failure']}")
    return answer["columns"], answer["warnings"]


def interface(fmu: Fmu) -> str:
    """The kind of FMU it is run as: co-simulation where it offers that, else its first."""
    return "co-simulation" if "co-simulation" in fmu.kinds else "".join(fmu.kinds[:1])


def _gathered(fmu: Fmu, given: Mapping[str, Any], other: Callable[[str], Any]) -> dict[str, Any]:
    """Elements put together where the FMU has arrays; `other` gives those that are not given."""
    found = dict(given)
    for v in fmu.variables:
        names = [element.name for element in v.elements()]
        if v.size is not None and any(name in given for name in names):
            found[v.name] = [found.pop(n) if n in given else other(n) for n in names]
    return found


def _typed(fmu: Fmu, values: Mapping[str, float]) -> dict[str, Any]:
    """Start values as FMPy takes them for each type."""
    bases = {v.name: v.base for v in fmu.scalars}
    for name, v in values.items():
        if "Int" in bases[name] and v != int(v):
            raise InputError(f"{name} is {v:g}; it must be a whole number")
        if bases[name] == "Boolean" and v not in (0.0, 1.0):
            raise InputError(f"{name} is {v:g}; it must be true or false")
    return {
        name: bool(v) if bases[name] == "Boolean" else int(v) if "Int" in bases[name] else v
        for name, v in values.items()
    }


def _check(
    fmu: Fmu, signals: Signals, stop: float, step: float, start_values: Mapping[str, float]
) -> None:
    """Refuse what the FMU does not have, and times without sense."""
    inputs = [v.name for v in fmu.scalars if v.causality == "input"]
    parameters = [v.name for v in fmu.scalars if v.start is not None]
    for names, known, what in (
        (signals.columns, inputs, "input"),
        (start_values, parameters, "parameter"),
    ):
        unknown = next((name for name in names if name not in known), None)
        if unknown is not None:
            shown = ", ".join(known[:6]) + (", ..." if len(known) > 6 else "")
            raise InputError(f"{fmu.path} has no {what} {unknown}; it has {shown or 'none'}")
    if not 0.0 < step <= stop:
        raise InputError(f"the step of {step:g} s must be positive and not exceed {stop:g} s")
    if stop / step > _MOST_SAMPLES:
        raise InputError(f"{stop / step:.3g} steps are more than {_MOST_SAMPLES}; make them longer")


def ask(what: str, **job: Any) -> dict[str, Any]:
    """The answer of a child process to a job.

    Raises:
        MissingPartError: FMPy is not installed.
        CheckFailedError: the process crashed or did not end.
    """
    if find_spec("fmpy") is None:
        raise MissingPartError("fmpy", "fmu")
    with tempfile.TemporaryDirectory(prefix="kr16_play_") as folder:
        answer = Path(folder) / "answer.json"
        text = json.dumps({"do": what, "answer": str(answer), **job})
        script = Path(__file__).with_name("child.py")
        try:
            done = subprocess.run(
                [sys.executable, "-P", str(script)], input=text, capture_output=True, text=True,
                timeout=_LONGEST, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise CheckFailedError(f"the FMU did not end within {_LONGEST:g} s") from None
        if not answer.exists():
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise CheckFailedError(f"the FMU ended its process with code {done.returncode}: {last}")
        found: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
        return found
