"""Planes of route codes: the word as colour, the changes of its first symbols as lines."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from numpy.typing import NDArray

from rigidpend.experiments import plots
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.shared import MEANING
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers import Array

NAMES = {
    "theta2_0": plots.axis_label(MEANING["theta2_0"]),
    "log10_J1_0": r"$\log_{10} J_1^0$",
    "mu": r"$\mu$",
    "h0": r"$h_0$",
    "beta0": r"$\beta_0$ (rad)",
    "alpha0": r"$\alpha_0$ (rad)",
}
SHADES = LinearSegmentedColormap.from_list(
    "word", ["#1d3557", "#3f6f9f", "#9cc3d5", "#f3efe0", "#efc88b", "#cf7a4c", "#7a2e2e"]
)
"""Colours of words: blue if the first symbol is 0, orange if it is 1."""
TALL, SMALL, BELOW, ABOVE, LEFT, GAP = 2.9, 1.75, 0.95, 0.15, 0.66, 0.58
"""Heights of the plane and of its zooms, margins, inches."""
ACROSS = 3
"""Zooms side by side."""
MOST: dict[Any, int] = {"x": 10, "y": 6}
"""Most characters of a tick by its axis; longer ones are told from a common value."""


def draw(result: Loaded) -> Figure:
    """Draw the plane of a result, and its zooms below."""
    data = result["data"]
    zooms = data.get("zooms", {})
    columns, bands = min(ACROSS, max(1, len(zooms))), -(-len(zooms) // ACROSS)
    # A single zoom is as large as the plane, for comparison.
    small = TALL if len(zooms) == 1 else SMALL
    high = ABOVE + TALL + bands * (small + GAP) + BELOW
    figure = Figure(figsize=(plots.WIDTH, high))
    # Labels of small numbers are wide: the right margin holds half of the last one.
    wide = plots.WIDTH - LEFT - (0.12 if "x_axis" not in data else 0.3)
    whole = plots.panel(figure, LEFT, high - ABOVE - TALL, wide, TALL)
    _draw_plane(whole, data, data)
    each = (wide - (columns - 1) * GAP) / columns
    for k, (name, zoom) in enumerate(zooms.items()):
        left = LEFT + (k % ACROSS) * (each + GAP)
        bottom = high - ABOVE - TALL - (k // ACROSS + 1) * (small + GAP)
        before = list(figure.axes)
        axes = plots.panel(figure, left, bottom, each, small)
        _draw_plane(axes, zoom, data)
        axes.spines[:].set(color=plots.ZOOM, linewidth=1.2)
        times = np.ptp(data["y"]) / np.ptp(zoom["y"])
        axes.set_title(f"{name}: {times:.3g} times higher", loc="left", fontsize=8, pad=3)
        _frame(before, zoom, name)
    look: Any = {"fontsize": 7.5, "borderaxespad": 0.2, "columnspacing": 1.4}
    figure.legend(handles=_entries(data, zooms), loc="lower center", ncols=3, **look)
    return figure


def shades(codes: NDArray[np.uint8]) -> Array:
    """Words as numbers between 0 and 1, neighbours along a Gray code: (rows, columns).

    A word's number is the middle of those of all words that begin with it. In a Gray code a symbol
    1 mirrors the order of what follows, so that words on both sides of a change of a symbol get
    similar numbers.
    """
    total = np.full(codes.shape[1:], 0.5 ** (len(codes) + 1))
    flipped = np.zeros(codes.shape[1:], dtype=np.uint8)
    for i, layer in enumerate(codes):
        flipped = flipped ^ (layer == 1)
        total += flipped * 0.5 ** (i + 1)
    return total


def _draw_plane(axes: Axes, plane: Data, data: Data) -> None:
    x, y, codes = plane["x"], plane["y"], plane["codes"]
    extent = *plots.cell_ends(x), *plots.cell_ends(y)
    plots.draw_cells(axes, x, y, shades(codes), cmap=SHADES, vmin=0, vmax=1)
    plots.draw_changes(axes, x, y, codes)
    row, column = np.nonzero(plane["certain"] < len(codes))
    if row.size:
        axes.plot(x[column], y[row], ",", color=plots.DOUBT, label="uncertain", rasterized=True)
    _mark(axes.axhline, float(data["marked"]), y)
    if "marked_x" in data:
        _mark(axes.axvline, float(data["marked_x"]), x)
    axes.set(xlim=extent[:2], ylim=extent[2:])
    axes.set_xlabel(NAMES[str(data.get("x_axis", "theta2_0"))], labelpad=2)
    if axes.get_position().x0 * plots.WIDTH < 1.01 * LEFT:
        axes.set_ylabel(NAMES[str(data["y_axis"])], labelpad=3)
    wide = axes.get_position().width > 0.5
    axes.tick_params(labelsize=8 if wide else 6.5, pad=2)
    axes.locator_params(axis="x", nbins=8 if wide else 3)
    if not wide and str(data["y_axis"]) == "mu":
        # Closer ticks would need more digits than there is room for.
        axes.locator_params(axis="y", nbins=3)
    # Where ticks need more characters than there is room for, what they share stands apart.
    axes.ticklabel_format(useOffset=False)
    for axis, most in MOST.items():
        if max(len(x.get_text()) for x in getattr(axes, f"get_{axis}ticklabels")()) > most:
            axes.ticklabel_format(axis=axis, useOffset=True)
            # What is left may still have the digits of doubles, -0.9996 in the place of -1.
            axes.tick_params(axis=axis, labelsize=6, pad=1)


def _mark(line: Callable[..., Any], value: float, cells: Array) -> None:
    """Mark a value of an axis by a line, if it is between the ends."""
    if plots.holds(cells, value):
        line(value, color="white", lw=1.6)
        line(value, color=plots.ZOOM, lw=0.8, ls=(0, (5, 3)), label="marked")


def _frame(before: list[Axes], zoom: Data, name: str) -> None:
    """Frame a zoom in the smallest plane drawn so far that holds it."""
    (left, right), (low, top) = (plots.cell_ends(zoom[key]) for key in ("x", "y"))

    def holds(axes: Axes) -> bool:
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        # The ends of the plane are rounded to doubles: a zoom up to them must count as inside.
        a, b = 1e-9 * (x1 - x0), 1e-9 * (y1 - y0)
        return x0 - a <= left and right <= x1 + a and y0 - b <= low and top <= y1 + b

    around = sorted(filter(holds, before), key=lambda axes: float(np.ptp(axes.get_xlim())))
    for axes in around[:1]:
        look: Any = {"fill": False, "edgecolor": plots.ZOOM, "linewidth": 1.2}
        axes.add_patch(Rectangle((left, low), right - left, top - low, label=name, **look))


def _entries(data: Data, zooms: Data) -> list[Any]:
    """Entries of the legend, only for things that the figure shows."""
    planes = (data, *zooms.values())
    own = [
        f"{NAMES[str(data[f'{key}_axis'])]} = {float(data[marked]):g}"
        for key, marked in (("y", "marked"), ("x", "marked_x"))
        if marked in data and any(plots.holds(plane[key], data[marked]) for plane in planes)
    ]
    (width, grey), *_ = plots.LINES
    symbols = len(data["codes"])
    shades = "; shades: later symbols" if symbols > 1 else ""
    lines = [str(k + 1) for k in range(min(symbols, len(plots.LINES)))]
    changes = f"changes of symbol{'s' if len(lines) > 1 else ''} {', '.join(lines)}"
    entries: list[Any] = [
        Patch(facecolor=SHADES(0.25), label=f"$z_1 = 0${shades}"),
        Patch(facecolor=SHADES(0.75), label=f"$z_1 = 1${shades}"),
        plots.entry(changes, color=grey, lw=width),
    ]
    if own:
        entries.append(plots.entry(", ".join(own), color=plots.ZOOM, lw=0.8, ls=(0, (5, 3))))
    if zooms:
        entries.append(Patch(fill=False, edgecolor=plots.ZOOM, lw=1.2, label="magnified part"))
    if any((plane["certain"] < len(plane["codes"])).any() for plane in planes):
        entries.append(plots.entry("uncertain", color=plots.DOUBT, marker=".", ls=""))
    return entries


CAPTION = (
    "Each cell is an orbit, coloured by its route code: blue if it leaves on the left first,"
    " orange if on the right, and shaded by what comes next. The closer to a line between two"
    " colours it starts, the longer it stays with a periodic orbit. For a start or a weight"
    " exp(pi^2/nu) times smaller it stays one rotation longer, and the same pattern comes again."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the plane and of its zooms."""
    data = result["data"]
    zooms = data.get("zooms", {})
    planes = [data, *zooms.values()]
    shapes = [plane["codes"].shape for plane in planes]
    across, nu = f"Across: {data['x_axis']}. " if "x_axis" in data else "", float(data["nu"])
    repeats = f"nu = {nu:.6f}: a zoom repeats after {np.exp(np.pi**2 / nu):.6g}."
    columns = [
        Column("plane", ["whole", *zooms]),
        Column("columns", [columns for _, _, columns in shapes]),
        Column("rows", [rows for _, rows, _ in shapes]),
        Column("symbols", map(math.prod, shapes)),
        Column("certain", [int(plane["certain"].sum()) for plane in planes]),
        Column("cells by return maps", [plane["by_map"].sum() for plane in planes]),
    ]
    return [Table.of("Planes", columns, f"{across}Upwards: {data['y_axis']}. {repeats}")]
