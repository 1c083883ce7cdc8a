"""Layout of a result of `route_codes`."""

from __future__ import annotations

from rigidpend.experiments.data.bounds import ROUNDING
from rigidpend.experiments.data.layout import ANY, FLAG, FLOAT, Field, Layout
from rigidpend.experiments.route_layout import MEANING

BY_MAP = Field(
    FLAG,
    ("columns",),
    "1",
    "whether return maps found the column; absent: all were integrated",
    within=ANY,
)
ZEROS = Field(FLOAT, ("zeros",), "rad", "zeros of Melnikov's integral in theta2_0", within=ROUNDING)

ROUTES: Layout = {**MEANING, "by_map": BY_MAP}
LAYOUT: Layout = {"<arrays>": {**MEANING, "by_map?": BY_MAP, "melnikov_zeros": ZEROS}}
