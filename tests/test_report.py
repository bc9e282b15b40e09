"""Reports: what pages say, that nothing overlaps or leaves the sheet, and equal bytes."""

from __future__ import annotations

import dataclasses
import datetime as dt
import itertools
import json
import os
import subprocess
import sys
import time
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import kr16cli
from command_line import complains, kr16
from kr16cli.report import build, fmus, times, typeset
from kr16cli.report.content import KINDS, Content, Evidence, outline
from kr16cli.report.page import HEIGHT, WIDTH, Page, to_pdf
from kr16cli.report.sources import read
from kr16cli.report.style import number, styled
from kr16cli.simulate.run import Run
from kr16cli.study.bands import of_motion
from kr16cli.study.uncertainty import torque_bands
from kr16cli.verify import registry
from kr16cli.verify.records import Result, Setting

_WHEN = dt.datetime(2026, 1, 2, tzinfo=dt.UTC)
_RUN = (  # quick cases of every suite that have no figures or whose figures are real and cheap
    "kinematics.closed-form", "kinematics.rpy", "inverse.closure.generic",
    "inverse.closure.near-wrist", "inverse.closure.near-wrist-pi", "inverse.complete",
    "velocity.difference", "velocity.determinant", "dynamics.sum-of-terms", "dynamics.power",
    "datasheet.numbers", "datasheet.reach", "datasheet.masses", "chapter.wrist",
    "chapter.singularities",
)  # fmt: skip


def _made(id: str, **changes: Any) -> Result:
    """A result that no suite made, for pages whose cases are too slow here."""
    plain = Result(
        id=id, group=id.partition(".")[0], title=f"Title of {id}", statement="a = b",
        regime="somewhere", method="two ways", grade="C", error=2e-9, tolerance=1e-8, unit="rad",
        reason="rounding", status="passed", samples=12, seed=20161,
        worst={"command": "kr16 fk 1.5 2.5 -3.5 4.5 5.5 6.5"}, evidence="twelve samples",
    )  # fmt: skip
    return dataclasses.replace(plain, **changes)


_Word = tuple[str, float, tuple[float, float, float, float]]
"""Text, size, and the box it fills: left, top, right, bottom in points."""


@cache
def _results() -> tuple[Result, ...]:
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
        _made("simulation.order", figures=order),
        _made("simulation.energy", figures={"time": seconds, "drift": [1e-13] * 21}),
        _made("simulation.tolerance", figures={"time": seconds, "gap": [1e-12] * 21}),
        _made(
            "engines.pinocchio.motion",
            title="Pinocchio: a simulated motion",
            figures={"time": seconds, "gap": [1e-13] * 21},
        ),
        _made(
            "engines.toolbox.fk",
            status="skipped",
            error=None,
            worst={},
            samples=0,
            evidence="roboticstoolbox is not installed",
        ),
    ]
    return (*real, *made)


def _content(
    kind: str = "verification",
    results: tuple[Result, ...] | None = None,
    robot: kr16cli.Robot | None = None,
    **evidence: Any,
) -> Content:
    plan = outline(kind)
    robot = robot or kr16cli.load_robot()
    shown = tuple(r for r in results or _results() if r.group in plan.suites)
    found = Evidence(shown, 20161, True, "made by a test", **evidence)
    made, absent = _drawings(kind, robot.data.path, found.run is not None)
    return Content(plan, robot.data, found, made, absent, _WHEN)


@cache
def _drawings(kind: str, path: str, recorded: bool) -> tuple[dict[str, Any], dict[str, str]]:
    evidence = Evidence((), None, None, "", run=_run() if recorded else None)
    return build.drawn(outline(kind), Setting(kr16cli.load_robot(path), quick=True), evidence)


class _Recorder(RendererBase):
    """Draws nothing, and keeps the box of every word that would be drawn."""

    def __init__(self) -> None:
        super().__init__()
        self.words: list[_Word] = []

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
def _figures(kind: str) -> list[Figure]:
    with styled():
        return build.compose(_content(kind, **_extras(kind))).finish()


