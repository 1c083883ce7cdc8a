"""The sets and their images, as one draws a horseshoe: at two scales, for images are long."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.experiments.plots import BLUE, RED, WIDTH, entry, title

Array: TypeAlias = NDArray[Any]

HEIGHT = 5.9
"""Height of the figure, inches."""
COLOUR = (BLUE, RED)
"""Colours of symbols 0 and 1."""
ROOM = 1.25
"""Widths of a magnified panel, in those of the larger of the two strips in it."""


def draw(result: Loaded) -> Figure:
    """Draw both sections, and below each one crossing of a set and an image, magnified."""
    data = result["data"]
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    panels = figure.subplots(2, 2)
    for column, rising in enumerate((True, False)):
        whole, near = panels[:, column]
        words = "upward" if rising else "downward"
        title(whole, "ab"[column], f"{words} crossings")
        # At this scale a set has no width of its own to be seen by.
        _draw(whole, data, rising, 1.8)
        if data["sets"]["rising"][data["line"]["target"][0]] == rising:
            whole.plot(data["drawn"]["line_chi"], data["drawn"]["line_d"], color="0.2", lw=0.8)
        target = int(np.flatnonzero(data["sets"]["rising"] == rising)[-1])
        source = int(np.flatnonzero(data["sets"]["rising"] != rising)[0])
        x, y = _crossing(data["drawn"], source, target)
        _draw(near, data, rising)
        near.set(xlim=x, ylim=y)
        whole.add_patch(_frame(x, y))
        times = np.ptp(np.array(whole.get_ylim())) / (y[1] - y[0])
        title(near, "cd"[column], f"one crossing of these, {times:.0f} times higher")
    figure.legend(
        handles=[
            *(entry(f"set of symbol {k}", color=COLOUR[k], lw=4) for k in (0, 1)),
            *(
                entry(f"image of set {k}", color=COLOUR[k], lw=4, alpha=0.4)
                for k in (0, 1)
            ),
            entry("starts on a line", color="0.2", lw=0.8),
        ],
        loc="outside lower center", ncols=5, fontsize=7.5,
    )  # fmt: skip
    return figure


def _draw(axes: Axes, data: Data, rising: bool, edge: float = 0.6) -> None:
    drawn, symbol = data["drawn"], data["sets"]["symbol"]
    for k, of in enumerate(data["sets"]["rising"]):
        colour = COLOUR[int(symbol[k])]
        if of == rising:
            axes.fill(drawn["chi"][k], drawn["d"][k], color=colour, lw=edge, joinstyle="bevel")
        else:
            x, y = drawn["image_chi"][k], drawn["image_d"][k]
            axes.fill(
                x, y, facecolor=colour, edgecolor=colour, alpha=0.4, lw=edge, joinstyle="bevel"
            )
    axes.set(xlabel=r"$\chi$ (rad)", ylabel="$d$ from the stable surface (1)")
    axes.ticklabel_format(style="sci", scilimits=(-2, 2))


def _crossing(drawn: Data, source: int, target: int) -> tuple[Any, Any]:
    """Limits about the place where the middle of an image crosses the middle of a set."""
    sides = drawn["chi"].shape[1] // 4
    # The image of u from -1 to 1 at v = -1 and, backwards, at v = 1; the set's v at u = -1 and 1.
    x = _middle(drawn["image_chi"][source], sides, 0)
    y = _middle(drawn["image_d"][source], sides, 0)
    level = _middle(drawn["d"][target], sides, 1)
    at = int(np.argmin(np.abs(y - level.mean())))
    high = ROOM * np.ptp(drawn["d"][target])
    slope = abs((y[-1] - y[0]) / (x[-1] - x[0]))
    thick = np.abs(
        drawn["image_d"][source][:sides] - drawn["image_d"][source][2 * sides : 3 * sides][::-1]
    )
    wide = 2 * ROOM * (high + thick.max()) / slope
    here = x[at] + (level.mean() - y[at]) * (x[-1] - x[0]) / (y[-1] - y[0])
    return (here - wide, here + wide), (level.mean() - high, level.mean() + high)


def _middle(outline: Array, sides: int, first: int) -> Array:
    """The middle line between two opposite sides of an outline."""
    one = outline[first * sides : (first + 1) * sides]
    other = outline[(first + 2) * sides : (first + 3) * sides]
    return (one + other[::-1]) / 2


def _frame(x: Any, y: Any) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x[0], y[0]), x[1] - x[0], y[1] - y[0], fill=False, ec="0.2", lw=0.8)
