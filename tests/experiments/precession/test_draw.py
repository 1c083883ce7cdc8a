"""The figure of the precession: increments and remainders are the file's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments.precession.draw import draw
from tests.experiments.figures import check_on_page, styled
from tests.results.loaded import loaded

RATIOS = np.array([1e-4, 1e-3, 1e-2])
NAMES = np.array(["i", "iii"], dtype=object)


@pytest.fixture
def data() -> dict[str, Any]:
    rng = np.random.default_rng(2)
    remainder = RATIOS[:, None] ** 2 * rng.uniform(1, 2, (2, 3, 4))
    slope = np.full((2, 4), 2.0)
    slope[1, [0, 2]] = np.nan
    return {
        "mu_over_h0": RATIOS,
        "drawn": 1,
        "bodies": {
            "name": NAMES,
            "alpha0": np.array([1.5, 2.0]),
            "beta0": np.array([3.14, 2.0]),
            "regime": np.array(["1 = 2 > 0 > 3 = 4", "2 > 0 = 1 = 3 > 4"], dtype=object),
            "unit": np.array([[1e-4, 1e-3, 1e-2], [2e-4, 2e-3, 2e-2]]),
            "first_order": 1e-3 * rng.uniform(-1, 1, (2, 3, 4)),
            "gained": 1e-3 * rng.uniform(-1, 1, (2, 3, 2, 4)),
            "remainder": remainder,
            "mean_remainder": RATIOS[:, None] * remainder,
            "slope": slope,
        },
    }


def drawn(data: Any) -> Figure:
    return styled(draw, loaded(data))


def panel(figure: Figure, letter: str) -> Axes:
    [found] = [x for x in figure.axes if x.get_title(loc="left").startswith(f"{letter})")]
    return found


def heights(axes: Axes, label: str) -> Any:
    [found] = [x for x in axes.lines if x.get_label() == label]
    return np.asarray(found.get_ydata())


@pytest.mark.slow
@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.parametrize("separatrix", [1, 2, 3, 4])
def test_increments_are_those_at_the_drawn_mu_in_the_largest_there_is(
    data: Any, row: int, separatrix: int
) -> None:
    axes, bodies, k = panel(drawn(data), "a"), data["bodies"], separatrix - 1
    unit, label = bodies["unit"][row, 1], f"{NAMES[row]} {separatrix}"
    first = heights(axes, f"first {label}")
    np.testing.assert_allclose(first, bodies["first_order"][row, 1, k] / unit)
    gained = heights(axes, f"gained {label}")
    np.testing.assert_allclose(gained, bodies["gained"][row, 1, :, k] / unit)


def test_every_regime_is_named_with_its_order_and_angles(data: Any) -> None:
    axes = panel(drawn(data), "a")
    labels = [x.get_text() for x in axes.get_xticklabels()]
    assert labels[0].startswith("i)  1 = 2 > 0 > 3 = 4\n")
    assert r"\alpha_0 = 2.00$, $\beta_0 = 2.00$" in labels[1]
    assert [text.get_text() for text in axes.texts] == ["1", "2", "3", "4"] * 2
    assert r"\mu/h_0 = 0.001" in axes.get_title(loc="left")


@pytest.mark.parametrize(
    ("letter", "field", "k"),
    [("b", "remainder", 1), ("c", "remainder", 0), ("d", "mean_remainder", 1)],
)
def test_remainders_are_the_file_s_beside_a_guide(
    data: Any, letter: str, field: str, k: int
) -> None:
    axes = panel(drawn(data), letter)
    for row, name in enumerate(NAMES):
        found = heights(axes, f"{field} {name}")
        np.testing.assert_array_equal(found, data["bodies"][field][row, :, k])
    guide = heights(axes, "guide")
    slope = np.log(guide[1] / guide[0]) / np.log(RATIOS[-1] / RATIOS[0])
    assert slope == pytest.approx(3 if letter == "d" else 2)
    assert axes.texts[0].get_text() == f"slope {slope:.0f}"
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_a_body_without_an_increment_is_named_as_rounding(data: Any) -> None:
    figure = drawn(data)
    assert [x.get_text() for x in panel(figure, "c").texts[1:]] == ["iii) no increment: rounding"]
    assert panel(figure, "b").texts[1:] == []


@pytest.mark.slow
def test_axes_are_named_and_the_page_holds_them(data: Any) -> None:
    figure = drawn(data)
    check_on_page(figure)
    assert [x.get_xlabel() for x in figure.axes[1:]] == [r"$\mu/h_0$"] * 3
    assert "(rad)" in panel(figure, "b").get_ylabel()
    assert r"\Delta\theta_3" in panel(figure, "a").get_ylabel()


def test_the_legend_names_the_bodies(data: Any) -> None:
    [legend] = drawn(data).legends
    assert [text.get_text() for text in legend.get_texts()] == ["i)", "iii)", "guide"]


@pytest.mark.slow
def test_a_separatrix_s_number_stands_on_the_far_side_of_its_increment_from_zero(
    data: Any,
) -> None:
    figure = drawn(data)
    figure.draw_without_rendering()
    axes, first = panel(figure, "a"), data["bodies"]["first_order"][:, 1]
    first = first / data["bodies"]["unit"][:, 1:2]
    numbers = [text for text in axes.texts if text.get_text() in ("1", "2", "3", "4")]
    assert len(numbers) == first.size
    for text, value in zip(numbers, first.ravel(), strict=True):
        box, at = text.get_window_extent(), axes.transData.transform((0, value))[1]
        middle = (box.y0 + box.y1) / 2
        assert (middle > at) == (value >= 0)
        assert abs(middle - at) > 5
