"""What `kr16 simulate` takes and gives: its options, the scenario they make, the run's files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.cli import batch, render, values
from kr16cli.cli import output as out
from kr16cli.errors import CheckFailedError, InputError

if TYPE_CHECKING:
    from kr16cli.robot import RobotData
    from kr16cli.simulate.scenario import Scenario

_SIX = ("1", "2", "3", "4", "5", "6")

Scene = Annotated[
    str | None,
    typer.Argument(metavar="SCENARIO", help="A scenario file, or a shipped one: free_swing."),
]
Q = Annotated[
    str | None,
    typer.Option("--q", metavar="A1 A2 A3 A4 A5 A6", help="Joint angles at the start, deg (rad)."),
]
Duration = Annotated[
    str | None, typer.Option("--duration", metavar="S", help="Length, s; 1 without a scenario.")
]
Torque = Annotated[
    str | None,
    typer.Option("--torque", metavar="KIND", help="zero, constant (--tau), gravity or csv."),
]
TorqueCsv = Annotated[
    str | None,
    typer.Option("--torque-csv", metavar="FILE", help="Columns time (s), tau1 to tau6 (N m)."),
]
OutputStep = Annotated[
    str | None, typer.Option("--output-step", metavar="S", help="Time between samples, 0.01 s.")
]
Method = Annotated[
    str | None,
    typer.Option(
        "--method",
        metavar="NAME",
        help="auto, DOP853, RK45, Radau, LSODA, RK4 or SemiImplicitEuler; auto is DOP853, "
        "with --drives LSODA.",
    ),
]
Step = Annotated[
    str | None,
    typer.Option("--step", metavar="S", help="Step of RK4 and SemiImplicitEuler, 0.004 s."),
]
Plot = Annotated[
    str | None, typer.Option("--plot", metavar="FILE.pdf", help="Draw the run; needs matplotlib.")
]
Rtol = Annotated[
    str | None, typer.Option("--rtol", metavar="X", help="Relative tolerance of a step, 1e-9.")
]
Atol = Annotated[
    str | None, typer.Option("--atol", metavar="X", help="Absolute tolerance, 1e-10 rad, rad/s.")
]


def scenario(p: Mapping[str, Any]) -> Scenario | None:
    """The scenario of a command's parameters, options before the file; None without either."""
    from kr16cli.simulate.scenario import with_options

    si = p["si"]
    q, qd = values.joints(p["q"], "--q", si=si), values.option(p["qd"], _SIX, "--qd")
    if p["scene"] is None and q is None:
        return None
    options = {
        "duration_s": _number(p, "duration"),
        "output_step_s": _number(p, "output_step"),
        "drives": p["drives"] or None,
        "gravity": values.option(p["gravity"], "XYZ", "--gravity"),
        "initial": {"q" if si else "q_deg": q, "qd" if si else "qd_deg_s": qd},
        "torque": _torque(p),
        "solver": {
            "method": p["method"], "rtol": _number(p, "rtol"), "atol": _number(p, "atol"),
            "step_s": _number(p, "step"),
        },
    }  # fmt: skip
    load = values.payload(p["payload"], p["load_data"], si=si)
    return with_options(p["scene"], options, load)


def _number(p: Mapping[str, Any], name: str) -> float | None:
    """One number of an option, or None where it was not given."""
    text = p[name]
    return None if text is None else values.number(text, f"--{name.replace('_', '-')}")


def _torque(p: Mapping[str, Any]) -> dict[str, Any] | None:
    """The torque that options ask for; --tau and --torque-csv say the kind themselves."""
    tau, file = values.option(p["tau"], _SIX, "--tau"), p["torque_csv"]
    kind = p["torque"] or ("constant" if tau else "csv" if file else None)
    if kind is None:
        return None
    table = {"kind": kind, "tau_nm": tau, "file": file}
    return {key: value for key, value in table.items() if value is not None}


def simulate(p: Mapping[str, Any], data: RobotData, asked: Scenario) -> None:
    """Simulate and write: the run as CSV or npz where asked for, else its summary.

    A run in a file leaves stdout to the summary.

    Raises:
        CheckFailedError: the solver failed; what there is of the run is written first.
    """
    file = p["output"] not in (None, "-")
    record = file and (p["format_"] or Path(p["output"]).suffix[1:]).lower() in ("csv", "npz")
    kind = out.choose_format(p["format_"], p["json"] and not record, p["output"])
    with out.Target(p["output"]) as target, _plot(p["plot"], p["output"]) as picture:
        from kr16cli.simulate.experiment import simulate as experiment
        from kr16cli.simulate.summary import envelope

        run = experiment(data, asked, on_step=_progress(asked.duration))
        answer = envelope(run, data)
        texts: dict[str, Callable[[], str | bytes]] = {
            "csv": run.to_csv, "npz": run.to_npz,
            "json": lambda: render.json_text(answer), "table": lambda: table(answer, si=p["si"]),
        }  # fmt: skip
        target.write(texts[kind]())
        if isinstance(picture, out.Target):
            from kr16cli.report.motion_figures import motion_pdf
            from kr16cli.study.bands import of_run

            picture.write(motion_pdf(run, data.joints, of_run(data, run)))
        if record:
            out.Target(None).write(texts["json" if p["json"] else "table"]())
    batch.warn(answer["warnings"])
    if run.failure:
        raise CheckFailedError(_failed(answer["result"]))


