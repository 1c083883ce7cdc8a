"""Levels of a zoom: spacing, symbols, and the precision that decided them."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Magnified again and again about a phase at which a symbol changes, the array of route codes"
    " comes to repeat itself, row after row from below. The orbit at that phase stays with a"
    " periodic orbit for ever; an orbit at a distance d from it stays a time that grows as"
    " ln(1/d), and its next symbols follow from the phase at which it leaves, which is the same"
    " again for a d that is exp(pi^2/nu) times smaller: one rotation more. In colour: what differs"
    " from the array before."
)


def same(before: Data, level: Data) -> NDArray[np.bool_]:
    """Compare the symbols of a level with the level before, step by step from the centre."""
    return np.asarray(before["codes"] == level["codes"])


def share(before: Data, level: Data) -> float:
    """The share of symbols that a level repeats."""
    return float(same(before, level).mean())


def tables(result: Loaded) -> list[Table]:
    """Table of the levels, with the phase at their centre in the note."""
    data = result["data"]
    levels = list(data["levels"].values())
    symbol, repeats = int(data["symbol"]), float(data["repeats_after"])
    return [
        Table(
            f"Levels around the phase at which symbol {symbol} changes",
            ("level", "spacing (rad)", "columns", "symbols", "certain", "as before", "bits"),
            [
                _row(k, level, f"{100 * share(before, level):.1f} %" if k else "")
                for k, (before, level) in enumerate(zip([levels[0], *levels], levels, strict=False))
            ],
            f"theta2_0 = {decimals_of(levels[-1])} rad at the last centre, rounded; rows repeat"
            f" after a zoom of {repeats:.6f}.",
        )
    ]


def decimals_of(level: Data) -> str:
    """The centre of a level, rounded to a hundredth of its step or finer."""
    digits = max(2, 3 - math.floor(math.log10(float(level["step"]))))
    nearest = round(Fraction(level["centre"]) * 10**digits)
    return f"{Decimal(f'{nearest}e-{digits}'):f}"


def _row(k: int, level: Data, repeated: str) -> tuple[str, ...]:
    bits = np.unique(level["bits"])
    certain = int(np.count_nonzero(level["certain"]))
    size = level["codes"].size
    numbers = (str(level["codes"].shape[1]), str(size), str(certain))
    return str(k), f"{float(level['step']):.3g}", *numbers, repeated, ", ".join(map(str, bits))
