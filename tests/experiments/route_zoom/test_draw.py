"""The figure of zooms: its arrays are the file's."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import QuadMesh

from rigidpend.experiments.route_zoom.draw import draw
from tests.experiments.figures import styled
from tests.results.loaded import loaded

N = 5


def level(step: float, seed: int, doubtful: bool = False) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    certain = np.ones((4, N), dtype=bool)
    certain[3, 1] = not doubtful
    return {
        "codes": random.integers(0, 2, (4, N)).astype(np.uint8),
        "certain": certain,
        "bits": np.array([53, 53, 113, 64, 53]),
        "offset": (np.arange(N) - 2) * step,
        "step": step,
    }


def figure_of(**levels: Any) -> Any:
    data = {"levels": levels, "symbol": 1, "repeats_after": 9.22, "reference_bits": 192}
    return styled(draw, loaded(data))


def test_every_level_is_drawn_with_its_step_and_its_codes() -> None:
    levels = {"level00": level(1e-1, 0), "level01": level(1e-3, 1)}
    drawn = [axes for axes in figure_of(**levels).axes if axes.collections]
    assert len(drawn) == 2
    for axes, given, step in zip(drawn, levels.values(), ("10^{-1}", "10^{-3}"), strict=True):
        [mesh] = [c for c in axes.collections if isinstance(c, QuadMesh)]
        assert np.array_equal(np.asarray(mesh.get_array()).reshape(4, N), given["codes"])
        assert step in axes.get_title()


def test_only_uncertain_cells_are_marked() -> None:
    figure = figure_of(level00=level(1e-1, 0), level01=level(1e-3, 1, doubtful=True))
    marks = [[x for x in axes.lines if x.get_label() == "uncertain"] for axes in figure.axes[:2]]
    assert marks[0] == []
    [mark] = marks[1]
    assert np.allclose(mark.get_xydata(), [[-1, 4]])


def test_the_caption_says_what_repeats_and_why() -> None:
    said = " ".join(text.get_text() for text in figure_of(level00=level(1e-1, 0)).texts)
    assert "9.22" in said
    assert "192 bits" in said.replace("\n", " ")
    assert "one rotation" in said.replace("\n", " ")
    assert "(rad" in said or "in steps" in said
