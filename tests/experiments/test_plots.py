"""The ticks at the separatrices: named in order, and readable for every body."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from rigidpend.experiments.heteroclinic_cycle.draw import PANEL
from rigidpend.experiments.plots import WIDTH, separatrix_ticks

PLACES = ["beta_0-", "beta_0+", "beta_0-", "beta_0+", "beta_0-"]


def axes_with(alpha0: float, width: float) -> Figure:
    """A figure with an axis of that width in inches, separatrices for alpha0, beta0 = 1."""
    figure = Figure(figsize=(7.2, 3))
    axes = figure.add_axes((0.1, 0.4, width / 7.2, 0.5))
    first, second = 1 - alpha0, 1 + alpha0
    places = np.array([first, second, first + 2 * np.pi, second + 2 * np.pi, first + 4 * np.pi])
    separatrix_ticks(axes, places, digits=3)
    figure.draw_without_rendering()
    return figure


@pytest.mark.slow
@pytest.mark.parametrize("width", [3.1, WIDTH * PANEL[2]])
@pytest.mark.parametrize("alpha0", [0.05, 0.3, 0.8, 1.2, np.pi / 2, 1.9, 2.4, 2.8, 3.1])
def test_no_two_labels_overlap_for_any_body(alpha0: float, width: float) -> None:
    [axes] = axes_with(alpha0, width).axes
    boxes = [label.get_window_extent() for label in axes.get_xticklabels()]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


def test_each_label_names_its_separatrix_and_its_place() -> None:
    [axes] = axes_with(1.9, 6.0).axes
    texts = [label.get_text() for label in axes.get_xticklabels()]
    assert all(place in text for place, text in zip(PLACES, texts, strict=True))
    shown = [float(text.splitlines()[-1].strip("$")) for text in texts]
    np.testing.assert_allclose(shown, axes.get_xticks(), atol=5e-4)
