"""Levels of a zoom: spacing, symbols, and the precision that decided them."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np

from rigidpend.experiments.data.tree import Data, Loaded
from rigidpend.machine.tables import Table

CAPTION = (
    "Route codes around a phase at which a symbol changes, each array much finer than the one"
    " before, down to spacings far below those of doubles. Rows repeat after a zoom of"
    " exp(pi^2/nu), the self-similarity of the codes."
)


def tables(result: Loaded) -> list[Table]:
    """Table of the levels, with the phase at their centre in the note."""
    data = result["data"]
    levels = list(data["levels"].values())
    symbol, repeats = int(data["symbol"]), float(data["repeats_after"])
    return [
        Table(
            f"Levels around the phase at which symbol {symbol} changes",
            ("level", "spacing (rad)", "columns", "symbols", "certain", "bits"),
            [_row(k, level) for k, level in enumerate(levels)],
            f"theta2_0 = {_decimals(levels[-1])} rad at the last centre, rounded; rows repeat after"
            f" a zoom of {repeats:.6f}.",
        )
    ]


def _decimals(level: Data) -> str:
    """The centre of a level, rounded to a hundredth of its step or finer."""
    digits = max(2, 3 - math.floor(math.log10(float(level["step"]))))
    nearest = round(Fraction(level["centre"]) * 10**digits)
    return f"{Decimal(f'{nearest}e-{digits}'):f}"


def _row(k: int, level: Data) -> tuple[str, ...]:
    bits = np.unique(level["bits"])
    certain = int(np.count_nonzero(level["certain"]))
    size = level["codes"].size
    numbers = (str(level["codes"].shape[1]), str(size), str(certain))
    return str(k), f"{float(level['step']):.3g}", *numbers, ", ".join(map(str, bits))
