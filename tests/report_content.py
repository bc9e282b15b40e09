"""Contents of reports for tests: results, drawings and files as suites and commands make them."""

from __future__ import annotations

import dataclasses
import datetime as dt
from functools import cache
from typing import Any

from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure

import kr16cli
from kr16cli.report import build, fmus, times
from kr16cli.report.content import Content, Evidence, outline
from kr16cli.report.page import HEIGHT, WIDTH
from kr16cli.report.style import styled
from kr16cli.simulate.run import Run
from kr16cli.verify import registry
from kr16cli.verify.records import Result, Setting

WHEN = dt.datetime(2026, 1, 2, tzinfo=dt.UTC)
_RUN = (  # quick cases of every suite that have no figures or whose figures are real and cheap
    "kinematics.closed-form", "kinematics.rpy", "inverse.closure.generic",
    "inverse.closure.near-wrist", "inverse.closure.near-wrist-pi", "inverse.complete",
    "velocity.difference", "velocity.determinant", "dynamics.sum-of-terms", "dynamics.power",
    "datasheet.numbers", "datasheet.reach", "datasheet.masses", "chapter.wrist",
    "chapter.singularities",
)  # fmt: skip


def made_result(id: str, **changes: Any) -> Result:
    """A result that no suite made, for pages whose cases are too slow here."""
    plain = Result(
        id=id, group=id.partition(".")[0], title=f"Title of {id}", statement="a = b",
        regime="somewhere", method="two ways", grade="C", error=2e-9, tolerance=1e-8, unit="rad",
        reason="rounding", status="passed", samples=12, seed=20161,
        worst={"command": "kr16 fk 1.5 2.5 -3.5 4.5 5.5 6.5"}, evidence="twelve samples",
    )  # fmt: skip
    return dataclasses.replace(plain, **changes)


Word = tuple[str, float, tuple[float, float, float, float]]
"""Text, size, and the box it fills: left, top, right, bottom in points."""


@cache
def made_results() -> tuple[Result, ...]:
    cases = [c for c in registry.cases(registry.SUITES) if c.id in _RUN]
    real = list(registry.run(cases, Setting(kr16cli.load_robot(), quick=True)))
    assert [r.id for r in real if r.status != "passed"] == []
    seconds = [0.1 * i for i in range(21)]
    steps = [0.04, 0.02, 0.01]
    order = {
        "Runge-Kutta step": steps,
        "Runge-Kutta error": [h**4 for h in steps],
        "Euler step": [0.1 * h for h in steps],
        "Euler error": list(steps),
    }
    made = [
        made_result("simulation.order", figures=order),
        made_result("simulation.energy", figures={"time": seconds, "drift": [1e-13] * 21}),
        made_result("simulation.tolerance", figures={"time": seconds, "gap": [1e-12] * 21}),
        made_result(
            "engines.pinocchio.motion",
            title="Pinocchio: a simulated motion",
            figures={"time": seconds, "gap": [1e-13] * 21},
        ),
        made_result(
            "engines.toolbox.fk",
            status="skipped",
            error=None,
            worst={},
            samples=0,
            evidence="roboticstoolbox is not installed",
        ),
    ]
    return (*real, *made)


def content_of(
    kind: str = "verification",
    results: tuple[Result, ...] | None = None,
    robot: kr16cli.Robot | None = None,
    **evidence: Any,
) -> Content:
    plan = outline(kind)
    robot = robot or kr16cli.load_robot()
    shown = tuple(r for r in results or made_results() if r.group in plan.suites)
    found = Evidence(shown, 20161, True, "made by a test", **evidence)
    made, absent = _drawings(kind, robot.data.path, found.run is not None)
    return Content(plan, robot.data, found, made, absent, WHEN)


@cache
def _drawings(kind: str, path: str, recorded: bool) -> tuple[dict[str, Any], dict[str, str]]:
    evidence = Evidence((), None, None, "", run=recorded_run() if recorded else None)
    return build.drawn(outline(kind), Setting(kr16cli.load_robot(path), quick=True), evidence)


class _Recorder(RendererBase):
    """Draws nothing, and keeps the box of every word that would be drawn."""

    def __init__(self) -> None:
        super().__init__()
        self.words: list[Word] = []

    def get_canvas_width_height(self) -> tuple[float, float]:
        return WIDTH, HEIGHT

    def draw_path(self, *args: Any, **kwargs: Any) -> None:
        pass

    def draw_image(self, *args: Any, **kwargs: Any) -> None:
        pass

    def draw_text(self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float,
                  ismath: Any = False, mtext: Any = None) -> None:  # fmt: skip
        w, h, d = self.get_text_width_height_descent(s, prop, ismath)
        box = (x, y - h + d, x + w, y + d)
        if angle:
            assert angle == 90
            box = (x - h + d, y - w, x + d, y)
        self.words.append((s, float(prop.get_size()), box))