def _extras(kind: str) -> dict[str, Any]:
    """What only files bring: FMUs on several hosts, times, a recorded motion."""
    if kind == "verification":
        return {"fmus": tuple(fmus.cases(_fmu_table())), "bench": times.read(_bench())}
    return {"run": _run()} if kind == "simulation" else {}


def _fmu_row(**changes: Any) -> dict[str, Any]:
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


def _fmu_table(*rows: dict[str, Any]) -> dict[str, Any]:
    tau = {"group": "tau", "largest": 3e-13, "unit": "N.m", "time": 0.1, "relative": 3e-15}
    usual = (
        _fmu_row(),
        _fmu_row(host="Ecos 0.7"),
        _fmu_row(file="KR16_controller.fmu", deviations=[tau]),
        _fmu_row(interface="model-exchange", fmi_version="3.0", platform="Windows x86_64 (wine)"),
    )
    data = kr16cli.load_data()
    return {
        "schema": "kr16.fmu_table/1",
        "robot": data.name,
        "model_sha256": data.sha256,
        "result": {"rows": list(rows or usual)},
    }


def _bench() -> dict[str, Any]:
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
def _run() -> Run:
    from kr16cli.simulate.experiment import simulate
    from kr16cli.simulate.scenario import Scenario

    scenario = Scenario("rest", q=(0.0, -1.5, 1.5, 0.0, 0.3, 0.0), duration=0.1, output_step=0.01)
    return simulate(kr16cli.load_data(), scenario)


def _words(figure: Figure) -> list[_Word]:
    recorder = _Recorder()
    with styled():
        figure.draw(recorder)
    return recorder.words


@cache
def _drawn(kind: str) -> list[list[_Word]]:
    """The words of every page of a report."""
    return [_words(figure) for figure in _figures(kind)]


def _said(content: Content) -> list[str]:
    """All words of a report's pages but those of its figures."""
    with styled():
        document = build.compose(content)
    document.finish()
    return [piece.text for page in document.pages for piece in page.words.pieces]


@pytest.mark.parametrize("kind", KINDS)
def test_no_word_leaves_the_sheet(kind: str) -> None:
    for n, drawn in enumerate(_drawn(kind), 1):
        for text, _, (left, top, right, bottom) in drawn:
            inside = left >= 20 and right <= WIDTH - 20 and top >= 20 and bottom <= HEIGHT - 20
            assert inside, f"page {n}: {text!r} at {left:.0f} {top:.0f} {right:.0f} {bottom:.0f}"


@pytest.mark.parametrize("kind", KINDS)
def test_no_two_words_overlap(kind: str) -> None:
    for n, drawn in enumerate(_drawn(kind), 1):
        # Indices of formulas stand above one another by design.
        words = [(text, box) for text, size, box in drawn if size >= 6.9]
        words.sort(key=lambda word: word[1][1])
        for i, (text, (left, top, right, bottom)) in enumerate(words):
            for other, (l2, t2, r2, b2) in itertools.islice(words, i + 1, None):
                if t2 > bottom:
                    break
                across = min(right, r2) - max(left, l2)
                down = min(bottom, b2) - max(top, t2)
                assert across < 1.5 or down < 1.5, f"page {n}: {text!r} and {other!r}"


@pytest.mark.parametrize("kind", KINDS)
def test_every_page_has_its_footer_and_says_which_of_how_many(kind: str) -> None:
    pages = _drawn(kind)
    sha = kr16cli.load_data().sha256[:12]
    for n, drawn in enumerate(pages, 1):
        shown = [text for text, _, (_, top, _, _) in drawn if top > HEIGHT - 60]
        assert any(kr16cli.__version__ in t and sha in t for t in shown), n
        assert any(t.endswith(f"page {n} of {len(pages)}") for t in shown), n


