"""As many parts as a config may ask for are drawn: below each other where the page is full."""

from __future__ import annotations

import struct
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from rigidpend import render
from rigidpend.experiments.asymptotic_surfaces import draw as surfaces
from rigidpend.experiments.precession import draw as precession
from rigidpend.experiments.route_codes import draw as codes
from tests.experiments.trees import reference


def arrays(count: int) -> Any:
    result = reference("fig4")
    result["data"] = {f"a{k}": result["data"]["right"] for k in range(count)}
    return result


def bodies(count: int) -> Any:
    result = reference("fig3")
    one = result["data"]["bodies"]["a"]
    result["data"]["bodies"] = {f"b__{k}_": one for k in range(count)}
    table = result["data"]["table"]
    result["data"]["table"] = {name: np.resize(x, count) for name, x in table.items()}
    return result


def inside(figure: Figure) -> None:
    """No panel lies on another, none beyond the page."""
    boxes = [axes.get_position() for axes in figure.axes]
    for k, box in enumerate(boxes):
        assert box.width > 0
        assert box.height > 0
        assert 0 <= box.x0 < box.x1 <= 1 + 1e-9
        assert 0 <= box.y0 < box.y1 <= 1
        assert not any(box.overlaps(other) for other in boxes[:k])


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 6, 7, 20])
def test_any_number_of_arrays_has_its_panels(count: int) -> None:
    with matplotlib.rc_context(fname=render.STYLE):
        figure = codes.draw(arrays(count))
    assert len(figure.axes) == count
    inside(figure)
    assert figure.get_figwidth() <= 7.2 + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 7, 8, 20])
def test_any_number_of_bodies_has_its_panels(count: int) -> None:
    with matplotlib.rc_context(fname=render.STYLE):
        figure = surfaces.draw(bodies(count))
    assert len(figure.axes) == 2 * count
    inside(figure)


def test_every_body_has_its_curve() -> None:
    result = reference("precession")
    group = result["data"]["bodies"]
    result["data"]["bodies"] = {name: np.concatenate([x] * 3) for name, x in group.items()}
    with matplotlib.rc_context(fname=render.STYLE):
        figure = precession.draw(result)
    for panel in figure.axes[1:4]:
        curves = [line for line in panel.lines if str(line.get_label()) != "guide"]
        assert len(curves) == 15


@pytest.mark.slow
def test_an_image_of_many_parts_has_no_more_pixels_than_can_be_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As with 400 parts and the bound of the library, in a fiftieth of the time."""
    assert render.PIXELS < 2**16, "the library refuses 2^16 in a direction"
    monkeypatch.setattr(render, "PIXELS", 800)
    for count in (1, 14):
        width, height = struct.unpack(">II", render.image([arrays(count)], "png")[16:24])
        assert 700 < max(width, height) <= 800


@pytest.mark.slow
def test_names_with_underscores_are_drawn() -> None:
    assert render.image([bodies(2)], "png").startswith(b"\x89PNG")
