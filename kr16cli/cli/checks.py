"""What `kr16 verify` takes and gives: its options, running the cases, and writing the results."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from kr16cli.assets import asset
from kr16cli.cli import output as out
from kr16cli.cli import render, rows, run
from kr16cli.cli.progress import Bar
from kr16cli.errors import FileError, InputError

if TYPE_CHECKING:
    from kr16cli.robot import RobotData
    from kr16cli.verify.records import Case, Result, Setting

_DEFAULT_SEED = 20161

Suite = Annotated[
    list[str] | None,
    typer.Option("--suite", metavar="NAME", help="Only this suite; may be repeated. Default: all."),
]
Quick = Annotated[bool, typer.Option("--quick", help="Fewer samples: seconds instead of minutes.")]
Seed = Annotated[
    str | None, typer.Option("--seed", metavar="N", help=f"Of all samples; {_DEFAULT_SEED}.")
]
Junit = Annotated[
    str | None, typer.Option("--junit", metavar="FILE", help="Write the cases as JUnit XML too.")
]
List = Annotated[bool, typer.Option("--list", help="Name the cases and run none.")]
SelfTest = Annotated[
    bool,
    typer.Option("--self-test", help="Seed faults in the model: does a case see each of them?"),
]
Figures = Annotated[
    bool, typer.Option("--figures", help="With --json: what reports draw, for kr16 report --from.")
]
UrdfFile = Annotated[str, typer.Argument(metavar="FILE.urdf", help="A URDF of this arm.")]
PoseFile = Annotated[
    str,
    typer.Argument(
        metavar="FILE.csv",
        help="Columns a1..a6 and x,y,z,a,b,c, in deg and mm; example_poses is a made-up one.",
    ),
]


def suites(ctx: typer.Context) -> int:
    """Run the suites asked for and write the results; 1 if a case failed."""
    from kr16cli.verify import registry, report_text

    if ctx.params.get("self_test"):
        return _self_test(ctx)
    names = [w for word in ctx.params.get("suite") or ["all"] for w in word.split(",") if w]
    cases = registry.cases(registry.SUITES if "all" in names else names)
    if ctx.params.get("list_"):
        sys.stdout.write(report_text.listing(cases))
        return 0
    setting = make_setting(ctx)
    inputs = {"suites": names, "quick": setting.quick, "seed": setting.seed}
    with _Targets(ctx) as targets:
        results = _run(cases, setting)
        return targets.write(setting.robot.data, inputs, results)


def _self_test(ctx: typer.Context) -> int:
    """Seed faults and write what became of each; 1 if one survives without a reason."""
    from kr16cli.robot_file import load_data
    from kr16cli.verify import fault_text, selftest

    setting = make_setting(ctx)
    if setting.robot.data.sha256 != load_data().sha256:
        raise InputError("--self-test seeds faults in the shipped robot; leave --robot out")
    if ctx.params.get("suite"):
        raise InputError("--self-test runs the suites it needs; leave --suite out")
    seeded = selftest.chosen(setting.seed, quick=setting.quick)
    inputs = {"self_test": True, "quick": setting.quick, "seed": setting.seed}
    with _Targets(ctx) as targets:
        found = {}
        with Bar() as bar:
            for fault in selftest.run(seeded, setting.seed):
                found[fault.mutant.id] = fault
                bar.show(len(found), len(seeded), f" {fault.mutant.id}")
        faults = [found[mutant.id] for mutant in seeded]
        extra = fault_text.counts(faults) | {"faults": [f.entry() for f in faults]}
        targets.write(setting.robot.data, inputs, [], extra, fault_text.table(faults))
    return 0 if all(fault.explained for fault in faults) else 1


def chapter(ctx: typer.Context) -> int:
    """Judge every equation of the chapter; 1 if a verdict is not proved."""
    from kr16cli.verify.chapter import audit, to_json

    setting = make_setting(ctx)
    inputs = {"quick": setting.quick, "seed": setting.seed}
    with _Targets(ctx) as targets:
        equations = audit(setting)
        proved = [e.proved for e in equations]
        extra = {"equations": [to_json(e) for e in equations]}
        lines = render.grid(
            ["equation", "verdict", "proved", "says"],
            [[_label(e), e.verdict, "yes" if e.proved else "NO", e.says] for e in equations],
        )
        text = "\n".join([*lines, "", f"{sum(proved)} of {len(proved)} verdicts are proved", ""])
        code = targets.write(setting.robot.data, inputs, [], extra, text)
    return code if all(proved) else 1


def _label(equation: Any) -> str:
    part = equation.part
    return equation.id if part is None else f"{equation.id}[{','.join(map(str, part))}]"


def model(ctx: typer.Context, file: str) -> int:
    """Compare a URDF with the robot; 1 if something differs."""
    from kr16cli.verify import urdf_check

    data = run.load(ctx)
    with _Targets(ctx) as targets:
        return targets.write(data, {"file": file}, urdf_check.check(data, file))


def poses(ctx: typer.Context, file: str) -> int:
    """Compare recorded poses with the robot; 1 if something differs."""
    import numpy as np

    from kr16cli import kuka, units
    from kr16cli.verify import pose_check, report_text

    data, si = run.load(ctx), bool(_parameter(ctx, "si"))
    with _Targets(ctx) as targets:
        shipped = file == "example_poses" and not Path(file).exists()
        if shipped and si:
            raise InputError("example_poses is in mm and degrees; leave out --si")
        source = str(asset(f"data/reference/{file}.csv")) if shipped else file
        pairs = list(rows.read(source, "q", ("pose",), si=si).rows)
        for i, row in enumerate(pairs, 1):
            if row.problem or len(row.values.get("pose", ())) != 6:
                reason = row.problem or "no pose; the header must name x, y, z, a, b, c as well"
                raise FileError(file, f"row {i}: {reason}")
        q = np.array([[v if si else units.rad(v) for v in row.values["q"]] for row in pairs])
        T = np.array([kuka.matrix_from_pose(row.values["pose"], si=si) for row in pairs])
        found = pose_check.check(data, q, T, si=si)
        extra = {
            "base": _pose(found.base),
            "tool": _pose(found.tool),
            "recorded": found.recorded,
            "rows": found.rows,
        }
        length, angle = ("m", "rad") if si else ("mm", "deg")
        fitted = render.grid(
            ["best fit", *(f"{n} {length if n in 'XYZ' else angle}" for n in kuka.POSE_FIELDS)],
            [
                [name, *(render.shown(v, length) for v in pose)]
                for name, pose in (("base", found.base), ("tool", found.tool))
            ],
        )
        text = report_text.table(found.results) + "\n" + "\n".join(fitted) + "\n"
        frames = {"base": f"{length} {angle}", "tool": f"{length} {angle}"}
        inputs = {"file": file, "si": si}
        return targets.write(data, inputs, found.results, extra, text, frames)


def _pose(pose: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyzabc", (v + 0.0 for v in pose), strict=True))


def make_setting(ctx: typer.Context) -> Setting:
    """The robot, the seed and whether to be quick, of --robot, --seed and --quick."""
    from kr16cli.api import Robot
    from kr16cli.verify.records import Setting

    text = _parameter(ctx, "seed")
    try:
        seed = _DEFAULT_SEED if text is None else int(text)
    except ValueError:
        raise InputError(f"--seed is {text}; it must be a whole number, 0 or more") from None
    if seed < 0:
        raise InputError(f"--seed is {seed}; it must be 0 or more")
    return Setting(Robot(run.load(ctx)), seed, bool(_parameter(ctx, "quick")))


def _parameter(ctx: typer.Context, name: str) -> Any:
    """An option of a command, given after it or before it."""
    here: Any = ctx
    while here is not None:
        if here.params.get(name):
            return here.params[name]
        here = here.parent
    return None


def _run(cases: Sequence[Case], setting: Setting) -> list[Result]:
    """Run the cases with a bar on a terminal's stderr."""
    from kr16cli.verify import registry

    results: list[Result] = []
    with Bar() as bar:
        for result in registry.run(cases, setting):
            results.append(result)
            bar.show(len(results), len(cases), f" {result.id}")
    return results


