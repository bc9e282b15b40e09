"""What `kr16 sweep` takes and gives: its options, files, and the summary as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.cli import render, studies, values
from kr16cli.errors import CheckFailedError

if TYPE_CHECKING:
    from kr16cli.robot import RobotData
    from kr16cli.study.sweep import SweepWork

Scene = Annotated[
    str | None,
    typer.Argument(metavar="SCENARIO", help="A scenario file, or a shipped one: ptp_16kg."),
]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="PATH=VALUES",
        help="What to vary: LOW:HIGH:COUNT, V,V,.., LOW:HIGH or MEAN+-SIGMA; x before it makes "
        "factors. Paths are those of the scenario's and the robot's file: payload.mass, "
        "controller.kp[2], link[3].com[1]. May be repeated.",
    ),
]
MonteCarlo = Annotated[
    str | None, typer.Option("--monte-carlo", metavar="N", help="N random runs.")
]
Latin = Annotated[
    str | None, typer.Option("--latin", metavar="N", help="N runs of a Latin hypercube.")
]
Seed = Annotated[str, typer.Option("--seed", metavar="S", help="Of the random numbers.")]
Simulator = Annotated[
    bool,
    typer.Option("--simulator", help="Run all in the simulator, one by one; it is much slower."),
]


def work(p: Mapping[str, Any], data: RobotData) -> SweepWork:
    """The sweep that options ask for."""
    from kr16cli.study.design import design
    from kr16cli.study.sweep import sweep_of

    return sweep_of(
        data.path,
        p["scene"],
        design(
            p["vary"] or (),
            latin=values.whole(p["latin"], "--latin", 1, 10**8),
            monte_carlo=values.whole(p["monte_carlo"], "--monte-carlo", 1, 10**8),
            seed=values.whole(p["seed"], "--seed", 0, 2**63) or 0,
        ),
        simulator=p["simulator"],
    )


def make(p: Mapping[str, Any], data: RobotData) -> None:
    """Run the sweep, write and draw it, and tell its summary.

    Raises:
        CheckFailedError: some runs failed; all is written first.
    """
    asked = work(p, data)
    from kr16cli.study import sweep_facts, tables

    file = studies.data_file(p, tables.SUFFIXES)
    if file is not None:
        tables.require(file)
    with studies.picture(p, p["output"]) as draw, studies.carried_out(p, asked, file) as store:
        columns = sweep_facts.whole(asked, store)
        answer = sweep_facts.answer(asked, columns)
        if file is not None:
            tables.write(file, asked, store, answer)
        if draw is not None:
            from kr16cli.report.sweep_figures import sweep_drawn

            draw(sweep_drawn(answer, columns, str(p["plot"])))
    studies.tell(p, file, answer, table)
    failed = answer["result"]["failed"]
    if failed:
        first = answer["result"]["failures"][0]
        raise CheckFailedError(
            f"{failed} of {answer['result']['runs']} runs failed, the first of them run "
            f"{first['run']}: {first['reason']}; the column status tells of each"
        )


def table(answer: Mapping[str, Any]) -> str:
    """The summary as text."""
    result, units = answer["result"], answer["units"]
    varied = result["vary"]
    runs = result["runs"]
    lines = [
        f"{answer['input']['scenario']['name']}: {answer['robot']}, {runs} run{'s' * (runs > 1)}, "
        f"{result['design']}, {result['failed']} failed",
        *_ran(result),
        *(
            f"  {path} from {v['least']:.6g} to {v['largest']:.6g} {units.get(path, '')}".rstrip()
            for path, v in varied.items()
        ),
    ]
    rows = []
    for name, told in result["figures"].items():
        if told is None or not told["varies"]:
            continue
        unit = units.get(name) or units.get(name.rpartition("_")[0]) or ""
        ranks = [told["rank_correlation"][path] for path in varied]
        rows.append(
            [
                f"{name} {'' if unit == '1' else unit}".rstrip(),
                *(f"{told[k]:.5g}" for k in ("least", "mean", "largest", "sigma")),
                *("-" if r is None else f"{r:+.2f}" for r in ranks),
            ]
        )
    still = [n for n, told in result["figures"].items() if told and not told["varies"]]
    if still:
        lines.append(f"  unchanged: {', '.join(_folded(still))}")
    if rows:
        header = ["", "least", "mean", "largest", "sigma", *(f"rank {path}" for path in varied)]
        lines += render.grid(header, rows)
    return "\n".join([*lines, ""])


def _ran(result: Mapping[str, Any]) -> list[str]:
    """Who ran how many, and why not the compiled solvers."""
    words = {
        "rollout": "by the compiled solvers: {} of {}",
        "simulator": "in the simulator: {} of {}",
    }
    why = result["why_simulator"]
    return [
        f"  {words[name].format(count, result['runs'])}"
        + (f"; {why}" if name == "simulator" and why else "")
        for name, count in result["engines"].items()
    ]


def _folded(names: Sequence[str]) -> list[str]:
    """Names of numbers; of figures with a number for each joint, the figure if all are there."""
    stems = [name.rpartition("_")[0] for name in names]
    whole = {stem for stem in stems if stems.count(stem) == 6}
    folded = (stem if stem in whole else n for n, stem in zip(names, stems, strict=True))
    return list(dict.fromkeys(folded))
