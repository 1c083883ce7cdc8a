"""The fields of an array of route codes, as they are stored.

Shared by the experiments that store routes: `route_codes`, `route_zoom`, `herpolhodes`.
"""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLAG,
    FLOAT,
    WHOLE,
    Field,
)

SYMBOLS, CROSSINGS = ("symbols", "columns"), ("symbols+1", "columns")

MEANING = {
    "theta2_0": Field(
        FLOAT,
        ("columns",),
        "rad",
        "initial phase of each column, rounded to a double; exactly start + k step of the config",
    ),
    "codes": Field(
        WHOLE, SYMBOLS, "1", "symbols, row 0 = symbol 1: 0 left, 1 right, 255 none (no return)"
    ),
    "certain": Field(
        FLAG, SYMBOLS, "1", "whether two independent computations establish the symbol"
    ),
    "bits": Field(WHOLE, ("columns",), "bit", "precision that decided the column"),
    "crossing_time": Field(
        FLOAT,
        CROSSINGS,
        "t' = t s",
        "times of the crossings of J1 = J2/2, NaN where there is none",
        gaps=True,
    ),
    "separatrix": Field(
        WHOLE, CROSSINGS, "1", "separatrix beside which the crossing lies, 1..4, 0 for none"
    ),
}
