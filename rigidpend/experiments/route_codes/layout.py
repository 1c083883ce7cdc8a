"""Layout of a result of `route_codes`."""

from __future__ import annotations

from rigidpend.experiments.data.bounds import ROUNDING
from rigidpend.experiments.data.layout import ANY, FLAG, FLOAT, Field, Layout
from rigidpend.experiments.route_layout import MEANING

ZEROS = Field(FLOAT, ("zeros",), "rad", "zeros of Melnikov's integral in theta2_0", within=ROUNDING)
BY_MAP = Field(
    FLAG,
    ("columns",),
    "1",
    "whether return maps found the column; absent: all were integrated",
    within=ANY,
)

LAYOUT: Layout = {"<arrays>": {**MEANING, "melnikov_zeros": ZEROS, "by_map?": BY_MAP}}
