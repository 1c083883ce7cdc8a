"""Arrays of symbols as cells: black is 0, white is 1, grey is no symbol."""

from __future__ import annotations

from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch

from rigidpend.experiments.plots.palette import BLUE, GREEN, PINK, RED
from rigidpend.numbers.alphabet import NO_SYMBOL

ZOOM, DOUBT, ZERO, NONE = RED, PINK, BLUE, "0.7"
"""Colours of a magnified part, an uncertain symbol, a zero of Melnikov's integral, no return."""
PROVEN = GREEN
"""Colour of a proven symbol's dot."""
COLOURS = ListedColormap(["black", "white", NONE])
"""Colours of the codes 0, 1 and `NO_SYMBOL`, by the bounds of `NORM`."""
NORM = BoundaryNorm([-0.5, 0.5, 1.5, NO_SYMBOL + 0.5], 3)


def symbol_entries(zero: str = r"$z_i = 0$ (left)", one: str = r"$z_i = 1$ (right)") -> list[Patch]:
    """Legend entries of the two symbols."""
    return [
        Patch(facecolor="black", edgecolor="0.6", label=zero),
        Patch(facecolor="white", edgecolor="0.6", label=one),
    ]
