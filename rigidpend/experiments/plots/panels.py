"""Titles of panels and entries of legends, as all figures have them."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D


def title(axes: Axes, letter: str, text: str, size: float = 8.5) -> None:
    """Title of a panel, behind its letter."""
    axes.set_title(f"{letter})  {text}", loc="left", fontsize=size)


def entry(label: str, **look: Any) -> Line2D:
    """A line or a mark of a legend, for what is drawn alike."""
    return Line2D([], [], label=label, **look)
