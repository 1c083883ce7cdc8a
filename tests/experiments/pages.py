"""Figures of results, with all that is on them in its place, and what is upon another."""

import itertools
from collections.abc import Iterable
from typing import Any

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rigidpend import experiments
from rigidpend.render import STYLE


def styled(result: Any) -> Figure:
    """The figure of a result in the style of all."""
    with matplotlib.rc_context(fname=STYLE):
        figure: Figure = experiments.drawing(result["attributes"]["experiment"]).draw(result)
    return figure


def laid_out(figure: Figure) -> Figure:
    """The same figure, whose artists have their places."""
    with matplotlib.rc_context(fname=STYLE):
        # With a canvas all passes measure the same text once.
        FigureCanvasAgg(figure)
        figure.draw_without_rendering()
    return figure


def overlap(boxes: Iterable[Any]) -> bool:
    """Whether a box is upon another one."""
    return any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
