"""Intervals of the line of starts with their proven symbols, as Fig. 4 has columns."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rigidpend.experiments.data.tree import Loaded
from rigidpend.experiments.plots import (
    NO_RETURN,
    SYMBOL_COLOURS,
    SYMBOL_NORM,
    WIDTH,
    symbol_entries,
)

ROW, AROUND = 0.22, 0.95
"""Height of a row, and room around them, inches."""


def draw(result: Loaded) -> Figure:
    """Draw the symbols that all starts of an interval have, and their shares of the line."""
    intervals, shares = result["data"]["intervals"], result["data"]["shares"]
    codes = intervals["codes"]
    figure = Figure(figsize=(WIDTH, AROUND + ROW * len(codes)), layout="constrained")
    axes = figure.subplots()
    ends = (
        2
        * np.pi
        * np.stack((intervals["place"], intervals["place"] + 1.0))
        / 2.0 ** intervals["depth"]
    )
    rows = np.arange(len(codes) + 1) + 0.5
    axes.pcolormesh(
        np.append(ends[0], ends[1, -1]), rows, codes, cmap=SYMBOL_COLOURS, norm=SYMBOL_NORM,
        edgecolors="0.6", linewidth=0.2,
    )  # fmt: skip
    axes.set(xlabel=r"$\theta_2^0$ (rad)", yticks=np.arange(len(codes)) + 1)
    axes.set_ylabel("$i$", rotation=0, labelpad=6, va="center")
    for row, share in enumerate(shares, 1):
        # Rounded down.
        text = f"{np.floor(1000 * share) / 10:.1f} %"
        axes.text(1.01, row, text, transform=axes.get_yaxis_transform(), va="center", fontsize=7.5)
    entries = [*symbol_entries(), Patch(facecolor=NO_RETURN, edgecolor="0.6", label="not proven")]
    figure.legend(handles=entries, loc="outside lower center", ncols=3, handleheight=1.0)
    return figure