def test_the_verification_report_has_all_its_pages() -> None:
    assert set(_left_out("verification")) == {"speed", "fmu"}
    assert len(_drawn("verification")) >= 16
    text = "\n".join(word for page in _drawn("verification") for word, *_ in page)
    for said in (
        "PASSED: all", "not validated on a robot", "Not affiliated with KUKA", "0.158 or 0.115",
        "OUTSIDE LIMITS", "audit only", "NASA-STD-7009B", "kr16 fk 1.5 2.5 -3.5 4.5 5.5 6.5",
        "roboticstoolbox is not installed", "SOURCE_DATE_EPOCH=", "(3.24)", "misprint",
        "wrist height", "KR16_controller.fmu", "Windows x86_64 (wine)", "quick run, ",
        "Batches are 8 to 8 times faster than any peer measured",
    ):  # fmt: skip
        assert said in text, said
    for result in _results():
        assert result.id in text


def test_the_second_page_tells_what_the_numbers_are_worth() -> None:
    data = kr16cli.load_data()
    words = [word for word, *_ in _drawn("verification")[1]]
    nominal = abs(kr16cli.load_robot().gravity(np.zeros(6))[1])
    q = np.zeros((1, 6))
    half = torque_bands(data, q, q, q)[0, 1]
    said = " ".join(words)
    assert f"A2 holds {nominal:.0f} ± {half:.0f} N m" in said
    assert "link[3].mass" in words and "± 20 %" in words
    assert "kr16 uncertainty --q '0 0 0 0 0 0'" in said
    assert "trust" in _left_out("dynamics", "chapter3")
    assert "Chapter 3 test arm states no tolerance" in _left_out("dynamics", "chapter3")["trust"]


def test_torque_plots_have_bands_or_say_why_not() -> None:
    content = _content("dynamics")
    bands, torques = content.drawings["torque_bands"], content.drawings["torques"]
    motion = torques["q"], torques["qd"], torques["qdd"]
    want = torque_bands(content.data, *motion, payload=torques["payload"], drives=True)
    assert bands["half"] == pytest.approx(want, abs=1e-9)
    share = (np.abs(torques["tau"]) + want) / torques["limit"]
    text = " ".join(_said(content))
    assert f"at most {100 * share.max():.0f} %" in text
    assert "95 % of the torque this motion needs" in text
    shown = " ".join(word for page in _drawn("simulation") for word, *_ in page)
    assert "no band on torque: it is given, the motion answers" in shown
    around = of_motion(kr16cli.load_data("chapter3"), *motion)
    assert around.half is None and "states no tolerance" in around.words


def test_a_failed_case_is_red_and_says_so_in_words() -> None:
    bad = dataclasses.replace(_results()[0], status="failed", error=3e-3, evidence="off by a lot")
    content = _content("kinematics", (bad, *_results()[1:]))
    text = "\n".join(_said(content))
    assert "FAILED: 1 of" in text
    assert "PASSED" not in text
    assert f"FAILED {bad.id}: off by a lot" in text
    with styled():
        page = build.compose(content).finish()[0]
    assert _red(page) > 500
    assert _red(_figures("kinematics")[0]) == 0


def test_an_unproved_verdict_on_the_chapter_is_not_hidden() -> None:
    rows = [dataclasses.replace(r) for r in _results() if r.id == "chapter.wrist"]
    equations = [dict(e) for e in rows[0].figures["equations"]]
    wrong = next(e for e in equations if e["verdict"] == "misprint")
    wrong["proved"] = False
    bad = dataclasses.replace(rows[0], figures={"equations": equations})
    words = _said(_content(results=(bad,)))
    text = "\n".join(words)
    assert "1 verdicts are NOT PROVED" in text
    assert "FAILED: 1 of" in text
    assert "NOT PROVED" in words
    assert "Every verdict is proved" not in text


