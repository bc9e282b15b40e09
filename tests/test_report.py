"""Reports: what pages say, that nothing overlaps or leaves the sheet, and equal bytes."""

from __future__ import annotations

import dataclasses
import datetime as dt
import itertools
import json
import os
import subprocess
import sys
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
from kr16cli.report import build, typeset
from kr16cli.report.content import KINDS, Content, Evidence, outline
from kr16cli.report.page import HEIGHT, WIDTH
from kr16cli.report.sources import read
from kr16cli.report.style import number, styled
from kr16cli.simulate.run import Run
from kr16cli.verify import drawings, registry
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
    time = [0.1 * i for i in range(21)]
    steps = [0.04, 0.02, 0.01]
    order = {
        "Runge-Kutta step": steps,
        "Runge-Kutta error": [h**4 for h in steps],
        "Euler step": [0.1 * h for h in steps],
        "Euler error": list(steps),
    }
    made = [
        _made("simulation.order", figures=order),
        _made("simulation.energy", figures={"time": time, "drift": [1e-12 * t for t in time]}),
        _made("simulation.tolerance", figures={"time": time, "gap": [1e-11 * t for t in time]}),
        _made(
            "engines.pinocchio.motion",
            title="Pinocchio: a simulated motion",
            figures={"time": time, "gap": [1e-13] * 21},
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
    names = tuple(name for page in plan.pages for name in build.DRAWN.get(page, ()))
    made, absent = _drawings(names, robot.data.path)
    found = Evidence(shown, 20161, True, "made by a test", **evidence)
    return Content(plan, robot.data, found, made, absent, _WHEN)


@cache
def _drawings(names: tuple[str, ...], path: str) -> tuple[dict[str, Any], dict[str, str]]:
    return drawings.draw(names, Setting(kr16cli.load_robot(path), quick=True))


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
        figures = build.compose(_content(kind, run=_run() if kind == "simulation" else None))
        return figures.finish()


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
    assert set(_left_out("verification")) == {"speed"}
    assert len(_drawn("verification")) >= 16
    text = "\n".join(word for page in _drawn("verification") for word, *_ in page)
    for said in (
        "PASSED: all", "not validated on a robot", "Not affiliated with KUKA", "0.158 or 0.115",
        "OUTSIDE LIMITS", "audit only", "NASA-STD-7009B", "kr16 fk 1.5 2.5 -3.5 4.5 5.5 6.5",
        "roboticstoolbox is not installed", "SOURCE_DATE_EPOCH=", "(3.24)", "misprint",
        "wrist height",
    ):  # fmt: skip
        assert said in text, said
    for result in _results():
        assert result.id in text


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
    row = {"quantity": "fk", "batch_ns": 41.25, "threads_ns": 22.0, "call_ns": 900.0,
           "peers": {"Pinocchio": 310.0, "MuJoCo": 900.0}, "ratio": 7.5}  # fmt: skip
    bench = {
        "schema": "kr16.bench/1",
        "input": {"threads": 2},
        "result": {"engine": "native", "machine": {"cores": 2}, "rows": [row]},
    }
    results, times = tmp_path / "results.json", tmp_path / "bench.json"
    results.write_text(json.dumps(_saved("dynamics")), encoding="utf-8")
    times.write_text(json.dumps(bench), encoding="utf-8")
    content = build.gather("dynamics", Setting(kr16cli.load_robot()), [results, times])
    words = _said(content)
    assert {"41.2", "Pinocchio", "7.5"} <= set(words)
    assert "speed" in _left_out("dynamics")


def _left_out(kind: str) -> dict[str, str]:
    content = _content(kind)
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
