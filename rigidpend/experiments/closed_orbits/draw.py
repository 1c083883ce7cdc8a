"""Exponents of closed orbits by the length of their words, and convergence of averages."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rigidpend.experiments.data import Data, Loaded
from rigidpend.experiments.plots import BLUE, RED, WIDTH, beside, title
from rigidpend.machine.wording import Column, Table
from rigidpend.numbers import Array
from rigidpend.numbers.texts import NO_SYMBOL

LEAST, APART = 4, 4
"""Least width for the marks of one length, and the space between two lengths, in marks."""
NAMED = 2
"""Largest length of words that are written beside their orbits."""
ALIKE = 9
"""Digits after the point to which exponents are compared: rounding changes them by 1e-12."""


def draw(result: Loaded) -> Figure:
    """Draw the exponent of every orbit, and the distance of averages from the longest words'."""
    data = result["data"]
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1))
    _draw_orbits(left, data)
    _draw_averages(right, data["averages"])
    return figure


def _draw_orbits(axes: Axes, data: Data) -> None:
    """Draw a mark for each orbit; those of one length stand side by side in ascending order."""
    orbits, averages = data["orbits"], data["averages"]
    exponent, length = orbits["exponent"], (orbits["word"] != NO_SYMBOL).sum(axis=1)
    mean, error = float(averages["long_orbit"]), float(averages["long_orbit_error"])
    said = "random orbit and its standard error"
    axes.axhspan(mean - error, mean + error, color=RED, alpha=0.3, lw=0, label=said)
    place, middles = _places(length, exponent)
    for here, name, colour, inside in (
        (orbits["positive"], "positive", BLUE, BLUE),
        (~orbits["positive"], "negative", "0.4", "white"),
    ):
        marks: Any = {"color": colour, "mfc": inside, "label": f"one orbit, multiplier {name}"}
        axes.plot(place[here], exponent[here], "o", ms=2.7, mew=0.7, **marks)
    for k in np.flatnonzero(length <= NAMED):
        side, ha = (-4, "right") if place[k] < middles[length[k] - 1] else (4, "left")
        word = "".join(map(str, orbits["word"][k, : length[k]]))
        look: Any = {"ha": ha, "va": "center", "fontsize": 7.5}
        beside(axes, word, (place[k], exponent[k]), side, 0, **look)
    axes.set(xlabel="symbols of the word", ylabel="Lyapunov exponent per passage")
    axes.set_xticks(middles, [str(n + 1) for n in range(len(middles))])
    axes.ticklabel_format(axis="y", useOffset=False)
    low, high = axes.get_ylim()
    # The legend stands above all marks.
    axes.set_ylim(low, high + 0.28 * (high - low))
    axes.legend(fontsize=7, loc="upper right")
    title(axes, "a", f"all {len(length)} orbits")


def _places(length: Array, exponent: Array) -> tuple[Array, list[float]]:
    """Places of the marks of the orbits, and the middles of those of each length."""
    places, end = np.empty(len(length)), 0.0
    middles: list[float] = []
    for n in range(1, int(length.max()) + 1):
        here = np.flatnonzero(length == n)
        # An orbit and its time reversal have equal exponents up to rounding, which must not
        # decide their order: a stable sort of rounded exponents keeps the order of words.
        order = here[np.argsort(exponent[here].round(ALIKE), kind="stable")]
        middles.append(end + max(len(here), LEAST) / 2)
        places[order] = middles[-1] + np.arange(len(here)) - (len(here) - 1) / 2
        end = middles[-1] + max(len(here), LEAST) / 2 + APART
    return places, middles


def _draw_averages(axes: Axes, averages: Data) -> None:
    length, mean = averages["length"], averages["mean"]
    error, apart = float(averages["long_orbit_error"]), np.abs(mean[:-1] - mean[-1])
    axes.axhline(error, color=RED, lw=0.9, ls="--", label="standard error of the random orbit")
    axes.semilogy(length[:-1], apart, "o-", color=BLUE, ms=4, lw=1, label="mean over all words")
    axes.set_xlabel("symbols of the words")
    said = f"distance from that of {length[-1]} symbols, {mean[-1]:.6f}"
    axes.set_ylabel(said, fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.2)
    axes.legend(fontsize=7, loc="upper right")
    title(axes, "b", "averages over closed orbits")


CAPTION = (
    "Each word of symbols has a periodic orbit that repeats it (left), and averages over all"
    " words of a length settle within a few lengths (right). The words are read from a passage"
    " past the upper orbit on, and the orbits found by the return map. Averages of their Lyapunov"
    " exponents tend to that of long orbits of random symbols: each symbol more leaves a small"
    " part of the distance, while a random orbit must be a hundred times as long for each digit."
)
SHORT = 4
"""Largest length of words whose orbits have rows of their own; there are twelve such orbits."""


def tables(result: Loaded) -> list[Table]:
    """Table of the shortest orbits, and a table of the averages over each length."""
    orbits, averages = result["data"]["orbits"], result["data"]["averages"]
    words = ["".join(map(str, word[word != NO_SYMBOL])) for word in orbits["word"]]
    short = [k for k, word in enumerate(words) if len(word) <= SHORT]
    signs = np.where(orbits["positive"], "positive", "negative")
    gaps = ["not verified" if np.isnan(gap) else f"{gap:.0e}" for gap in orbits["closing"]]
    stable = int(np.count_nonzero(orbits["stable"]))
    long, error = float(averages["long_orbit"]), float(averages["long_orbit_error"])
    return [
        Table.of(
            f"Closed orbits of words of up to {SHORT} symbols",
            [
                Column("word", [words[k] for k in short]),
                Column("period (t')", orbits["period"][short], ".6f"),
                Column("action", orbits["action"][short], ".6f"),
                Column("exponent per passage", orbits["exponent"][short], ".6f"),
                Column("multiplier", signs[short]),
                Column("gap in 113 bits", [gaps[k] for k in short]),
            ],
            "The action is the integral of J1 dtheta1 + J2 dtheta2, dimensionless. The gap is what"
            " one period leaves open in d and chi. Words are read from a passage past the upper"
            " orbit on: one of odd length twice, while one of even length and the same from its"
            " second symbol on are two orbits. A word read backward with 0 and 1 exchanged is that"
            " of the reversed orbit, which has the same numbers.",
        ),
        Table.of(
            "Averages over all words of a length",
            [
                Column("symbols", averages["length"]),
                Column("words", averages["points"]),
                Column("Lyapunov exponent per passage", averages["mean"], ".9f"),
            ],
            f"A long orbit of random symbols has {long:.4f} +- {error:.4f}. Of {len(words)} orbits"
            f" {stable} are stable.",
        ),
    ]
