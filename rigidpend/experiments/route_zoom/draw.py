"""Zooms into the arrays of Fig. 4, from a spacing of tenths to far below doubles."""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.experiments.plots.code_arrays import COLOURS, DOUBT, NORM, ZOOM, symbol_entries
from rigidpend.experiments.plots.palette import WIDTH

ACROSS = 3
"""Number of levels side by side."""
HIGH, TOP, BOTTOM, LEFT, GAP = 0.95, 0.3, 1.25, 0.4, 0.42
"""Height of an array, margins, and the space between rows, inches."""


def draw(result: Loaded) -> Figure:
    """Draw every level of a result, coarse to fine, in reading order."""
    data = result["data"]
    levels = list(data["levels"].values())
    rows = -(-len(levels) // ACROSS)
    high = TOP + rows * (HIGH + GAP) + BOTTOM - GAP
    figure = Figure(figsize=(WIDTH, high))
    grid = figure.subplots(rows, ACROSS, squeeze=False, sharey=True)
    figure.subplots_adjust(
        left=LEFT / WIDTH,
        right=0.985,
        top=1 - TOP / high,
        bottom=BOTTOM / high,
        hspace=GAP / HIGH,
        wspace=0.08,
    )
    for axes, level in zip(grid.flat, levels, strict=False):
        _draw_level(axes, level, int(data["symbol"]))
    for axes in grid.flat[len(levels) :]:
        axes.set_axis_off()
    for axes in grid[:, 0]:
        axes.set_ylabel(r"$i$", rotation=0, va="center", labelpad=6)
    _explain(figure, data, high)
    return figure


def _draw_level(axes: Axes, level: Data, symbol: int) -> None:
    """Draw one array, its columns counted in steps from the centre."""
    step, codes = float(level["step"]), level["codes"]
    # Phases themselves are beyond doubles, of which neighbours would be the same.
    columns = level["offset"] / step
    axes.pcolormesh(columns, np.arange(1, len(codes) + 1), codes, cmap=COLOURS, norm=NORM)
    row, column = np.nonzero(~level["certain"])
    if row.size:
        axes.plot(columns[column], row + 1, "x", color=DOUBT, ms=2.5, mew=0.7, label="uncertain")
    axes.axhline(symbol + 0.5, color=ZOOM, lw=0.8, label="the symbol that changes")
    axes.set_title(rf"step {_power(step)} rad", fontsize=8, pad=3)
    axes.set_yticks([1, 5, 10, 15] if len(codes) == 15 else [1, len(codes)])
    axes.tick_params(labelsize=7, pad=2)


def _power(step: float) -> str:
    mantissa, exponent = f"{step:.0e}".split("e")
    factor = "" if mantissa == "1" else rf"{mantissa}\cdot "
    return rf"${factor}10^{{{int(exponent)}}}$"


def _explain(figure: Figure, data: Data, high: float) -> None:
    """Write below the arrays: axis, legend, and what repeats and why."""
    label = r"columns: $\theta_2^0$ less that of the centre, in steps"
    figure.text(0.5, (BOTTOM - 0.32) / high, label, ha="center", va="top", fontsize=8)
    said = (
        f"In the middle symbol {int(data['symbol'])} changes: the orbit there stays with the "
        "periodic orbit for ever. Beside it, at a distance d, orbits stay a time that grows as "
        "ln(1/d), and the symbols above follow from the phase at which they leave. A zoom by "
        f"exp(π²/ν) = {float(data['repeats_after']):.2f} adds one rotation, so the rows above "
        "repeat: zooming changes nothing, and never ends. Columns are differences from one orbit "
        f"in {int(data['reference_bits'])} bits."
    )
    text = "\n".join(textwrap.wrap(said, 112))
    figure.text(0.5, (BOTTOM - 0.5) / high, text, ha="center", va="top", fontsize=7.5)
    entries = [
        *symbol_entries(r"$z_i = 0$", r"$z_i = 1$"),
        Patch(facecolor="none", edgecolor=ZOOM, label="below: the symbol that changes"),
    ]
    figure.legend(handles=entries, loc="lower center", ncols=3, fontsize=7.5, borderaxespad=0.1)
