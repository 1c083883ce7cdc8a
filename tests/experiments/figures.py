"""Figures of results in our style, for tests of what is drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rigidpend.experiments.data import Loaded
from rigidpend.render import STYLE


def styled(draw: Callable[[Loaded], Figure], result: Loaded, *, laid_out: bool = False) -> Figure:
    """The figure of a result; laid out, its artists have their places."""
    with matplotlib.rc_context(fname=STYLE):
        made = draw(result)
        if laid_out:
            # With a canvas all passes measure the same text once.
            FigureCanvasAgg(made)
            made.draw_without_rendering()
    return made


def panel(figure: Figure, letter: str) -> Any:
    """The panel whose title begins with a letter."""
    [found] = [x for x in figure.axes if x.get_title(loc="left").startswith(f"{letter})")]
    return found


def check_on_page(figure: Figure) -> None:
    """Hold that a figure, laid out, is no wider than a page, and no panel sticks out of it."""
    assert figure.get_size_inches()[0] <= 7.2 + 1e-9
    width, height = figure.bbox.size
    for axes in figure.axes:
        box = axes.get_tightbbox()
        assert box is not None
        assert box.x0 > -1
        assert box.y0 > -1
        assert box.x1 < width + 1
        assert box.y1 < height + 1
