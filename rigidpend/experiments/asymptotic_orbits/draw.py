"""Doubly asymptotic orbits: as the skeleton of Fig. 4's plane, on the sphere, and in space."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rigidpend.experiments.asymptotic_orbits.layout import DRAWN, PLANE
from rigidpend.experiments.data.tree import Data, Loaded
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
        title(one, letter, _count(name))
    return figure


def _count(name: str) -> str:
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
        axes.plot(theta1, height, color=colour, ls=style, lw=1.2, label=_count(name))
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
