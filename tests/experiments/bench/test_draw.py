"""The figure of `bench`: its lines are the file's. Artists, never pixels."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rigidpend.experiments.bench.draw import LOOKS, draw
from rigidpend.measure.benchmark.methods import METHODS
from rigidpend.render import STYLE
from tests.measure.benchmark.data import data


@pytest.fixture(scope="module")
def figure() -> Figure:
    with matplotlib.rc_context(fname=STYLE):
        made = draw({"data": data()})
        made.draw_without_rendering()
    return made


def line(axes: Axes, label: str) -> Line2D:
    [found] = [line for line in axes.lines if line.get_label() == label]
    return found


def xy(axes: Axes, label: str) -> Any:
    return np.asarray(line(axes, label).get_xydata())


def test_every_method_has_a_look_of_its_own() -> None:
    assert set(LOOKS) == set(METHODS)
    assert len({(look.colour, look.marker, str(look.line)) for look in LOOKS.values()}) == len(
        LOOKS
    )


def test_lines_are_time_against_error(figure: Figure) -> None:
    axes, record = figure.axes[0], data()["free_body"]["scipy_dop853"]
    np.testing.assert_array_equal(
        xy(axes, "scipy_dop853"), np.stack((record["error"], record["seconds"]), axis=1)
    )
    assert axes.get_xscale() == axes.get_yscale() == "log"
    left, right = axes.get_xlim()
    assert left > right, "smaller errors are to the right"


def test_an_error_that_is_none_is_not_drawn(figure: Figure) -> None:
    assert len(xy(figure.axes[0], "heyoka_eq1")) == 2
    assert not [x for x in figure.axes[0].lines if x.get_label() == "diffrax"]
    assert len(xy(figure.axes[1], "scipy_dop853")) == 2


def test_what_did_not_go_all_the_way_is_hollow(figure: Figure) -> None:
    axes = figure.axes[2]
    marks = [x for x in axes.lines if x.get_label() == "scipy_dop853, marks"]
    assert [x.get_markerfacecolor() for x in marks if len(np.asarray(x.get_xydata()))] == ["white"]
    marks = [x for x in axes.lines if x.get_label() == "aligned_batch, marks"]
    assert [x.get_markerfacecolor() for x in marks if len(np.asarray(x.get_xydata()))] != ["white"]


def test_ours_lies_above_and_is_widest(figure: Figure) -> None:
    axes = figure.axes[0]
    ours, others = (
        line(axes, "aligned_batch"),
        [line(axes, "scipy_dop853"), line(axes, "heyoka_eq1")],
    )
    assert ours.get_linewidth() > max(other.get_linewidth() for other in others)
    assert ours.get_zorder() > max(other.get_zorder() for other in others)


def test_the_cost_is_drawn_against_both_numbers(figure: Figure) -> None:
    for axes, n in zip(figure.axes[3:5], (10.0, 5.0), strict=True):
        assert xy(axes, "route_codes")[1, 0] == n


def test_who_has_every_symbol_right_is_ranked_by_time(figure: Figure) -> None:
    axes = figure.axes[5]
    at = {str(x.get_label()): np.asarray(x.get_xydata())[0].tolist() for x in axes.lines}
    assert at == {"scipy_dop853": [16, 0], "route_codes": [0.02, 1], "aligned_batch": [0.007, 2]}
    assert {text.get_text() for text in axes.texts} == {LOOKS[name].label for name in at}


def test_axes_name_what_they_show_with_units(figure: Figure) -> None:
    for axes in figure.axes:
        assert axes.get_xlabel()
    assert all("(s)" in axes.get_ylabel() for axes in figure.axes[:5])
    assert figure.get_figwidth() == 7.2


def test_the_legend_holds_what_is_shown(figure: Figure) -> None:
    [legend] = figure.legends
    shown = {text.get_text() for text in legend.get_texts()}
    assert shown == {
        LOOKS[name].label
        for name in ("route_codes", "aligned_batch", "heyoka_eq1", "scipy_dop853", "diffrax")
    }


def test_who_is_fast_is_named_on_the_right_and_who_is_slow_on_the_left(figure: Figure) -> None:
    """Inside the panel, beside the mark and not upon it."""
    [axes] = [x for x in figure.axes if x.get_xlabel() == "time (s)" and not len(x.get_yticks())]
    points = [np.asarray(x.get_xydata()) for x in axes.lines]
    marks = [x[0] for x in points if len(x) == 1]
    middle = np.sqrt(np.prod([min(x for x, _ in marks), max(x for x, _ in marks)]))
    assert len(axes.texts) == len(marks) > 1
    for text, (seconds, row) in zip(axes.texts, marks, strict=True):
        box, at = text.get_window_extent(), axes.transData.transform((seconds, row))
        if seconds <= middle:
            assert box.x0 > at[0] + 3
        else:
            assert box.x1 < at[0] - 3


def test_times_are_medians_and_not_the_fastest(figure: Figure) -> None:
    record = data()["free_body"]["scipy_dop853"]
    assert (record["fastest"] < record["seconds"]).all()
    np.testing.assert_array_equal(xy(figure.axes[0], "scipy_dop853")[:, 1], record["seconds"])
    [axes] = [x for x in figure.axes if x.get_xlabel() == "time (s)" and not len(x.get_yticks())]
    shown = {str(x.get_label()): float(x.get_xdata()[0]) for x in axes.lines}  # type: ignore[arg-type, index]
    for name, seconds in shown.items():
        assert seconds in data()["codes"][name]["seconds"]
