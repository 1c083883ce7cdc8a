"""Doubly asymptotic orbits: as the skeleton of Fig. 4's plane, on the sphere, and in space.

In tables: doubly asymptotic orbits counted by the symbols of their codes, and the shortest of them.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rigidpend.experiments.asymptotic_orbits import DRAWN, PLANE
from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.plots import (
    BLUE,
    GREEN,
    PINK,
    RED,
    WIDTH,
    axis_label,
    draw_codes,
    entry,
    label_hodograph,
    symbol_entries,
    title,
)
from rigidpend.machine.wording import Table

HEIGHT = 5.4
"""Height of the figure, inches."""
ENDS = {"heteroclinic": BLUE, "homoclinic": RED}
CURVES = (BLUE, RED, GREEN, PINK)
STYLES = ("-", (0, (6, 2)), (0, (2, 2)), (0, (1, 4)))
"""Line styles of the sampled orbits, where they lie upon each other."""
SHADES = ListedColormap(["0.35", "white", "0.85"])
"""Colours of symbols 0 and 1 and of no return, light enough for the skeleton upon them."""


def draw(result: Loaded) -> Figure:
    """Draw the skeleton over the route codes, and below it the orbits that were sampled."""
    data = result["data"]
    drawn = sorted(data["drawn"].items())
    figure = Figure(figsize=(WIDTH, HEIGHT if drawn else HEIGHT / 2), layout="constrained")
    if not drawn:
        _draw_plane(figure.subplots(), data)
        return figure
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.35, 1))
    above, below = parts
    _draw_plane(above.subplots(), data)
    axes = below.subplots(1, 1 + len(drawn), width_ratios=(1.5, *(1 for _ in drawn)))
    _draw_heights(axes[0], drawn)
    for one, (name, curve), colour, letter in zip(axes[1:], drawn, CURVES, "cdef", strict=False):
        _draw_hodograph(one, curve, colour)
        title(one, letter, _counted(name))
    return figure


def _counted(name: str) -> str:
    return {"0": "no symbol", "1": "1 symbol"}.get(name, f"{name} symbols")


def _draw_plane(axes: Axes, data: Data) -> None:
    plane = data["plane"]
    rows, columns = plane["codes"].shape
    edges = np.linspace(0, 2 * np.pi, columns + 1)
    draw_codes(axes, edges, plane["codes"], SHADES, rasterized=True)
    for name, orbits in data["orbits"].items():
        row, colour = int(name) + 1, ENDS[str(orbits["ends"])]
        axes.vlines(orbits["theta2_0"], row - 0.5, row + 0.5, colour, lw=0.8)
    axes.set(xlim=(0, 2 * np.pi), ylim=(0.5, rows + 0.5))
    axes.set_yticks(range(1, rows + 1))
    axes.set_xlabel(axis_label(PLANE["theta2_0"]))
    title(axes, "a", "route codes")
    zero, one = symbol_entries()
    zero.set_facecolor(SHADES(0))
    lines = [entry(name, color=colour) for name, colour in ENDS.items()]
    axes.legend(
        handles=[zero, one, *lines], ncols=4, fontsize=7.5,
        loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1,
    )  # fmt: skip


def _draw_heights(axes: Axes, drawn: list[tuple[str, Data]]) -> None:
    for (name, curve), colour, style in zip(drawn, CURVES, STYLES, strict=False):
        theta1, height = curve["theta1"] / np.pi, curve["J1_over_J2"]
        # theta1 is modulo 4 pi: no line where it begins anew.
        broken = np.flatnonzero(np.abs(np.diff(theta1)) > 2) + 1
        theta1, height = np.insert(theta1, broken, np.nan), np.insert(height, broken, np.nan)
        axes.plot(theta1, height, color=colour, ls=style, lw=1.2, label=_counted(name))
    axes.set(
        xlim=(0, 4),
        ylim=(-0.02, 1.02),
        xlabel=r"$\theta_1/\pi$",
        ylabel=axis_label(DRAWN["J1_over_J2"]),
    )
    axes.legend(fontsize=7, loc="center right", handlelength=2.4)
    title(axes, "b", "the sampled orbits")


def _draw_hodograph(axes: Axes, curve: Data, colour: str) -> None:
    omega = curve["omega"]
    axes.plot(omega[:, 2], omega[:, 0], color=colour, lw=0.6)
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_locator(MaxNLocator(3))
    label_hodograph(axes)


CAPTION = (
    "Where a symbol of the route codes changes lies an orbit that never leaves again: a"
    " homoclinic one, which returns to the periodic orbit that it came from, or a heteroclinic"
    " one, which goes to the other. Row i + 1 of the plane has the orbits with i symbols, as far"
    " as no passage takes too many rotations. The hodographs of the sampled orbits begin and end"
    " at the origin, where omega is horizontal along eta."
)
ROWS = 24
"""Orbits that have a row of their own: the first in the order of symbols and phases."""


def tables(result: Loaded) -> list[Table]:
    """Table of the counts, and that of the first orbits."""
    lengths = sorted(result["data"]["orbits"].items(), key=lambda pair: int(pair[0]))
    each = [(orbits, k) for _, orbits in lengths for k in range(len(orbits["theta2_0"]))]
    first = [_row(*one) for one in each[:ROWS]]
    return [
        Table(
            "Doubly asymptotic orbits by the symbols of their codes",
            ("symbols", "orbits", "kind", "arcs searched", "largest residual", "map's error (rad)"),
            [_count(name, orbits) for name, orbits in lengths],
            "All leave the lower periodic orbit. The map's error is that of theta2_0 in doubles,"
            " against integration in 106 bits.",
        ),
        Table(
            "The first orbits",
            ("address", "kind", "theta2_0 (rad)", "flight (t')", "theta3+ - theta3- (rad)"),
            first,
            f"{len(first)} of {len(each)}. theta2_0 is theta2 where J1 = J1_0.",
        ),
    ]


def _count(name: str, orbits: Data) -> tuple[str, ...]:
    count = len(orbits["theta2_0"])
    residual, moved = (float(np.abs(orbits[key]).max(initial=0.0)) for key in ("residual", "moved"))
    ends, arcs = str(orbits["ends"]), str(int(orbits["arcs"]))
    return name, str(count), ends, arcs, f"{residual:.0e}", f"{moved:.0e}"


def _row(orbits: Data, k: int) -> tuple[str, ...]:
    phase = digits(float(orbits["theta2_0"][k]), float(orbits["theta2_0_rest"][k]))
    numbers = f"{orbits['flight'][k]:.9f}", f"{orbits['theta3'][k]:.12f}"
    return address(orbits, k), str(orbits["ends"]), phase, *numbers


def address(orbits: Data, k: int) -> str:
    """The address of an orbit: its first cell, and each symbol with its half rotations."""
    terms = zip(orbits["word"][:, k], orbits["half_turns"][:, k], strict=True)
    return " ".join(["ab"[int(orbits["first"][k])], *(f"{s}^{n}" for s, n in terms)])


def digits(high: float, rest: float, places: int = 29) -> str:
    """The sum of two doubles to so many digits behind the point."""
    whole = round((Fraction(high) + Fraction(rest)) * 10**places)
    text = str(whole).rjust(places + 1, "0")
    return f"{text[:-places]}.{text[-places:]}"
