"""The figure of the benchmark: what wins and loses is where the numbers are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rigidpend.experiments.bench.draw import APPEARANCES, draw, style
from rigidpend.experiments.bench.methods import METHODS
from tests.experiments.bench.data import data
from tests.experiments.figures import panel, styled
from tests.results.loaded import loaded


@pytest.fixture(scope="module")
def figure() -> Figure:
    return styled(draw, loaded(data()))


POINTS: Any = [
    # Ratios of the meeting: of a family the fastest that is good enough.
    ("a", "aligned_batch", [[1, 0]], [[1, 1]]),
    ("a", "heyoka_eq1", [[0.5, 0]]),
    ("a", "heyoka_principal", [[0.8, 1]]),
    ("a", "route_codes"),
    ("a", "heyoka_two_forms"),
    # Shares of bodies that rise to all with the slowest; a peer's 1,000 orbits scaled to 10,000.
    ("b", "route_codes_auto", [[5, 0.25], [5, 0.5], [10, 0.75], [40, 1]]),
    ("c", "route_codes_auto", [[1, 0.25], [1.5, 0.5], [2, 0.75], [8, 1]]),
    ("c", "heyoka_principal", [[0.68, 0.25], [2.3, 0.5], [2.3, 0.75], [2.3, 1]]),
    # Time against error; an error of the size of the answer is not drawn.
    ("d", "aligned_batch", [[1e-2, 0.006], [1e-7, 0.007]]),
    ("d", "scipy_dop853", [[1e-3, 12], [1e-6, 16]]),
    # Wrong symbols per million, none on the floor.
    ("e", "heyoka_principal", [[0.2, 2000]]),
    ("e", "route_codes", [[0.2, 0]]),
]


@pytest.mark.parametrize(("letter", "name", "expected"), [(x, y, z) for x, y, *z in POINTS])
def test_lines_are_where_the_numbers_are(
    figure: Figure, letter: str, name: str, expected: Any
) -> None:
    lines = [x for x in panel(figure, letter).lines if x.get_label() == name]
    for line, points in zip(lines, expected, strict=True):
        np.testing.assert_allclose(np.asarray(line.get_xydata()), points)


def test_axes_say_which_way_is_better(figure: Figure) -> None:
    ratios = panel(figure, "a")
    assert [x.get_text() for x in ratios.get_yticklabels()] == ["free body", "route codes"]
    assert ratios.get_ylim()[0] > ratios.get_ylim()[1], "the first row is above"
    hollow = {x.get_label() for x in ratios.lines if x.get_markerfacecolor() == "white"}
    assert hollow == {"heyoka_eq1"}, "what did not reach the level"
    assert "10,000 orbits" in panel(figure, "c").get_xlabel()
    left, right = panel(figure, "d").get_xlim()
    assert left > right, "smaller errors are to the right"
    assert panel(figure, "e").get_ylim()[0] == 0


def test_families_look_different_and_the_legend_holds_those_that_are_shown(figure: Figure) -> None:
    assert set(APPEARANCES) == {method.family for method in METHODS.values()}
    assert len({(x["color"], x["marker"]) for x in APPEARANCES.values()}) == len(APPEARANCES)
    assert style("heyoka_two_forms")["ls"] == "--" != style("heyoka_principal")["ls"]
    assert style("route_codes")["color"] != style("aligned_batch")["color"]
    [legend] = [found for half in figure.subfigs for found in half.legends]
    assert [text.get_text() for text in legend.get_texts()] == [
        *("rigidpend", "rigidpend, every symbol certain", "heyoka, batches", "SciPy DOP853"),
        "two runs of a peer compared",
    ]
