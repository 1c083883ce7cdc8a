"""The figure of `heteroclinic_cycle`: the graph that is drawn is the file's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation

from rigidpend.experiments.contract import Means
from rigidpend.experiments.heteroclinic_cycle import compute as heteroclinic_cycle
from rigidpend.experiments.heteroclinic_cycle.draw import draw
from rigidpend.experiments.heteroclinic_cycle.schema import Config
from tests.config.samples import content as typed
from tests.experiments.figures import styled
from tests.experiments.trees import from_file

FIG2 = Path(__file__).resolve().parents[3] / "configs" / "fig2.yaml"


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Any:
    tree = heteroclinic_cycle.compute(typed(Config, FIG2), Means())
    return from_file(tmp_path_factory.mktemp("result"), "heteroclinic_cycle", tree)


@pytest.fixture(scope="module")
def figure(result: Any) -> Figure:
    return styled(draw, result, laid_out=True)


def arrows(figure: Figure) -> list[Annotation]:
    """The edges, in the order in which they were drawn."""
    [axes] = figure.axes
    return [t for t in axes.texts if isinstance(t, Annotation) and t.arrow_patch is not None]


def test_every_edge_of_the_file_is_an_arrow_from_its_start_to_its_end(
    figure: Figure, result: Any
) -> None:
    edges = result["data"]["edges"]
    for k, arrow in enumerate(arrows(figure)):
        assert arrow.get_label() == f"{edges['from'][k]} -> {edges['to'][k]}"
        assert arrow.xyann == (edges["theta1"][0, k], edges["J1"][0, k])
        assert arrow.xy == (edges["theta1"][1, k], edges["J1"][1, k])
        assert arrow.arrow_patch is not None
        assert "-|>" in str(type(arrow.arrow_patch.get_arrowstyle()).arrow)  # type: ignore[attr-defined]
    assert len(arrows(figure)) == len(edges["symbol"]) == 13


def test_the_symbols_are_written_at_the_turns_and_nowhere_else(figure: Figure, result: Any) -> None:
    [axes] = figure.axes
    symbols = zip(arrows(figure), result["data"]["edges"]["symbol"], strict=True)
    expected = {id(arrow.arrow_patch): int(symbol) for arrow, symbol in symbols if symbol != 255}
    written = [t for t in axes.texts if t.get_text() in ("0", "1") and isinstance(t, Annotation)]
    found = {id(t.xycoords): int(t.get_text()) for t in written}
    assert found == expected


def test_a_symbol_stands_beside_the_middle_of_its_arrow(figure: Figure, result: Any) -> None:
    [axes] = figure.axes
    edges = result["data"]["edges"]
    middles = {
        id(a.arrow_patch): axes.transData.transform(
            (edges["theta1"][:, k].mean(), edges["J1"][0, k])
        )
        for k, a in enumerate(arrows(figure))
    }
    written = [t for t in axes.texts if t.get_text() in ("0", "1") and isinstance(t, Annotation)]
    for text in written:
        box, middle = text.get_window_extent(), middles[id(text.xycoords)]
        assert abs((box.x0 + box.x1) / 2 - middle[0]) < 8
        outside = box.y0 - middle[1] if middle[1] > axes.bbox.y0 + 5 else middle[1] - box.y1
        assert 0 < outside < 20


def test_the_symbols_have_their_own_colours_and_lines(figure: Figure, result: Any) -> None:
    looks: dict[int, set[Any]] = {}
    edges = result["data"]["edges"]
    for arrow, symbol, again in zip(arrows(figure), edges["symbol"], edges["again"], strict=True):
        if not again:
            assert arrow.arrow_patch is not None
            colour = tuple(arrow.arrow_patch.get_edgecolor())
            looks.setdefault(int(symbol), set()).add(
                (colour, str(arrow.arrow_patch.get_linestyle()))
            )
    assert sorted(looks) == [0, 1, 255]
    assert all(len(look) == 1 for look in looks.values())
    assert len(set.union(*looks.values())) == 3


def test_the_vertices_are_the_file_s(figure: Figure, result: Any) -> None:
    [axes] = figure.axes
    v = result["data"]["vertices"]
    found = {(t.get_text(), t.get_position()) for t in axes.texts if t.get_bbox_patch() is not None}
    assert found == set(zip(v["label"], zip(v["theta1"], v["J1"], strict=True), strict=True))


def test_the_rectangles_are_shaded_and_named(figure: Figure, result: Any) -> None:
    [axes] = figure.axes
    rectangles = result["data"]["rectangles"]
    patches = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    for patch, name, bounds in zip(
        patches, rectangles["name"], rectangles["theta1"].T, strict=True
    ):
        assert patch.get_label() == name
        np.testing.assert_allclose((patch.get_x(), patch.get_x() + patch.get_width()), bounds)
        [text] = [t for t in axes.texts if t.get_text() == f"{name} rectangle"]
        inner, outer = text.get_window_extent(), patch.get_window_extent()
        assert outer.x0 < inner.x0 < inner.x1 < outer.x1
    assert patches[0].get_facecolor() != patches[1].get_facecolor()


def test_the_ticks_are_the_places_of_the_separatrices(figure: Figure, result: Any) -> None:
    [axes] = figure.axes
    v = result["data"]["vertices"]
    np.testing.assert_array_equal(axes.get_xticks(), v["theta1"][v["J1"] == 0])
    texts = [label.get_text() for label in axes.get_xticklabels()]
    assert texts[0] == "$\\beta_0-\\alpha_0$\n\n$-0.3398$"
    assert texts[3] == "$\\beta_0+\\alpha_0$\n$+2\\pi$\n$9.7646$"
    assert axes.get_xlabel() == r"$\theta_1$ (rad, modulo $4\pi$)"
    assert axes.get_ylabel() == "$J_1/J_2$"


def test_everything_is_on_a_page(figure: Figure) -> None:
    assert figure.get_size_inches()[0] <= 7.2
    box = figure.get_tightbbox().transformed(figure.dpi_scale_trans)
    frame = figure.bbox.padded(1)
    assert frame.contains(box.x0, box.y0)
    assert frame.contains(box.x1, box.y1)
