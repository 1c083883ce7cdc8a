"""The figure of planes: words as colours, lines at changes, the config's own row, zooms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

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


def figure_of(doubtful: bool = False, marked: float = -8.0, **zooms: Any) -> Any:
    data = {**plane(0, 6, doubtful), "y_axis": "log10_J1_0", "marked": marked, "nu": 4.4}
    return styled(draw, loaded({**data, "zooms": zooms} if zooms else data))


def test_words_are_a_gray_code_between_0_and_1() -> None:
    codes = np.array([[0, 0, 0, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 1, 0, 0], [0, 1, 1, 0, 0, 1, 1, 0]])
    found = words(codes[:, None, :].astype(np.uint8))[0]
    assert found == pytest.approx(np.arange(8) / 8)


def test_lines_are_where_symbols_change() -> None:
    (axes,) = figure_of().axes
    first = axes.collections[-1].get_paths()[0].vertices
    assert np.ptp(first[:, 0]) < 1
    assert abs(first[:, 0].mean() - 3) < 0.5


def test_zooms_are_framed_in_the_smallest_plane_around_them() -> None:
    figure = figure_of(first=plane(1, 3), second=plane(1.5, 2))
    whole, first, second = figure.axes
    assert [frame.get_label() for frame in whole.patches] == ["first"]
    assert [frame.get_label() for frame in first.patches] == ["second"]
    assert not second.patches


@pytest.mark.parametrize("doubtful", [True, False])
def test_uncertain_cells_are_marked(doubtful: bool) -> None:
    figure = figure_of(doubtful)
    marks = [line for line in figure.axes[0].lines if line.get_label() == "uncertain"]
    assert len(marks) == doubtful
    if doubtful:
        assert marks[0].get_xdata() == pytest.approx([plane(0, 6)["x"][3]])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert ("uncertain" in labels) == doubtful


@pytest.mark.parametrize(("marked", "shown"), [(-8.0, True), (-2.0, False)])
def test_the_row_of_the_config_is_marked_where_it_is_shown(marked: float, shown: bool) -> None:
    (axes,) = figure_of(marked=marked).axes
    lines = [line for line in axes.lines if line.get_label() == "marked"]
    assert len(lines) == shown


def test_columns_have_their_name_and_their_own_value_marked() -> None:
    data = {**plane(0, 6), "y_axis": "mu", "marked": -8.0, "nu": 4.4}
    (axes,) = draw(loaded({**data, "x_axis": "h0", "marked_x": 1.5})).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$h_0$", r"$\mu$")
    lines = [line for line in axes.lines if line.get_label() == "marked"]
    assert [(*np.ravel(line.get_xdata()), *np.ravel(line.get_ydata())) for line in lines] == [
        (0, 1, -8.0, -8.0),
        (1.5, 1.5, 0, 1),
    ]
    (plain,) = draw(loaded(data)).axes
    assert plain.get_xlabel() == r"$\theta_2^0$ (rad)"
