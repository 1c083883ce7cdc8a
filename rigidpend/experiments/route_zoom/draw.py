"""Zooms into the arrays of Fig. 4, side by side; symbols new at a level are in colour."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers.texts import NO_SYMBOL

NEW = ("#A04000", "#FFD0A0")
"""Colours of symbols 0 and 1 that differ from those of the previous array."""
CELLS = ListedColormap(["black", "white", *NEW, plots.NO_RETURN])
NORM = BoundaryNorm([-0.5, 0.5, 1.5, 2.5, 3.5, NO_SYMBOL + 0.5], 5)
ACROSS = 3
"""Number of levels side by side."""
ROW, AROUND = 1.36, 0.8
"""Height of a row of arrays, and room below all of them, inches."""


def draw(result: Loaded) -> Figure:
    """Draw every level of a result, coarse to fine, in reading order."""
    data = result["data"]
    levels = list(data["levels"].values())
    rows = -(-len(levels) // ACROSS)
    figure = Figure(figsize=(plots.WIDTH, rows * ROW + AROUND), layout="constrained")
    grid = figure.subplots(rows, ACROSS, squeeze=False, sharey=True)
    for axes, before, level in zip(grid.flat, [levels[0], *levels], levels, strict=False):
        _draw_level(axes, level, before, int(data["symbol"]))
        if level is not before:
            text = f"{100 * share(before, level):.0f} % as before"
            axes.set_title(text, fontsize=8, pad=3, loc="right")
    for axes in grid[:, 1:].flat:
        axes.set_ylabel("")
    for axes in grid.flat[len(levels) :]:
        axes.set_axis_off()
    _explain(figure, data)
    return figure


def _draw_level(axes: Axes, level: Data, before: Data, symbol: int) -> None:
    """Draw one array, its columns counted in steps from the centre."""
    step, codes = float(level["step"]), level["codes"]
    # Offsets in steps, because phases of neighbouring columns may round to the same double.
    columns = level["offset"] / step
    cells = codes + 2 * ((codes != before["codes"]) & (codes != NO_SYMBOL))
    plots.draw_codes(axes, plots.column_edges(columns), cells, CELLS, NORM)
    plots.mark_doubt(axes, columns, level["certain"], 2.5)
    axes.axhline(symbol + 0.5, color=plots.ZOOM, lw=0.8)
    axes.set_title(rf"step {_power(step)} rad", fontsize=8, pad=3, loc="left")
    axes.tick_params(labelsize=7, pad=2)


def _power(step: float) -> str:
    mantissa, exponent = f"{step:.1e}".split("e")
    return rf"${mantissa}\cdot 10^{{{int(exponent)}}}$"


def _explain(figure: Figure, data: Data) -> None:
    """Write below the arrays: the axis, the legend, and the share of repeated symbols."""
    text = (
        "columns: $\\theta_2^0$ less that of the centre, in steps\n"
        f"Rows repeat after a zoom by exp(π²/ν) = {float(data['repeats_after']):.4f}. "
        f"Columns are differences from one orbit in {int(data['reference_bits'])} bits."
    )
    entries = [
        *plots.symbol_entries(r"$z_i = 0$", r"$z_i = 1$"),
        *(Patch(facecolor=NEW[k], label=f"{k}, differs from the array before") for k in (0, 1)),
        Patch(facecolor="none", edgecolor=plots.ZOOM, label=f"above symbol {int(data['symbol'])}"),
    ]
    legend = figure.legend(
        handles=entries, loc="outside lower center", ncols=5, title=text, fontsize=7.5
    )
    legend.get_title().set(fontsize=7.5, ha="center", linespacing=1.5)


CAPTION = (
    "Magnified again and again about a phase at which a symbol changes, the array of route codes"
    " comes to repeat itself, row after row from below. The orbit at that phase stays with a"
    " periodic orbit for ever; an orbit at a distance d from it stays for a time that grows as"
    " ln(1/d), and its next symbols follow from the phase at which it leaves. This phase is the"
    " same again, one rotation later, for a d that is exp(pi^2/nu) times smaller. In colour: what"
    " differs from the array before."
)


def share(before: Data, level: Data) -> float:
    """The share of symbols that a level repeats, compared step by step from the centre."""
    return float((before["codes"] == level["codes"]).mean())


def tables(result: Loaded) -> list[Table]:
    """Table of the levels, with the phase at their centre in the note."""
    data = result["data"]
    levels = list(data["levels"].values())
    return [
        Table.of(
            f"Levels around the phase at which symbol {int(data['symbol'])} changes",
            [
                Column("level", range(len(levels))),
                Column("spacing (rad)", [level["step"] for level in levels], ".3g"),
                Column("columns", [level["codes"].shape[1] for level in levels]),
                Column("symbols", [level["codes"].size for level in levels]),
                Column("certain", [np.count_nonzero(level["certain"]) for level in levels]),
                Column("as before", ["", *(f"{100 * share(*x):.1f} %" for x in pairwise(levels))]),
                Column("bits", [", ".join(map(str, np.unique(x["bits"]))) for x in levels]),
            ],
            f"theta2_0 = {decimals_of(levels[-1])} rad at the last centre, rounded; rows repeat"
            f" after a zoom of {float(data['repeats_after']):.6f}.",
        )
    ]


def decimals_of(level: Data) -> str:
    """The centre of a level, rounded to a hundredth of its step or finer."""
    digits = max(2, 3 - math.floor(math.log10(float(level["step"]))))
    return plots.decimals(Fraction(level["centre"]), digits)
