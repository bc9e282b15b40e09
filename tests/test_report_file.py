"""The PDF of a report: its text, fonts, metadata, and equal bytes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

import kr16cli
from kr16cli.report import build, typeset
from kr16cli.report.page import HEIGHT, Page, to_pdf
from kr16cli.report.style import styled
from report_content import WHEN, content_of, extras_of, saved_results


@cache
def _pdf(kind: str) -> bytes:
    return build.build(content_of(kind))


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
    results.write_text(json.dumps(saved_results("simulation")), encoding="utf-8")
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
    content = content_of(**extras_of("verification"))
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
            pdf = to_pdf([page.figure], {}, WHEN)
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