def test_a_case_that_raised_leads_the_list_of_margins() -> None:
    bad = dataclasses.replace(_results()[0], status="failed", error=None, evidence="ValueError: x")
    words = _said(_content("kinematics", (*_results()[1:], bad)))
    assert "not measured" in words
    assert any(w.startswith("FAILED: 1 of") for w in words)


def _red(figure: Figure) -> int:
    """Pixels of the page drawn in the colour of failure, at 100 dpi."""
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(100)
    with styled():
        canvas.draw()
    figure.set_dpi(72)
    pixels = np.asarray(canvas.buffer_rgba()).astype(int)
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    return int(((red > 150) & (green < 40) & (blue < 70)).sum())


def test_every_page_puts_ink_on_paper_when_rendered() -> None:
    for n, figure in enumerate(_figures("dynamics"), 1):
        canvas = FigureCanvasAgg(figure)
        with styled():
            canvas.draw()
        dark = np.asarray(canvas.buffer_rgba())[..., :3].min(axis=-1) < 128
        assert 0.001 < dark.mean() < 0.4, n
        assert dark[-60:].any(), f"page {n} has no footer"


# The file ------------------------------------------------------------------------------------


@cache
def _pdf(kind: str) -> bytes:
    return build.build(_content(kind))


def test_text_can_be_extracted_from_every_page_and_fonts_are_embedded() -> None:
    pypdf = pytest.importorskip("pypdf")
    reader = pypdf.PdfReader(BytesIO(_pdf("simulation")))
    for n, page in enumerate(reader.pages, 1):
        text = page.extract_text()
        assert f"page {n} of {len(reader.pages)}" in text
        assert len(text) > 100
        assert abs(float(page.mediabox.width) - 595.276) < 0.1
        for font in page["/Resources"]["/Font"].values():
            described = font.get_object()["/DescendantFonts"][0].get_object()["/FontDescriptor"]
            assert "/FontFile2" in described.get_object()
    assert "PASSED" in reader.pages[0].extract_text()


def test_metadata_names_the_model_and_the_time_asked_for() -> None:
    pdf = _pdf("simulation")
    sha = kr16cli.load_data().sha256
    assert f"/Keywords (model {sha})".encode() in pdf
    assert b"/Title (Simulation report: KUKA KR 16-2)" in pdf
    assert b"/Author (kr16cli)" in pdf
    assert b"/CreationDate (D:20260102000000Z)" in pdf


def test_equal_input_gives_equal_bytes_in_another_process(tmp_path: Path) -> None:
    results = tmp_path / "results.json"
    results.write_text(json.dumps(_saved("simulation")), encoding="utf-8")
    made = []
    for n, seed in enumerate(("1", "2")):
        path = tmp_path / f"{n}.pdf"
        environment = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000", "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-m", "kr16cli", "report", "simulation", "-o", str(path), "--from",
             str(results)],
            env=environment, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        made.append(path.read_bytes())
    assert made[0] == made[1]
    assert b"/CreationDate (D:20231114221320Z)" in made[0]


def test_twenty_pages_take_few_seconds() -> None:
    content = _content(**_extras("verification"))
    _pdf("simulation")  # imports and fonts are there
    start = time.process_time()
    pdf = build.build(content)
    spent = time.process_time() - start
    pages = pdf.count(b"/Type /Page\n") or pdf.count(b"/Type /Page ")
    assert pages >= 20
    assert spent / pages * 20 < 8.0