class _Targets:
    """The outputs of a verification, opened before the work starts."""

    def __init__(self, ctx: typer.Context) -> None:
        output = _parameter(ctx, "output")
        self._kind = out.choose_format(
            _parameter(ctx, "format_"), bool(_parameter(ctx, "json")), output, ("table", "json")
        )
        self._stack = ExitStack()
        self._main, self._file = out.Target(output), _parameter(ctx, "junit")
        self._junit = out.Target(self._file)
        self._figures = bool(_parameter(ctx, "figures"))

    def __enter__(self) -> _Targets:
        self._stack.enter_context(self._main)
        self._stack.enter_context(self._junit)
        return self

    def __exit__(self, *details: object) -> None:
        self._stack.close()

    def write(
        self,
        data: RobotData,
        inputs: Mapping[str, Any],
        results: Sequence[Result],
        extra: Mapping[str, Any] | None = None,
        text: str | None = None,
        units: Mapping[str, str] | None = None,
    ) -> int:
        """Write what was found, whole; 1 if a case failed."""
        from kr16cli.verify import report_text as text_of

        counts = text_of.counts(results)
        if self._kind == "json":
            found = (
                counts
                | {"cases": [text_of.entry(r, figures=self._figures) for r in results]}
                | dict(extra or {})
            )
            envelope = {
                "schema": "kr16.verify/1",
                "robot": data.name,
                "model_sha256": data.sha256,
                "units": {"error": "as `unit` of each case", **(units or {})},
                "input": dict(inputs),
                "result": found,
                "warnings": [],
            }
            self._main.write(render.json_text(envelope))
        else:
            self._main.write(text_of.table(results) if text is None else text)
        if self._file is not None:
            self._junit.write(text_of.junit(results, f"kr16 verify, {data.name}"))
        return 1 if counts["failed"] else 0
