"""The figure of `route_codes`: what is drawn is what the file holds. Artists, never pixels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from rigidpend import render
from rigidpend.experiments.route_codes.draw import draw
from rigidpend.results import store
from tests.experiments.figures import styled
from tests.results.loaded import loaded

REFERENCE = Path(__file__).resolve().parents[3] / "results" / "reference" / "fig4.h5"
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
    """Two arrays as in Fig. 4."""
    return {"left": array(LEFT), "right": array(RIGHT)}


def drawn(data: Data) -> Figure:
    return styled(draw, loaded(data), laid_out=True)


def mesh(axes: Axes) -> QuadMesh:
    [found] = [artist for artist in axes.collections if isinstance(artist, QuadMesh)]
    return found


def line(axes: Axes, marker: str) -> Any:
    """The points of the markers of that kind, (n, 2), or None."""
    found = [artist for artist in axes.lines if artist.get_marker() == marker]
    assert len(found) <= 1
    return np.array(found[0].get_xydata()).reshape(-1, 2) if found else None


def frames(axes: Axes) -> list[Rectangle]:
    return [patch for patch in axes.patches if isinstance(patch, Rectangle)]


def legend(figure: Figure) -> list[str]:
    [found] = figure.legends
    return [text.get_text() for text in found.get_texts()]


def cell_sides(axes: Axes, columns: int, rows: int) -> tuple[float, float]:
    """Width and height of a cell on paper, inches."""
    figure = axes.figure
    assert isinstance(figure, Figure)
    box, (wide, high) = axes.get_position(), figure.get_size_inches()
    return float(box.width * wide / columns), float(box.height * high / rows)


def colour(axes: Axes, code: int) -> tuple[float, ...]:
    """The colour in which a code is drawn."""
    return tuple(mesh(axes).to_rgba(np.array([[code]]))[0, 0, :3])


def test_the_axes_are_the_phase_in_radians_and_the_symbol_s_number(data: Data) -> None:
    for axes in drawn(data).axes:
        assert axes.get_xlabel() == r"$\theta_2^0$ (rad)"
        assert axes.get_ylabel() == "$i$"


def test_each_array_is_drawn_in_the_file_s_order_under_its_name(data: Data) -> None:
    assert [axes.get_title(loc="left") for axes in drawn(data).axes] == ["left", "right"]
    assert [axes.get_title(loc="left") for axes in drawn({"a": array(LEFT)}).axes] == ["a"]


def test_the_mesh_holds_the_file_s_codes() -> None:
    groups = store.load(REFERENCE)["data"]
    figure = drawn(groups)
    assert len(figure.axes) == len(groups) == 2
    for axes, group in zip(figure.axes, groups.values(), strict=True):
        np.testing.assert_array_equal(mesh(axes).get_array(), group["codes"])


def test_zero_is_black_and_one_is_white(data: Data) -> None:
    for axes in drawn(data).axes:
        assert colour(axes, 0) == (0, 0, 0)
        assert colour(axes, 1) == (1, 1, 1)
        assert colour(axes, 255) not in {(0, 0, 0), (1, 1, 1)}


def test_the_bottom_row_is_the_first_symbol(data: Data) -> None:
    for axes, group in zip(drawn(data).axes, data.values(), strict=True):
        corners = np.asarray(mesh(axes).get_coordinates())
        np.testing.assert_allclose(corners[:, 0, 1], np.arange(16) + 0.5)
        assert axes.get_ylim() == (0.5, 15.5)
        assert 1 in axes.get_yticks()
        # Each cell is around its phase, half a step wide on both sides.
        middle = (corners[0, 1:, 0] + corners[0, :-1, 0]) / 2
        np.testing.assert_allclose(middle, group["theta2_0"], atol=1e-12)
        np.testing.assert_allclose(axes.get_xlim(), corners[0, [0, -1], 0])


def test_the_cells_of_fig4_are_square_and_of_one_size(data: Data) -> None:
    sides = [cell_sides(a, n, 15) for a, n in zip(drawn(data).axes, (63, 32), strict=True)]
    assert np.ptp(np.ravel(sides)) < 0.01 * np.mean(sides)


def test_the_arrays_do_not_overlap_and_stay_on_the_page(data: Data) -> None:
    left, right = (axes.get_position() for axes in drawn(data).axes)
    assert 0 < left.x0 < left.x1 < right.x0 < right.x1 < 1
    assert 0 < left.y0 < left.y1 < 1


def test_the_markers_are_at_the_file_s_melnikov_zeros(data: Data) -> None:
    left, right = drawn(data).axes
    np.testing.assert_array_equal(line(left, "^")[:, 0], ZEROS)
    # No zero lies in the right array.
    assert len(line(right, "^")) == 0


def test_only_zeros_inside_the_range_are_marked() -> None:
    group = array(LEFT[10:40], zeros=[0.94, 0.96, 3.94, 3.96])
    [axes] = drawn({"a": group}).axes
    np.testing.assert_array_equal(line(axes, "^")[:, 0], [0.96, 3.94])


def test_the_frame_is_the_extent_of_what_it_magnifies(data: Data) -> None:
    left, right = drawn(data).axes
    [frame] = frames(left)
    np.testing.assert_allclose((frame.get_x(), frame.get_x() + frame.get_width()), right.get_xlim())
    assert (frame.get_y(), frame.get_y() + frame.get_height()) == (0.5, 15.5)
    assert frames(right) == []


def test_the_magnified_array_has_the_frame_s_colour(data: Data) -> None:
    left, right = drawn(data).axes
    [frame] = frames(left)
    edge = frame.get_edgecolor()
    assert all(spine.get_edgecolor() == edge for spine in right.spines.values())
    assert all(spine.get_edgecolor() != edge for spine in left.spines.values())


def test_arrays_side_by_side_magnify_nothing() -> None:
    figure = drawn({"a": array(LEFT[:20]), "b": array(LEFT[30:50])})
    assert [frames(axes) for axes in figure.axes] == [[], []]
    assert "magnified part" not in legend(figure)


def test_uncertain_cells_and_no_others_are_marked(data: Data) -> None:
    cells = {(0, 0), (14, 62), (3, 7)}
    for row, column in cells:
        data["left"]["certain"][row, column] = False
    left, right = drawn(data).axes
    found = {(round(y) - 1, round(x * 10)) for x, y in line(left, "x")}
    assert found == cells
    assert len(line(left, "x")) == 3
    assert line(right, "x") is None


def test_the_legend_of_fig4_says_what_is_in_it(data: Data) -> None:
    assert legend(drawn(data)) == [
        "$z_i = 0$ (left)",
        "$z_i = 1$ (right)",
        "zero of Melnikov's integral",
        "magnified part",
    ]


def test_the_legend_tells_of_doubt_and_of_no_return_only_where_there_are(data: Data) -> None:
    data["right"]["certain"][4, 4] = False
    assert legend(drawn(data))[4:] == ["uncertain"]
    data["left"]["codes"][5, 5] = 255
    assert legend(drawn(data))[4:] == ["no return", "uncertain"]
    data["right"]["certain"][4, 4] = True
    assert legend(drawn(data))[4:] == ["no return"]


@pytest.mark.slow
@pytest.mark.parametrize(("columns", "rows"), [(1, 15), (2, 1), (63, 30), (1000, 15), (40, 300)])
def test_any_number_of_cells_is_drawn_inside_the_figure(columns: int, rows: int) -> None:
    group = array(np.arange(columns) / 1000, rows)
    [axes] = drawn({"a": group}).axes
    np.testing.assert_array_equal(mesh(axes).get_array(), group["codes"])
    box = axes.get_position()
    assert 0 < box.x0 < box.x1 < 1
    assert 0 < box.y0 < box.y1 < 1
    wide, _ = axes.figure.get_size_inches()  # type: ignore[union-attr]
    assert 3.4 - 1e-9 <= wide <= 7.2 + 1e-9
    width, height = cell_sides(axes, columns, rows)
    # Cells are square but where rows would be lower than can be seen.
    assert height == pytest.approx(max(width, 0.06))
    assert width <= 0.12 + 1e-9
    if columns >= 63:
        assert wide == pytest.approx(7.2) or width == pytest.approx(0.12)


def test_thirty_symbols_keep_square_cells() -> None:
    [axes] = drawn({"a": array(LEFT, 30)}).axes
    width, height = cell_sides(axes, 63, 30)
    assert width == pytest.approx(height, rel=0.01)
    assert axes.get_ylim() == (0.5, 30.5)


def test_zeros_are_marked_where_phases_descend_too() -> None:
    [axes] = drawn({"a": array(LEFT[::-1])}).axes
    assert sorted(line(axes, "^")[:, 0]) == ZEROS.tolist()


def test_the_legend_names_no_marker_that_is_not_drawn() -> None:
    figure = drawn({"a": array(RIGHT)})
    assert "zero of Melnikov's integral" not in legend(figure)


@pytest.mark.parametrize("columns", [1, 3, 20, 63])
def test_the_legend_is_inside_the_figure_and_below_the_axes(columns: int) -> None:
    group = array(LEFT[:columns])
    group["codes"][0, 0], group["certain"][1, 0] = 255, False
    figure = drawn({"a": group})
    assert figure.get_size_inches()[0] >= 3.4 - 1e-9
    [found], [axes] = figure.legends, figure.axes
    box = found.get_window_extent()
    assert 0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert 0 <= box.y0 < box.y1 <= axes.get_window_extent().y0


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_equal_results_give_equal_images_whenever_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    images = []
    for name, seconds in (("a", "0"), ("b", "1000000000")):
        # What matplotlib takes for the time of day.
        monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
        target = tmp_path / f"{name}.{suffix}"
        render.render(REFERENCE, target)
        images.append(target.read_bytes())
    assert images[0] == images[1]
    starts = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
    assert images[0].startswith(starts[suffix])


def test_render_leaves_matplotlib_s_settings_as_they_were(tmp_path: Path) -> None:
    with matplotlib.rc_context({"font.size": 17, "savefig.dpi": 51}):
        before = dict(matplotlib.rcParams)
        render.render(REFERENCE, tmp_path / "a.png")
        assert dict(matplotlib.rcParams) == before


@pytest.mark.slow
def test_the_reader_s_settings_leave_the_figure_as_it_is(tmp_path: Path) -> None:
    render.render(REFERENCE, tmp_path / "a.png")
    with matplotlib.rc_context({"font.size": 17, "savefig.dpi": 51, "savefig.bbox": "tight"}):
        render.render(REFERENCE, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_figure_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    target = tmp_path / "none" / "a.png"
    with pytest.raises(store.StoreError, match="cannot be written: No such file or directory"):
        render.render(REFERENCE, target)
