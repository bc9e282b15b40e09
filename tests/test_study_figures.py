"""Pictures of studies: what their words say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kr16cli.robot_file import load_data
from kr16cli.study import map_facts, map_sections, sweep_facts
from kr16cli.study.design import design
from kr16cli.study.grid import from_abc, make_grid
from kr16cli.study.maps import MapWork
from kr16cli.study.session import finished
from kr16cli.study.sweep import sweep_of

pytest.importorskip("matplotlib")

from matplotlib.text import Text

from kr16cli.report.map_figures import map_figure
from kr16cli.report.style import styled
from kr16cli.report.sweep_figures import sweep_figure

DATA = load_data()


def words(figure: Any) -> str:
    return "\n".join(text.get_text() for text in figure.findobj(Text))


def swept(*vary: str, scenario: str = "free_swing") -> str:
    plan = design(vary, latin=None, monte_carlo=None, seed=1)
    work = sweep_of(DATA.path, scenario, plan)
    with finished(work) as store:
        columns = sweep_facts.whole(work, store)
    with styled():
        return words(sweep_figure(sweep_facts.answer(work, columns), columns))


def mapped(quantity: Any, **ranges: list[float]) -> str:
    grid = make_grid(DATA, 0.2, rotations=from_abc([(0.0, 180.0, 0.0)]), ranges=ranges)
    work = MapWork(DATA, quantity, grid)
    with finished(work) as store, styled():
        layers, edges = map_sections.sections(work, store), map_sections.outline(work)
        return words(map_figure(work, layers, edges, map_facts.facts(work, store)))


def test_axes_of_a_sweep_are_named_in_words_with_units() -> None:
    said = swept("payload.mass=0:16:3", "link[2].mass=x0.9,x1.1", "duration_s=0.1")
    for part in ("payload.mass, kg", "link[2].mass, factor", "largest kinetic\nenergy, J",
                 "angle at the end,\nA2, rad", "6 runs", "line: the mean"):  # fmt: skip
        assert part in said


def test_a_sweep_in_which_nothing_varies_or_succeeds_says_so() -> None:
    assert "1 run, factorial\nno figure varies" in swept("payload.mass=5", "duration_s=0.05")
    assert "1 failed\nno run has figures" in swept("duration_s=-1")


def test_a_map_says_what_it_shows_and_what_its_lines_are() -> None:
    said = mapped("condition")
    for part in ("condition number of J, best branch", "section y = 0 m", "A2 = -155 deg",
                 "envelope of this point, A1 = 0; thin: A1 = 180 deg", "white: not",
                 "linear rows of J over a length of 1 m", "the three sections in"):  # fmt: skip
        assert part in said.replace("\n", " "), part
    payload = mapped("payload", y=[0.0]).replace("\n", " ")
    assert "payload that can be held at rest" in payload
    assert "rated, in motion: 16 kg" in payload
    assert "in space" not in payload


def test_colours_end_where_a_condition_number_says_no_more() -> None:
    from kr16cli.report.map_figures import _Scale

    work = MapWork(DATA, "condition", make_grid(DATA, 0.5, rotations=from_abc([(0, 180, 0)])))
    scale = _Scale(work, np.array([4.0, 9.0, 1e12]))
    assert (scale.norm.vmin, scale.norm.vmax, scale.clipped) == (4.0, 100.0, True)
    tame = _Scale(work, np.full(5, 7.0))
    assert tame.norm.vmin < tame.norm.vmax
    assert not tame.clipped