def test_words_stand_in_the_file_where_the_page_puts_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pypdf = pytest.importorskip("pypdf")

    def placed() -> list[tuple[str, float, float]]:
        with styled():
            page = Page()
            page.write(100.0, 200.0, "Left. Tiffany's 95 % AV")
            page.write(300.0, 220.0, "right", size=7.0, face=typeset.BOLD, align="right")
            page.write(100.0, 240.0, "Ṁ - 2C ‖ Δ", color="#B00020")
            page.write(100.0, 260.0, "mono ⁻⁹", face=typeset.Face(typeset.MONO))
            page.write(100.0, 280.0, "q\u0307")  # stands on another letter: shaped by matplotlib
            pdf = to_pdf([page.figure], {}, _WHEN)
        found: list[tuple[str, float, float]] = []

        def visit(text: str, cm: Any, tm: Any, font: Any, size: Any) -> None:
            if text.strip():
                found.append((text.strip(), cm[4] + tm[4], cm[5] + tm[5]))

        pypdf.PdfReader(BytesIO(pdf)).pages[0].extract_text(visitor_text=visit)
        return found

    quick = placed()
    letters = "".join(text for text, *_ in quick).replace(" ", "")
    assert letters.partition("q\u0307")[:2] == (
        "Left.Tiffany's95%AVrightṀ-2C‖Δmono⁻⁹",
        "q\u0307",
    )
    assert quick[0][1:] == pytest.approx((100.0, HEIGHT - 200.0 - 0.95 * 9.0), abs=0.01)
    right = 300.0 - typeset.width("right", 7.0, typeset.BOLD)
    assert quick[1][1:] == pytest.approx((right, HEIGHT - 220.0 - 0.95 * 7.0), abs=0.01)
    monkeypatch.setattr("kr16cli.report.words._Letters.of", lambda renderer: None)
    shaped = placed()
    assert "".join(text for text, *_ in shaped).replace(" ", "") == letters


def _saved(kind: str, **changes: Any) -> dict[str, Any]:
    """What `kr16 verify --json` saves when it keeps the figures."""
    data = kr16cli.load_data()
    suites = outline(kind).suites
    cases = [dataclasses.asdict(r) for r in _results() if r.group in suites]
    return {
        "schema": "kr16.verify/1",
        "robot": data.name,
        "model_sha256": data.sha256,
        "input": {"suites": suites, "quick": True, "seed": 20161},
        "result": {"cases": cases},
    } | changes


# Sources of results --------------------------------------------------------------------------


def test_saved_results_are_read_back_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(json.dumps(_saved("verification")), encoding="utf-8")
    found = read([path], outline("verification").suites, kr16cli.load_data())
    assert (found.seed, found.quick) == (20161, True)
    assert found.results == tuple(
        dataclasses.replace(r, worst=json.loads(json.dumps(r.worst))) for r in _results()
    )


def test_results_without_figures_still_give_a_report_that_says_so(tmp_path: Path) -> None:
    saved = _saved("simulation")
    for case in saved["result"]["cases"]:
        del case["figures"]
    source, target = tmp_path / "results.json", tmp_path / "report.pdf"
    source.write_text(json.dumps(saved), encoding="utf-8")
    done = kr16("report", "simulation", "--from", source, "-o", target)
    assert done.code == 0
    assert "no page on orders: case simulation.order: no figure data in the file" in done.err
    assert "no page on energy" in done.err and "run" not in done.err.split()
    assert target.read_bytes().startswith(b"%PDF")


def test_a_failed_case_makes_the_exit_code_1(tmp_path: Path) -> None:
    saved = _saved("simulation")
    saved["result"]["cases"][0] |= {"status": "failed", "error": 1.0}
    source, target = tmp_path / "results.json", tmp_path / "report.pdf"
    source.write_text(json.dumps(saved), encoding="utf-8")
    done = kr16("report", "simulation", "--from", source, "-o", target)
    assert (done.code, done.err) == (1, "")
    assert target.exists()


def test_a_recorded_run_is_drawn_and_nothing_is_run(tmp_path: Path) -> None:
    source, target = tmp_path / "run.npz", tmp_path / "run.pdf"
    source.write_bytes(_run().to_npz())
    done = kr16("report", "simulation", "--from", source, "-o", target)
    assert (done.code, done.out) == (0, "")
    assert target.read_bytes().startswith(b"%PDF")
    content = build.gather("simulation", Setting(kr16cli.load_robot()), [source])
    assert content.results == ()
    words = _said(content)
    assert any("NO CHECKS" in word for word in words)
    assert "Recorded motion rest" in words
    assert "angle, deg" in [word for page in _drawn("simulation") for word, *_ in page]


