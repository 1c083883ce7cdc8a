"""Ticks of a theta1 axis at the separatrices 1, 2, 3, 4 and, 4 pi further, 1."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

NAMES = (
    "$\\beta_0-\\alpha_0$\n",
    "$\\beta_0+\\alpha_0$\n",
    "$\\beta_0-\\alpha_0$\n$+2\\pi$",
    "$\\beta_0+\\alpha_0$\n$+2\\pi$",
    "$\\beta_0-\\alpha_0$\n$+4\\pi$",
)
"""Labels of the five places, as in (sol_1)-(sol_22)."""
CLOSE = 0.14
"""Distance of places, in parts of the axis, below which their labels turn away not to touch."""


def put(axes: Axes, places: ArrayLike, digits: int) -> None:
    """Name the places on the x axis, whose limits they are.

    Parameters
    ----------
    axes : Axes
    places : (5,) array
        theta1 of the separatrices, ascending, radians.
    digits : int
        Behind the point.
    """
    x = np.asarray(places, dtype=float).tolist()
    labels = [f"{name}\n${place:.{digits}f}$" for name, place in zip(NAMES, x, strict=True)]
    axes.set_xticks(x, labels)
    texts = axes.get_xticklabels()
    for (left, right), (first, second) in zip(pairwise(x), pairwise(texts), strict=True):
        if right - left < CLOSE * (x[-1] - x[0]):
            first.set_horizontalalignment("right")
            second.set_horizontalalignment("left")
    axes.set_xlim(x[0], x[-1])
