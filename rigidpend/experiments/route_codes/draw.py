"""Arrays of Fig. 4: black cells are symbol 0, white ones 1, the bottom row is i = 1.

In tables: the precision that decided symbols, and their agreement with Melnikov's sign.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.shared import MEANING
from rigidpend.machine.wording import Table
from rigidpend.numbers.expressions import NO_SYMBOL

LARGEST = 0.12
"""Largest side of a cell, inches."""
LOWEST = 0.06
"""Least height of a row, inches, even where cells are then not square."""
NARROWEST, ENTRY, ROW = 3.4, 1.4, 0.2
"""Least width of a figure, width and height of an entry of its legend, inches."""
LEFT, RIGHT, BELOW, ABOVE, BETWEEN = 0.45, 0.12, 0.75, 0.25, 0.55
"""Margins around the arrays, and the space between two, inches."""
ACROSS, APART, TALLEST = 6, 0.55, 100.0
"""Arrays side by side, at most; inches between bands of them, and of the highest array."""
MAGNIFIED = "magnified part"
"""Label of the legend's entry for frames, which results drawn together have not."""


class Array(NamedTuple):
    """One array of a result."""

    name: str
    theta2_0: NDArray[np.float64]
    codes: NDArray[np.uint8]
    certain: NDArray[np.bool_]
    melnikov_zeros: NDArray[np.float64]
    proven: NDArray[np.bool_]
    """All False where there is no certificate."""

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the largest phase of its columns' edges; phases may descend."""
        first, last = sorted(map(float, plots.column_edges(self.theta2_0)[[0, -1]]))
        return first, last

    @property
    def zeros_shown(self) -> list[float]:
        """Melnikov zeros within the array's range."""
        first, last = self.ends
        return [float(x) for x in self.melnikov_zeros if first <= x <= last]

    def magnifies(self, whole: Array) -> bool:
        """True if it lies inside another array and is finer."""
        (first, last), (low, high) = self.ends, whole.ends
        finer = (last - first) / len(self.theta2_0) < (high - low) / len(whole.theta2_0)
        return finer and low <= first and last <= high


