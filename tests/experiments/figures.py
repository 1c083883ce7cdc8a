"""Figures of results in our style, for tests of what is drawn."""

from __future__ import annotations

from collections.abc import Callable

import matplotlib
from matplotlib.figure import Figure

from rigidpend.render import STYLE
from rigidpend.results.tree import Loaded


def styled(draw: Callable[[Loaded], Figure], result: Loaded, *, laid_out: bool = False) -> Figure:
    """The figure of a result; laid out, its artists have their places."""
    with matplotlib.rc_context(fname=STYLE):
        made = draw(result)
        if laid_out:
            made.draw_without_rendering()
    return made
