"""The arrays of Fig. 4 as the paper draws them; its marks and its legend tell what there is."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.route_codes.draw import draw
from tests.experiments.figures import styled
from tests.results.loaded import loaded

LEFT, RIGHT = np.arange(63) / 10, 3 * np.pi / 40 + np.arange(32) / 100
ZEROS = np.array([1.563050, 4.704643])

Data = dict[str, dict[str, Any]]


def array(phases: Any, rows: int = 15, zeros: Any = ZEROS) -> dict[str, Any]:
    """An array of certain codes in which no row or column is like the next."""
    i, k = np.indices((rows, len(phases)))
    return {
        "theta2_0": np.asarray(phases, dtype=float),
        "codes": ((i * i + 3 * k + k // 2) % 3 % 2).astype(np.uint8),
        "certain": np.ones((rows, len(phases)), dtype=bool),
        "melnikov_zeros": np.asarray(zeros),
    }


@pytest.fixture
def data() -> Data:
    return {"left": array(LEFT), "right": array(RIGHT)}


def drawn(data: Data, *, laid_out: bool = False) -> Figure:
    return styled(draw, loaded(data), laid_out=laid_out)


def marks(axes: Axes, marker: str) -> Any:
    """The points of the markers of that kind, (n, 2)."""
    found = [np.reshape(x.get_xydata(), (-1, 2)) for x in axes.lines if x.get_marker() == marker]
    return np.concatenate(found) if found else np.empty((0, 2))


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def cell_sides(axes: Axes, columns: int, rows: int) -> Any:
    """Width and height of a cell on paper, inches."""
    figure: Any = axes.figure
    box, (wide, high) = axes.get_position(), figure.get_size_inches()
    return box.width * wide / columns, box.height * high / rows


def test_zero_is_black_one_is_white_and_square_cells_stand_around_their_phases(data: Data) -> None:
    figure, sides = drawn(data, laid_out=True), []
    for axes, group in zip(figure.axes, data.values(), strict=True):
        mesh: Any = axes.collections[0]
        zero, one, none = mesh.to_rgba(np.array([[0, 1, 255]]))[0, :, :3].tolist()
        assert (zero, one) == ([0, 0, 0], [1, 1, 1])
        assert none not in (zero, one)
        np.testing.assert_array_equal(mesh.get_array(), group["codes"])
        corners = np.asarray(mesh.get_coordinates())
        np.testing.assert_allclose(corners[:, 0, 1], np.arange(16) + 0.5)
        assert axes.get_ylim() == (0.5, 15.5), "the bottom row is the first symbol"
        middle = (corners[0, 1:, 0] + corners[0, :-1, 0]) / 2
        np.testing.assert_allclose(middle, group["theta2_0"], atol=1e-12)
        sides += cell_sides(axes, group["theta2_0"].size, 15)
    assert np.ptp(sides) < 0.01 * np.mean(sides)
    left, right = (axes.get_position() for axes in figure.axes)
    assert 0 < left.x1 < right.x0 < right.x1 < 1


@pytest.mark.parametrize(
    ("phases", "zeros", "shown"),
    [
        (LEFT, ZEROS, [*ZEROS]),
        (RIGHT, ZEROS, []),
        (LEFT[::-1], ZEROS, [*ZEROS]),
        (LEFT[10:40], [0.94, 0.96, 3.94, 3.96], [0.96, 3.94]),
    ],
    ids=["both", "none", "descending", "within"],
)
def test_zeros_of_melnikov_s_integral_inside_the_range_are_marked(
    phases: Any, zeros: Any, shown: list[float]
) -> None:
    figure = drawn({"a": array(phases, zeros=zeros)})
    assert sorted(marks(figure.axes[0], "^")[:, 0]) == shown
    assert ("zero of Melnikov's integral" in legend(figure)) == bool(shown)


def test_what_is_magnified_is_framed_in_the_colour_of_what_magnifies_it(data: Data) -> None:
    left, right = drawn(data).axes
    [frame] = left.patches
    box: Any = frame.get_extents().transformed(left.transData.inverted())
    np.testing.assert_allclose(box.intervalx, right.get_xlim())
    np.testing.assert_allclose(box.intervaly, (0.5, 15.5))
    edge = frame.get_edgecolor()
    assert all(spine.get_edgecolor() == edge for spine in right.spines.values())
    assert all(spine.get_edgecolor() != edge for spine in left.spines.values())
    apart = drawn({"a": array(LEFT[:20]), "b": array(LEFT[30:50])})
    assert not any(axes.patches for axes in (*apart.axes, right))
    assert "magnified part" not in legend(apart)
    # What ends where the whole does is inside it.
    both = {"a": array(np.arange(8)), "b": array(5.125 + np.arange(10) / 4)}
    assert len(drawn(both).axes[0].patches) == 1

    alone = drawn({"a": array([0.25]), "b": array(0.2 + np.arange(8) / 100)})
    assert not any(axes.patches for axes in alone.axes)


@pytest.mark.parametrize("columns", [1, 2, 3, 8])
def test_phases_of_few_columns_are_told_and_none_upon_another(columns: int) -> None:
    for start in (0.0, 3 * np.pi / 40, 1.0):
        figure = drawn({"a": array(start + np.arange(columns) / 10)})
        [axes] = figure.axes
        low, high = axes.get_xlim()
        ticks = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
        shown = [(x, label) for x, label in ticks if low <= x <= high]
        assert shown
        for x, label in shown:
            assert abs(float(label.get_text()) - x) < 1e-5
        boxes = [label.get_window_extent() for _, label in shown]
        assert all(one.x1 < two.x0 for one, two in pairwise(boxes))


def test_uncertain_and_proven_cells_and_no_others_are_marked(data: Data) -> None:
    cells = {(0, 0), (14, 62), (3, 7)}
    data["left"]["proven"] = np.zeros((15, 63), dtype=bool)
    for row, column in cells:
        data["left"]["certain"][row, column] = False
        data["left"]["proven"][14 - row, column] = True
    figure = drawn(data)
    assert "proven symbol" in legend(figure)
    left, right = figure.axes
    for marker, rows in (("x", 0), ("o", 14)):
        found = [(round(y) - 1, round(x * 10)) for x, y in marks(left, marker)]
        assert sorted(found) == sorted((abs(rows - row), column) for row, column in cells)
        assert not len(marks(right, marker))


@pytest.mark.parametrize("doubt", [False, True])
@pytest.mark.parametrize("lost", [False, True])
def test_the_legend_tells_of_doubt_and_of_no_return_where_there_are(
    data: Data, doubt: bool, lost: bool
) -> None:
    data["right"]["certain"][4, 4] = not doubt
    data["left"]["codes"][5, 5] = 255 if lost else 0
    always = ["$z_i = 0$ (left)", "$z_i = 1$ (right)", "zero of Melnikov's integral"]
    said = ["magnified part", *["no return"] * lost, *["uncertain"] * doubt]
    assert legend(drawn(data)) == always + said


@pytest.mark.slow
@pytest.mark.parametrize(("columns", "rows"), [(1, 15), (2, 1), (63, 30), (1000, 15), (40, 300)])
def test_any_number_of_cells_is_drawn_inside_the_figure(columns: int, rows: int) -> None:
    figure = drawn({"a": array(np.arange(columns) / 1000, rows)}, laid_out=True)
    [axes] = figure.axes
    box, below = axes.get_position(), figure.legends[0].get_window_extent()
    assert 0 < box.x0 < box.x1 < 1
    assert 0 < box.y0 < box.y1 < 1
    assert 0 <= below.x0 < below.x1 <= figure.bbox.x1
    assert 0 <= below.y0 < below.y1 <= axes.get_window_extent().y0
    wide, (width, height) = figure.get_figwidth(), cell_sides(axes, columns, rows)
    assert 3.4 - 1e-9 <= wide <= 7.2 + 1e-9
    # Cells are square but where rows would be lower than can be seen.
    assert height == pytest.approx(max(width, 0.06))
    assert width <= 0.12 + 1e-9
    if columns >= 63:
        assert wide == pytest.approx(7.2) or width == pytest.approx(0.12)
