"""Closed orbits by their words, and averages over them beside a long orbit."""

from __future__ import annotations

import numpy as np

from rigidpend.alphabet import NO_SYMBOL
from rigidpend.results.tree import Data, Loaded
from rigidpend.tables import Table

CAPTION = (
    "Periodic orbits of the perturbed body, one for each periodic word of symbols, found by the"
    " return map and verified by integration over a period. Their Floquet multipliers, averaged"
    " over all points of a length, give the Lyapunov exponent of long orbits."
)
SHORT = 4
"""Words of up to so many symbols have a row of their own; there are six."""


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
            " one period leaves open in d and chi; words of odd length are read twice.",
        ),
        Table(
            "Averages over all points of a length",
            ("length", "points", "Lyapunov exponent per passage"),
            [
                (str(length), str(points), f"{mean:.4f}")
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
