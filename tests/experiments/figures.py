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
    [found] = [x for x in figure.axes if x.get_title(loc="left").startswith(f"{letter})")]
    return found
