"""Simulate an FMU with FMPy in a process of its own, which cannot import kr16cli.

Run by path, not as part of the package: a crash of the FMU ends this process alone, and an FMU
that secretly used the installed package would fail. Reads a job as JSON from stdin, writes the
answer as JSON to the file the job names.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any


class _Closed:
    """Finds kr16cli and refuses it."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> None:
        if name.split(".", maxsplit=1)[0] == "kr16cli":
            raise ImportError("kr16cli is closed to the FMU under test")


def _messages(warnings: list[str], errors: list[str]) -> Any:
    def logger(environment: Any, name: Any, status: int, category: Any, message: Any) -> None:
        text = message.decode(errors="replace") if isinstance(message, bytes) else str(message)
        kept = errors if status >= 2 else warnings
        if status >= 1 and len(kept) < 20:
            kept.append(" ".join(text.replace("%%", "%").split()))

    return logger


def _signals(job: dict[str, Any]) -> Any:
    """The inputs as the structured array FMPy takes, or None."""
    import numpy as np

    if not job["inputs"]:
        return None
    given = {"time": job["times"], **job["inputs"]}
    columns = {name: np.array(values, np.float64).T for name, values in given.items()}
    table = np.empty(
        len(job["times"]), dtype=[(n, np.float64, c.shape[1:]) for n, c in columns.items()]
    )
    for name, column in columns.items():
        table[name] = column
    return table


def _columns(result: Any) -> dict[str, list[float]]:
    """What FMPy recorded, each element of an array a column."""
    columns = {}
    for name in result.dtype.names:
        values = result[name]
        if values.ndim == 1:
            columns[name] = [float(v) for v in values]
            continue
        for k, element in enumerate(values.reshape(len(values), -1).T, 1):
            columns[f"{name}[{k}]"] = [float(v) for v in element]
    return columns


def simulate(job: dict[str, Any]) -> dict[str, Any]:
    """Times and outputs of a run from 0 to `stop` in steps of `step`, inputs included."""
    import fmpy

    warnings: list[str] = []
    errors: list[str] = []
    try:
        result = fmpy.simulate_fmu(
            job["fmu"], validate=False, start_time=0.0, stop_time=job["stop"],
            output_interval=job["step"], start_values=job["start_values"],
            input=_signals(job), output=job["outputs"], logger=_messages(warnings, errors),
            debug_logging=True, fmi_type=job["kind"], relative_tolerance=job["tolerance"],
            record_events=False,
        )  # fmt: skip
    except Exception as error:
        return {"failure": " ".join([*str(error).split(), *errors[:1]])}
    return {"columns": _columns(result), "warnings": warnings}


def validate(job: dict[str, Any]) -> dict[str, Any]:
    """What FMPy's validation complains of, the XML schema included."""
    from fmpy.validation import validate_fmu

    return {"problems": [" ".join(str(p).split()) for p in validate_fmu(job["fmu"])]}


def states(job: dict[str, Any]) -> dict[str, Any]:
    """Whether saved, serialized and reset instances repeat what they did, to the last bit."""
    import shutil

    import fmpy
    from fmpy import fmi2, fmi3

    description = fmpy.read_model_description(job["fmu"], validate=False)
    folder = fmpy.extract(job["fmu"])
    third = description.fmiVersion.startswith("3")
    make: Any = fmi3.FMU3Slave if third else fmi2.FMU2Slave
    save, restore, write, read, get = (
        ("getFMUState", "setFMUState", "serializeFMUState", "deserializeFMUState", "getFloat64")
        if third
        else ("getFMUstate", "setFMUstate", "serializeFMUstate", "deSerializeFMUstate", "getReal")
    )
    outputs = [v for v in description.modelVariables
               if v.causality == "output" and v.type in ("Real", "Float64")]  # fmt: skip
    references = [v.valueReference for v in outputs]
    counted = {"nValues": sum(math.prod(v.shape or ()) for v in outputs)} if third else {}
    h, differing = job["step"], []

    def begin(slave: Any) -> None:
        if third:
            slave.enterInitializationMode(startTime=0.0)
        else:
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
        slave.exitInitializationMode()
        for k in range(10):
            slave.doStep(k * h, h)

    def go_on(slave: Any) -> Any:
        for k in range(10, 20):
            slave.doStep(k * h, h)
        return getattr(slave, get)(references, **counted)

    try:
        first, second = (
            make(guid=description.guid, unzipDirectory=folder, instanceName=name,
                 modelIdentifier=description.coSimulation.modelIdentifier)
            for name in ("first", "second")
        )  # fmt: skip
        for slave in (first, second):
            slave.instantiate()
        begin(first)
        state = getattr(first, save)()
        content = getattr(first, write)(state)
        expected = go_on(first)
        getattr(first, restore)(state)
        if go_on(first) != expected:
            differing.append("a state set back")
        getattr(second, restore)(getattr(second, read)(content))
        if go_on(second) != expected:
            differing.append("a state serialized and set in another instance")
        first.terminate()
        first.reset()
        begin(first)
        if go_on(first) != expected:
            differing.append("a run after reset")
        for slave in (first, second):
            slave.terminate()
            slave.freeInstance()
    except Exception as error:
        return {"failure": " ".join(str(error).split())}
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return {"differing": differing}


def main() -> None:
    """Do the job on stdin."""
    sys.meta_path.insert(0, _Closed())
    job = json.load(sys.stdin)
    jobs = {"simulate": simulate, "validate": validate, "states": states}
    answer = jobs[job["do"]](job)
    with open(job["answer"], "w", encoding="utf-8") as file:  # noqa: PTH123
        json.dump(answer, file)


if __name__ == "__main__":
    main()
