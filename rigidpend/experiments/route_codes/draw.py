"""Arrays of Fig. 4: black cells are symbol 0, white ones 1, the bottom row is i = 1."""

import math
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.shared import MEANING
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers.texts import NO_SYMBOL

LARGEST = 0.12
"""Largest side of a cell, inches."""
LOWEST = 0.06
"""Least height of a row, inches, even if cells are then not square."""
NARROWEST, ENTRY, ROW = 3.4, 1.4, 0.2
"""Least width of a figure, and width and height of a legend entry, inches."""
LEFT, RIGHT, BELOW, ABOVE, BETWEEN = 0.45, 0.12, 0.75, 0.25, 0.55
"""Margins around the arrays, and the space between two, inches."""
NAMED = 0.75
"""Room for the words at an array, inches; nearer to the edge they extend leftwards."""
TITLE, SPACE = 9.0, 0.1
"""Size of an array's name, points, and the space behind it, inches."""
LINED = 0.02
"""Least width of a column, inches, for lines between cells: they would cover narrower ones."""
ACROSS, APART, TALLEST = 6, 0.55, 100.0
"""Most arrays side by side; inches between bands of arrays, and height of the tallest array."""


def _ends(array: Data) -> tuple[float, float]:
    """The least and the largest phase of the columns' edges; phases may descend."""
    first, last = sorted(map(float, plots.column_edges(array["theta2_0"])[[0, -1]]))
    return first, last


def _zeros(array: Data) -> list[float]:
    """Melnikov zeros within the array's range, which may be longer than a turn."""
    first, last = _ends(array)
    # Each is repeated, beginning with the first one in the range.
    begun = (first + (float(x) - first) % math.tau for x in array["melnikov_zeros"])
    return sorted(y for x in begun for y in np.arange(x, last, math.tau).tolist())


def _magnifies(part: Data, whole: Data) -> bool:
    """True if an array lies inside another and is finer; single columns have no step to compare."""
    (first, last), (low, high) = _ends(part), _ends(whole)
    columns = len(part["theta2_0"]), len(whole["theta2_0"])
    finer = (last - first) / columns[0] < (high - low) / columns[1]
    return min(columns) > 1 and finer and low <= first and last <= high


def draw(result: Loaded) -> Figure:
    """Draw every array of a result with square cells, side by side where there is room."""
    arrays = result["data"]
    names = list(arrays)
    bands = [{x: arrays[x] for x in names[k : k + ACROSS]} for k in range(0, len(names), ACROSS)]
    zooms = [(x, y) for x in names for y in names if _magnifies(arrays[y], arrays[x])]
    figure = _arranged(bands, bool(zooms))
    panels = dict(zip(names, figure.axes, strict=True))
    for whole, part in zooms:
        start, end = _ends(arrays[part])
        frame = Rectangle((start, 0.5), end - start, len(arrays[whole]["codes"]), fill=False)
        frame.set(edgecolor=plots.ZOOM, linewidth=1.4, zorder=4)
        panels[whole].add_patch(frame)
        panels[part].spines[:].set(color=plots.ZOOM, linewidth=1.4)
    return figure


