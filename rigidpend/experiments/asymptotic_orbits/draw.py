"""Doubly asymptotic orbits: as the skeleton of Fig. 4's plane, by height, and as hodographs."""

from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rigidpend.experiments import plots
from rigidpend.experiments.asymptotic_orbits import DRAWN, PLANE
from rigidpend.experiments.data import Data, Loaded
from rigidpend.machine.wording import Column, Table, counted

HEIGHT = 5.4
"""Height of the figure, inches."""
ENDS = {"heteroclinic": plots.BLUE, "homoclinic": plots.RED}
CURVES = (plots.BLUE, plots.RED, plots.GREEN, plots.PINK)
STYLES = ("-", (0, (6, 2)), (0, (2, 2)), (0, (1, 4)))
"""Line styles of the sampled orbits, which show each orbit where several coincide.

No legend names the lines, for it would hide some: their colours are those of the hodographs."""
SHADES = ListedColormap(["0.35", "white", "0.85"])
"""Colours of symbols 0 and 1 and of no return, light enough for the skeleton drawn over them."""


def draw(result: Loaded) -> Figure:
    """Draw the skeleton over the route codes, and below them the sampled orbits."""
    data = result["data"]
    drawn = sorted(data["drawn"].items())
    size = plots.WIDTH, HEIGHT if drawn else HEIGHT / 2
    figure = Figure(figsize=size, layout="constrained")
    if not drawn:
        _draw_plane(figure.subplots(), data)
        return figure
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.35, 1))
    above, below = parts
    _draw_plane(above.subplots(), data)
    axes = below.subplots(1, 1 + len(drawn), width_ratios=(1.5, *(1 for _ in drawn)))
    _draw_heights(axes[0], drawn)
    for one, (name, curve), colour, letter in zip(axes[1:], drawn, CURVES, "cdef", strict=False):
        one.plot(curve["omega"][:, 2], curve["omega"][:, 0], color=colour, lw=0.6)
        for axis in (one.xaxis, one.yaxis):
            axis.set_major_locator(MaxNLocator(3))
        plots.label_hodograph(one)
        plots.title(one, letter, _counted(name))
    return figure


def _counted(name: str) -> str:
    return counted(int(name), "symbol") if int(name) else "no symbol"


def _draw_plane(axes: Axes, data: Data) -> None:
    codes = data["plane"]["codes"]
    rows, columns = codes.shape
    edges = np.linspace(0, 2 * np.pi, columns + 1)
    plots.draw_codes(axes, edges, codes, SHADES, rasterized=True)
    for name, orbits in data["orbits"].items():
        row, colour = int(name) + 1, ENDS[str(orbits["ends"])]
        axes.vlines(orbits["theta2_0"], row - 0.5, row + 0.5, colour, lw=0.8)
    axes.set(xlim=(0, 2 * np.pi), ylim=(0.5, rows + 0.5), yticks=range(1, rows + 1))
    axes.set_xlabel(plots.axis_label(PLANE["theta2_0"]))
    plots.title(axes, "a", "route codes")
    zero, one = plots.symbol_entries()
    zero.set_facecolor(SHADES(0))
    lines = [plots.entry(name, color=colour) for name, colour in ENDS.items()]
    plots.legend_above(axes, [zero, one, *lines], ncols=4)


def _draw_heights(axes: Axes, drawn: list[tuple[str, Data]]) -> None:
    for (_, curve), colour, style in zip(drawn, CURVES, STYLES, strict=False):
        theta1, height = curve["theta1"] / np.pi, curve["J1_over_J2"]
        # theta1 is modulo 4 pi; NaN breaks the line where it jumps from one end to the other.
        broken = np.flatnonzero(np.abs(np.diff(theta1)) > 2) + 1
        theta1, height = np.insert(theta1, broken, np.nan), np.insert(height, broken, np.nan)
        axes.plot(theta1, height, color=colour, ls=style, lw=1.2)
    axes.set(xlim=(0, 4), ylim=(-0.02, 1.02), xlabel=r"$\theta_1/\pi$")
    axes.set_ylabel(plots.axis_label(DRAWN["J1_over_J2"]))
    plots.title(axes, "b", "the sampled orbits")


CAPTION = (
    "Where a symbol of the route codes changes lies an orbit that never leaves again: a"
    " homoclinic one, which returns to the periodic orbit that it came from, or a heteroclinic"
    " one, which goes to the other. Row i + 1 of the plane has the orbits with i symbols,"
    " without those of which a passage takes too many rotations. The hodographs of the sampled"
    " orbits begin and end at the origin, where omega is horizontal along eta. The codes are those"
    " of starts beside the unstable surface with one J2_0, the orbits lie on it with one energy:"
    " where the weight acts strongly on a body, lines and changes are seen apart."
)
ROWS = 24
"""Number of orbits with a row of the table: the first in the order of symbols and phases."""


def tables(result: Loaded) -> list[Table]:
    """Table of the counts, and a table of the first orbits."""
    lengths = sorted(result["data"]["orbits"].items(), key=lambda pair: int(pair[0]))
    groups = [orbits for _, orbits in lengths]
    each = [(orbits, k) for orbits in groups for k in range(len(orbits["theta2_0"]))]
    first = each[:ROWS]
    largest = {
        key: [np.abs(orbits[key]).max(initial=0.0) for orbits in groups]
        for key in ("residual", "moved")
    }
    return [
        Table.of(
            "Doubly asymptotic orbits by the symbols of their codes",
            [
                Column("symbols", [name for name, _ in lengths]),
                Column("orbits", [len(orbits["theta2_0"]) for orbits in groups]),
                Column("kind", [orbits["ends"] for orbits in groups]),
                Column("arcs searched", [orbits["arcs"] for orbits in groups]),
                Column("largest residual", largest["residual"], ".0e"),
                Column("map's error (rad)", largest["moved"], ".0e"),
            ],
            "All leave the lower periodic orbit. The map's error is that of theta2_0 in doubles,"
            " against integration.",
        ),
        Table.of(
            "The first orbits",
            [
                Column("address", [address(*one) for one in first]),
                Column("kind", [orbits["ends"] for orbits, _ in first]),
                Column("theta2_0 (rad)", [phase_text(*one) for one in first]),
                Column("flight (t')", [orbits["flight"][k] for orbits, k in first], ".9f"),
                Column("theta3+ - theta3- (rad)", [x["theta3"][k] for x, k in first], ".12f"),
            ],
            f"{len(first)} of {len(each)}. theta2_0 is theta2 where J1 = J1_0.",
        ),
    ]


def phase_text(orbits: Data, k: int) -> str:
    """theta2_0 of an orbit to 30 digits."""
    whole, rest = (Fraction(float(orbits[key][k])) for key in ("theta2_0", "theta2_0_rest"))
    return plots.decimals(whole + rest, 29)


def address(orbits: Data, k: int) -> str:
    """The address of an orbit: its first cell, and each symbol with its half rotations."""
    terms = zip(orbits["word"][:, k], orbits["half_turns"][:, k], strict=True)
    return " ".join(["ab"[int(orbits["first"][k])], *(f"{s}^{n}" for s, n in terms)])