def test_measured_times_are_shown_only_where_given(tmp_path: Path) -> None:
    results, measured = tmp_path / "results.json", tmp_path / "bench.json"
    results.write_text(json.dumps(_saved("dynamics")), encoding="utf-8")
    measured.write_text(json.dumps(_bench()), encoding="utf-8")
    content = build.gather("dynamics", Setting(kr16cli.load_robot()), [results, measured])
    words = _said(content)
    assert {"41.2", "Pinocchio", "310.0", "7.5", "2.5", "62 %", "2.25", "times drift"} <= set(words)
    assert "speed" in _left_out("dynamics")


def test_slower_than_a_peer_is_said_in_the_title() -> None:
    slow = _bench()
    slow["result"]["rows"][0]["ratio"] = 0.5
    words = _said(_content(bench=times.read(slow)))
    assert "Batches are slower than a peer in 1 of 1 quantities" in words
    alone = _bench()
    del alone["result"]["rows"][0]
    words = _said(_content(bench=times.read(alone)))
    assert "Measured times, as the bench file gives them" in words


def test_times_alone_add_their_page_to_suites_that_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "bench.json"
    file.write_text(json.dumps(_bench()), encoding="utf-8")
    cases = [c for c in registry.cases(["dynamics"]) if c.id == "dynamics.power"]
    monkeypatch.setattr(registry, "cases", lambda names: cases)
    content = build.gather("dynamics", Setting(kr16cli.load_robot(), quick=True), [file])
    assert [r.id for r in content.results] == ["dynamics.power"]
    assert content.evidence.source.startswith("run for this report")
    assert "41.2" in _said(content)


# FMUs ----------------------------------------------------------------------------------------


def test_an_fmu_built_from_the_robot_moves_as_the_simulator() -> None:
    pytest.importorskip("pythonfmu")
    pytest.importorskip("fmpy")
    result = fmus.own(kr16cli.load_data())
    assert (result.status, result.group, result.grade) == ("passed", "fmu", "D")
    assert result.error is not None and result.error <= result.tolerance
    assert {d["group"] for d in result.figures["deviations"]} >= {"q", "qd", "pose", "energy"}


def test_an_arm_that_can_be_no_fmu_is_skipped_with_the_reason() -> None:
    result = fmus.own(kr16cli.load_data("kr16_l6"))
    assert result.status == "skipped"
    content = _content(fmus=(result,))
    words = "\n".join(_said(content))
    assert "no inertial data" in content.left_out["fmu"]
    assert "fmu: KUKA KR 16 L6" in words
    assert "no inertial data" in " ".join(words.partition("Identity")[0].split())


def test_checks_of_fmus_are_read_one_or_many_and_judged(tmp_path: Path) -> None:
    one, many = tmp_path / "one.json", tmp_path / "many.json"
    row = _fmu_row()
    check = _fmu_table() | {"schema": "kr16.fmu_check/1", "input": {"file": row.pop("file")}}
    one.write_text(json.dumps(check | {"result": row}), encoding="utf-8")
    many.write_text(json.dumps(_fmu_table()), encoding="utf-8")
    found = read([one, many], outline("verification").suites, kr16cli.load_data())
    assert [r.id for r in found.fmus] == [
        "fmu.KR16-CS-FMPy-Linux-x86_64",
        "fmu.KR16-CS-FMPy-Linux-x86_64-2",
        "fmu.KR16-CS-Ecos-Linux-x86_64",
        "fmu.KR16_controller-CS-FMPy-Linux-x86_64",
        "fmu.KR16-ME-FMPy-Windows-x86_64-wine",
    ]
    assert {r.status for r in found.fmus} == {"passed"}
    assert found.fmus[0].error == 3e-11
    assert found.fmus[0].worst == {"output": "tau_applied", "at": "0.3 s"}


