"""The figure of planes: words as colours, lines at changes, the config's own row, zooms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rigidpend.experiments.plots import DOUBT, ZOOM
from rigidpend.experiments.route_map.draw import draw, words
from tests.experiments.figures import styled
from tests.results.loaded import loaded

N = 8


def plane(low: float, high: float, doubtful: bool = False) -> dict[str, Any]:
    random = np.random.default_rng(1)
    x = low + (high - low) * (np.arange(N) + 0.5) / N
    codes = random.integers(0, 2, (3, N, N)).astype(np.uint8)
    codes[0] = x > (low + high) / 2
    certain = np.full((N, N), 3, dtype=np.uint8)
    certain[2, 3] -= doubtful
    by_map = np.ones((N, N), dtype=bool)
    return {"codes": codes, "certain": certain, "by_map": by_map, "x": x, "y": x - 10}


def figure_of(doubtful: bool = False, **given: Any) -> Any:
    own = {"y_axis": "log10_J1_0", "marked": -8.0, "nu": 4.4}
    return styled(draw, loaded({**plane(0, 6, doubtful), **own, **given}))


def coloured(axes: Any, colour: str) -> list[list[float]]:
    """The lines of a colour, flat: x, then y."""
    lines = [line for line in axes.lines if line.get_color() == colour]
    return [[*np.ravel(line.get_xdata()), *np.ravel(line.get_ydata())] for line in lines]


def test_words_are_a_gray_code_between_0_and_1() -> None:
    codes = np.array([[0, 0, 0, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 1, 0, 0], [0, 1, 1, 0, 0, 1, 1, 0]])
    found = words(codes[:, None, :].astype(np.uint8))[0]
    assert found == pytest.approx((np.arange(8) + 0.5) / 8)


@pytest.mark.parametrize(
    ("symbols", "shades", "lines"),
    [
        (1, "", "changes of symbol 1"),
        (2, "; shades: later symbols", "changes of symbols 1, 2"),
        (3, "; shades: later symbols", "changes of symbols 1, 2, 3"),
    ],
)
def test_the_legend_tells_of_the_symbols_that_there_are_and_shows_the_colours_of_the_first(
    symbols: int, shades: str, lines: str
) -> None:
    figure = figure_of(codes=plane(0, 6)["codes"][:symbols])
    [legend] = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said[:3] == [f"$z_1 = {k}${shades}" for k in (0, 1)] + [lines]
    [image] = figure.axes[0].images
    colours = image.to_rgba(image.get_array())[..., :3]
    for k, patch in enumerate(legend.get_patches()[:2]):
        from_legend = np.abs(colours - patch.get_facecolor()[:3]).sum(axis=-1)
        own = plane(0, 6)["codes"][0] == k
        assert from_legend[own].mean() < from_legend[~own].min()
        # Where no symbol follows there is one colour, that of the legend.
        assert symbols > 1 or from_legend[own].max() < 1e-12


def test_lines_are_where_symbols_change() -> None:
    (axes,) = figure_of().axes
    first = axes.collections[-1].get_paths()[0].vertices
    assert np.ptp(first[:, 0]) < 1
    assert abs(first[:, 0].mean() - 3) < 0.5


def test_zooms_are_framed_in_the_smallest_plane_around_them() -> None:
    figure = figure_of(zooms={"first": plane(1, 3), "second": plane(1.5, 2)})
    framed = [
        [(patch.get_x(), patch.get_width()) for patch in axes.patches] for axes in figure.axes
    ]
    assert framed == [[(1, 2)], [(1.5, 0.5)], []]
    # One may reach to the plane's ends.
    high = {
        part: {**plane(low, 6), "y": plane(low, 6)["x"] + 1} for part, low in (("", 0), ("a", 3))
    }
    figure = figure_of(**high[""], zooms={"a": high["a"]})
    assert [len(axes.patches) for axes in figure.axes] == [1, 0]


@pytest.mark.parametrize("doubtful", [True, False])
def test_uncertain_cells_are_marked(doubtful: bool) -> None:
    figure = figure_of(doubtful)
    place = [plane(0, 6)["x"][3], plane(0, 6)["y"][2]]
    assert coloured(figure.axes[0], DOUBT) == ([place] if doubtful else [])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert ("uncertain" in labels) == doubtful


def test_own_values_are_marked_where_they_are_shown_and_axes_have_their_names() -> None:
    (axes,) = figure_of(x_axis="h0", y_axis="mu", marked_x=1.5).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$h_0$", r"$\mu$")
    assert coloured(axes, ZOOM) == [[0, 1, -8, -8], [1.5, 1.5, 0, 1]]
    (axes,) = figure_of(marked=-2.0).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == (r"$\theta_2^0$ (rad)", r"$\log_{10} J_1^0$")
    assert coloured(axes, ZOOM) == []
