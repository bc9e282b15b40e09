"""From results to the bytes of a PDF."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from kr16cli.errors import InputError, MissingPartError
from kr16cli.report import fmus, sources, studies
from kr16cli.report.content import (
    KINDS,
    Content,
    Drawing,
    Evidence,
    LackingError,
    Outline,
    creation_time,
    outline,
)
from kr16cli.verify.records import Setting

if TYPE_CHECKING:
    from kr16cli.report.page import Document

DRAWN = {
    "poses": ("poses",),
    "forward": ("known_poses",),
    "branches": ("branches",),
    "singularities": ("singularity_maps",),
    "workspace": ("workspace",),
    "mass_centres": ("mass_centres",),
    "torques": ("torques",),
}
"""The drawing data that pages need."""


def require_matplotlib() -> None:
    """MissingPartError where matplotlib is not installed."""
    from importlib.util import find_spec

    if find_spec("matplotlib") is None:
        raise MissingPartError("matplotlib", "report")


def gather(
    kind: str,
    setting: Setting,
    paths: Sequence[str | Path] = (),
    progress: Callable[[int, int, str], None] | None = None,
) -> Content:
    """Everything a report draws: results (run now, or read from files) and drawing data.

    Args:
        kind: one of KINDS.
        setting: the robot, seed and whether to be quick.
        paths: files to read results from; where they hold neither results of suites nor a run,
            the suites run, and for a page on FMUs one is built and checked.
        progress: told how many cases are done, of how many, and the last.

    Raises:
        InputError, FileError: an unknown report, or files that do not fit it.
    """
    plan, created = outline(kind), creation_time()
    data = setting.robot.data
    evidence = sources.read(paths, plan.suites, data) if paths else None
    if evidence and evidence.run and "run" not in plan.pages:
        raise InputError("a run of kr16 simulate goes with `kr16 report simulation`")
    if evidence and evidence.fmus and "fmu" not in plan.pages:
        raise InputError("a check of kr16 fmu check goes with `kr16 report verification`")
    if not (evidence and (evidence.results or evidence.run)):
        evidence = sources.run_suites(plan.suites, setting, progress, evidence)
        if "fmu" in plan.pages and not evidence.fmus:
            evidence = replace(evidence, fmus=fmus.own(data, quick=setting.quick))
    drawings, absent = drawn(plan, setting, evidence)
    return Content(plan, data, evidence, drawings, absent, created)


def drawn(
    plan: Outline, setting: Setting, evidence: Evidence
) -> tuple[dict[str, Drawing], dict[str, str]]:
    """The drawing data of a report's pages, and for those that could not be made the reason."""
    from kr16cli.verify.drawings import draw

    names = [name for page in plan.pages for name in DRAWN.get(page, ())]
    made, absent = draw(names, setting)
    more, lacking = studies.studied(plan.pages, setting.robot.data, made, evidence.run)
    return made | more, absent | lacking


def build(content: Content) -> bytes:
    """The report as the content of a PDF file.

    A page whose data are missing is left out; `content.left_out` then says why.

    Raises:
        MissingPartError: matplotlib is not installed.
    """
    require_matplotlib()
    from kr16cli.report.page import to_pdf
    from kr16cli.report.style import styled

    with styled():
        figures = compose(content).finish()
        title = f"{content.outline.title}: {content.data.name}"
        metadata = {
            "Title": title,
            "Author": "kr16cli",
            "Subject": "Verification of kinematics, dynamics and simulation",
            "Keywords": f"model {content.data.sha256}",
            "Creator": f"kr16 report {content.outline.kind}",
        }
        return to_pdf(figures, metadata, content.created)


def compose(content: Content) -> Document:
    """All pages in the outline's order, without footers yet."""
    from kr16cli.report import pages
    from kr16cli.report.page import Document

    document = Document(content.footer, content.outline.title)
    for name in content.outline.pages:
        before = len(document.pages)
        try:
            pages.PAGES[name](document, content)
        except LackingError as reason:
            del document.pages[before:]
            content.left_out[name] = str(reason)
    return document


__all__ = ["KINDS", "build", "compose", "gather", "require_matplotlib"]
