"""Closed orbits by their words, and averages over them beside a long orbit."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Loaded
from rigidpend.machine.tables import Column, Table
from rigidpend.numbers.expressions import NO_SYMBOL

CAPTION = (
    "Each word of symbols has a periodic orbit that repeats it (left), and averages over all"
    " words of a length settle within a few lengths (right). The words are read from a passage"
    " past the upper orbit on, and the orbits found by the return map. Averages of their Lyapunov"
    " exponents tend to that of long orbits of random symbols: each symbol more leaves a small"
    " part of the distance, where a random orbit must be a hundred times as long for each digit."
)
SHORT = 4
"""Words of up to so many symbols have a row of their own; there are twelve."""


def tables(result: Loaded) -> list[Table]:
    """Table of the shortest orbits, and that of the averages over each length."""
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
