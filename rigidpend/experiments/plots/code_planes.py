"""Planes of orbits: where cells end, and lines along which symbols of their codes change."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

LINES = ((0.9, "0.0"), (0.55, "0.12"), (0.3, "0.25"))
"""Widths and greys of the lines where symbols 1, 2, 3 change."""


def cell_ends(values: NDArray[np.float64]) -> tuple[float, float]:
    """The outer ends of cells, from their middles."""
    half = (values[1] - values[0]) / 2
    return float(values[0] - half), float(values[-1] + half)


def draw_changes(
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    codes: NDArray[np.uint8],
    lines: tuple[tuple[float, str], ...] = LINES,
) -> None:
    """Draw the changes of the first symbols of codes (symbols, rows, columns)."""
    for (width, grey), layer in reversed(list(zip(lines, codes, strict=False))):
        if (layer != layer.flat[0]).any():
            axes.contour(x, y, layer == 1, [0.5], colors=grey, linewidths=width)
