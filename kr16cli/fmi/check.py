"""Check an FMU: its description, its states, and its motion against the direct simulator."""

from __future__ import annotations

import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from kr16cli.errors import CheckFailedError, InputError
from kr16cli.fmi import play
from kr16cli.fmi.compare import STEP, STOP, Comparison, Report
from kr16cli.fmi.reading import Fmu
from kr16cli.robot import RobotData
from kr16cli.robot_file import load_data

SCHEMA = "kr16.fmu_check/1"
EQUAL_STEPS = 1e-9
"""Largest relative deviation allowed where both take the same steps: round-off, grown by 1 s of
motion."""

OWN_STEPS = 1e-5
"""The same for an FMU that steps in its own way, and for model exchange, where the host steps."""

_FINE = 1e-11
"""Relative tolerance of FMPy's solver in model exchange; its error is some thousand times that."""


def check(
    fmu: Fmu,
    robot: RobotData | None,
    tolerance: float | None = None,
    kind: str = "",
    compared: Comparison | None = None,
) -> Report:
    """Check an FMU in FMPy.

    Args:
        fmu: the FMU, ours or another with the same variables.
        robot: what it should move like; None takes the numbers inside an FMU of ours, else the
            KR 16-2.
        tolerance: largest deviation over the size of a quantity; None chooses by whose FMU
            it is, and how it is run.
        kind: one of `fmu.kinds`; that which `play.interface` says where none is given.
        compared: the comparison with the simulator, where there is one already.

    Raises:
        MissingPartError: FMPy is not installed.
    """
    path, kind = str(Path(fmu.path).resolve()), kind or play.interface(fmu)
    problems = list(play.ask("validate", fmu=path)["problems"])
    own, exchange = _ours(fmu), kind == "model-exchange"
    if own and not exchange:
        problems += _states(path, fmu)
    data = robot or (fmu.cargo.data if fmu.cargo else load_data())
    if fmu.cargo and robot and robot.sha256 != fmu.cargo.data.sha256:
        problems.append(
            f"the FMU holds {fmu.cargo.data.name}, model {fmu.cargo.data.sha256[:12]}; "
            f"{robot.path} is model {robot.sha256[:12]}"
        )
    allowed = tolerance or (EQUAL_STEPS if own and not exchange else OWN_STEPS)
    compared = compared or Comparison(fmu, data)
    if not compared.shared:
        problems.append("no output is named like ours; nothing can be compared")
        return Report(problems, [], allowed, 0)
    try:
        compared.expected(after=exchange)
        signals = compared.signals(stairs=exchange)
        columns, _ = play.play(fmu, signals, STOP, STEP, {}, kind, _FINE)
    except CheckFailedError as error:
        problems.append(str(error))
    except InputError as error:
        problems.append(f"the direct simulator refuses it: {error}")
    else:
        report = compared.report(columns, problems, allowed, after=exchange)
        return report._replace(problems=[*_other_robot(fmu, data, report), *report.problems])
    return Report(problems, [], allowed, len(compared.times) - 1)


def _other_robot(fmu: Fmu, data: RobotData, report: Report) -> list[str]:
    """That a native FMU, which holds no robot file, deviates because it is of another robot."""
    text = fmu.attributes.get("description", "")
    if not report.problems or fmu.cargo or not _ours(fmu) or f"the {data.name}." in text:
        return []
    return [
        f"the FMU says '{text.partition('.')[0]}' and was compared with {data.name}; give the "
        "robot it was built for by --robot"
    ]


def _ours(fmu: Fmu) -> bool:
    """Whether the FMU takes the simulator's steps: what this package builds does."""
    return fmu.cargo is not None or fmu.attributes.get("generationTool", "").startswith("kr16cli ")


def _states(path: str, fmu: Fmu) -> list[str]:
    """What is wrong with saving, restoring and resetting."""
    answer = play.ask("states", fmu=path, step=fmu.number("stepSize") or 0.01)
    if "failure" in answer:
        return [f"saving and restoring failed: {answer['failure']}"]
    return [f"{what} does not repeat the run" for what in answer["differing"]]


def envelope(fmu: Fmu, report: Report, kind: str = "") -> dict[str, Any]:
    """The JSON answer of `kr16 fmu check`; `kind` as it was given to `check`."""
    about = fmu.cargo.about if fmu.cargo else {}
    return {
        "schema": SCHEMA,
        "robot": about.get("robot"),
        "model_sha256": about.get("model_sha256"),
        "units": {d.group: d.unit for d in report.deviations},
        "input": {"file": fmu.path},
        "result": {
            "fmi_version": fmu.attributes["fmiVersion"],
            "interface": kind or play.interface(fmu),
            "host": f"FMPy {metadata.version('fmpy')}",
            "platform": f"{platform.system()} {platform.machine()}",
            **report.row(),
        },
        "warnings": [],
    }
