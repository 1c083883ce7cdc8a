"""Closed orbits by their words, and averages over them beside a long orbit."""

from __future__ import annotations

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table
from rigidpend.numbers.alphabet import NO_SYMBOL

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
    data = result["data"]
    orbits, averages = data["orbits"], data["averages"]
    words = ["".join(map(str, word[word != NO_SYMBOL])) for word in orbits["word"]]
    long, error = float(averages["long_orbit"]), float(averages["long_orbit_error"])
    return [
        Table(
            f"Closed orbits of words of up to {SHORT} symbols",
            (
                "word",
                "period (t')",
                "action",
                "exponent per passage",
                "multiplier",
                "gap in 113 bits",
            ),
            [_row(k, word, orbits) for k, word in enumerate(words) if len(word) <= SHORT],
            "The action is the integral of J1 dtheta1 + J2 dtheta2, dimensionless. The gap is what"
            " one period leaves open in d and chi. Words are read from a passage past the upper"
            " orbit on: one of odd length twice, while one of even length and the same from its"
            " second symbol on are two orbits. A word read backward with 0 and 1 exchanged is that"
            " of the reversed orbit, which has the same numbers.",
        ),
        Table(
            "Averages over all words of a length",
            ("symbols", "words", "Lyapunov exponent per passage"),
            [
                (str(length), str(points), f"{mean:.9f}")
                for length, points, mean in zip(
                    averages["length"], averages["points"], averages["mean"], strict=True
                )
            ],
            f"A long orbit of random symbols has {long:.4f} +- {error:.4f}. Of {len(words)} orbits"
            f" {int(np.count_nonzero(orbits['stable']))} are stable.",
        ),
    ]


def _row(k: int, word: str, orbits: Data) -> tuple[str, ...]:
    gap = float(orbits["closing"][k])
    sign = "positive" if orbits["positive"][k] else "negative"
    shown = "not verified" if np.isnan(gap) else f"{gap:.0e}"
    numbers = (f"{orbits[key][k]:.6f}" for key in ("period", "action", "exponent"))
    return word, *numbers, sign, shown
