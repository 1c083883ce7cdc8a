"""Figure and tables of a full shift.

The figure shows sets and images as a horseshoe is drawn, at two scales, because images are long and
thin. The tables list the covering relations, each with the margins by which it holds.
"""

import functools
import itertools
import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.plots import BLUE, RED, WIDTH, entry, title
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers import Array

HEIGHT = 5.9
"""Height of the figure, inches."""
COLOUR = (BLUE, RED)
"""Colours of symbols 0 and 1."""
ROOM = 1.25
"""Size of a magnified panel over that of the strips in it."""
DOWN = Context(40, ROUND_FLOOR)
"""Numbers of 40 digits, rounded down."""


def draw(result: Loaded) -> Figure:
    """Draw both sections, and below each one crossing of a set and an image, magnified."""
    data = result["data"]
    figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
    panels = figure.subplots(2, 2)
    for column, rising in enumerate((True, False)):
        whole, near = panels[:, column]
        words = "upward" if rising else "downward"
        title(whole, "ab"[column], f"{words} crossings")
        # At this scale a set is thinner than a line: its edge is drawn wide enough to be seen.
        _draw(whole, data, rising, 1.8)
        if data["sets"]["rising"][data["line"]["target"][0]] == rising:
            whole.plot(data["drawn"]["line_chi"], data["drawn"]["line_d"], color="0.2", lw=0.8)
        target = int(np.flatnonzero(data["sets"]["rising"] == rising)[-1])
        source = int(np.flatnonzero(data["sets"]["rising"] != rising)[0])
        x, y = _crossing(data["drawn"], source, target)
        _draw(near, data, rising)
        near.set(xlim=x, ylim=y)
        frame: Any = {"fill": False, "ec": "0.2", "lw": 0.8}
        whole.add_patch(Rectangle((x[0], y[0]), x[1] - x[0], y[1] - y[0], **frame))
        times = np.ptp(np.array(whole.get_ylim())) / (y[1] - y[0])
        title(near, "cd"[column], f"one crossing of these, {_rounded(times)} times higher")
    entries = [
        *(entry(f"set of symbol {k}", color=COLOUR[k], lw=4) for k in (0, 1)),
        *(entry(f"image of set {k}", color=COLOUR[k], lw=4, alpha=0.4) for k in (0, 1)),
        entry(
            # Starts of an approach lie about it, in the image of the last set on their way.
            "middle of the approach's image" if "approach" in data else "starts on a line",
            color="0.2",
            lw=0.8,
        ),
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=5, fontsize=7.5)
    return figure


def _draw(axes: Axes, data: Data, rising: bool, edge: float = 0.6) -> None:
    """Draw the sets of a section and the images in it, with edges of a width in points."""
    drawn, sets = data["drawn"], data["sets"]
    look: Any = {"lw": edge, "joinstyle": "bevel"}
    for k, (of, symbol) in enumerate(zip(sets["rising"], sets["symbol"], strict=True)):
        # The images in a section are those of the sets of the other one.
        of_image = "" if of == rising else "image_"
        colour, alpha = COLOUR[int(symbol)], 0.4 if of_image else None
        outline = drawn[f"{of_image}chi"][k], drawn[f"{of_image}d"][k]
        # Images lie upon sets, through which they can be seen to go.
        axes.fill(*outline, color=colour, alpha=alpha, zorder=1.2 if of_image else 1, **look)
    axes.set(xlabel=r"$\chi$ (rad)", ylabel="$d$ from the stable surface (1)")
    axes.ticklabel_format(style="sci", scilimits=(-2, 2))


def _rounded(times: float) -> str:
    """A factor in three digits, written out: 105,000."""
    return f"{float(f'{times:.3g}'):,.0f}"


def _crossing(drawn: Data, source: int, target: int) -> tuple[Any, Any]:
    """Limits of both axes about the place where the middle of an image crosses that of a set."""
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
    # An outline runs around: its opposite sides have opposite directions.
    one = outline[first * sides : (first + 1) * sides]
    other = outline[(first + 2) * sides : (first + 3) * sides]
    return (one + other[::-1]) / 2


CAPTION = (
    "Each image (pale strip) crosses all sets (full strips) of its panel from end to end, as in a"
    " horseshoe. The sets lie on the section J1 = J2/2, at upward and at downward crossings, and"
    " the images are those after one passage. It is proven that they cross. So every sequence of 0"
    " and 1 is the route code of an orbit in the sets, and every periodic sequence that of a closed"
    " orbit; where C7 holds, each sequence of sets has one orbit only. A line of starts with one"
    " J1_0 crosses the sets of a section too: every one-sided sequence is the code of one of these"
    " starts, after the symbols of its approach. Where C8 holds, every finite sequence is the code"
    " of an orbit from the lower periodic orbit to the upper or the lower one, and of one from the"
    " upper one. What looks like a line in the upper panels is a set: below, one crossing is"
    " magnified."
)


