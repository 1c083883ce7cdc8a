"""Figures of results in our style, for tests of what is drawn."""

from __future__ import annotations

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rigidpend import experiments
from rigidpend.experiments.data import Loaded
from rigidpend.render import STYLE


def styled(result: Loaded, *, laid_out: bool = False) -> Figure:
    """The figure of a result; laid out, its artists have their places."""
    with matplotlib.rc_context(fname=STYLE):
        made = experiments.drawing(result["attributes"]["experiment"]).draw(result)
        if laid_out:
            # With a canvas all passes measure the same text once.
            FigureCanvasAgg(made)
            made.draw_without_rendering()
    return made


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]
