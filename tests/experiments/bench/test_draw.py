"""The figure of the benchmark: what wins and loses is where the numbers are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.bench.draw import APPEARANCES, draw
from rigidpend.experiments.bench.measuring.methods import METHODS
from rigidpend.results.store import load
from tests.experiments.bench.measuring.data import data
from tests.experiments.figures import check_on_page, styled
from tests.results.loaded import loaded


@pytest.fixture(scope="module")
def figure() -> Figure:
    return styled(draw, loaded(data()), laid_out=True)


def panel(figure: Figure, letter: str) -> Axes:
    [found] = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(letter)]
    return found


def lines(axes: Axes, name: str) -> list[list[list[float]]]:
    """Points of each line of a method."""
    found = [line for line in axes.lines if line.get_label() == name]
    return [np.asarray(line.get_xydata()).tolist() for line in found]


def test_every_method_has_an_appearance_of_its_own() -> None:
    assert set(APPEARANCES) == set(METHODS)
    looks = {(look.colour, look.marker, look.line) for look in APPEARANCES.values()}
    assert len(looks) == len(APPEARANCES)


def test_the_stored_measurement_is_one_page_and_does_not_leave_it() -> None:
    made = styled(draw, load(Path("results/measured/bench.h5")), laid_out=True)
    check_on_page(made)
    assert made.get_figwidth() == 7.2
    assert made.get_figheight() < 9.7
    assert len(made.axes) == 5
    assert all(axes.get_xlabel() for axes in made.axes)


def test_ratios_are_those_of_the_meeting_a_row_for_one_thread_and_one_for_two(
    figure: Figure,
) -> None:
    axes = panel(figure, "a")
    rows = [text.get_text() for text in axes.get_yticklabels()]
    assert rows == ["free body, 1 thread", "route codes, 1 thread", "2 threads"]
    assert lines(axes, "aligned_batch") == [[[1, 0]], [[1, 1]], [[1, 2]]]
    assert lines(axes, "heyoka_eq1")[0][0] == pytest.approx([0.5, 0])
    assert [ratio for [[ratio, _]] in lines(axes, "heyoka_principal")] == pytest.approx([0.8, 2])
    assert axes.get_ylim()[0] > axes.get_ylim()[1], "the first row is above"


def test_what_did_not_reach_the_level_is_hollow(figure: Figure) -> None:
    hollow = {x.get_label() for x in panel(figure, "a").lines if x.get_markerfacecolor() == "white"}
    assert hollow == {"heyoka_eq1"}


def test_work_is_time_against_error_and_only_the_front(figure: Figure) -> None:
    axes = panel(figure, "b")
    assert lines(axes, "aligned_batch") == [[[1e-2, 0.006], [1e-7, 0.007]]]
    # An error of the size of the answer is not drawn.
    assert lines(axes, "scipy_dop853") == [[[1e-3, 12], [1e-6, 16]]]
    left, right = axes.get_xlim()
    assert left > right, "smaller errors are to the right"
    assert lines(panel(figure, "c"), "diffrax") == []


def test_wrong_symbols_are_per_million_and_none_lies_on_the_floor(figure: Figure) -> None:
    axes = panel(figure, "d")
    assert lines(axes, "heyoka_principal")[0][0] == pytest.approx([0.2, 2000])
    assert lines(axes, "route_codes")[0][0][1] == axes.get_ylim()[0] == 0


def test_ever_more_orbits_are_dotted_beyond_what_was_measured(figure: Figure) -> None:
    axes = panel(figure, "e")
    assert np.transpose(lines(axes, "route_codes_map")[0])[1].tolist() == [1e-3, 1e-2, 0.1]
    assert max(y for line in lines(axes, "_scaled") for _, y in line) == pytest.approx(2000)
    assert max(line[0][1] for line in lines(axes, "_first")) == pytest.approx(2.001)


def test_the_legend_holds_what_is_shown(figure: Figure) -> None:
    [legend] = figure.legends
    shown: Any = {line.get_label() for axes in figure.axes for line in axes.lines}
    expected = {APPEARANCES[name].label for name in shown & set(METHODS)}
    assert {text.get_text() for text in legend.get_texts()} == expected
    assert APPEARANCES["heyoka_two_forms"].label in expected
