"""The figure of the splitting: every panel shows what the file holds, and no more."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from rigidpend.experiments.splitting.draw import BITS, NONE, draw
from tests.experiments.figures import check_on_page, styled
from tests.processes import modules
from tests.results.loaded import loaded

RATIOS = np.array([1e-6, 1e-3, 0.03, 0.1, 0.3])
NAMES = np.array(["a", "fig4", "b", "c"], dtype=object)


@pytest.fixture
def data() -> dict[str, Any]:
    rng = np.random.default_rng(1)
    resolved = np.ones((4, 5), dtype=bool)
    resolved[3, 3:] = False
    excess = RATIOS[:, None] * rng.uniform(-1, 1, (4, 5, 6))
    excess[3, 4] = np.nan
    g = np.linspace(-np.pi, np.pi, 9)
    return {
        "mu_over_h0": RATIOS,
        "bodies": {
            "name": NAMES,
            "nu": np.array([1.5, 4.25, 6.0, 12.0]),
            "reduced": np.exp(-rng.uniform(1, 9, (4, 5))),
            "curve_excess": RATIOS * rng.uniform(1, 2, (4, 5)),
            "excess": excess,
            "error": np.where(resolved, 3.2e-14, np.inf),
            "resolved": resolved,
            "bits": np.array([[113, 64, 53, 53, 53]] * 4),
        },
        "curve": {
            "body": "fig4",
            "g": g,
            "melnikov": np.cos(g),
            "measured": np.cos(g) + RATIOS[:, None] * np.sin(2 * g + 0.1),
        },
        "closed_form": {"nu": np.linspace(1, 14, 20), "decay": np.exp(-np.linspace(1, 14, 20))},
    }


def drawn(data: Any) -> Figure:
    return styled(draw, loaded(data))


def line(axes: Axes, label: str) -> Any:
    [found] = [x for x in axes.lines if x.get_label() == label]
    return np.column_stack((np.asarray(found.get_xdata()), np.asarray(found.get_ydata())))


def test_the_curves_are_the_file_s_from_a_visible_mu_on(data: Any) -> None:
    axes, curve = drawn(data).axes[0], data["curve"]
    for k, said in ((2, "$0.03$"), (3, "$0.1$"), (4, "$0.3$")):
        np.testing.assert_array_equal(line(axes, said)[:, 1], curve["measured"][k])
    np.testing.assert_array_equal(line(axes, "Melnikov")[:, 1], curve["melnikov"])
    assert "$0.001$" not in [x.get_label() for x in axes.lines]
    np.testing.assert_allclose(line(axes, "heteroclinic")[:, 0], [-np.pi / 2, np.pi / 2])


def test_a_curve_that_is_not_known_is_not_drawn(data: Any) -> None:
    data["curve"]["measured"][4] = np.nan
    labels = [x.get_label() for x in drawn(data).axes[0].lines]
    assert "$0.1$" in labels
    assert "$0.3$" not in labels


@pytest.mark.slow
@pytest.mark.parametrize("row", range(4))
def test_errors_are_the_file_s_where_they_are_resolved(data: Any, row: int) -> None:
    axes, bodies = drawn(data).axes[1], data["bodies"]
    known, name = bodies["resolved"][row], NAMES[row]
    whole, cosine = (line(axes, f"{field} {name}") for field in ("curve_excess", "excess"))
    np.testing.assert_array_equal(whole[:, 0], RATIOS[known])
    np.testing.assert_array_equal(whole[:, 1], bodies["curve_excess"][row][known])
    np.testing.assert_array_equal(cosine[:, 1], np.abs(bodies["excess"][row, known, 0]))
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_the_decay_stands_beside_its_closed_form(data: Any) -> None:
    axes, bodies = drawn(data).axes[2], data["bodies"]
    np.testing.assert_array_equal(line(axes, r"$\nu/\sinh\nu$")[:, 1], data["closed_form"]["decay"])
    smallest = line(axes, r"$\mu/h_0 = 10^{-6}$")
    np.testing.assert_array_equal(
        smallest, np.column_stack((bodies["nu"], bodies["reduced"][:, 0]))
    )
    np.testing.assert_array_equal(line(axes, r"$\mu/h_0 = 0.3$")[:, 0], bodies["nu"][:3])
    assert [text.get_text() for text in axes.texts] == ["a", "4", "b", "c"]


def test_the_table_tells_precision_and_error_of_every_cell(data: Any) -> None:
    axes = drawn(data).axes[3]
    said = [text.get_text() for text in axes.texts]
    colours = [to_hex(patch.get_facecolor()).upper() for patch in axes.patches]
    assert len(said) == len(colours) == 20
    assert said[:5] == ["\N{MINUS SIGN}13"] * 5
    assert colours[:5] == [BITS[113], BITS[64], BITS[53], BITS[53], BITS[53]]
    assert said[18:] == ["\N{MULTIPLICATION SIGN}"] * 2
    assert colours[18:] == [NONE] * 2
    assert [x.get_text() for x in axes.get_yticklabels()] == [
        "a  1.5",
        "Fig. 4  4.2",
        "b  6.0",
        "c  12.0",
    ]


@pytest.mark.slow
def test_axes_are_named_and_the_page_holds_them(data: Any) -> None:
    figure = drawn(data)
    check_on_page(figure)
    for axes, letter in zip(figure.axes, "abcd", strict=True):
        assert axes.get_title(loc="left").startswith(f"{letter})")
        assert axes.get_xlabel()
        assert axes.get_ylabel()
    assert "(rad)" in figure.axes[0].get_xlabel()


def test_one_body_alone_can_be_drawn(data: Any) -> None:
    data["bodies"] = {key: values[1:2] for key, values in data["bodies"].items()}
    figure = drawn(data)
    assert len(figure.axes[3].patches) == 5


@pytest.mark.slow
def test_the_figure_is_drawn_without_an_integrator_or_pyplot(tmp_path: Path) -> None:
    found = modules(
        "import rigidpend.experiments.splitting.draw, rigidpend.experiments.precession.draw",
        tmp_path,
    )
    computing = {
        "heyoka",
        "scipy",
        "matplotlib.pyplot",
        "rigidpend.surfaces",
        "rigidpend.orbits.integrate",
        "rigidpend.mechanics.precession",
    }
    assert found & computing == set()


def test_labels_of_the_slopes_stand_beside_their_own_curves(data: Any) -> None:
    """The whole curve's errors are the larger: their label is on the upper left."""
    figure = drawn(data)
    places = {
        text.get_text().partition(" ")[0].partition(",")[0]: text.get_position()
        for axes in figure.axes
        for text in axes.texts
        if "slope" in text.get_text()
    }
    whole, cosine = places["whole"], places["$\\cos"]
    assert whole[1] > cosine[1] + 0.2
    assert whole[0] < cosine[0]


@pytest.mark.slow
def test_a_body_s_name_stands_above_and_right_of_its_mark(data: Any) -> None:
    figure = drawn(data)
    figure.draw_without_rendering()
    found = 0
    for axes in figure.axes:
        for text in axes.texts:
            if text.get_text() in ("a", "4", "b", "c") and hasattr(text, "xyann"):
                box, at = text.get_window_extent(), axes.transData.transform(text.xy)  # type: ignore[attr-defined]
                assert box.x0 > at[0]
                assert box.y0 > at[1]
                found += 1
    assert found == 4