def tables(result: Loaded) -> list[Table]:
    """The table of relations and that of sets."""
    data = result["data"]
    sets, relations, line = data["sets"], data["relations"], data["line"]
    rows = list(zip(sets["rising"], sets["symbol"], strict=True))
    names = [f"{'upward' if rising else 'downward'}, symbol {k}" for rising, k in rows]
    targets = relations["target"]
    pairs = math.prod(np.unique(sets["rising"], return_counts=True)[1])
    return [
        Table.of(
            "Covering relations, all proven",
            [
                Column("set", np.repeat(names, targets.shape[1])),
                Column("covers", [names[k] for k in targets.flat]),
                Column("|U| of the ends' images", map(_more, relations["edge"].flat)),
                Column("|V| of the image", map(_less, relations["across"].flat)),
                Column("stretch", map(_more, relations["stretch"].flat)),
                Column("squeeze", map(_less, relations["squeeze"].flat)),
            ],
            "A relation needs more than 1 and less than 1. The stretch is |dU/du| - |dU/dv|, the"
            " squeeze |dV/du| + |dV/dv|: more than 1 and less than 1 make the orbit of a sequence"
            " the only one in the sets. The line of starts, with theta2_0 from about"
            f" {line['theta2'][0]:.6g} to {line['theta2'][1]:.6g}, crosses those of"
            f" a section too{_behind(data)}: {_more(min(line['edge']))},"
            f" {_less(max(line['across']))};"
            f" stretch {_more(min(line['stretch']))}, squeeze {_less(max(line['squeeze']))}.",
        ),
        Table.of(
            "Sets and passages from them",
            [
                Column("set", names),
                Column("half width in d", sets["a"], ".3g"),
                Column("bound on the distance", [_above(x, 2) for x in sets["bound"]]),
                Column(
                    "time of a passage (t')",
                    [
                        f"{_below(low, 6)} to {_above(high, 6)}"
                        for low, high in zip(sets["shortest"], sets["longest"], strict=True)
                    ],
                ),
            ],
            f"The topological entropy is at least ln({pairs})/2 a passage, and at least"
            f" {_below(entropy(sets), 4)} a unit of t'.{_energies(result)}",
        ),
    ]


def _more(x: float) -> str:
    """Words on a lower bound."""
    return f"more than {_below(x, 4)}"


def _less(x: float) -> str:
    """Words on an upper bound."""
    return f"less than {_above(x, 4)}"


def entropy(sets: Data) -> float:
    """The lower bound s of Theorem 10 on the entropy a unit of t', by the longest passages."""
    # A sum that falls as s grows: bisection ends at an s where more than 1 of it is certain.
    low, high = 0.0, 1.0
    while low < (middle := (low + high) / 2) < high:
        weights = [_weight(middle, float(time)) for time in sets["longest"]]
        total = [
            functools.reduce(DOWN.add, itertools.compress(weights, of))
            for of in (sets["rising"], ~sets["rising"])
        ]
        low, high = (middle, high) if DOWN.multiply(*total) > 1 else (low, middle)
    return low


def _weight(s: float, time: float) -> Decimal:
    """A lower bound on exp(-s time)."""
    # The exponential is rounded to the nearest number, whatever the context says.
    return DOWN.next_minus(DOWN.exp(DOWN.multiply(Decimal(-s), Decimal(time))))


def _behind(data: Data) -> str:
    """Words on the approach of a line of starts; empty without one."""
    if "approach" not in data:
        return ""
    return f" after the symbols {''.join(map(str, data['approach']['symbol']))}"


def _energies(result: Loaded) -> str:
    """A sentence on the energies; empty if there is only one."""
    found, given = result["data"].get("energies"), result["config"]["problem"]
    if found is None:
        return ""
    middle = "h" if given.get("h") is not None else f"h0 + {float(found['shift'])!r}"
    return (
        f" All of this holds for every energy that differs from {middle} by at most"
        f" {float(found['spread'])!r}, with sets that move with it; drawn are those of the middle."
    )


def _below(x: float, digits: int) -> str:
    """A lower bound as text with some digits, rounded down."""
    return f"{Context(digits, ROUND_FLOOR).create_decimal_from_float(float(x)):g}"


def _above(x: float, digits: int) -> str:
    """An upper bound as text with some digits, rounded up."""
    return f"{Context(digits, ROUND_CEILING).create_decimal_from_float(float(x)):g}"