def draw(result: Loaded) -> Figure:
    """Draw every array of a result, side by side as far as there is room, with square cells."""
    arrays = [_read(name, group) for name, group in result["data"].items()]
    bands = [arrays[k : k + ACROSS] for k in range(0, len(arrays), ACROSS)]
    cell = _cell(bands)
    wide = max(NARROWEST, *(plots.WIDTH - _room(band) + _columns(band) * cell for band in bands))
    entries = _legend_entries(arrays)
    across = min(len(entries), int(wide / ENTRY))
    below = BELOW + ROW * (-(-len(entries) // across) - 1)
    figure = _arranged(bands, cell, wide, below)
    for axes, array in zip(figure.axes, arrays, strict=True):
        _mark_zooms(axes, array, arrays)
    figure.legend(
        handles=entries,
        loc="lower center",
        ncols=across,
        handlelength=1.0,
        handleheight=1.0,
        columnspacing=1.6,
        borderaxespad=0.1,
    )
    return figure


def draw_together(results: Sequence[tuple[str, Loaded]]) -> Figure:
    """Draw the arrays of several results, a row for each, in one figure."""
    bands = [
        [_read(name, group) for name, group in result["data"].items()][:ACROSS]
        for _, result in results
    ]
    figure = _arranged(bands, _cell(bands), plots.WIDTH, BELOW)
    firsts = itertools.accumulate(map(len, bands), initial=0)
    for (label, _), band, first in zip(results, bands, firsts, strict=False):
        figure.axes[first].set_title(f"{band[0].name}, {label}", loc="left")
    shown = [array for band in bands for array in band]
    entries = [x for x in _legend_entries(shown) if x.get_label() != MAGNIFIED]
    figure.legend(handles=entries, loc="lower center", ncols=min(len(entries), ACROSS))
    return figure


def _arranged(bands: list[list[Array]], cell: float, wide: float, below: float) -> Figure:
    """Arrays in rows, with cells of that size, above so much room for a legend; inches."""
    heights = [
        min(max(len(array.codes) for array in band) * max(cell, LOWEST), TALLEST) for band in bands
    ]
    high = below + sum(heights) + len(bands) * (ABOVE + APART) - APART
    figure, bottom = Figure(figsize=(wide, high)), high
    for band, height in zip(bands, heights, strict=True):
        bottom, left = bottom - height - ABOVE, LEFT
        for array in band:
            width = array.codes.shape[1] * cell
            _draw_array(plots.panel(figure, left, bottom, width, height), array)
            left += width + BETWEEN
        bottom -= APART
    return figure


def _cell(bands: list[list[Array]]) -> float:
    """The side of a cell by which all rows have room, inches."""
    return min(LARGEST, *(_room(band) / _columns(band) for band in bands))


def _columns(band: list[Array]) -> int:
    return sum(array.codes.shape[1] for array in band)


def _room(band: list[Array]) -> float:
    """Inches for the cells of arrays side by side."""
    return plots.WIDTH - LEFT - RIGHT - BETWEEN * (len(band) - 1)


def _read(name: str, group: Data) -> Array:
    unproven = np.zeros_like(group["certain"])
    fields = (group.get(field, unproven) for field in Array._fields[1:])
    return Array(name, *map(np.asarray, fields))


def _draw_array(axes: Axes, array: Array) -> None:
    # Between more cells than that there would be nothing but lines to be seen.
    line: dict[str, Any] = (
        {"edgecolors": "0.6", "linewidth": 0.25} if array.codes.size < 5000 else {}
    )
    plots.draw_codes(axes, plots.column_edges(array.theta2_0), array.codes, **line)
    plots.mark_doubt(axes, array.theta2_0, array.certain)
    row, column = np.nonzero(array.proven)
    if row.size:
        axes.plot(array.theta2_0[column], row + 1, "o", color=plots.PROVEN, ms=0.9, mew=0)
    zeros, below = array.zeros_shown, axes.get_xaxis_transform()
    places = np.full(len(zeros), -0.05)
    axes.plot(zeros, places, "^", color=plots.ZERO, ms=4, transform=below, clip_on=False, zorder=5)
    axes.tick_params(axis="x", pad=6)
    axes.set_xlabel(plots.axis_label(MEANING["theta2_0"]), labelpad=2)
    axes.set_title(array.name, loc="left")


def _mark_zooms(axes: Axes, array: Array, arrays: list[Array]) -> None:
    """Frame what another array magnifies, and frame that array alike."""
    for other in arrays:
        if other.magnifies(array):
            start, end = other.ends
            frame = Rectangle((start, 0.5), end - start, len(array.codes), fill=False)
            frame.set(edgecolor=plots.ZOOM, linewidth=1.4, zorder=4)
            axes.add_patch(frame)
        if array.magnifies(other):
            axes.spines[:].set(color=plots.ZOOM, linewidth=1.4)


def _legend_entries(arrays: list[Array]) -> list[Artist]:
    """Entries of the legend: those of what the figure shows, and no more."""
    entries: list[Artist] = [*plots.symbol_entries()]
    if any(array.zeros_shown for array in arrays):
        entries.append(
            plots.entry("zero of Melnikov's integral", color=plots.ZERO, marker="^", ls="", ms=5)
        )
    if any(a.magnifies(b) for a in arrays for b in arrays):
        entries.append(Patch(fill=False, edgecolor=plots.ZOOM, lw=1.4, label=MAGNIFIED))
    if any((array.codes == NO_SYMBOL).any() for array in arrays):
        entries.append(Patch(facecolor=plots.NO_RETURN, edgecolor="0.6", label="no return"))
    if any(array.proven.any() for array in arrays):
        entries.append(plots.entry("proven symbol", color=plots.PROVEN, marker="o", ls="", ms=2.5))
    if not all(array.certain.all() for array in arrays):
        entries.append(plots.entry("uncertain", color=plots.DOUBT, marker="x", ls=""))
    return entries


CAPTION = (
    "Orbits that start beside each other take the same turns at first and other ones later: the"
    " array is plain at the bottom and seems random at the top. A column is one initial phase"
    " theta2_0 on S1-; cell i, counted from below, says on which side the orbit leaves after its"
    " i-th passage: 0 black, 1 white."
)


def tables(result: Loaded) -> list[Table]:
    """Table of counts by precision, and of the first symbol against Melnikov's zeros."""
    arrays = result["data"].items()
    header = ("array", "columns", "symbols", "certain", "decided in", "Melnikov zeros")
    return [Table("Symbols and what decided them", header, [_row(*pair) for pair in arrays])]


def _row(name: str, array: Data) -> tuple[str, ...]:
    bits, counts = np.unique(array["bits"], return_counts=True)
    decided = ", ".join(f"{n} in {b} bits" for b, n in zip(bits, counts, strict=True))
    zeros = ", ".join(f"{x:.6f}" for x in array["melnikov_zeros"])
    codes = array["codes"]
    certain = int(np.count_nonzero(array["certain"]))
    return name, str(codes.shape[1]), str(codes.size), str(certain), decided, zeros