def _arranged(bands: list[dict[str, Data]], magnified: bool) -> Figure:
    """Arrays in bands, with cells as large as the width allows, above a legend."""
    rooms = [plots.WIDTH - LEFT - RIGHT - BETWEEN * (len(band) - 1) for band in bands]
    columns = [sum(array["codes"].shape[1] for array in band.values()) for band in bands]
    cell = min(LARGEST, *(room / n for room, n in zip(rooms, columns, strict=True)))
    wides = (plots.WIDTH - room + n * cell for room, n in zip(rooms, columns, strict=True))
    wide = max(NARROWEST, *wides)
    most = [max(len(array["codes"]) for array in band.values()) for band in bands]
    heights = [min(rows * max(cell, LOWEST), TALLEST) for rows in most]
    entries = _legend_entries([x for band in bands for x in band.values()], magnified)
    across = min(len(entries), int(wide / ENTRY))
    below = BELOW + ROW * (-(-len(entries) // across) - 1)
    high = below + sum(heights) + len(bands) * (ABOVE + APART) - APART
    figure, bottom = Figure(figsize=(wide, high)), high
    for band, height in zip(bands, heights, strict=True):
        bottom, left, last = bottom - height - ABOVE, LEFT, list(band)[-1]
        named = 0.0
        for name, array in band.items():
            width = array["codes"].shape[1] * cell
            axes = plots.panel(figure, left, bottom, width, height)
            # The bare name, left or right, could be mistaken for a symbol.
            said, room = f"{name} array", wide - left if name == last else width + BETWEEN
            at_edge = left + max(NAMED, plots.inches(said, TITLE)) > wide
            if at_edge:
                room = left + width - named
            if plots.inches(said, TITLE) > room - SPACE:
                said = plots.fitting(name, TITLE, room - SPACE)
            axes.set_title(said, loc="right" if at_edge else "left")
            _draw_array(axes, array, cell >= LINED, left + NAMED > wide)
            named = left + plots.inches(said, TITLE)
            left += width + BETWEEN
        bottom -= APART
    look: Any = {"handlelength": 1.0, "handleheight": 1.0, "columnspacing": 1.6}
    figure.legend(handles=entries, loc="lower center", ncols=across, borderaxespad=0.1, **look)
    return figure


def _draw_array(axes: Axes, array: Data, lined: bool, at_edge: bool) -> None:
    codes, phases = array["codes"], array["theta2_0"]
    line: dict[str, Any] = {"edgecolors": "0.6", "linewidth": 0.25} if lined else {}
    plots.draw_codes(axes, plots.column_edges(phases), codes, **line)
    plots.mark_doubt(axes, phases, array["certain"])
    if "proven" in array:
        row, column = np.nonzero(array["proven"])
        axes.plot(phases[column], row + 1, "o", color=plots.PROVEN, ms=0.9, mew=0)
    zeros, below = _zeros(array), axes.get_xaxis_transform()
    places = np.full(len(zeros), -0.05)
    axes.plot(zeros, places, "^", color=plots.ZERO, ms=4, transform=below, clip_on=False, zorder=5)
    axes.tick_params(axis="x", pad=6)
    # A narrow array has room for one label; Matplotlib would show at least two.
    axes.locator_params(axis="x", min_n_ticks=1)
    if len(phases) == 1:
        axes.set_xticks(phases, [f"{phases[0]:.6g}"], ha="right" if at_edge else "center")
    label = plots.axis_label(MEANING["theta2_0"])
    axes.set_xlabel(label, labelpad=2, loc="right" if at_edge else "center")


def _legend_entries(arrays: list[Data], magnified: bool) -> list[Artist]:
    """Entries of the legend, only for things that the figure shows."""
    zero = plots.entry("zero of Melnikov's integral", color=plots.ZERO, marker="^", ls="", ms=5)
    no_return = Patch(facecolor=plots.NO_RETURN, edgecolor="0.6", label="no return")
    proven = plots.entry("proven symbol", color=plots.PROVEN, marker="o", ls="", ms=2.5)
    marks = [
        (zero, any(map(_zeros, arrays))),
        (Patch(fill=False, edgecolor=plots.ZOOM, lw=1.4, label="magnified part"), magnified),
        (no_return, any((array["codes"] == NO_SYMBOL).any() for array in arrays)),
        (proven, any(np.any(array.get("proven", False)) for array in arrays)),
        (
            plots.entry("uncertain", color=plots.DOUBT, marker="x", ls=""),
            not all(array["certain"].all() for array in arrays),
        ),
    ]
    return [*plots.symbol_entries(), *(mark for mark, shown in marks if shown)]


CAPTION = (
    "Orbits that start beside each other take the same turns at first and mostly different ones"
    " later. A column is one initial phase theta2_0 on S1-; cell i, counted from below, says on"
    " which side the orbit leaves after its i-th passage: 0 black, 1 white."
)


def tables(result: Loaded) -> list[Table]:
    """Tables of counts by precision, and of the first symbol against Melnikov's zeros."""
    names, arrays = list(result["data"]), list(result["data"].values())
    columns = [
        Column("array", names),
        Column("columns", [array["codes"].shape[1] for array in arrays]),
        Column("symbols", [array["codes"].size for array in arrays]),
        Column("certain", [np.count_nonzero(array["certain"]) for array in arrays]),
        Column("decided in", [_decided(array["bits"]) for array in arrays]),
        Column(
            "Melnikov zeros", [", ".join(f"{x:.6f}" for x in a["melnikov_zeros"]) for a in arrays]
        ),
    ]
    return [Table.of("Symbols and what decided them", columns)]


def _decided(bits: NDArray[np.int64]) -> str:
    counts = zip(*np.unique(bits, return_counts=True), strict=True)
    return ", ".join(f"{count} in {bits} bits" for bits, count in counts)
