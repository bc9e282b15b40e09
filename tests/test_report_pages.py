"""Reports: what pages say, and that nothing overlaps or leaves the sheet."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import kr16cli
from kr16cli.report import build
from kr16cli.report.content import KINDS
from kr16cli.report.page import HEIGHT, WIDTH
from kr16cli.report.style import styled
from kr16cli.study.bands import of_motion
from kr16cli.study.uncertainty import torque_bands
from report_content import content_of, drawn_words, figures_of, left_out, made_results, said_by


@pytest.mark.parametrize("kind", KINDS)
def test_no_word_leaves_the_sheet(kind: str) -> None:
    for n, drawn in enumerate(drawn_words(kind), 1):
        for text, _, (left, top, right, bottom) in drawn:
            inside = left >= 20 and right <= WIDTH - 20 and top >= 20 and bottom <= HEIGHT - 20
            assert inside, f"page {n}: {text!r} at {left:.0f} {top:.0f} {right:.0f} {bottom:.0f}"


@pytest.mark.parametrize("kind", KINDS)
def test_no_two_words_overlap(kind: str) -> None:
    for n, drawn in enumerate(drawn_words(kind), 1):
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
    pages = drawn_words(kind)
    sha = kr16cli.load_data().sha256[:12]
    for n, drawn in enumerate(pages, 1):
        shown = [text for text, _, (_, top, _, _) in drawn if top > HEIGHT - 60]
        assert any(kr16cli.__version__ in t and sha in t for t in shown), n
        assert any(t.endswith(f"page {n} of {len(pages)}") for t in shown), n


def test_the_verification_report_has_all_its_pages() -> None:
    assert set(left_out("verification")) == {"speed", "fmu"}
    assert len(drawn_words("verification")) >= 16
    text = "\n".join(word for page in drawn_words("verification") for word, *_ in page)
    for said in (
        "PASSED: all", "not validated on a robot", "Not affiliated with KUKA", "0.158 or 0.115",
        "OUTSIDE LIMITS", "audit only", "NASA-STD-7009B", "kr16 fk 1.5 2.5 -3.5 4.5 5.5 6.5",
        "roboticstoolbox is not installed", "SOURCE_DATE_EPOCH=", "(3.24)", "misprint",
        "wrist height", "KR16_controller.fmu", "Windows x86_64 (wine)", "quick run, ",
        "Batches are 8 to 8 times faster than any peer measured",
    ):  # fmt: skip
        assert said in text, said
    for result in made_results():
        assert result.id in text


def test_the_second_page_tells_what_the_numbers_are_worth() -> None:
    data = kr16cli.load_data()
    words = [word for word, *_ in drawn_words("verification")[1]]
    nominal = abs(kr16cli.load_robot().gravity(np.zeros(6))[1])
    q = np.zeros((1, 6))
    half = torque_bands(data, q, q, q)[0, 1]
    said = " ".join(words)
    assert f"A2 holds {nominal:.0f} ± {half:.0f} N m" in said
    assert "link[3].mass" in words and "± 20 %" in words
    assert "kr16 uncertainty --q '0 0 0 0 0 0'" in said
    assert "trust" in left_out("dynamics", "chapter3")
    assert "Chapter 3 test arm states no tolerance" in left_out("dynamics", "chapter3")["trust"]


def test_torque_plots_have_bands_or_say_why_not() -> None:
    content = content_of("dynamics")
    bands, torques = content.drawings["torque_bands"], content.drawings["torques"]
    motion = torques["q"], torques["qd"], torques["qdd"]
    want = torque_bands(content.data, *motion, payload=torques["payload"], drives=True)
    assert bands["half"] == pytest.approx(want, abs=1e-9)
    share = (np.abs(torques["tau"]) + want) / torques["limit"]
    text = " ".join(said_by(content))
    assert f"at most {100 * share.max():.0f} %" in text
    assert "95 % of the torque this motion needs" in text
    shown = " ".join(word for page in drawn_words("simulation") for word, *_ in page)
    assert "no band on torque: it is given, the motion answers" in shown
    around = of_motion(kr16cli.load_data("chapter3"), *motion)
    assert around.half is None and "states no tolerance" in around.words


def test_a_failed_case_is_red_and_says_so_in_words() -> None:
    bad = dataclasses.replace(
        made_results()[0], status="failed", error=3e-3, evidence="off by a lot"
    )
    content = content_of("kinematics", (bad, *made_results()[1:]))
    text = "\n".join(said_by(content))
    assert "FAILED: 1 of" in text
    assert "PASSED" not in text
    assert f"FAILED {bad.id}: off by a lot" in text
    with styled():
        page = build.compose(content).finish()[0]
    assert _red(page) > 500
    assert _red(figures_of("kinematics")[0]) == 0


def test_an_unproved_verdict_on_the_chapter_is_not_hidden() -> None:
    rows = [dataclasses.replace(r) for r in made_results() if r.id == "chapter.wrist"]
    equations = [dict(e) for e in rows[0].figures["equations"]]
    wrong = next(e for e in equations if e["verdict"] == "misprint")
    wrong["proved"] = False
    bad = dataclasses.replace(rows[0], figures={"equations": equations})
    words = said_by(content_of(results=(bad,)))
    text = "\n".join(words)
    assert "1 verdicts are NOT PROVED" in text
    assert "FAILED: 1 of" in text
    assert "NOT PROVED" in words
    assert "Every verdict is proved" not in text


def test_a_case_that_raised_leads_the_list_of_margins() -> None:
    bad = dataclasses.replace(
        made_results()[0], status="failed", error=None, evidence="ValueError: x"
    )
    words = said_by(content_of("kinematics", (*made_results()[1:], bad)))
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
    for n, figure in enumerate(figures_of("dynamics"), 1):
        canvas = FigureCanvasAgg(figure)
        with styled():
            canvas.draw()
        dark = np.asarray(canvas.buffer_rgba())[..., :3].min(axis=-1) < 128
        assert 0.001 < dark.mean() < 0.4, n
        assert dark[-60:].any(), f"page {n} has no footer"


def test_an_arm_without_inertias_has_a_report_without_their_pages() -> None:
    robot = kr16cli.load_robot("kr16_l6")
    content = content_of("dynamics", robot=robot)
    words = said_by(content)
    assert {"mass_centres", "torques"} <= set(content.left_out)
    assert "no inertial data" in content.left_out["torques"]
    assert any(word.startswith("torques: KUKA KR 16 L6 has no") for word in words)
    assert "The working envelope at A1 = 0" in said_by(content_of("kinematics", robot=robot))
