"""As many parts as a config may ask for are drawn: below each other where the page is full."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

from rigidpend import experiments, render
from tests.experiments.figures import styled
from tests.experiments.trees import reference


def arrays(count: int) -> Any:
    result = reference("fig4")
    result["data"] = {f"a{k}": result["data"]["right"] for k in range(count)}
    return result


def bodies(count: int) -> Any:
    """Bodies whose names have underscores, which would lower what is behind them."""
    result = reference("fig3")
    one = result["data"]["bodies"]["a"]
    result["data"]["bodies"] = {f"b__{k}_": one for k in range(count)}
    table = result["data"]["table"]
    result["data"]["table"] = {name: np.resize(x, count) for name, x in table.items()}
    return result


@pytest.mark.slow
@pytest.mark.parametrize(
    ("several", "count", "panels"),
    [*((arrays, n, n) for n in (6, 7, 20)), *((bodies, n, 2 * n) for n in (1, 7, 8))],
)
def test_any_number_of_parts_has_its_panels_on_the_page_and_none_upon_another(
    several: Any, count: int, panels: int
) -> None:
    result = several(count)
    figure = styled(experiments.drawing(result["attributes"]["experiment"]).draw, result)
    boxes = [axes.get_position() for axes in figure.axes]
    assert len(boxes) == panels
    for k, box in enumerate(boxes):
        assert box.width > 0
        assert box.height > 0
        assert 0 <= box.x0 < box.x1 <= 1 + 1e-9
        assert 0 <= box.y0 < box.y1 <= 1
        assert not any(box.overlaps(other) for other in boxes[:k])
    assert figure.get_figwidth() <= 7.2 + 1e-9


def test_every_body_has_its_curve() -> None:
    result = reference("precession")
    group = result["data"]["bodies"]
    result["data"]["bodies"] = {name: np.concatenate([x] * 3) for name, x in group.items()}
    figure = styled(experiments.drawing("precession").draw, result)
    # Beside a guide.
    assert [len(panel.lines) for panel in figure.axes[1:]] == [16] * 3


@pytest.mark.slow
def test_an_image_of_many_parts_has_no_more_pixels_than_can_be_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As with 400 parts and the bound of the library, in a fiftieth of the time."""
    assert render.PIXELS < 2**16, "the library refuses 2^16 in a direction"
    monkeypatch.setattr(render, "PIXELS", 800)
    for several in (arrays(14), bodies(2)):
        width, height = struct.unpack(">II", render.image([several], "png")[16:24])
        assert 700 < max(width, height) <= 800
