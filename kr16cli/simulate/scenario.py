"""Scenarios, schema kr16.scenario/1: the start, the torques and the length of a simulation."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, cast

from kr16cli.assets import asset
from kr16cli.errors import FileError
from kr16cli.robot import Inertia6, Payload, Vector3
from kr16cli.simulate.motion_spec import (
    ControllerSpec,
    ReferenceSpec,
    Six,
    controller_of,
    limits_of,
    reference_of,
    wrench_of,
)
from kr16cli.simulate.plant import Limits, Wrench
from kr16cli.simulate.scenario_check import DEFAULT_STEP, FIXED, SCHEMA, problems_in
from kr16cli.units import rad

__all__ = [
    "Scenario",
    "Six",
    "SolverSpec",
    "TorqueSpec",
    "load_scenario",
    "parse_scenario",
    "read_table",
    "with_options",
]

Kind = Literal["zero", "constant", "gravity", "csv"]

FIXED_STEP = 0.004
"""Step of a method without error control where none is given, s."""

_ZEROS: Six = (0.0,) * 6


@dataclass(frozen=True)
class TorqueSpec:
    """Which joint torques are applied.

    `kind` is "zero", "constant" (`tau`, N m), "gravity" (compensates gravity, payload
    included) or "csv" (`file` with columns time and tau1 to tau6).
    """

    kind: Kind = "zero"
    tau: Six | None = None
    file: str | None = None


@dataclass(frozen=True)
class SolverSpec:
    """How the equations of motion are integrated.

    `method` is one of SciPy's solvers, or "RK4" or "SemiImplicitEuler" with a fixed `step` (s),
    shortened to fit between breaks. "auto" is LSODA with drives, whose friction makes joints
    nearly at rest stiff, RK4 under a sampled controller, else DOP853. `rtol` and `atol` (rad,
    rad/s) bound the error of an adaptive step; more than `max_steps` steps end the run as
    failed.
    """

    method: str = "auto"
    rtol: float = 1e-9
    atol: float = 1e-10
    max_steps: int = 100_000
    step: float | None = None


@dataclass(frozen=True)
class Scenario:
    """What is simulated: SI units, joint angles in rad.

    `gravity` (m/s2, robroot) is None for that of the robot's file; `output_step` (s) is the
    distance of the samples of the run, whose last is at `duration` (s) whatever the step.
    A `controller` drives the joints in place of `torque`, along the `reference`.
    """

    name: str
    q: Six
    qd: Six = _ZEROS
    duration: float = 1.0
    output_step: float = DEFAULT_STEP
    torque: TorqueSpec = TorqueSpec()
    payload: Payload | None = None
    drives: bool = False
    gravity: Vector3 | None = None
    solver: SolverSpec = SolverSpec()
    limits: Limits = field(default_factory=Limits)
    wrench: Wrench | None = None
    controller: ControllerSpec | None = None
    reference: ReferenceSpec | None = None
    description: str = ""
    folder: Path = field(default=Path(), compare=False)

    def solver_used(self) -> SolverSpec:
        """The solver with a method by name in place of "auto", and its step."""
        solver, loop = self.solver, self.controller
        if solver.method == "auto":
            sampled = loop is not None and loop.sampling is not None
            method = "LSODA" if self.drives else "RK4" if sampled else "DOP853"
            solver = replace(solver, method=method)
        if solver.method in FIXED and solver.step is None:
            return replace(solver, step=FIXED_STEP)
        return solver

    def describe(self) -> dict[str, Any]:
        """The scenario as a JSON-ready table in SI units; what is None is left out."""
        table = asdict(self)
        del table["folder"]
        return cast("dict[str, Any]", _plain(table))


def load_scenario(path: str | Path) -> Scenario:
    """Load and check a scenario.

    Args:
        path: a TOML file, or the name of a shipped one such as "free_swing".

    Raises:
        FileError: the file cannot be read or is no TOML.
        ParameterError: the first broken rule, with key, value and rule.
    """
    file = scenario_file(path)
    return parse_scenario(read_table(file), str(file), file.parent)


def with_options(
    path: str | Path | None, options: Mapping[str, Any], payload: Payload | None = None
) -> Scenario:
    """The scenario of a file with some of its values replaced.

    Args:
        path: as for `load_scenario`; None starts from a scenario of 1 s without torque.
        options: a table like a scenario file's; None, or an empty table, replaces nothing.
            The entries of `initial` and `solver` replace one by one, all else as a whole. A
            solver's method takes the place of what the file says to methods of the other kind.
        payload: replaces the file's.

    Raises:
        FileError, ParameterError: as `load_scenario`; the file itself must be sound.
    """
    table: dict[str, Any] = {"schema": SCHEMA, "name": "options", "duration_s": 1.0}
    folder = Path()
    if path is not None:
        file = scenario_file(path)
        table = read_table(file)
        parse_scenario(table, str(file))
        folder = file.parent
    given = {key: value for key, value in options.items() if value is not None}
    for key in ("initial", "solver"):
        own = {k: v for k, v in given.pop(key, {}).items() if v is not None}
        kept = {k: v for k, v in table.get(key, {}).items() if not _same(k, own)}
        table[key] = kept | own
        if "method" in own:
            foreign = ("rtol", "atol") if own["method"] in FIXED else ("step_s",)
            table[key] = {k: v for k, v in kept.items() if k not in foreign} | own
    if "torque" in given:  # it takes the place of a controller
        table.pop("controller", None)
        table.pop("reference", None)
    scenario = parse_scenario(table | given, "options", Path() if "torque" in given else folder)
    return scenario if payload is None else replace(scenario, payload=payload)


def _same(key: str, others: Mapping[str, Any]) -> bool:
    """Whether a quantity is among others, in whatever unit: q and q_deg, qd and qd_deg_s."""
    return key.partition("_deg")[0] in {other.partition("_deg")[0] for other in others}


def parse_scenario(table: Mapping[str, Any], path: str, folder: Path = Path()) -> Scenario:
    """Check the table of a scenario file and turn it into a Scenario.

    Args:
        table: what tomllib returns, or a mapping of the same shape.
        path: what messages call the file.
        folder: what a torque file's name is relative to.

    Raises:
        ParameterError: the first broken rule.
    """
    problems = problems_in(table, path)
    if problems:
        raise problems[0]
    defaults = Scenario(name="", q=_ZEROS)
    initial, gravity = table["initial"], table.get("gravity")
    return Scenario(
        name=table["name"],
        description=table.get("description", ""),
        q=_angles(initial, "q", "q_deg"),
        qd=_angles(initial, "qd", "qd_deg_s"),
        duration=float(table["duration_s"]),
        output_step=float(table.get("output_step_s", defaults.output_step)),
        torque=_torque(table.get("torque", {"kind": "zero"})),
        payload=_payload(table["payload"]) if "payload" in table else None,
        drives=table.get("drives", False),
        gravity=None if gravity is None else cast("Vector3", _numbers(gravity)),
        solver=_solver(table.get("solver", {})),
        limits=limits_of(table.get("limits", {})),
        wrench=wrench_of(table["wrench"]) if "wrench" in table else None,
        controller=controller_of(table["controller"]) if "controller" in table else None,
        reference=reference_of(table["reference"]) if "reference" in table else None,
        folder=folder,
    )


def scenario_file(path: str | Path) -> Path:
    """The file meant: a path, or a bare name among the shipped scenarios."""
    file = Path(path)
    if file.is_file():
        return file
    shipped = {found.stem: found for found in sorted(asset("data/scenarios").glob("*.toml"))}
    if str(path) in shipped:
        return shipped[str(path)]
    if file.exists():
        return file
    names = ", ".join(shipped)
    raise FileError(file, f"no such file, and no shipped scenario of that name; shipped: {names}")


def read_table(file: Path) -> dict[str, Any]:
    """The table of a scenario file; FileError with the reason where there is none."""
    try:
        return tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        reason = f"not UTF-8 text at byte {error.start}; save the file as UTF-8"
    except IsADirectoryError:
        reason = "is a directory; name a scenario file in it"
    except OSError as error:
        reason = f"cannot be read: {error.strerror or error}"
    except RecursionError:
        reason = "no TOML: nested too deeply"
    except ValueError as error:  # TOMLDecodeError says the line; others come from int()
        reason = f"no TOML: {' '.join(str(error).split())}"
    raise FileError(file, reason)


def _angles(initial: Mapping[str, Any], key: str, key_deg: str) -> Six:
    """Six angles or speeds, given in rad or in degrees; zeros where neither is."""
    if key_deg in initial:
        return cast("Six", tuple(rad(float(v)) for v in initial[key_deg]))
    return cast("Six", _numbers(initial.get(key, _ZEROS)))


def _solver(table: Mapping[str, Any]) -> SolverSpec:
    given = {key: value for key, value in table.items() if key != "step_s"}
    return SolverSpec(**given, step=table.get("step_s"))


def _torque(table: Mapping[str, Any]) -> TorqueSpec:
    tau = table.get("tau_nm")
    return TorqueSpec(
        kind=table["kind"],
        tau=None if tau is None else cast("Six", _numbers(tau)),
        file=table.get("file"),
    )


def _payload(table: Mapping[str, Any]) -> Payload:
    return Payload(
        mass=float(table["mass"]),
        com=cast("Vector3", _numbers(table.get("com", (0.0,) * 3))),
        inertia=cast("Inertia6", _numbers(table.get("inertia", _ZEROS))),
    )


def _numbers(values: Sequence[float]) -> tuple[float, ...]:
    """Floats without negative zeros."""
    return tuple(float(v) + 0.0 for v in values)


def _plain(value: Any) -> Any:
    """Tuples as lists, named ones as tables, as JSON has them; what is None is left out."""
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
