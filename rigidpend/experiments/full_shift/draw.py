"""The sets and their images, as one draws a horseshoe: at two scales, for images are long.

In tables: covering relations, each with the margin by which it holds.
"""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.plots import BLUE, RED, WIDTH, entry, title
from rigidpend.machine.wording import Table

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


CAPTION = (
    "Each image, a pale strip, crosses all sets of its panel, the full ones, from end to end, as"
    " in a horseshoe. The sets lie on the section J1 = J2/2, of upward and of downward"
    " crossings, and the images are those after one passage. That they cross is proven, and from"
    " it follows that every sequence of 0 and 1 is the route code of an orbit in the sets (each"
    " sequence of sets that of one alone where C7 holds), and every periodic one that of a closed"
    " orbit. A line of starts of one J1_0 crosses those of a section too: every one-sided sequence"
    " is the code of one of them, behind that of its approach; where C8 holds every finite sequence"
    " is that of an orbit from the lower periodic orbit to the upper or the lower one, and of one"
    " from the upper one. What looks like a line in the upper panels is a set: below, one"
    " crossing is magnified."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the relations, and that of the sets."""
    data = result["data"]
    sets, relations, line = data["sets"], data["relations"], data["line"]
    names = [_name(sets, k) for k in range(len(sets["rising"]))]
    pairs = math.prod(np.unique(sets["rising"], return_counts=True)[1])
    return [
        Table(
            "Covering relations, all proven",
            ("set", "covers", "|U| of the ends' images", "|V| of the image", "stretch", "squeeze"),
            [
                (
                    names[k],
                    names[relations["target"][k][j]],
                    f"more than {_below(relations['edge'][k][j], 4)}",
                    f"less than {_above(relations['across'][k][j], 4)}",
                    f"more than {_below(relations['stretch'][k][j], 4)}",
                    f"less than {_above(relations['squeeze'][k][j], 4)}",
                )
                for k, j in np.ndindex(relations["target"].shape)
            ],
            "A relation needs more than 1 and less than 1. The stretch is |dU/du| - |dU/dv|, the"
            " squeeze |dV/du| + |dV/dv|: more than 1 and less than 1 make the orbit of a sequence"
            " the only one in the sets. The line of starts, with theta2_0 from"
            f" {line['theta2'][0]:.5f} to {line['theta2'][1]:.5f}, crosses those of a section"
            f" too{_behind(data)}: more than {_below(min(line['edge']), 4)}, less than"
            f" {_above(max(line['across']), 4)}; stretch more than"
            f" {_below(min(line['stretch']), 4)}, squeeze less than"
            f" {_above(max(line['squeeze']), 4)}.",
        ),
        Table(
            "Sets and passages from them",
            ("set", "half width in d", "bound on the distance", "time of a passage (t')"),
            [
                (
                    names[k],
                    f"{sets['a'][k]:.3g}",
                    _above(sets["bound"][k], 2),
                    f"{_below(sets['shortest'][k], 6)} to {_above(sets['longest'][k], 6)}",
                )
                for k in range(len(names))
            ],
            f"The topological entropy is at least ln({pairs})/2 a passage, and at least"
            f" {_below(entropy(sets), 4)} a unit of t'.{_energies(result)}",
        ),
    ]


def entropy(sets: Data) -> float:
    """The bound of Theorem 10, from the largest times of passages: a unit of t', rounded down."""
    low, high = 0.0, 1.0
    while low < (middle := (low + high) / 2) < high:
        weights = np.exp(-middle * sets["longest"])
        total = weights[sets["rising"]].sum() * weights[~sets["rising"]].sum()
        low, high = (middle, high) if total > 1 else (low, middle)
    return low


def _behind(data: Data) -> str:
    """Words on the approach of a line of starts."""
    if "approach" not in data:
        return ""
    return f" after the symbols {''.join(map(str, data['approach']['symbol']))}"


def _energies(result: Loaded) -> str:
    """A sentence on the energies, where there are several."""
    found, given = result["data"].get("energies"), result["config"]["problem"]
    if found is None:
        return ""
    middle = "h" if given.get("h") is not None else f"h0 + {float(found['shift'])!r}"
    return (
        f" All of this is of every energy that differs from {middle} by at most"
        f" {float(found['spread'])!r}, with sets that move with it; drawn are those of the middle."
    )


def _below(x: float, digits: int) -> str:
    """A lower bound as text, rounded down."""
    return f"{Context(digits, ROUND_FLOOR).create_decimal_from_float(float(x)):g}"


def _above(x: float, digits: int) -> str:
    """An upper bound as text, rounded up."""
    return f"{Context(digits, ROUND_CEILING).create_decimal_from_float(float(x)):g}"


def _name(sets: Data, k: int) -> str:
    return f"{'upward' if sets['rising'][k] else 'downward'}, symbol {sets['symbol'][k]}"
