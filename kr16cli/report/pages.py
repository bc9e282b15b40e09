"""The pages by the names that reports/outline.toml uses."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from kr16cli.report import back_pages as back
from kr16cli.report import chapter_pages as chapter
from kr16cli.report import dynamics_pages as dynamics
from kr16cli.report import fmu_pages as fmus
from kr16cli.report import front_pages as front
from kr16cli.report import kinematics_pages as kinematics
from kr16cli.report import speed_pages as times
from kr16cli.report import trust_pages as trust
from kr16cli.report.content import Content
from kr16cli.report.page import Document

PAGES: Mapping[str, Callable[[Document, Content], None]] = {
    "verdict": front.verdict,
    "trust": trust.trust,
    "identity": front.identity,
    "poses": front.poses,
    "margins": front.margins,
    "forward": kinematics.forward,
    "closure": kinematics.closure,
    "branches": kinematics.branches,
    "jacobian": kinematics.jacobian,
    "singularities": kinematics.singularities,
    "workspace": kinematics.workspace,
    "chapter": chapter.chapter,
    "dynamics": dynamics.dynamics,
    "mass_centres": dynamics.mass_centres,
    "torques": dynamics.torques,
    "orders": dynamics.orders,
    "energy": dynamics.energy,
    "engines": dynamics.engines,
    "run": dynamics.run,
    "fmu": fmus.fmu,
    "speed": times.speed,
    "credibility": back.credibility,
    "traceability": back.traceability,
    "cases": back.cases,
    "reproduction": back.reproduction,
    "references": back.references,
}
