"""Finite-time exponents over a plane, their spread, and a check of some of them."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.exponents import LOG10_J1_0
from rigidpend.experiments.shared import MEANING
from rigidpend.machine.wording import Column, Table, counted

SHADES = ("#cfe3f1", "#8fbfdf")
"""Colours of the spread's wider and narrower band."""
HIGHEST = 0.99
"""Share of cells below the largest exponent of the colour scale, and above the least."""
CHANGES = ((0.6, "white"), (0.35, "0.8"), (0.2, "0.7"))
"""Widths and colours of the lines where symbols 1, 2, 3 change."""


def draw(result: Loaded) -> Figure:
    """Draw the plane, and below it the exponents' spread and their check."""
    data = result["data"]
    figure = Figure(figsize=(plots.WIDTH, 5.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.7, 1))
    _draw_plane(figure, figure.add_subplot(grid[0, :]), data)
    _draw_spread(figure.add_subplot(grid[1, 0]), data["growth"])
    _draw_check(figure.add_subplot(grid[1, 1]), data["checked"])
    return figure


def _draw_plane(figure: Figure, axes: Axes, data: Data) -> None:
    x, y, exponent = data["theta2_0"], data["log10_J1_0"], data["exponent"]
    known = exponent[np.isfinite(exponent)]
    ends = np.quantile(known, (1 - HIGHEST, HIGHEST)) if known.size else (0, 1)
    shown = plots.draw_cells(axes, x, y, exponent, cmap="magma", vmin=ends[0], vmax=ends[1])
    figure.colorbar(shown, ax=axes, label="exponent per passage", extend="both", pad=0.01)
    plots.draw_changes(axes, x, y, data["codes"], CHANGES)
    axes.set(xlabel=plots.axis_label(MEANING["theta2_0"]), ylabel=plots.axis_label(LOG10_J1_0))
    axes.set_ylim(*plots.cell_ends(y))
    passages = counted(len(data["codes"]), "passage")
    said = rf"exponents of {passages}, Euclidean norm of $(M', \gamma)$"
    marked = float(data["marked"])
    # A config's own action may be none of the plane.
    if plots.holds(y, marked):
        axes.axhline(marked, color="white", lw=0.8, ls=(0, (5, 3)))
        said += rf"; dashed: $\log_{{10}} J_1^0 = {marked:.4g}$"
    plots.title(axes, "a", said)


def _draw_spread(axes: Axes, growth: Data) -> None:
    n, shares = growth["passages"], growth["share"]
    middle = len(shares) // 2
    for k in range(middle):
        low, high = growth["exponent"][k], growth["exponent"][-1 - k]
        said = f"{100 * (shares[-1 - k] - shares[k]):.0f} % of cells"
        # Opaque colours: transparent bands on top of each other would not match the legend.
        axes.fill_between(n, low, high, color=SHADES[k], lw=0, label=said)
    axes.plot(n, growth["exponent"][middle], "o-", color=plots.BLUE, ms=4, lw=1, label="median")
    axes.set_ylim(bottom=0)
    axes.set_xticks(n)
    axes.set(xlabel="passages", ylabel="exponent per passage")
    axes.legend(fontsize=7.5)
    plots.title(axes, "b", "over fewer passages")


def _draw_check(axes: Axes, checked: Data) -> None:
    order = np.argsort(checked["growth"])
    growth, difference = checked["growth"][order], np.abs(checked["difference"][order])
    axes.semilogy(growth, difference, ".", color=plots.BLUE, ms=3, label="difference")
    axes.semilogy(growth, checked["allowed"][order], ".", color=plots.RED, ms=3, label="allowed")
    axes.set(xlabel="ln of the growth", ylabel="|difference of ln growth|")
    plots.title(axes, "c", "variational equations less map")
    # Room for the legend above the marks.
    axes.margins(y=0.2)
    axes.legend(fontsize=7.5, loc="upper right", ncols=2)


CAPTION = (
    "Orbits that start side by side separate fastest (bright) along the lines where a symbol of"
    " their route code changes. The exponent is the logarithm of the largest growth of a deviation"
    " through some passages, divided by their number, from the derivatives of the return map, in"
    " the Euclidean norm of (M', gamma), on the section at the orbit's energy. In"
    " some cells the variational equations are integrated as well."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the quantiles, with the check below."""
    data = result["data"]
    growth = data["growth"]
    quantiles = zip(growth["share"], growth["exponent"], strict=True)
    below = [Column(f"{100 * share:.0f} % of cells below", x, ".4f") for share, x in quantiles]
    known, difference = np.isfinite(data["exponent"]), np.abs(data["checked"]["difference"])
    note = f"{known.sum()} of {known.size} cells are known."
    held = difference[np.isfinite(difference)]
    if held.size:
        note += (
            f" The variational equations differ by {np.median(held):.1g} in ln of the growth"
            f" (median of {held.size} cells), by {held.max():.1g} at most."
        )
    columns = [Column("passages", growth["passages"]), *below]
    return [Table.of("Finite-time exponents, per passage", columns, note)]
