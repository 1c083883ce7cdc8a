"""Fig. 3 as drawn: every panel shows the file's curves, in the file's window."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from rigidpend.experiments.asymptotic_surfaces.draw import draw
from tests.experiments.figures import styled
from tests.processes import modules
from tests.results.loaded import loaded

NAMES = ("a", "b", "c")
SURFACES = ("S2_plus", "S1_minus")


def curves(seed: int) -> dict[str, Any]:
    """Two curves, of 3 and 4 points."""
    random = np.random.default_rng(seed)
    return {
        "theta1": 3 + 0.01 * random.uniform(-1, 1, 7),
        "J1_over_J2": random.uniform(0, 1, 7),
        "sample": np.arange(7),
        "offsets": np.array([0, 3, 7]),
        "theta2_0": np.array([0.0, 1.0]),
    }


def body(k: int) -> dict[str, Any]:
    swing = 0.002 * (k + 1)
    return {
        "centre": 3.0,
        "Delta_1": swing,
        "born": 3 + swing * np.array([-1, 1]),
        "window": 3 + 3 * swing * np.array([-1, 1]),
        "time_step": 0.1,
        "S1_minus": curves(2 * k),
        "S2_plus": curves(2 * k + 1),
    }


@pytest.fixture
def data() -> dict[str, Any]:
    table = {name: np.array([1.5, 2.25, 10.0]) for name in ("alpha0", "gamma0", "nu")}
    return {"table": table, "bodies": {name: body(k) for k, name in enumerate(NAMES)}}


def drawn(data: Any) -> Figure:
    return styled(draw, loaded(data))


def panel(figure: Figure, name: str, surface: str) -> Axes:
    [found] = [axes for axes in figure.axes if axes.get_label() == f"{name} {surface}"]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("name", NAMES)
def test_a_panel_draws_the_file_s_curves_in_the_file_s_window(
    data: Any, name: str, surface: str
) -> None:
    axes, group = panel(drawn(data), name, surface), data["bodies"][name]
    [lines] = [x for x in axes.collections if isinstance(x, LineCollection)]
    segments = lines.get_segments()
    assert [len(x) for x in segments] == [3, 4]
    points = np.column_stack((group[surface]["theta1"], group[surface]["J1_over_J2"]))
    np.testing.assert_array_equal(np.concatenate(segments), points)
    assert axes.get_xlim() == tuple(group["window"])
    low, high = axes.get_ylim()
    assert low < 0 < 1 < high
    np.testing.assert_array_equal(axes.get_xticks(), group["born"])
    edges = [float(np.asarray(line.get_xdata())[0]) for line in axes.lines]
    np.testing.assert_array_equal(edges, group["born"])


def test_S2_plus_is_above_S1_minus_and_bodies_stand_side_by_side(data: Any) -> None:
    figure = drawn(data)
    boxes = {axes.get_label(): axes.get_position() for axes in figure.axes}
    assert len(boxes) == 6
    for name in NAMES:
        upper, lower = (boxes[f"{name} {surface}"] for surface in SURFACES)
        assert 0 < lower.y0 < lower.y1 < upper.y0 < upper.y1 < 1
        assert (upper.x0, upper.x1) == (lower.x0, lower.x1)
    assert np.ptp([box.height for box in boxes.values()]) < 1e-12
    row = [boxes[f"{name} S1_minus"] for name in NAMES]
    assert 0 < row[0].x0 < row[0].x1 < row[1].x0 < row[1].x1 < row[2].x0 < row[2].x1 < 1


def test_panels_say_their_letter_nu_place_and_scale(data: Any) -> None:
    figure = drawn(data)
    for name, nu, swing in zip(NAMES, ("1.50", "2.25", "10.00"), (2, 4, 6), strict=True):
        title = panel(figure, name, "S2_plus").get_title()
        assert rf"\it{{{name}}}" in title
        assert nu in title
        label = panel(figure, name, "S1_minus").get_xlabel()
        assert r"\theta_1 - 3.0000$ rad" in label
        assert rf"\Delta_1 = 0.00{swing}00$ rad" in label
    for surface, said in zip(SURFACES, ("$S_2^{+}$", "$S_1^{-}$"), strict=True):
        first = panel(figure, "a", surface)
        assert first.get_ylabel() == "$J_1/J_2$"
        assert [text.get_text() for text in first.texts] == [said]


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 3, 7, 12])
def test_any_number_of_bodies_fits_the_page(n: int) -> None:
    data = {
        "table": {"nu": np.arange(n) + 1.0},
        "bodies": {f"b{k}": body(k % 3) for k in range(n)},
    }
    figure = drawn(data)
    assert figure.get_size_inches()[0] <= 7.2 + 1e-9
    assert len(figure.axes) == 2 * n
    assert all(axes.get_position().x1 < 1 for axes in figure.axes)


@pytest.mark.slow
def test_the_figure_is_drawn_without_an_integrator_or_pyplot(tmp_path: Path) -> None:
    found = modules("import rigidpend.experiments.asymptotic_surfaces.draw", tmp_path)
    computing = {
        "heyoka",
        "scipy",
        "matplotlib.pyplot",
        "rigidpend.surfaces.curves",
        "rigidpend.orbits.integrate",
        "rigidpend.mechanics.periodic",
    }
    assert found & computing == set()


def test_a_surface_s_name_stands_left_of_its_row_in_the_upper_half(data: Any) -> None:
    figure = drawn(data)
    figure.draw_without_rendering()
    for surface in SURFACES:
        axes = panel(figure, "a", surface)
        [text] = axes.texts
        box = text.get_window_extent()
        assert 0 < box.x0 < box.x1 < axes.bbox.x0
        assert (box.y0 + box.y1) / 2 > (axes.bbox.y0 + axes.bbox.y1) / 2
