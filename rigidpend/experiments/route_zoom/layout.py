"""Layout of a result of `route_zoom`."""

from __future__ import annotations

from rigidpend.experiments.data.layout import (
    FLOAT,
    TEXT,
    WHOLE,
    Field,
    Layout,
)
from rigidpend.experiments.route_layout import MEANING

RELATIVE = "precision that decided the column, relative to its distance from the change"
ROUTES = {name: field for name, field in MEANING.items() if name != "theta2_0"} | {
    "bits": Field(WHOLE, ("columns",), "bit", RELATIVE)
}
PLACE = {
    "centre": Field(TEXT, (), "rad", "theta2_0 of the middle, exact"),
    "theta2_0": Field(TEXT, ("columns",), "rad", "initial phase of each column, exact"),
    "offset": Field(
        FLOAT, ("columns",), "rad", "theta2_0 of each column less the centre, rounded to a double"
    ),
    "step": Field(FLOAT, (), "rad", "spacing of the columns, rounded to a double"),
}
"""Phases beyond doubles: the very numbers that were used, and doubles to draw them by."""
REPEATS_AFTER = Field(FLOAT, (), "1", "zoom after which the rows repeat, exp(pi^2/nu)")
SYMBOL = Field(WHOLE, (), "1", "the symbol that changes at the centre")
REFERENCE_BITS = Field(
    WHOLE, (), "bit", "precision of the reference orbit beside which columns were followed"
)

LAYOUT: Layout = {
    "levels": {"<levels>": {**ROUTES, **PLACE}},
    "repeats_after": REPEATS_AFTER,
    "symbol": SYMBOL,
    "reference_bits": REFERENCE_BITS,
}