@cache
def figures_of(kind: str) -> list[Figure]:
    with styled():
        return build.compose(content_of(kind, **extras_of(kind))).finish()


def extras_of(kind: str) -> dict[str, Any]:
    """What only files bring: FMUs on several hosts, times, a recorded motion."""
    if kind == "verification":
        return {"fmus": tuple(fmus.cases(fmu_table())), "bench": times.read(bench_answer())}
    return {"run": recorded_run()} if kind == "simulation" else {}


def fmu_row(**changes: Any) -> dict[str, Any]:
    sizes = {"q": ("rad", 0.0), "qd": ("rad/s", 2e-13), "tau_applied": ("N.m", 3e-11)}
    deviations = [
        {"group": g, "largest": size, "unit": unit, "time": 0.3, "relative": size}
        for g, (unit, size) in sizes.items()
    ]
    plain = {
        "file": "KR16.fmu", "fmi_version": "2.0", "interface": "co-simulation",
        "host": "FMPy 0.3", "platform": "Linux x86_64", "passed": True, "problems": [],
        "tolerance": 1e-9, "steps": 100, "deviations": deviations,
    }  # fmt: skip
    return plain | changes


def fmu_table(*rows: dict[str, Any]) -> dict[str, Any]:
    tau = {"group": "tau", "largest": 3e-13, "unit": "N.m", "time": 0.1, "relative": 3e-15}
    usual = (
        fmu_row(),
        fmu_row(host="Ecos 0.7"),
        fmu_row(file="KR16_controller.fmu", deviations=[tau]),
        fmu_row(interface="model-exchange", fmi_version="3.0", platform="Windows x86_64 (wine)"),
    )
    data = kr16cli.load_data()
    return {
        "schema": "kr16.fmu_table/1",
        "robot": data.name,
        "model_sha256": data.sha256,
        "result": {"rows": list(rows or usual)},
    }


def bench_answer() -> dict[str, Any]:
    fk = {"quantity": "fk", "batch_ns": 41.25, "threads_ns": 22.0, "call_ns": 900.0,
          "peers": {"Pinocchio": 310.0, "MuJoCo": 900.0}, "ratio": 7.5, "gflop_s": 2.5,
          "gb_s": 9.0, "share": 0.625, "call_ratio": 2.25}  # fmt: skip
    gravity = {"quantity": "gravity", "batch_ns": 20.0, "threads_ns": 11.0, "call_ns": 800.0}
    return {
        "schema": "kr16.bench/1",
        "input": {"threads": 2},
        "result": {
            "engine": "native",
            "machine": {"cores": 2},
            "limits": {"gflop_s": 63.0, "read_gb_s": 12.0, "write_gb_s": 15.0},
            "rows": [fk, gravity],
        },
        "warnings": ["times drift"],
    }


@cache
def recorded_run() -> Run:
    from kr16cli.simulate.experiment import simulate
    from kr16cli.simulate.scenario import Scenario

    scenario = Scenario("rest", q=(0.0, -1.5, 1.5, 0.0, 0.3, 0.0), duration=0.1, output_step=0.01)
    return simulate(kr16cli.load_data(), scenario)


def _words(figure: Figure) -> list[Word]:
    recorder = _Recorder()
    with styled():
        figure.draw(recorder)
    return recorder.words


@cache
def drawn_words(kind: str) -> list[list[Word]]:
    """The words of every page of a report."""
    return [_words(figure) for figure in figures_of(kind)]


def said_by(content: Content) -> list[str]:
    """All words of a report's pages but those of its figures."""
    with styled():
        document = build.compose(content)
    document.finish()
    return [piece.text for page in document.pages for piece in page.words.pieces]


def saved_results(kind: str, **changes: Any) -> dict[str, Any]:
    """What `kr16 verify --json` saves when it keeps the figures."""
    data = kr16cli.load_data()
    suites = outline(kind).suites
    cases = [dataclasses.asdict(r) for r in made_results() if r.group in suites]
    return {
        "schema": "kr16.verify/1",
        "robot": data.name,
        "model_sha256": data.sha256,
        "input": {"suites": suites, "quick": True, "seed": 20161},
        "result": {"cases": cases},
    } | changes


def left_out(kind: str, robot: str | None = None) -> dict[str, str]:
    content = content_of(kind, robot=kr16cli.load_robot(robot) if robot else None)
    with styled():
        build.compose(content)
    return content.left_out
