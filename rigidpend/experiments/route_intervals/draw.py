"""Intervals of the line of starts with their proven symbols, below columns of single starts.

A table has the shares of the line on which the first symbols are proven.
"""

from fractions import Fraction

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.shared import MEANING
from rigidpend.machine.wording import Table
from rigidpend.numbers import Array

ROW, CELL, AROUND = 0.22, 0.1, 1.3
"""Heights of a row of intervals and of a row of columns, and room around both, inches."""


def draw(result: Loaded) -> Figure:
    """Draw columns of single starts, and below them the proven symbols of intervals."""
    data = result["data"]
    high = [CELL * len(data["columns"]["codes"]), ROW * len(data["intervals"]["codes"])]
    figure = Figure(figsize=(plots.WIDTH, AROUND + sum(high)), layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=high)
    doubtful = _draw_columns(above, data["columns"])
    _draw_intervals(below, data["intervals"], data["shares"])
    entries: list[Artist] = [
        *plots.symbol_entries(),
        Patch(facecolor=plots.NO_RETURN, edgecolor="0.6", label="not proven"),
    ]
    if doubtful:
        entries.append(plots.entry("uncertain", color=plots.DOUBT, marker="x", ls=""))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries), handleheight=1.0)
    return figure


def _draw_columns(axes: Axes, columns: Data) -> bool:
    """Draw a column for each start; return True if a symbol is uncertain."""
    phases, certain = columns["theta2_0"], columns["certain"]
    _draw_codes(axes, plots.column_edges(phases), columns["codes"])
    plots.mark_doubt(axes, phases, certain)
    axes.set_title("single starts", loc="left")
    return not certain.all()


def _draw_intervals(axes: Axes, intervals: Data, shares: Data) -> None:
    """Draw each interval with its proven symbols, and beside each row its share of the line."""
    codes = intervals["codes"]
    places = np.stack((intervals["place"], intervals["place"] + 1.0))
    ends = 2 * np.pi * places / 2.0 ** intervals["depth"]
    edges = np.append(ends[0], ends[1, -1])
    _draw_codes(axes, edges, codes)
    axes.set(xlabel=plots.axis_label(MEANING["theta2_0"]), yticks=np.arange(len(codes)) + 1)
    axes.set_title("all starts of an interval, proven", loc="left")
    for row, share in enumerate(shares, 1):
        # Rounded down: a proven share must not be overstated.
        text = f"{np.floor(1000 * share) / 10:.1f} %"
        axes.text(1.01, row, text, transform=axes.get_yaxis_transform(), va="center", fontsize=7.5)


def _draw_codes(axes: Axes, edges: Array, codes: NDArray[np.uint8]) -> None:
    """Draw codes in a frame that ends where they do."""
    plots.draw_codes(axes, edges, codes, edgecolors="0.6", linewidth=0.2)
    # Both panels have one axis: inside of a frame a blank beside the codes would look like ones.
    for side, place in (("left", edges[0]), ("right", edges[-1])):
        axes.spines[side].set_position(("data", place))
    axes.spines[["top", "bottom"]].set_bounds(edges[0], edges[-1])


CAPTION = (
    "Single starts with their symbols by integration, and below them intervals of the line, all of"
    " whose orbits are proven to have the symbols there: i = 1 at the bottom, 0 black, 1 white;"
    " grey symbols are not proven by intervals of this length. Beside each row is the share of the"
    " line on which so many symbols are proven."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the shares."""
    data = result["data"]
    count = data["intervals"]["place"].size
    rows = [
        (str(n), str(Fraction(float(share))), f"{float(share):.6g}")
        for n, share in enumerate(data["shares"], 1)
    ]
    header = ("symbols", "share of the line", "about")
    return [Table("Starts whose first symbols are proven", header, rows, f"{count} intervals.")]