def test_an_fmu_that_deviates_fails_the_report(tmp_path: Path) -> None:
    far = [
        {"group": "q", "largest": None, "unit": "rad", "time": 0.2, "relative": None},
        {"group": "qd", "largest": 3e-4, "unit": "rad/s", "time": 0.1, "relative": 3e-4},
    ]
    bad = _fmu_row(passed=False, deviations=far, problems=["q runs away"], host="Other 1.0")
    results, checks = tmp_path / "results.json", tmp_path / "fmus.json"
    results.write_text(json.dumps(_saved("verification")), encoding="utf-8")
    checks.write_text(json.dumps(_fmu_table(_fmu_row(), bad)), encoding="utf-8")
    content = build.gather("verification", Setting(kr16cli.load_robot()), [results, checks])
    words = _said(content)
    assert any(w.startswith("FAILED: 1 of 2 checks of FMUs") for w in words)
    assert "FAILED fmu.KR16-CS-Other-Linux-x86_64: q runs away" in words
    assert {"not finite", "3e-4"} <= set(words)
    assert content.by_margin()[0].id == "fmu.KR16-CS-Other-Linux-x86_64"
    assert content.count("failed") == 1


def test_checks_of_fmus_go_with_the_verification_report_only(tmp_path: Path) -> None:
    source = tmp_path / "fmus.json"
    source.write_text(json.dumps(_fmu_table()), encoding="utf-8")
    complains(
        kr16("report", "dynamics", "-o", tmp_path / "r.pdf", "--from", source), "verification"
    )


def test_compiled_kernels_are_not_called_another_engine() -> None:
    native = _made("engines.native.fk", title="Compiled kernels: fk", grade="D")
    words = _said(_content(results=(*_results(), native)))
    assert "Pinocchio agree: same numbers, other code" in words
    assert words.index("The compiled kernels") < words.index("Compiled kernels: fk")


def _left_out(kind: str, robot: str | None = None) -> dict[str, str]:
    content = _content(kind, robot=kr16cli.load_robot(robot) if robot else None)
    with styled():
        build.compose(content)
    return content.left_out


def test_an_arm_without_inertias_has_a_report_without_their_pages() -> None:
    robot = kr16cli.load_robot("kr16_l6")
    content = _content("dynamics", robot=robot)
    words = _said(content)
    assert {"mass_centres", "torques"} <= set(content.left_out)
    assert "no inertial data" in content.left_out["torques"]
    assert any(word.startswith("torques: KUKA KR 16 L6 has no") for word in words)
    assert "The working envelope at A1 = 0" in _said(_content("kinematics", robot=robot))


# Refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "no/such/folder/r.pdf"], ["no/such/folder/", "cannot be written"]),
        ([], ["give its name", "-o FILE.pdf"]),
        (["-o", "r.txt"], ["r.txt", ".pdf"]),
        (["weather", "-o", "r.pdf"], ["weather", "kinematics"]),
        (["-o", "r.pdf", "--seed", "-3"], ["--seed", "-3"]),
        (["-o", "r.pdf", "--seed", "x"], ["--seed", "x"]),
        (["-o", "r.pdf", "--from", "missing.json"], ["missing.json", "cannot be read"]),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    arguments: list[str], said: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    complains(kr16("report", *arguments), *said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "no JSON"),
        ("[1]", "no JSON object"),
        ('{"schema": "kr16.fk/1"}', "neither"),
        (json.dumps({"schema": "kr16.bench/1", "result": {"rows": [{}]}}), "not whole"),
        (json.dumps({"schema": "kr16.fmu_table/1", "result": {"rows": [{}]}}), "not whole"),
        (json.dumps({"schema": "kr16.fmu_check/1", "result": []}), "not whole"),
    ],
)
def test_a_file_that_holds_no_results_is_refused(content: str, said: str, tmp_path: Path) -> None:
    source = tmp_path / "results.json"
    source.write_text(content, encoding="utf-8")
    target = tmp_path / "r.pdf"
    complains(kr16("report", "-o", target, "--from", source), "results.json", said)
    assert not target.exists()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"model_sha256": "0" * 64}, "model 000000000000"),
        ({"result": {"cases": []}}, "no case"),
        ({"result": {"cases": [{"id": "kinematics.rpy"}]}}, "lacks group"),
        ({"result": {}}, "not whole"),
    ],
)
def test_results_that_do_not_fit_are_refused(
    changes: dict[str, Any], said: str, tmp_path: Path
) -> None:
    source = tmp_path / "results.json"
    source.write_text(json.dumps(_saved("kinematics", **changes)), encoding="utf-8")
    complains(kr16("report", "-o", tmp_path / "r.pdf", "--from", source), said)


