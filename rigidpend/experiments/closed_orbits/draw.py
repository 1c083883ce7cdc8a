"""Closed orbits on the section, and their exponents beside that of a long orbit."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidpend.render.palette import BLUE, RED, WIDTH
from rigidpend.render.panels import title
from rigidpend.results.tree import Data, Loaded

HEIGHT = 3.2
"""Height of the figure, inches."""


def draw(result: Loaded) -> Figure:
    """Draw the orbits' upward crossings, and the exponent of every word."""
    data = result["data"]
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_places(figure, left, data)
    _draw_exponents(right, data)
    return figure


def _draw_places(figure: Figure, axes: Axes, data: Data) -> None:
    places, exponent = data["places"], data["orbits"]["exponent"]
    shown = axes.scatter(
        places["chi"], places["d"], c=exponent[places["of"]], s=9, lw=0, cmap="viridis"
    )
    figure.colorbar(shown, ax=axes, label="exponent per passage")
    axes.set(xlabel=r"$\chi$ (rad)", ylabel=r"$d$")
    axes.ticklabel_format(axis="y", style="sci", scilimits=(0, 0), useMathText=True)
    title(axes, "a", "upward crossings of all orbits")


def _draw_exponents(axes: Axes, data: Data) -> None:
    orbits, averages = data["orbits"], data["averages"]
    length = (orbits["word"] < 2).sum(axis=1)
    axes.plot(length, orbits["exponent"], ".", color="0.6", ms=5, label="one orbit")
    axes.plot(
        averages["length"], averages["mean"], "o-", color=BLUE, ms=4, lw=1, label="mean over points"
    )
    mean, error = float(averages["long_orbit"]), float(averages["long_orbit_error"])
    axes.axhspan(mean - error, mean + error, color=RED, alpha=0.25, lw=0)
    axes.axhline(mean, color=RED, lw=0.9, label="long orbit")
    axes.set(xlabel="symbols of the word", ylabel="Lyapunov exponent per passage")
    axes.legend(fontsize=7.5)
    title(axes, "b", "averages over closed orbits")