def _plot(file: str | None, output: str | None) -> AbstractContextManager[object]:
    """The file of a plot, opened; MissingPartError at once if it could not be drawn."""
    if file is None:
        return nullcontext()
    if Path(file).suffix.lower() != ".pdf":
        raise InputError(f"--plot {file}: the suffix must be .pdf")
    if output is not None and Path(file).resolve() == Path(output).resolve():
        raise InputError(f"--plot {file}: is the file of -o, too; give another name")
    from kr16cli.report.motion_figures import require_matplotlib

    require_matplotlib()
    return out.Target(file)


def _failed(result: Mapping[str, Any]) -> str:
    """The failure of a run with time and state, in one line."""
    final = result["final"]
    q, qd = (" ".join(f"{v:.6g}" for v in final[key]) for key in ("q", "qd"))
    return (
        f"the simulation ended at {final['time']:.6g} s: {result['failure']}; there q = {q} rad, "
        f"qd = {qd} rad/s; the part before is written and marked; try a looser rtol, more "
        "max_steps or smaller torques"
    )


def table(answer: Mapping[str, Any], *, si: bool = False) -> str:
    """The summary as a table: a line for each joint, then the pose, energies, events, solver."""
    from kr16cli import units

    result, solver = answer["result"], answer["result"]["solver"]
    final, far, energy = result["final"], result["extremes"], result["energy"]
    unit = "rad" if si else "deg"

    def column(numbers: Sequence[float], of: str) -> list[str]:
        turned = numbers if si else [units.deg(v) for v in numbers]
        return [render.shown(v, of) for v in turned]

    def torques(numbers: Sequence[float]) -> list[str]:
        return [f"{round(v, 3) + 0.0:.3f}" for v in numbers]

    joints = zip(
        far["joint"], column(final["q"], unit), column(far["q_min"], unit),
        column(far["q_max"], unit), column(final["qd"], unit), column(far["qd_max"], unit),
        torques(final["tau"]), torques(far["tau_max"]),
        strict=True,
    )  # fmt: skip
    header = ["", f"q {unit}", "min", "max", f"qd {unit}/s", "largest", "tau N m", "largest"]
    x, y, z, *abc = final["pose"]
    place = [v if si else units.mm(v) for v in (x, y, z)]
    length = "m" if si else "mm"
    shown = [*(render.shown(v, length) for v in place), *column(abc, unit)]
    balance = ("kinetic", "potential")
    return "\n".join(
        [
            f"{result['scenario']}: {answer['robot']}, {result['duration']:g} s, "
            f"{result['samples']} samples{'' if result['complete'] else ', INCOMPLETE'}",
            *render.grid(header, [list(row) for row in joints]),
            f"pose {length} {unit}: " + "  ".join(shown),
            "energy J, start to end: "
            + ", ".join(
                f"{k} {energy[f'{k}_initial']:.6g} to {energy[f'{k}_final']:.6g}" for k in balance
            ),
            f"  work of torques {energy['work_torque']:.6g}, lost in friction "
            f"{energy['work_friction']:.6g}, unexplained at most {energy['drift_max']:.1e}",
            *(
                f"  work of the {name} {energy[f'work_{name}']:.6g}"
                for name in ("wrench", "contact")
                if energy[f"work_{name}"]
            ),
            *(f"event at {e['time']:.6f} s: {e['joint']} {e['kind']}" for e in result["events"]),
            *([_tracking(result["tracking"], si=si)] if result["tracking"] else []),
            f"solver {solver['method']}, {_accuracy(solver)}: "
            f"{solver['steps']} steps, {solver['evaluations']} evaluations",
            "",
        ]
    )


def _tracking(tracking: Mapping[str, float], *, si: bool) -> str:
    """How far the flange was from its reference, in a line."""
    from kr16cli import units

    length, angle = (1.0, 1.0) if si else (units.mm(1.0), units.deg(1.0))
    shown = [
        f"{when} {length * tracking[f'position_{when}']:.3g} {'m' if si else 'mm'}, "
        f"{angle * tracking[f'angle_{when}']:.3g} {'rad' if si else 'deg'}"
        for when in ("largest", "final")
    ]
    return "flange from its reference: " + "; ".join(shown)


def _accuracy(solver: Mapping[str, Any]) -> str:
    if solver["step"] is not None:
        return f"step {solver['step']:g} s"
    return f"rtol {solver['rtol']:g}, atol {solver['atol']:g}"


def _progress(duration: float) -> Callable[[float], None]:
    """Shows simulated time on stderr, on a terminal only."""
    if sys.stderr is None or not sys.stderr.isatty():
        return lambda t: None

    def tick(t: float) -> None:
        end = "\r\x1b[K" if t >= duration else ""
        print(f"\r{t:.3f} of {duration:g} s{end}", end="", file=sys.stderr, flush=True)

    return tick
