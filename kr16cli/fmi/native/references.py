"""Reference results and parameters inside an FMU, as the layered standard FMI-LS-REF has them.

https://modelica.github.io/fmi-ls-ref/main/: a manifest that lists files and their roles; here a
CSV with the default experiment and a parameter set (SSV of SSP 1.0).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache, partial
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from kr16cli.errors import InputError
from kr16cli.fmi import written
from kr16cli.fmi.description import word
from kr16cli.fmi.machine import Machine
from kr16cli.fmi.native.table import Item
from kr16cli.fmi.native.xmltext import xml
from kr16cli.fmi.variables import TYPES, UNITS, Part, Variable
from kr16cli.fmi.written_arm import WrittenArm
from kr16cli.kernels.straight_arm import Functions
from kr16cli.robot import RobotData

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
_MANIFEST = "http://fmi-standard.org/fmi-ls-manifest"
_ROWS = 50
_DIGITS = 10
_MOST = 2500
"""Internal steps, so that a build takes no longer than some seconds."""


class Results(NamedTuple):
    """Reference results: names of outputs, and rows of time (s) and their values, SI units.

    `whole` says whether they last as long as the experiment.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    whole: bool = True

    @property
    def stop(self) -> float:
        """The last time, s."""
        return self.rows[-1][0]

    def told(self) -> str:
        """What is in them, in words."""
        part = "" if self.whole else "the first "
        return f"{len(self.rows)} samples over {part}{self.stop:g} s"

    def csv(self) -> bytes:
        """A row a sample, numbers rounded to ten digits."""
        head = ",".join(["time", *self.names])
        lines = (",".join(f"{v + 0.0:.{_DIGITS}g}" for v in row) for row in self.rows)
        return "\n".join([head, *lines, ""]).encode()


def sample_places(stop: float, step: float) -> list[int]:
    """After which communication steps (of `step` s) a sample is taken: at most 52, to `stop`."""
    count = max(1, round(stop / step))
    return [*range(0, count, -(-count // _ROWS)), count]


@lru_cache(maxsize=1)
def functions() -> Functions:
    """The model's functions on plain floats, written out."""
    return written.functions(written.python())


def results(
    data: RobotData, known: Sequence[Variable], part: Part, stop: float, step: float
) -> Results:
    """The default experiment by the direct simulator: no input connected, its own internal steps.

    The model runs on plain floats, so that equal input gives equal bytes on every machine. Where
    internal steps are many, or a step fails, only the first part is there.

    Args:
        data: the robot.
        known: the table of variables, as for the pythonfmu FMU, with their start values.
        part: the robot or its controller.
        stop: end of the experiment, s.
        step: communication step, s.

    Raises:
        InputError: the start values cannot be used.
    """
    machine = Machine(known, data, partial(WrittenArm, functions=functions()), part)
    wanted = [
        place for place, v in enumerate(known) if v.causality == "output" and v.base == "Real"
    ]
    machine.enter()
    machine.leave()
    inner = min((v.start for v in known if v.name == "solver.step"), default=step)
    last = min(stop, max(step, _MOST * inner))
    wished = set(sample_places(last, step))
    rows = []
    for k in range(max(wished) + 1):
        try:
            if k:
                machine.step((k - 1) * step, step)
            if k in wished:
                rows.append((k * step, *machine.get(wanted)))
        except InputError:
            if not rows:
                raise
            last = rows[-1][0]
            break
    return Results(tuple(known[place].name for place in wanted), tuple(rows), last == stop)


def parameter_set(listed: Iterable[Item], name: str, description: str) -> Element:
    """An SSV document with the start values of all parameters that are scalars.

    Args:
        listed: the variables.
        name: of the parameter set.
        description: of it.
    """
    root = Element("ssv:ParameterSet", {
        "xmlns:ssc": SSC, "xmlns:ssv": SSV, "version": "1.0", "name": name,
        "description": description,
    })  # fmt: skip
    parameters = SubElement(root, "ssv:Parameters")
    used: set[str] = set()
    for item in listed:
        v = item.first
        if v.causality != "parameter" or len(item.members) > 1:
            continue
        unit = TYPES[v.type].unit
        used.add(unit)
        element = SubElement(parameters, "ssv:Parameter", {"name": v.name})
        value = SubElement(element, f"ssv:{v.base}", {"value": word(v.start)})
        if unit:
            value.set("unit", unit)
    units(root, used, "ssv:Units")
    return root


def units(root: Element, used: set[str], tag: str) -> None:
    """The definitions of the units that are used, below `root`."""
    found = [(name, unit) for name, unit in UNITS.items() if name in used]
    if not found:
        return
    listed = SubElement(root, tag)
    for name, unit in found:
        exponents = {key: getattr(unit, key) for key in ("kg", "m", "s", "rad")}
        element = SubElement(listed, "ssc:Unit", {"name": name})
        SubElement(element, "ssc:BaseUnit", {k: str(n) for k, n in exponents.items() if n})


def files(found: Results, listed: Sequence[Item]) -> dict[str, bytes]:
    """Contents by path in the FMU.

    Args:
        found: the reference results.
        listed: the variables.
    """
    few = any(len(item.members) > 1 for item in listed)
    what = "Start values of the parameters" + (" that are scalars" if few else "")
    shown = f"Default experiment, no input connected: {found.told()}"
    parameters = parameter_set(listed, "parameters", what)
    return {
        f"{FOLDER}/fmi-ls-manifest.xml": xml(_manifest((
            ("text/csv", "reference.csv", "result", shown),
            ("application/x-ssp-parameter-set", "parameters.ssv", "parameter", what),
        ))),
        f"{FOLDER}/reference.csv": found.csv(),
        f"{FOLDER}/parameters.ssv": xml(parameters),
    }  # fmt: skip


def _manifest(related: Iterable[tuple[str, str, str, str]]) -> Element:
    """The manifest: type, source, role and description of each file."""
    root = Element("fmiReferences", {
        "xmlns:fmi-ls": _MANIFEST,
        "fmi-ls:fmi-ls-name": "org.fmi-standard.fmi-ls-ref",
        "fmi-ls:fmi-ls-version": "1.0.0-alpha.1",
        "fmi-ls:fmi-ls-description":
            "Layered Standard providing information on related files included in an FMU.",
    })  # fmt: skip
    keys = ("type", "source", "role", "description")
    for row in related:
        SubElement(root, "Related", dict(zip(keys, row, strict=True)))
    return root