def test_a_run_goes_with_the_simulation_report_only(tmp_path: Path) -> None:
    source = tmp_path / "run.npz"
    source.write_bytes(_run().to_npz())
    complains(kr16("report", "dynamics", "-o", tmp_path / "r.pdf", "--from", source), "simulation")


def test_a_creation_time_that_is_none_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    complains(kr16("report", "-o", tmp_path / "r.pdf"), "SOURCE_DATE_EPOCH", "yesterday")


def test_without_matplotlib_the_extra_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(kr16cli.Kr16Error, match=r"kr16cli\[report\]") as raised:
        build.require_matplotlib()
    assert raised.value.exit_code == 4


# Small parts ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "shown"),
    [(None, "-"), (0.0, "0"), (1e-9, "1e-9"), (1.23e-14, "1.2e-14"), (0.4133, "0.413"),
     (5000.0, "5e+03"), (2e5, "2e5")],
)  # fmt: skip
def test_numbers_are_short(value: float | None, shown: str) -> None:
    assert number(value) == shown


def test_wrapped_lines_fit_and_lose_no_letter() -> None:
    text = "A line of words, then inverse.closure.near-wrist-pi.and.so.on.without.any.blank ends."
    lines = typeset.wrap(text, 90.0, 9.0)
    assert len(lines) > 4
    assert all(typeset.width(line, 9.0) <= 90.0 for line in lines)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


@pytest.mark.parametrize(
    ("plain", "runs"),
    [
        ("c23*c6", [("c", 0), ("23", -1), ("\u2009", 0), ("c", 0), ("6", -1)]),
        ("T_b^0", [("T", 0), ("b", -1), ("0", 1)]),
        ("Atan2(r32,", [("Atan2", 0), ("(", 0), ("r", 0), ("32", -1), (",", 0)]),
        ("omega_i", [("\u03c9", 0), ("i", -1)]),
        ("dq6", [("q\u0307", 0), ("6", -1)]),
        ("p x q", [("p", 0), ("\u00d7", 0), ("q", 0)]),
        ("for x >= 0", [("for", 0), ("x", 0), ("\u2265", 0), ("0", 0)]),
        ("u for x < 0", [("u", 0), ("for", 0), ("x", 0), ("<", 0), ("0", 0)]),
        ("of roll-pitch-yaw", [("of", 0), ("roll-pitch-yaw", 0)]),
        ("q_{1,i}", [("q", 0), ("1", -1), (",", -1), ("i", -1)]),
    ],
)
def test_formulas_get_their_indices(plain: str, runs: list[tuple[str, int]]) -> None:
    (line,) = typeset.formula(plain, 500.0, 9.0)
    assert [(r.text, (r.up > 0) - (r.up < 0)) for r in line.runs] == runs


def test_an_index_above_stands_over_the_one_below() -> None:
    (line,) = typeset.formula("T_b^0", 500.0, 9.0)
    below, above = line.runs[1:]
    assert below.right == above.right and below.up < 0 < above.up


def test_a_letter_no_font_has_is_replaced() -> None:
    assert typeset.printable("arm \U0001f9be") == "arm ?"
