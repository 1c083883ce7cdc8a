"""The figure of the benchmark: what wins and loses is where the numbers are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.bench.draw import APPEARANCES, draw, style
from rigidpend.experiments.bench.methods import METHODS
from rigidpend.results.store import load
from tests.experiments.bench.data import data
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


def points(figure: Figure, letter: str, name: str) -> Any:
    """Where the one line of a method goes in a panel."""
    [found] = lines(panel(figure, letter), name)
    return np.array(found)


def test_every_family_has_an_appearance_of_its_own() -> None:
    assert set(APPEARANCES) == {method.family for method in METHODS.values()}
    assert len({(look.colour, look.marker) for look in APPEARANCES.values()}) == len(APPEARANCES)
    assert style("heyoka_two_forms")["ls"] == "--" != style("heyoka_principal")["ls"]
    assert style("route_codes")["color"] != style("aligned_batch")["color"]


def test_the_stored_measurement_is_one_page_and_does_not_leave_it() -> None:
    made = styled(draw, load(Path("results/measured/bench.h5")), laid_out=True)
    check_on_page(made)
    assert made.get_figwidth() == 7.2
    assert made.get_figheight() < 9


def test_ratios_are_those_of_the_meeting_and_of_a_family_the_fastest_that_is_good_enough(
    figure: Figure,
) -> None:
    axes = panel(figure, "a")
    assert [x.get_text() for x in axes.get_yticklabels()] == ["free body", "route codes"]
    assert lines(axes, "aligned_batch") == [[[1, 0]], [[1, 1]]]
    assert lines(axes, "heyoka_eq1")[0][0] == pytest.approx([0.5, 0])
    assert lines(axes, "heyoka_principal")[0][0] == pytest.approx([0.8, 1])
    assert lines(axes, "route_codes") == lines(axes, "heyoka_two_forms") == []
    assert axes.get_ylim()[0] > axes.get_ylim()[1], "the first row is above"
    hollow = {x.get_label() for x in axes.lines if x.get_markerfacecolor() == "white"}
    assert hollow == {"heyoka_eq1"}, "what did not reach the level"


def test_bodies_are_shares_that_rise_to_all_with_the_slowest(figure: Figure) -> None:
    again, first = (points(figure, letter, "route_codes_auto") for letter in "bc")
    assert again.T.tolist() == [[5, 5, 10, 40], [0.25, 0.5, 0.75, 1]]
    assert first.T[0].tolist() == [1, 1.5, 2, 8]
    # A peer's 1,000 orbits are scaled to the 10,000 that ours followed.
    assert points(figure, "c", "heyoka_principal")[-1].tolist() == pytest.approx([2.3, 1])
    assert "10,000 orbits" in panel(figure, "c").get_xlabel()


def test_work_is_time_against_error_and_only_the_front(figure: Figure) -> None:
    assert points(figure, "d", "aligned_batch").tolist() == [[1e-2, 0.006], [1e-7, 0.007]]
    # An error of the size of the answer is not drawn.
    assert points(figure, "d", "scipy_dop853").tolist() == [[1e-3, 12], [1e-6, 16]]
    left, right = panel(figure, "d").get_xlim()
    assert left > right, "smaller errors are to the right"


def test_wrong_symbols_are_per_million_and_none_lies_on_the_floor(figure: Figure) -> None:
    assert points(figure, "e", "heyoka_principal")[0] == pytest.approx([0.2, 2000])
    assert points(figure, "e", "route_codes")[0][1] == panel(figure, "e").get_ylim()[0] == 0


def test_ever_more_orbits_are_dotted_beyond_what_was_measured(figure: Figure) -> None:
    assert points(figure, "f", "route_codes_map").T[1].tolist() == [1e-3, 1e-2, 0.1]
    scaled = lines(panel(figure, "f"), "_scaled")
    assert max(y for line in scaled for _, y in line) == pytest.approx(2000)


def test_the_legend_holds_the_families_that_are_shown(figure: Figure) -> None:
    [legend] = [found for axes in figure.axes if (found := axes.get_legend())]
    assert [text.get_text() for text in legend.get_texts()] == [
        *("rigidpend", "rigidpend, every symbol certain", "heyoka, batches", "SciPy DOP853"),
        "two runs of a peer compared",
    ]
