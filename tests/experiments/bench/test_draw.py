"""The figure of the benchmark: what wins and loses is where the numbers are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from rigidpend.experiments.bench.draw import APPEARANCES, LOSS, draw
from rigidpend.experiments.bench.measuring.methods import METHODS
from rigidpend.results.store import load
from tests.experiments.bench.measuring.data import data
from tests.experiments.figures import check_on_page, styled
from tests.results.loaded import loaded


@pytest.fixture(scope="module")
def figure() -> Figure:
    return styled(draw, loaded(data()), laid_out=True)


def panel(figure: Figure, title: str) -> Axes:
    [found] = [axes for axes in figure.axes if title in axes.get_title(loc="left")]
    return found


def xy(axes: Axes, label: str) -> Any:
    [found] = [line for line in axes.lines if line.get_label() == label]
    return np.asarray(found.get_xydata())


def test_every_method_has_an_appearance_of_its_own() -> None:
    assert set(APPEARANCES) == set(METHODS)
    looks = {(look.colour, look.marker, look.line) for look in APPEARANCES.values()}
    assert len(looks) == len(APPEARANCES)


def test_the_stored_measurement_fills_the_page_and_does_not_leave_it() -> None:
    """Words beside a panel take no width from the others."""
    made = styled(draw, load(Path("results/measured/bench.h5")), laid_out=True)
    check_on_page(made)
    panels = [axes for axes in made.axes if axes.axison]
    assert sum(axes.get_position().width for axes in panels[:2]) > 0.6


def test_ratios_are_those_of_the_meeting_with_the_fastest_on_top(figure: Figure) -> None:
    axes = panel(figure, "a)  free body")
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == ["SciPy DOP853", "ours, batches", "heyoka, (eq1) $^+$"]
    assert xy(axes, "heyoka_eq1")[0].tolist() == pytest.approx([0.5, 2])
    assert xy(axes, "aligned_batch")[0].tolist() == [1, 1]
    left, right = axes.get_xlim()
    assert left < 1 < right
    assert axes.get_xscale() == "log"


def test_two_threads_are_a_ring_beside_the_dot(figure: Figure) -> None:
    axes = panel(figure, "b)  route codes")
    rings = [line for line in axes.lines if line.get_markerfacecolor() == "white"]
    assert sorted(float(np.asarray(x.get_xydata())[0, 0]) for x in rings) == pytest.approx([1, 2])


def test_only_a_peer_that_is_faster_and_good_enough_is_named_in_red(figure: Figure) -> None:
    for title, expected in (("a)  free", set()), ("b)  route", {"heyoka, Euler-Poisson"})):
        labels = panel(figure, title).get_yticklabels()
        red = {x.get_text() for x in labels if to_rgba(x.get_color()) == to_rgba(LOSS)}
        assert red == expected
        bold = {x.get_text() for x in labels if x.get_fontweight() == "bold"}
        assert bold == {"ours, batches"}


def test_work_is_time_against_error_and_only_the_front(figure: Figure) -> None:
    axes = panel(figure, "route codes: each alone")
    np.testing.assert_array_equal(xy(axes, "aligned_batch"), [[1e-2, 0.006], [1e-7, 0.007]])
    # An error of the size of the answer is not drawn.
    np.testing.assert_array_equal(xy(axes, "scipy_dop853"), [[1e-3, 12], [1e-6, 16]])
    left, right = axes.get_xlim()
    assert left > right, "smaller errors are to the right"
    assert not [x for x in panel(figure, "body: each").lines if x.get_label() == "diffrax"]


def test_wrong_symbols_are_per_million_and_none_lies_on_the_floor(figure: Figure) -> None:
    axes = panel(figure, "random phases, J1_0 = 1e-10")
    assert xy(axes, "heyoka_principal")[0].tolist() == pytest.approx([0.2, 2000])
    assert xy(axes, "route_codes")[0, 1] == 0
    assert axes.get_ylim()[0] == 0


def test_ever_more_orbits_are_dotted_beyond_what_was_measured(figure: Figure) -> None:
    axes = panel(figure, "ever more orbits")
    np.testing.assert_array_equal(xy(axes, "route_codes_map")[:, 1], [1e-3, 1e-2, 0.1])
    dotted = [np.asarray(x.get_xydata()) for x in axes.lines if x.get_linestyle() == ":"]
    assert max(line[-1, 1] for line in dotted) == pytest.approx(2000), "0.2 s an orbit, 10,000"
    dashed = [np.asarray(x.get_xydata()) for x in axes.lines if x.get_linestyle() == "--"]
    assert max(line[0, 1] for line in dashed) == pytest.approx(2.001)
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")


def test_axes_name_what_they_show_with_units(figure: Figure) -> None:
    drawn = [axes for axes in figure.axes if axes.axison]
    assert all(axes.get_xlabel() for axes in drawn)
    assert figure.get_figwidth() == 7.2


def test_the_legend_holds_what_is_shown(figure: Figure) -> None:
    [legend] = figure.legends
    shown = {text.get_text() for text in legend.get_texts()}
    names = {
        "route_codes",
        "route_codes_map",
        "aligned_batch",
        "heyoka_eq1",
        "heyoka_principal",
        "scipy_dop853",
    }
    assert shown == {APPEARANCES[name].label for name in names | {"diffrax"}}
